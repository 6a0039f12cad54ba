import json

import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main


@pytest.fixture(scope="module")
def extracted(tmp_path_factory, tiny_dataroot):
    """A small finished folder; every test leaves it as it was."""
    out = tmp_path_factory.mktemp("verify") / "out"
    grid = ["--cell-size", "0.5", "--rows", "60", "--columns", "40", "--images", "none"]
    cache = ["--cache-dir", str(out.parent / "cache")]
    result = CliRunner().invoke(main, ["extract", str(tiny_dataroot), str(out), *grid, *cache])
    assert result.exit_code == 0, result.output
    return out


def verify(out, *more):
    return CliRunner().invoke(main, ["verify", str(out), *more])


def test_a_sound_folder(extracted):
    result = verify(extracted)
    assert (result.exit_code, result.stdout, result.stderr) == (0, f"{extracted}: sound\n", "")
    held = json.loads(verify(extracted, "--json").stdout)
    assert held == {"shards": str(extracted), "sound": True, "problems": []}


def test_problems_take_a_line_each(extracted):
    path = next(extracted.glob("*.h5"))
    whole = path.read_bytes()
    path.write_bytes(whole[:-1])
    result, as_json = verify(extracted), verify(extracted, "--json")
    path.write_bytes(whole)
    assert (result.exit_code, as_json.exit_code) == (1, 1)
    held = json.loads(as_json.stdout)
    assert (held["shards"], held["sound"]) == (str(extracted), False)
    assert [f"{one['file']}: {one['message']}" for one in held["problems"]] == result.stdout.splitlines()
    lines = result.stdout.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith(f"{path.name}: has {len(whole) - 1} bytes, by the manifest {len(whole)}; ")


def test_a_folder_without_shards(tmp_path):
    result = verify(tmp_path)
    assert (result.exit_code, result.stdout) == (1, "")
    assert "holds no shards" in result.stderr

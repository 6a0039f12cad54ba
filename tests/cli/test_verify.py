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


def verify(out):
    return CliRunner().invoke(main, ["verify", str(out)])


def test_a_sound_folder(extracted):
    result = verify(extracted)
    assert (result.exit_code, result.stdout, result.stderr) == (0, f"{extracted}: sound\n", "")


def test_problems_take_a_line_each(extracted):
    path = next(extracted.glob("*.h5"))
    whole = path.read_bytes()
    path.write_bytes(whole[:-1])
    result = verify(extracted)
    path.write_bytes(whole)
    assert result.exit_code == 1
    lines = result.stdout.splitlines()
    assert len(lines) == 2
    assert all(line.startswith(f"{path.name}: ") for line in lines)


def test_a_folder_without_shards(tmp_path):
    result = verify(tmp_path)
    assert (result.exit_code, result.stdout) == (1, "")
    assert "holds no shards" in result.stderr

import json
import shutil

import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main


@pytest.fixture
def dataroot(tiny_dataroot, tmp_path):
    """A copy of the synthetic dataset, free to be changed."""
    return shutil.copytree(tiny_dataroot, tmp_path / "data")


def _run(*arguments):
    return CliRunner().invoke(main, ["check", *map(str, arguments)])


def _drop_image(dataroot):
    next(dataroot.glob("samples/CAM_BACK/*.jpg")).unlink()


def _shrink_boxes(records):
    for record in records:
        record["size"] = [0, 0, 0]


def test_a_sound_dataset_passes(tiny_dataroot):
    result = _run(tiny_dataroot, "--strict")

    assert result.exit_code == 0, result.output
    assert result.stdout == f"{tiny_dataroot}: rules broken: 0 with errors, 0 with warnings\n"


def test_warnings_pass_unless_strict(dataroot):
    _drop_image(dataroot)

    assert _run(dataroot).exit_code == 0
    result = _run(dataroot, "--strict")
    assert result.exit_code == 1
    assert "R701 warning: image is absent (1×)\n    samples/CAM_BACK/" in result.stdout
    assert "→ download it, or extract with --images none" in result.stdout


def test_what_the_use_needs_is_an_error(dataroot):
    _drop_image(dataroot)

    result = _run(dataroot, "--camera", "CAM_FRONT,CAM_BACK")

    assert result.exit_code == 1
    assert "R701 error: image is absent (1×)\n    samples/CAM_BACK/" in result.stdout
    for options in (["--images", "none"], ["--exclude", "R701"]):
        assert _run(dataroot, "--camera", "CAM_FRONT,CAM_BACK", *options).exit_code == 0


def test_an_unknown_rule_is_one_line(dataroot):
    assert "unknown rule 'R7O1'; did you mean R701" in _run(dataroot, "--exclude", "R7O1").stderr


def test_corrected_tables_are_written_beside_and_checked(dataroot, edit_table):
    edit_table(dataroot, "sample", lambda records: records[0].update(next=None))
    assert _run(dataroot).exit_code == 1

    result = _run(dataroot, "--fix", "v1.0-fixed")

    assert result.exit_code == 0, result.output
    assert result.stdout == (
        "sample.json: next corrected in 1 record\n"
        f"{dataroot}/v1.0-fixed: written; use it with --version v1.0-fixed\n"
        f"{dataroot}: rules broken: 0 with errors, 0 with warnings\n"
    )
    assert "holds several versions" in _run(dataroot).stderr
    assert _run(dataroot, "--version", "v1.0-fixed", "--fix", "v1.0-again").stdout.startswith(
        "nothing to corr"
    )


def test_errors_fail(dataroot, edit_table):
    edit_table(dataroot, "sample_annotation", _shrink_boxes)

    result = _run(dataroot, "--quiet")

    assert result.exit_code == 1
    assert "R303 error: box size is not positive or immense (" in result.stdout
    assert result.stderr == ""


def test_json(dataroot, edit_table):
    _drop_image(dataroot)
    edit_table(dataroot, "sample_annotation", _shrink_boxes)

    result = _run(dataroot, "--json")

    content = json.loads(result.stdout)
    assert result.exit_code == 1
    assert (content["errors"], content["warnings"]) == (1, 2)
    assert [finding["rule"] for finding in content["findings"]] == ["R303", "R701", "R805"]
    assert set(content["findings"][0]) == {"rule", "severity", "title", "remedy", "count", "examples"}


def test_no_dataset_is_one_line(tmp_path):
    result = _run(tmp_path)

    assert result.exit_code == 1
    assert (
        result.stderr
        == f"ogmkit: error: {tmp_path}: holds no v1.0-… folder with tables; give the dataset's root\n"
    )

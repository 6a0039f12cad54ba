"""`ogmkit export-shards` and `export-cvt` end to end."""

import json
import tarfile

import pytest
from click.testing import CliRunner
from ogmkit_cli.main import main


@pytest.fixture
def invoke():
    return lambda *arguments: CliRunner().invoke(main, [str(one) for one in arguments])


def test_shards_become_tar_files_and_stay_when_it_is_run_again(sample_shards, tmp_path, invoke):
    out = tmp_path / "tars"
    for kept in (0, 2):
        result = invoke("export-shards", sample_shards, out, "--format", "webdataset")
        assert result.exit_code == 0, result.output
        assert result.stdout.startswith(f"{out}: 32 rows in 2 files ({kept} already there), ")
    with tarfile.open(out / "cameras/scene-0002.tar") as tar:
        assert "scene-0002-CAM_BACK-000000.drivable.png" in tar.getnames()


def test_a_layout_must_be_named(sample_shards, tmp_path, invoke):
    result = invoke("export-shards", sample_shards, tmp_path / "out", "--format", "tfrecord")
    assert result.exit_code == 2
    assert "is not one of" in result.stderr


def test_labels_of_a_split_for_cross_view_transformers(tiny_dataroot, tmp_path, invoke):
    out = tmp_path / "labels"
    result = invoke("export-cvt", tiny_dataroot, out, "--split", "val")
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith(f"{out}: 8 samples in 1 scene (0 already there), ")
    assert sorted(path.name for path in out.iterdir()) == ["export.json", "scene-0002", "scene-0002.json"]
    assert len(json.loads((out / "scene-0002.json").read_text())) == 8

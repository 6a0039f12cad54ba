"""What steps add to shards."""

import shutil

import pytest

from ogmkit.errors import OutputError
from ogmkit.footprints.settings import FootprintSettings
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.pipeline.output import begin_amending
from ogmkit.pipeline.render_footprints import render_footprints
from ogmkit.shards import schema
from ogmkit.shards.manifest import NAME, read_manifest, unfinished_command
from ogmkit.shards.verify import verify_folder
from ogmkit.workflow.groups import groups_gone, groups_of, settle


@pytest.fixture
def shards(plan_shards, tmp_path):
    return shutil.copytree(plan_shards, tmp_path / "shards")


def test_groups_are_looked_for_in_every_shard_and_camera(shards):
    assert groups_of(schema.FOOTPRINTS, ("a", "b")) == ("footprints/a", "footprints/b")
    assert groups_gone(shards, schema.HOMOGRAPHY, ("surface",)) == ""
    found = groups_gone(shards, schema.HOMOGRAPHY, ("surface", "dlt"), ("CAM_FRONT",))
    assert found == "homography/dlt is not in scene-0001.h5"
    (shards / "scene-0002.h5").unlink()
    assert groups_gone(shards, schema.HOMOGRAPHY, ("surface",)) == "scene-0002.h5 is gone"
    (shards / NAME).unlink()
    assert groups_gone(shards, schema.HOMOGRAPHY, ("surface",)) == "manifest.json is gone"


def test_another_command_goes_on_where_one_was_cut_short(shards, monkeypatch):
    class Killed(BaseException):
        pass

    def killed(*arguments):
        raise Killed

    with monkeypatch.context() as patch:
        patch.setattr("ogmkit.pipeline.amend.write_manifest", killed)
        with pytest.raises(Killed):
            render_footprints(shards, FootprintSettings(method="full-body"))
    assert unfinished_command(shards) == "render-footprints"
    assert verify_folder(shards)  # the manifest knows the old shards only
    with pytest.raises(OutputError, match="render-footprints is unfinished"):
        fit_shards(shards, ("dlt",))
    settle(shards, "homography-fit")
    assert verify_folder(shards) == ()
    fit_shards(shards, ("dlt",))
    assert groups_gone(shards, schema.FOOTPRINTS, ("surface", "full-body")) == ""


def test_a_command_that_was_cut_short_settles_its_own(shards):
    before = read_manifest(shards)
    settle(shards, "homography-fit")
    begin_amending(shards, "homography-fit")
    settle(shards, "homography-fit")
    assert unfinished_command(shards) == "homography-fit"
    assert read_manifest(shards) == before

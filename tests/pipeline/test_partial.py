"""Partial downloads: what is absent or bad is named by kind, or left out; nothing bridges the gap."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from ogmkit.base.execution import Execution
from ogmkit.errors import DataFileError, SettingsError
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.extract_summary import grouped
from ogmkit.pipeline.plan import plan
from ogmkit.pipeline.sources import RecordDataset
from ogmkit.shards.left_out import count_left_out
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.verify import verify_folder

FRAMES, SOUND = 8, 3
SCENES = ("scene-0001", "scene-0002")


@pytest.fixture
def skipping(small_settings):
    return replace(small_settings, skip_bad_frames=True)


@pytest.fixture
def complete(small_settings):
    return replace(small_settings, only_complete=True)


@pytest.fixture
def root(tmp_path, tiny_dataroot):
    """A copy of the dataset."""
    return shutil.copytree(tiny_dataroot, tmp_path / "root")


@pytest.fixture
def images(root):
    """The places of a scene's images: `images(scene, camera)`."""

    def find(scene, camera):
        with Dataset(root) as dataset:
            return [root / frame.image_path for frame in dataset.scene(scene, [camera]).cameras[camera]]

    return find


@pytest.fixture
def partial(root, images):
    """The dataset without the images of CAM_BACK but for three a scene."""
    for scene in SCENES:
        for path in images(scene, "CAM_BACK")[SOUND:]:
            path.unlink()
    with Dataset(root) as dataset:
        yield dataset


def _lose_one(path):
    path.unlink()


def _cut(path):
    path.write_bytes(path.read_bytes()[:-100])


def _shrink(path):
    from PIL import Image

    with Image.open(path) as image:
        image.resize((40, 20)).save(path)


DAMAGE = {"image is absent": _lose_one, "image is damaged": _cut, "image is of another size": _shrink}


@pytest.mark.sampled(1)
@pytest.mark.parametrize("workers", [1, 2])
def test_what_is_absent_is_one_line_before_any_map_is_decoded(
    tmp_path, run, partial, images, mask_cache, workers
):
    before = sorted(mask_cache.glob("*.mask"))
    summary = run(tmp_path / "out", dataset=partial, execution=Execution(workers=workers))
    assert [failure.scene for failure in summary.failures] == list(SCENES)
    (group,) = grouped(summary.failures)
    first = images(SCENES[0], "CAM_BACK")[SOUND]
    assert group.scenes == SCENES
    assert group.reason == (
        f"{first}: image is absent, one of 10 of CAM_BACK; download them, or leave out such scenes "
        "(--only-complete), such frames (--skip-bad-frames) or all images (--images none)"
    )
    assert sorted(mask_cache.glob("*.mask")) == before


def test_every_kind_of_absent_file_has_its_line(tmp_path, run, partial, root, small_settings):
    for path in (*root.glob("samples/LIDAR_TOP/*"), *root.glob("maps/*.png")):
        path.unlink()
    settings = replace(small_settings, targets=replace(small_settings.targets, lidar=True))
    groups = grouped(run(tmp_path / "out", settings, dataset=partial).failures)
    assert [group.scenes for group in groups] == [SCENES] * 3
    problems = {group.reason.partition(": ")[2].partition(";")[0] for group in groups}
    assert problems == {
        "image is absent, one of 10 of CAM_BACK",
        "LiDAR sweep is absent, one of 16 of CAM_FRONT, CAM_BACK",
        "map mask is absent, one of 2",
    }


def _turn(records):
    """Spoil all poses but the first, each in its own way."""
    for number, record in enumerate(records):
        record["rotation"] = [1.0, float(number), 0.0, 0.0]


def test_a_broken_rule_is_one_kind_whatever_the_record(tmp_path, run, root, edit_table):
    edit_table(root, "ego_pose", _turn)
    with Dataset(root) as dataset:
        (group,) = grouped(run(tmp_path / "out", dataset=dataset).failures)
    assert (group.scenes, group.others) == (SCENES, True)
    assert "R301, scene-0001" in group.reason


def test_nothing_is_said_of_cameras_that_were_not_chosen(tmp_path, run, partial, small_settings):
    summary = run(tmp_path / "out", replace(small_settings, cameras=("CAM_FRONT",)), dataset=partial)
    assert (summary.failures, summary.frames) == ((), 2 * FRAMES)


def test_a_bad_frame_is_left_out_of_its_camera_only(tmp_path, run, partial, skipping, undisturbed):
    out = tmp_path / "out"
    summary = run(out, skipping, dataset=partial)
    assert (summary.failures, summary.left_out) == ((), ())
    assert (summary.frames, summary.frames_left_out) == (2 * (FRAMES + SOUND), 2 * (FRAMES - SOUND))
    assert verify_folder(out) == ()
    for scene in SCENES:
        with Shard(out / f"{scene}.h5") as shard, Shard(undisturbed / f"{scene}.h5") as whole:
            assert [shard.frames(camera) for camera in ("CAM_FRONT", "CAM_BACK")] == [FRAMES, SOUND]
            assert "frames_left_out" not in shard.attributes("CAM_FRONT")
            assert shard.attributes("CAM_BACK")["frames_left_out"] == FRAMES - SOUND
            tokens = whole.strings("CAM_BACK", "sample_data_token")
            assert shard.strings("CAM_BACK", "left_out/sample_data_token") == tokens[SOUND:]
            (count,) = count_left_out(shard)
            assert (count.camera, count.reason, count.frames) == (
                "CAM_BACK",
                "image is absent",
                FRAMES - SOUND,
            )
            for name in ("trajectory/future", "trajectory/past", "boxes/size_wlh", "drivable", "vehicles"):
                found = shard.dataset("CAM_BACK", name)[:]
                np.testing.assert_array_equal(found, whole.dataset("CAM_BACK", name)[: len(found)])
            assert np.isfinite(shard.dataset("CAM_BACK", "trajectory/future")[0]).all()


def test_two_workers_leave_out_the_same(tmp_path, run, partial, skipping, digests):
    for workers in (1, 2):
        run(tmp_path / str(workers), skipping, dataset=partial, execution=Execution(workers=workers))
    assert digests(tmp_path / "1") == digests(tmp_path / "2")


def test_where_nothing_is_bad_nothing_differs(tmp_path, run, skipping, complete, undisturbed, digests):
    for settings in (skipping, complete):
        out = tmp_path / ("skipping" if settings.skip_bad_frames else "complete")
        run(out, settings)
        assert digests(out) == digests(undisturbed)


@pytest.mark.sampled(1)
@pytest.mark.parametrize("kind", DAMAGE)
def test_kinds_of_bad_frames(tmp_path, run, root, images, skipping, complete, kind):
    DAMAGE[kind](images(SCENES[0], "CAM_FRONT")[4])
    with Dataset(root) as dataset:
        summary = run(tmp_path / "frames", skipping, dataset=dataset)
        assert (summary.frames, summary.frames_left_out) == (4 * FRAMES - 1, 1)
        with Shard(tmp_path / "frames/scene-0001.h5") as shard:
            assert shard.strings("CAM_FRONT", "left_out/reason") == (kind,)
            assert shard.frames("CAM_BACK") == FRAMES
        summary = run(tmp_path / "scenes", complete, dataset=dataset)
        assert [one.scene for one in summary.left_out] == [SCENES[0]]
        assert (summary.scenes, summary.failures) == (1, ())
        failures = run(tmp_path / "neither", dataset=dataset).failures
        assert failures[0].error.kind == kind
        assert all(option in str(failures[0].error) for option in ("--only-complete", "--skip-bad-frames"))


def test_a_bad_sweep_is_a_bad_frame_of_every_camera(tmp_path, run, root, skipping):
    settings = replace(skipping, targets=replace(skipping.targets, lidar=True))
    sweeps = sorted((root / "samples/LIDAR_TOP").iterdir())
    sweeps[0].unlink()
    sweeps[-1].write_bytes(b"odd")
    with Dataset(root) as dataset:
        summary = run(tmp_path / "out", settings, dataset=dataset)
    assert (summary.frames, summary.frames_left_out) == (4 * FRAMES - 4, 4)
    assert verify_folder(tmp_path / "out") == ()
    with Shard(tmp_path / "out/scene-0002.h5") as shard:
        assert {shard.strings(camera, "left_out/reason") for camera in shard.cameras} == {
            ("LiDAR sweep is damaged",)
        }


def test_scenes_that_lack_a_file_are_left_out(tmp_path, run, root, images, complete, tiny_dataroot):
    for path in images(SCENES[1], "CAM_FRONT")[2:]:
        path.unlink()
    with Dataset(root) as dataset:
        summary = run(tmp_path / "out", complete, dataset=dataset)
    assert (summary.scenes, summary.failures) == (1, ())
    (left_out,) = summary.left_out
    assert (left_out.scene, left_out.absent[0].files) == (SCENES[1], FRAMES - 2)
    assert [entry.scene for entry in read_manifest(tmp_path / "out").shards] == [SCENES[0]]
    assert verify_folder(tmp_path / "out") == ()
    shutil.copytree(tiny_dataroot / "samples", root / "samples", dirs_exist_ok=True)
    with Dataset(root) as dataset:
        summary = run(tmp_path / "out", complete, dataset=dataset)
    assert (summary.scenes, summary.kept, summary.left_out) == (2, 1, ())


def test_a_scene_without_its_map_is_left_out_too(tmp_path, run, root, complete):
    with Dataset(root) as dataset:
        path = root / dataset.scene(SCENES[0], ["CAM_FRONT"]).cameras["CAM_FRONT"][0].map_path
        path.unlink()
        summary = run(tmp_path / "out", complete, dataset=dataset)
    assert [one.scene for one in summary.left_out] == [SCENES[0]]
    assert str(summary.left_out[0].error).startswith(f"{path}: map mask is absent")


def test_a_scene_that_has_no_sound_frame_of_a_camera_is_left_out(tmp_path, run, root, images, skipping):
    for path in images(SCENES[0], "CAM_BACK"):
        path.unlink()
    with Dataset(root) as dataset:
        summary = run(tmp_path / "out", skipping, dataset=dataset)
    assert (summary.scenes, summary.frames_left_out, summary.failures) == (1, 0, ())
    (left_out,) = summary.left_out
    assert "image is absent, and so for every frame of CAM_BACK" in str(left_out.error)


def test_the_same_command_goes_on_once_the_files_are_there(
    tmp_path, run, partial, root, tiny_dataroot, skipping, undisturbed, digests
):
    out = tmp_path / "out"
    run(out, skipping, dataset=partial)
    before = digests(out)
    assert run(out, skipping, dataset=partial).kept == 2
    assert digests(out) == before
    shutil.copytree(tiny_dataroot / "samples", root / "samples", dirs_exist_ok=True)
    summary = run(out, skipping, dataset=partial)
    assert (summary.kept, summary.frames_left_out) == (0, 0)
    manifest = replace(read_manifest(out), dataroot=read_manifest(undisturbed).dataroot)
    assert manifest == read_manifest(undisturbed)
    assert digests(out) | {"manifest.json": ""} == digests(undisturbed) | {"manifest.json": ""}


def test_a_damaged_file_is_read_again_to_see_whether_it_is_sound_now(tmp_path, run, root, images, skipping):
    path = images(SCENES[0], "CAM_FRONT")[4]
    whole = path.read_bytes()
    path.write_bytes(b"<html>")
    with Dataset(root) as dataset:
        run(tmp_path / "out", skipping, dataset=dataset)
        path.write_bytes(whole[:-9])
        assert run(tmp_path / "out", skipping, dataset=dataset).kept == 2
        path.write_bytes(whole)
        assert run(tmp_path / "out", skipping, dataset=dataset).kept == 1


def test_without_the_option_a_shard_that_lacks_frames_is_not_what_is_wanted(
    tmp_path, run, partial, skipping, complete, digests
):
    out = tmp_path / "out"
    run(out, skipping, dataset=partial)
    before = digests(out)
    summary = run(out, dataset=partial)
    assert [one.error.kind for one in summary.failures] == ["image is absent"] * 2
    summary = run(out, complete, dataset=partial)
    assert summary.left_out == ()
    for failure in summary.failures:
        assert str(failure.error) == (
            f"{out / failure.scene}.h5: is from an earlier run and can't be rebuilt (image is absent); "
            "remove it, or choose another OUT"
        )
    assert digests(out) == before


def test_a_whole_shard_stays_when_its_files_go(tmp_path, run, root, images, skipping, complete):
    out = tmp_path / "out"
    with Dataset(root) as dataset:
        run(out, dataset=dataset)
        images(SCENES[0], "CAM_FRONT")[0].unlink()
        for settings in (skipping, complete):
            summary = run(out, settings, dataset=dataset)
            assert (summary.kept, summary.frames_left_out) == (2, 0)


def test_a_plan_tells_what_would_be_left_out(tmp_path, run, partial, skipping, complete, small_settings):
    def planned(settings):
        return [(one.action, one.frames) for one in plan(partial, tmp_path / "out", settings, scenes=SCENES)]

    assert planned(small_settings) == [("fail", 0)] * 2
    assert planned(complete) == [("leave out", 0)] * 2
    assert planned(skipping) == [("write", FRAMES + SOUND)] * 2
    run(tmp_path / "out", skipping, dataset=partial)
    assert [action for action, _ in planned(skipping)] == ["keep"] * 2


def test_the_first_absent_file_is_raised_where_that_is_wanted(tmp_path, run, partial, complete):
    with pytest.raises(DataFileError, match=r"image is absent, one of 5 of CAM_BACK; download them"):
        run(tmp_path / "out", dataset=partial, strict=True)
    assert len(run(tmp_path / "out", complete, dataset=partial, strict=True).left_out) == 2


def test_records_made_in_python_may_lack_files_too(tmp_path, run, partial, skipping):
    scenes = tuple(partial.scene(name, ["CAM_FRONT", "CAM_BACK"]) for name in SCENES)
    own = RecordDataset(partial.root, "v1.0-mini", scenes)
    assert run(tmp_path / "out", skipping, dataset=own).frames_left_out == 2 * (FRAMES - SOUND)


def test_frames_or_scenes_not_both():
    with pytest.raises(SettingsError, match="leave out whole scenes or frames, not both"):
        ExtractSettings(only_complete=True, skip_bad_frames=True)

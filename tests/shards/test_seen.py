"""Masks of cells that are seen: stored by option, made again by `verify`, absent by default."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

from ogmkit.errors import FrameFileError, SettingsError
from ogmkit.geometry.se3 import transform_points
from ogmkit.raster.lidar import lidar_points_level
from ogmkit.raster.occlusion import reached_mask, unhidden_mask
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.verify import verify_folder
from ogmkit.shards.writer import write_shard
from ogmkit.target_settings import TargetSettings
from ogmkit.targets import build_targets

ALL = ("lidar", "rays")


@pytest.fixture(scope="module")
def settings(small_grid):
    return TargetSettings(grid=small_grid, seen=ALL, lidar=True)


@pytest.fixture
def shard(scene, settings, masks, tmp_path):
    """The hand-made scene with all masks, in a folder without a manifest."""
    path = tmp_path / "scene-0007.h5"
    write_shard(path, scene, settings, masks, dataset_version="v1.0-mini")
    return path


def messages(path):
    return [one.message for one in verify_folder(path.parent) if one.file == path.name]


def test_the_stored_masks_are_those_of_the_functions(shard, scene, settings):
    assert messages(shard) == []
    with Shard(shard) as opened:
        for camera, frames in scene.cameras.items():
            for row, frame in enumerate(frames):
                view = opened.dataset(camera, "field_of_view")[row]
                eye = frame.level_from_camera[:3, 3]
                rays = unhidden_mask(settings.grid, eye, frame.level_from_global, frame.boxes, view)
                np.testing.assert_array_equal(opened.dataset(camera, "seen/rays")[row], rays)
                centre = transform_points(frame.level_from_global, frame.lidar.global_from_lidar[None, :3, 3])
                np.testing.assert_allclose(opened.dataset(camera, "seen/lidar_centre_level")[row], centre[0])
                reached = reached_mask(settings.grid, centre[0], lidar_points_level(frame).astype(float))
                np.testing.assert_array_equal(opened.dataset(camera, "seen/lidar")[row], reached & view)


def test_some_cells_in_view_are_hidden_and_some_not_reached(shard):
    with Shard(shard) as opened:
        view, rays, lidar = (
            opened.dataset("CAM_FRONT", name)[:] for name in ("field_of_view", "seen/rays", "seen/lidar")
        )
    assert view[0].sum() == rays[0].sum()  # no box
    assert 0 < rays[1:].sum() < view[1:].sum()
    assert 0 < lidar.sum() < view.sum()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda mask: mask.write_direct(np.ones(mask.shape, np.uint8)),
            "goes beyond the field of view in frame 0",
        ),
        (
            lambda mask: mask.write_direct(np.zeros(mask.shape, np.uint8)),
            "contradicts boxes, poses or points in",
        ),
    ],
)
@pytest.mark.parametrize("kind", ALL)
def test_verify_tells_of_other_masks(shard, kind, change, said):
    with h5py.File(shard, "r+") as h5:
        change(h5[f"CAM_BACK/seen/{kind}"])
    (found,) = messages(shard)
    assert found.startswith(f"/CAM_BACK/seen/{kind} {said}")


def test_verify_tells_of_masks_that_are_missing_or_too_many(shard):
    with h5py.File(shard, "r+") as h5:
        h5["CAM_BACK/seen"].move("rays", "waves")
    assert messages(shard) == ["/CAM_BACK/seen/rays is missing", "/CAM_BACK/seen/waves is not in the schema"]


def test_by_default_there_are_none_and_no_setting_of_them(scene, small_grid, masks, tmp_path):
    path = tmp_path / "scene-0007.h5"
    write_shard(path, scene, TargetSettings(grid=small_grid), masks, dataset_version="v1.0-mini")
    with h5py.File(path) as h5:
        assert "seen" not in h5["CAM_FRONT"]
        assert "seen" not in h5.attrs["settings"]


def test_points_that_are_not_kept_are_read_for_their_mask_all_the_same(scene, settings, masks, tmp_path):
    path = tmp_path / "scene-0007.h5"
    write_shard(path, scene, replace(settings, lidar=False), masks, dataset_version="v1.0-mini")
    assert messages(path) == []
    with h5py.File(path) as h5:
        assert "lidar" not in h5["CAM_FRONT"]
        assert h5["CAM_FRONT/seen/lidar"][:].any()


def test_a_frame_without_a_sweep_has_no_such_mask(scene, settings):
    frame = replace(scene.cameras["CAM_FRONT"][0], lidar=None)
    with pytest.raises(FrameFileError, match="has no LiDAR sweep; extract without --lidar and --seen lidar"):
        build_targets(frame, replace(settings, lidar=False), None)
    assert np.isnan(frame.lidar_centre_level).all()


def test_kinds_stand_in_one_order_and_the_field_of_view_is_always_there():
    assert TargetSettings(seen=("lidar", "rays")).seen == ("fov", "rays", "lidar")
    assert TargetSettings(seen=()) == TargetSettings()
    stored = ExtractSettings(TargetSettings(seen=("rays",)))
    assert ExtractSettings.from_dict(stored.to_dict()) == stored
    with pytest.raises(SettingsError, match="unknown seen 'radar'"):
        TargetSettings(seen=("radar",))


def test_a_folder_of_them_is_sound(seen_shards):
    assert verify_folder(seen_shards) == ()
    assert read_manifest(seen_shards).settings.targets.seen == ("fov", "rays", "lidar")

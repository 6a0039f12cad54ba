"""Shards that lack frames, and those made without maps."""

from dataclasses import replace

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ogmkit.base.steps import nearest_rows
from ogmkit.frames import LeftOutFrame
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.shards.crosschecks import cross_problems
from ogmkit.shards.left_out import LeftOutCount, count_left_out, left_out_frames
from ogmkit.shards.neighbours import neighbour_rows
from ogmkit.shards.reader import Shard
from ogmkit.shards.structure import structure_problems
from ogmkit.shards.summary import summarise
from ogmkit.shards.writer import write_shard

LOST = (1, 3)
"""Of CAM_FRONT's five frames."""


def _without(scene, lost=LOST):
    frames = scene.cameras["CAM_FRONT"]
    records = tuple(
        LeftOutFrame(frames[i].sample_data_token, frames[i].timestamp_us, "image is absent") for i in lost
    )
    kept = tuple(frame for i, frame in enumerate(frames) if i not in lost)
    return replace(scene, cameras={**scene.cameras, "CAM_FRONT": kept}, left_out={"CAM_FRONT": records})


@pytest.fixture
def path(tmp_path, scene, small_settings, masks):
    path = tmp_path / "scene-0007.h5"
    write_shard(path, _without(scene), small_settings, masks, dataset_version="v1.0-mini")
    return path


@pytest.fixture
def problems(path):
    """What is wrong with the shard after a change: `problems(edit)`, which gets CAM_FRONT's group."""

    def find(edit):
        with h5py.File(path, "r+") as h5:
            edit(h5["CAM_FRONT"])
        with Shard(path) as shard:
            structure = list(structure_problems(shard))
            return structure or list(cross_problems(shard, "CAM_FRONT"))

    return find


def test_a_shard_knows_which_frames_it_lacks(path, scene):
    with Shard(path) as shard:
        assert list(structure_problems(shard)) == []
        assert [cross_problems(shard, camera) for camera in shard.cameras] == [(), ()]
        assert left_out_frames(shard, "CAM_FRONT") == _without(scene).left_out["CAM_FRONT"]
        assert left_out_frames(shard, "CAM_BACK") == ()
        assert count_left_out(shard) == (LeftOutCount("CAM_FRONT", "image is absent", len(LOST)),)
        assert (shard.frames("CAM_FRONT"), shard.left_out("CAM_FRONT"), shard.left_out("CAM_BACK")) == (
            3,
            2,
            0,
        )
    assert (summarise(path).frames, summarise(path).left_out) == (8, 2)


@pytest.mark.parametrize(
    ("edit", "problem"),
    [
        (lambda front: front.attrs.modify("frames_left_out", 3), "lists 2 frames, not 3 as attribute"),
        (lambda front: front.attrs.__delitem__("frames_left_out"), "attribute frames_left_out is missing"),
        (lambda front: front["left_out"].__delitem__("reason"), "left_out/reason is missing"),
        (
            lambda front: front["left_out/timestamp_us"].write_direct(np.array([2, 1])),
            "left_out/timestamp_us goes back after frame 0",
        ),
        (
            lambda front: front["left_out/sample_data_token"].__setitem__(0, "CAM_FRONT-ü-0"),
            "has duplicates, or names frames that are here",
        ),
        (
            lambda front: front["trajectory/future"].__setitem__((0, 1), [9.0, 9.0]),
            "trajectory/future contradicts the poses around frame 0",
        ),
    ],
)
def test_what_contradicts_itself_is_found(problems, edit, problem):
    assert any(problem in line for line in problems(edit))


def test_a_position_is_not_compared_with_a_pose_that_is_not_here(problems):
    """Frame 0's first point of the future is frame 1, which the shard lacks; its second is compared."""
    assert problems(lambda front: front["trajectory/future"].__setitem__((0, 0), [9.0, 9.0])) == []


class _Times:
    """What `neighbour_rows` reads of a shard."""

    def __init__(self, times_us, lost_us, step_s):
        self._columns = {"timestamp_us": times_us, "left_out/timestamp_us": lost_us}
        self.settings = type("", (), {"targets": type("", (), {"step_s": step_s})})

    def dataset(self, camera, name):
        return self._columns[name]

    def left_out(self, camera):
        return len(self._columns["left_out/timestamp_us"])


@settings(max_examples=60)
@given(st.data())
def test_neighbours_are_those_of_the_whole_recording(data):
    gaps = data.draw(st.lists(st.sampled_from([100_000, 400_000, 500_000, 600_000]), min_size=1, max_size=14))
    times_us = 10**15 + np.cumsum([0, *gaps])
    kept = np.array(data.draw(st.lists(st.booleans(), min_size=len(times_us), max_size=len(times_us))))
    kept[0] = True
    steps = range(-3, 4)
    rows, left_out = neighbour_rows(_Times(times_us[kept], times_us[~kept], 0.5), "CAM_FRONT", steps)
    place = np.where(kept, np.cumsum(kept) - 1, -1)
    whole = nearest_rows(times_us, steps, 0.5)[kept]
    np.testing.assert_array_equal(rows, np.where(whole >= 0, place[whole], -1))
    np.testing.assert_array_equal(left_out, (whole >= 0) & ~kept[whole])


def test_without_maps_a_shard_knows_no_drivable_area_and_says_so(tmp_path, scene, small_settings):
    nowhere = {
        camera: tuple(replace(frame, map_path="") for frame in frames)
        for camera, frames in scene.cameras.items()
    }
    path, whole = tmp_path / "without.h5", tmp_path / "with.h5"
    settings = replace(small_settings, no_map=True)
    masks = MaskStore(tmp_path / "masks")
    write_shard(path, replace(scene, cameras=nowhere), settings, masks, dataset_version="v1.0-mini")
    assert not (tmp_path / "masks").exists()
    write_shard(whole, scene, small_settings, masks, dataset_version="v1.0-mini")
    with Shard(path) as shard, Shard(whole) as other:
        assert list(structure_problems(shard)) == []
        assert [cross_problems(shard, camera) for camera in shard.cameras] == [(), ()]
        assert shard.h5.attrs["no_map"] == 1
        assert "no_map" not in other.h5.attrs
        assert "drivable_share" not in shard.attributes("CAM_FRONT")
        assert shard.drivable("CAM_FRONT", 0) is None
        names = {name for name in other.h5["CAM_FRONT"] if name != "drivable"}
        assert set(shard.h5["CAM_FRONT"]) == names
        for name in ("vehicles", "field_of_view", "image", "trajectory/past", "lidar/points"):
            for frame, found in enumerate(shard.dataset("CAM_FRONT", name)[:]):
                np.testing.assert_array_equal(found, other.dataset("CAM_FRONT", name)[frame])
    summary = summarise(path)
    assert np.isnan(summary.drivable_share)
    assert summary.vehicle_share == summarise(whole).vehicle_share


def test_a_raster_that_the_settings_leave_out_is_not_of_the_schema(tmp_path, scene, small_settings, masks):
    path = tmp_path / "scene.h5"
    write_shard(path, scene, replace(small_settings, no_map=True), masks, dataset_version="v1.0-mini")
    with h5py.File(path, "r+") as h5:
        h5["CAM_BACK/drivable"] = h5["CAM_BACK/vehicles"][:]
        del h5.attrs["no_map"]
    with Shard(path) as shard:
        assert list(structure_problems(shard)) == [
            "/ attribute no_map is missing",
            "/CAM_BACK/drivable is not in the schema",
        ]

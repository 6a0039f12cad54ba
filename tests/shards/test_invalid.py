"""Invalid frames of real shards, against what their datasets say."""

import shutil

import h5py
import pytest

from ogmkit.errors import ShardError
from ogmkit.shards.invalid import InvalidCount, count_invalid, invalid_frames
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard


@pytest.fixture
def out(sample_shards, tmp_path):
    return shutil.copytree(sample_shards, tmp_path / "out")


def found(path):
    with Shard(path) as shard:
        return invalid_frames(shard)


def test_trajectories_lack_the_past_at_the_start_and_the_future_at_the_end(sample_shards):
    # Eight frames: six past positions are there from the seventh on, six future ones up to the second.
    parts = [
        (one.scene, one.reason, one.frames)
        for one in found(sample_shards / "scene-0001.h5")
        if (one.camera, one.of) == ("CAM_BACK", "trajectory")
    ]
    assert parts == [
        ("scene-0001", "future positions are missing", (6, 7)),
        ("scene-0001", "past and future positions are missing", (2, 3, 4, 5)),
        ("scene-0001", "past positions are missing", (0, 1)),
    ]


def test_homographies_and_masks_have_their_reasons(out):
    with h5py.File(out / "scene-0002.h5", "r+") as file:
        group = file["CAM_FRONT"]
        group["homography/calibration/valid"][:] = [True, False, True, False, False, True, True, True]
        group["homography/calibration/reason"][:] = ["", "b", "", "a", "b", "", "", ""]
        group["footprints/calibration/valid"][3] = False
    parts = [
        (one.of, one.reason, one.frames)
        for one in found(out / "scene-0002.h5")
        if one.camera == "CAM_FRONT" and one.of.endswith("/calibration")
    ]
    assert parts == [
        ("homography/calibration", "a", (3,)),
        ("homography/calibration", "b", (1, 4)),
        ("footprints/calibration", "no valid homography calibration", (3,)),
    ]


def test_counts_are_over_all_scenes(sample_shards):
    counts = count_invalid(sample_shards, read_manifest(sample_shards))
    assert InvalidCount("CAM_FRONT", "trajectory", "past positions are missing", 4) in counts
    assert InvalidCount("CAM_FRONT", "trajectory", "past and future positions are missing", 8) in counts
    by_hand = 0
    for path in sample_shards.glob("*.h5"):
        with h5py.File(path, locking=False) as file:  # as a sample set that is still open has it
            by_hand += int((~file["CAM_FRONT/homography/dlt/valid"][:]).sum())
    assert by_hand > 0
    counted = [one.frames for one in counts if (one.camera, one.of) == ("CAM_FRONT", "homography/dlt")]
    assert sum(counted) == by_hand


def test_a_damaged_shard_is_named(out):
    path = out / "scene-0001.h5"
    with h5py.File(path, "r+") as file:
        del file["CAM_FRONT/trajectory/past_valid"]
    with pytest.raises(ShardError, match=r"scene-0001\.h5: has no dataset CAM_FRONT/trajectory/past_valid"):
        found(path)

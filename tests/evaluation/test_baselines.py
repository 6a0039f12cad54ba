"""Rows that need no run."""

import h5py
import numpy as np
import pytest

from ogmkit.errors import ShardError
from ogmkit.evaluation.baselines import Ceilings, mean_maps, on_grid
from ogmkit.evaluation.frames import FrameReader
from ogmkit.grid import GridSpec
from ogmkit.metrics.iou import masks_of
from ogmkit.pictures.masks import open_sets
from ogmkit.shards.manifest import read_manifest


class Truths:
    """A reader of codes that stand in the test."""

    def __init__(self, codes):
        self.codes = codes

    def truth(self, place):
        return np.array(self.codes[place], np.uint8)


@pytest.fixture
def reader(own_shards):
    paths = {entry.scene: own_shards / entry.file for entry in read_manifest(own_shards).shards}
    with FrameReader(paths) as reader:
        yield reader


def test_mean_maps_keep_what_over_half_of_a_cameras_frames_have():
    codes = {
        ("a", "FRONT", 0): [[1, 3, 0]],
        ("a", "FRONT", 1): [[1, 2, 2]],
        ("b", "FRONT", 0): [[0, 2, 1]],
        ("b", "BACK", 0): [[0, 1, 0]],
        ("b", "BACK", 1): [[0, 0, 3]],
    }
    ticks = []
    maps = mean_maps(Truths(codes), codes, GridSpec(1, 1, 3, 1, 2), 0.5, lambda: ticks.append(1))

    # FRONT: drivable in 2, 1, 1 of 3 frames, vehicles in 0, 3, 1. BACK: nothing in more than half of 2.
    np.testing.assert_array_equal(maps["FRONT"], [[1, 2, 0]])
    np.testing.assert_array_equal(maps["BACK"], [[0, 0, 0]])
    assert len(ticks) == 5
    lower = mean_maps(Truths(codes), codes, GridSpec(1, 1, 3, 1, 2), 0.3, lambda: None)
    np.testing.assert_array_equal(lower["FRONT"], [[1, 3, 3]])


def test_masks_are_laid_on_the_grid_as_pictures_do_it(reader, own_shards):
    scene = read_manifest(own_shards).shards[1].scene
    for index in range(3):
        frame = reader.frame((scene, "CAM_FRONT", index))
        (stored,) = open_sets(frame.shard, "CAM_FRONT", ("surface",))
        masks = stored.read(index)
        code = on_grid(frame, masks.drivable | masks.vehicles << np.uint8(1), "surface")
        for one, expected in zip(masks_of(code), masks.rewarped(frame.truth.shape), strict=True):
            np.testing.assert_array_equal(one, expected)


def test_ceilings_come_near_the_truth_and_bodies_are_stretched(reader, own_shards):
    ceilings = Ceilings(("calibration", "surface"), "surface", 1.0)
    assert ceilings.names == ("ceiling-calibration", "ceiling-surface", "ceiling-full-body")
    hits, unions, areas = np.zeros((3, 2)), np.zeros((3, 2)), np.zeros((3, 2))
    for entry in read_manifest(own_shards).shards:
        for index in range(entry.frames // 2):
            frame = reader.frame((entry.scene, "CAM_FRONT", index))
            seen, true = frame.field_of_view > 0, masks_of(frame.truth)
            codes = ceilings.codes(frame)
            assert tuple(codes) == ceilings.names
            for number, name in enumerate(ceilings.names):
                for target, found in enumerate(masks_of(codes[name])):
                    hits[number, target] += (found & true[target] & seen).sum()
                    unions[number, target] += ((found | true[target]) & seen).sum()
                    areas[number, target] += (found & seen).sum()
    iou = hits / unions

    assert (iou[:2, 0] > 0.9).all()  # the ground is almost flat here
    assert iou[2, 0] == iou[1, 0]  # the same drivable area
    assert iou[2, 1] < iou[1, 1] / 2
    assert areas[2, 1] > 2 * areas[1, 1]


@pytest.fixture
def spoilt(own_shards):
    """A scene in whose second frame the homography `surface` has been replaced: `spoilt(valid, matrix)`."""
    entry = read_manifest(own_shards).shards[0]

    def spoil(valid, matrix):
        with h5py.File(own_shards / entry.file, "r+") as h5:
            group = h5["CAM_FRONT/homography/surface"]
            group["valid"][1], group["bev_from_image"][1] = valid, matrix
        return entry.scene, "CAM_FRONT", 1

    return spoil


def test_without_a_valid_homography_a_ceiling_is_empty(reader, spoilt):
    frame = reader.frame(spoilt(False, np.full((3, 3), np.nan)))
    codes = Ceilings(("calibration", "surface"), "surface", 1.0).codes(frame)

    assert codes["ceiling-calibration"].any()
    assert not codes["ceiling-surface"].any()
    assert not codes["ceiling-full-body"].any()


def test_a_homography_that_is_called_valid_but_is_none_is_damage(reader, spoilt):
    frame = reader.frame(spoilt(True, np.zeros((3, 3))))

    with pytest.raises(ShardError, match="homography/surface: frame 1 is called valid but has no inverse"):
        Ceilings(("surface",), None, 1.0).codes(frame)


def test_without_homographies_there_are_no_ceilings():
    ceilings = Ceilings((), None, 2.0)

    assert ceilings.names == ()
    assert ceilings.codes(None) == {}

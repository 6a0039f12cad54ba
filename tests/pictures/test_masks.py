"""Reading masks, and laying them on the plane: against the pinhole formula of the fixture's camera."""

import h5py
import numpy as np
import pytest

from ogmkit.errors import ShardError
from ogmkit.pictures.masks import open_sets
from ogmkit.shards.reader import Shard


@pytest.fixture
def path(make_shards):
    return make_shards() / "scene-0001.h5"


def read(path, *names, index=1):
    with Shard(path) as shard:
        return [one.read(index) for one in open_sets(shard, "CAM_FRONT", names)]


def ground_mask(x_range, y_range, scale=1):
    """Pixels of the camera at (1.5, 0, 1.5), focal length 100, that see a rectangle of the ground."""
    v, u = np.mgrid[0 : 90 // scale, 0 : 160 // scale] * scale + (scale - 1) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(v > 44.5, 150 / (v - 44.5), np.inf)
    x, y = 1.5 + depth, -(u - 79.5) / 100 * depth
    return ((x_range[0] < x) & (x < x_range[1]) & (y_range[0] < y) & (y < y_range[1])).astype(np.uint8)


@pytest.mark.parametrize("scale", [1, 2])
def test_a_patch_of_ground_comes_back_to_its_cells(path, add_masks, grid, scale):
    vehicles, drivable = (ground_mask(x, y, scale) for x, y in (((6, 8), (-1, 1)), ((5, 7), (0, 2))))
    add_masks(path, scale=scale, vehicles=vehicles, drivable=drivable)
    (masks,) = read(path, "surface")
    drivable_bev, vehicles_bev = masks.rewarped(grid.shape)

    # Cells of 0.5 m, the ego at (80, 24): x 6…8 m is rows 64…67, y −1…1 m columns 22…25.
    expected = np.zeros(grid.shape, np.uint8)
    expected[64:68, 22:26] = 1
    np.testing.assert_array_equal(vehicles_bev, expected)
    expected = np.zeros(grid.shape, np.uint8)
    expected[66:70, 20:24] = 1
    np.testing.assert_array_equal(drivable_bev, expected)


def test_a_frame_without_homography_says_why(path, add_masks, grid):
    add_masks(path, invalid=(1,), vehicles=np.ones((90, 160), np.uint8))
    (masks,) = read(path, "surface")

    assert masks.reason == "no valid homography: too few corners"
    assert masks.rewarped(grid.shape) is None
    assert not masks.vehicles.any()
    (other,) = read(path, "surface", index=0)
    assert (other.reason, other.vehicles.all()) == ("", True)


def test_a_frame_whose_masks_were_not_made_says_so(path, add_masks, grid):
    add_masks(path)
    with h5py.File(path, "r+") as h5:
        h5["CAM_FRONT/footprints/surface/valid"][1] = False
    (masks,) = read(path, "surface")

    assert masks.reason == "no masks, though there is a homography"
    assert masks.rewarped(grid.shape) is None


def test_sets_share_the_last_one_s_homography(path, add_masks):
    add_masks(path, "dlt", homography="dlt")
    add_masks(path, "surface")
    add_masks(path, "full-body", homography="")
    with Shard(path) as shard:
        sources = [one.homography for one in open_sets(shard, "CAM_FRONT", ("full-body", "dlt"))]
        (alone,) = open_sets(shard, "CAM_FRONT", ("full-body",))

    assert sources == ["dlt", "dlt"]
    assert alone.homography == "surface"


def test_a_set_of_an_earlier_homography_is_told_apart(path, add_masks):
    add_masks(path)
    with h5py.File(path, "r+") as h5:
        h5["CAM_FRONT/homography/surface"].attrs["settings"] = '{"min_points": 8}'
    with pytest.raises(
        ShardError, match=r"CAM_FRONT/footprints/surface is warped by an earlier .* with --overwrite"
    ):
        read(path, "surface")


@pytest.mark.parametrize("matrix", [np.zeros((3, 3)), np.ones((3, 3)), np.full((3, 3), np.nan)])
def test_a_valid_homography_without_inverse_is_damage(path, add_masks, matrix):
    add_masks(path)
    with h5py.File(path, "r+") as h5:
        h5["CAM_FRONT/homography/surface/bev_from_image"][1] = matrix

    with pytest.raises(
        ShardError, match=r"scene-0001\.h5: CAM_FRONT/homography/surface: frame 1 .* no inverse"
    ):
        read(path, "surface")


def test_masks_of_different_shapes_are_damage(path, add_masks):
    add_masks(path, vehicles=np.ones((45, 80), np.uint8))

    with pytest.raises(ShardError, match=r"vehicles has shape \(3, 45, 80\), not \(3, 90, 160\)"):
        read(path, "surface")

import numpy as np
import pytest

from ogmkit.errors import SettingsError
from ogmkit.footprints.warp import warp_to_bev
from ogmkit.geometry.camera import project
from ogmkit.grid import GridSpec
from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.crop import cropped
from ogmkit.samples.arrays import SampleArrays

HEIGHT, WIDTH = 40, 60
INTRINSICS = np.array([[[50.0, 0.0, 29.0], [0.0, 52.0, 15.0], [0.0, 0.0, 1.0]]])
BEV_FROM_IMAGE = np.array([[[0.5, 0.02, -3.0], [0.01, 0.6, -2.0], [0.0, 0.001, 1.0]]])
GRID = GridSpec(0.5, 30, 34, 30.0, 20.0)


def sample():
    y, x = np.indices((HEIGHT, WIDTH))
    image = np.stack([4 * x, 6 * y, 0 * x], axis=-1).astype(np.uint8)
    vehicles = ((x > 14) & (x < 46) & (y > 8) & (y < 30)).astype(np.uint8)
    return SampleArrays(
        np.array([[HEIGHT, WIDTH]]),
        image=image[None],
        masks=np.stack([np.ones_like(vehicles), vehicles])[None],
        bev=np.ones((1, 2, *GRID.shape), np.uint8),
        bev_from_image=BEV_FROM_IMAGE,
        intrinsics=INTRINSICS,
        level_from_camera=np.eye(4)[None],
    )


def test_half_of_the_image_by_hand():
    """The window's left half column of pixels: u' = 0 and 1 both look into pixel 0 … 1 of the image."""
    found = cropped(sample(), 0.5, 0.0, 1.0)
    # Corners on corners: u = (u' + 1/2) / 2 − 1/2, and v likewise, 20 pixels further down.
    np.testing.assert_allclose(found.intrinsics[0], [[100, 0, 58.5], [0, 104, -9.5], [0, 0, 1]])
    assert (
        found.masks[0, 1, 0, 60:].tolist() == sample().masks[0, 1, 20, 30:].repeat(2)[: WIDTH - 60].tolist()
    )
    assert found.image[0, 10, 2::2, 0].tolist()[:3] == [3, 7, 11]


@pytest.mark.parametrize(("side", "left", "top"), [(0.8, 0.3, 0.9), (0.55, 1.0, 0.0), (1.0, 0.4, 0.4)])
def test_pixels_see_the_same_world(side, left, top):
    before = sample()
    after = cropped(before, side, left, top)
    points = np.array([[0.3, 0.2, 6.0], [-1.0, 0.5, 9.0], [0.1, -0.2, 4.0]])
    old, _ = project(before.intrinsics[0], points)
    new, _ = project(after.intrinsics[0], points)
    # The affine map between both, from the window's corners in the image.
    first = np.array([left * (1 - side) * WIDTH, top * (1 - side) * HEIGHT])
    np.testing.assert_allclose(old + 0.5, first + side * (new + 0.5))
    for matrix, pixels in ((before.bev_from_image[0], old), (after.bev_from_image[0], new)):
        cells = np.c_[pixels, np.ones(3)] @ matrix.T
        np.testing.assert_allclose(cells[:, :2] / cells[:, 2:], _cells(before.bev_from_image[0], old))
    assert abs(after.bev_from_image[0, 2, 2]) == pytest.approx(1)
    assert after.level_from_camera is before.level_from_camera
    assert after.bev is before.bev


def _cells(matrix, pixels):
    mapped = np.c_[pixels, np.ones(len(pixels))] @ matrix.T
    return mapped[:, :2] / mapped[:, 2:]


def test_masks_stay_on_their_truth():
    before, after = sample(), cropped(sample(), 0.7, 0.5, 0.4)
    truth = warp_to_bev(before.masks[0, 1], before.bev_from_image[0], GRID.shape)
    found = warp_to_bev(after.masks[0, 1], after.bev_from_image[0], GRID.shape)
    assert truth.sum() > 150
    assert (truth & found).sum() > 0.9 * (truth | found).sum()


def test_a_whole_window_changes_nothing():
    before, after = sample(), cropped(sample(), 1.0, 0.7, 0.2)
    np.testing.assert_array_equal(after.image, before.image)
    np.testing.assert_array_equal(after.masks, before.masks)
    np.testing.assert_allclose(after.bev_from_image, before.bev_from_image)


def test_the_seed_alone_decides_and_the_bound_holds():
    augmentation = Augmentation(colour=0.0, flip=0.0, crop=0.3)
    made = [augmentation.apply(sample(), GRID, seed) for seed in range(40)]
    focal = np.array([one.intrinsics[0, 0, 0] for one in made]) / INTRINSICS[0, 0, 0]
    assert 1 <= focal.min() < 1.1
    assert 1.3 < focal.max() <= 1 / 0.7
    again = augmentation.apply(sample(), GRID, 7)
    np.testing.assert_array_equal(again.image, made[7].image)
    with pytest.raises(SettingsError, match=r"crop 0\.95 is not within 0 … 0\.9"):
        Augmentation(crop=0.95)

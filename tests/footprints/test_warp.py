import numpy as np
import pytest

from ogmkit.errors import SettingsError
from ogmkit.footprints.warp import warp_to_bev, warp_to_image
from ogmkit.geometry.camera import image_from_ground
from ogmkit.grid import GridSpec

GRID = GridSpec(0.25, 240, 160, 200.0, 70.0)
POSES = {
    "level": {},
    "horizon below the middle": {"pitch": 12},
    "tilted horizon": {"pitch": 3, "roll": 25},
    "upside down": {"roll": 180},
    "no horizon": {"pitch": -60},
    "to the side": {"yaw": 100, "pitch": -5},
}
MIRROR = np.array([[-1.0, 0, 199], [0, 1, 0], [0, 0, 1]])


def homography(view):
    """By the calibration, with w > 0 before the camera."""
    return GRID.bev_from_level @ np.linalg.inv(image_from_ground(view.intrinsics, view.level_from_camera))


def nearest(source, source_from_result, size):
    """Pixel by pixel in float64; also where rounding decides, which other arithmetic may do otherwise."""
    v, u = np.mgrid[: size[0], : size[1]]
    x, y, w = np.moveaxis(np.stack([u, v, np.ones_like(u)], axis=-1) @ source_from_result.T, -1, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        place = np.stack([y / w, x / w])
    with np.errstate(invalid="ignore"):
        undecided = (np.abs(place - np.floor(place) - 0.5) < 1e-3).any(axis=0)
        inside = (w > 0) & (place > -0.5).all(axis=0)
        inside &= (place[0] < source.shape[0] - 0.5) & (place[1] < source.shape[1] - 0.5)
    row, column = np.where(inside, np.round(place), 0).astype(int)
    return np.where(inside, source[row, column], 0), undecided


def blotches(shape, seed=0):
    coarse = np.random.default_rng(seed).integers(0, 2, (shape[0] // 8, shape[1] // 8), dtype=np.uint8)
    return np.kron(coarse, np.ones((8, 8), np.uint8))


@pytest.mark.parametrize("pose", POSES.values(), ids=POSES)
def test_both_ways_take_the_nearest_value_wherever_w_is_positive(make_view, pose):
    matrix = homography(make_view(**pose))
    mask = blotches(GRID.shape)
    expected, undecided = nearest(mask, matrix, (120, 200))
    assert ((warp_to_image(mask, matrix, (120, 200)) == expected) | undecided).all()
    assert expected.any()
    image = blotches((120, 200))
    expected, undecided = nearest(image, np.linalg.inv(matrix), GRID.shape)
    assert ((warp_to_bev(image, matrix, GRID.shape) == expected) | undecided).all()
    assert expected.any()


def test_nothing_is_above_the_horizon_though_the_homography_gives_cells_there(make_view):
    view = make_view(pitch=5)
    matrix = homography(view)
    everywhere = np.ones(GRID.shape, np.uint8)
    horizon = 0.48 * 120 + 150 * np.tan(np.radians(5))  # by hand: the row of directions without fall
    shown = np.flatnonzero(warp_to_image(everywhere, matrix, view.image_size).any(axis=1))
    assert horizon < shown.min() < horizon + 6
    # The ground behind the camera is in this grid: without the horizon, the sky would show it.
    sky = np.array([100, horizon - 20, 1])
    column, row, w = matrix @ sky
    assert w < 0
    assert 0 < column / w < GRID.columns
    assert 0 < row / w < GRID.rows


def test_cells_behind_the_camera_are_empty(make_view):
    view = make_view()
    shown = warp_to_bev(np.ones(view.image_size, np.uint8), homography(view), GRID.shape)
    rows = np.flatnonzero(shown.any(axis=1))
    assert rows.max() < GRID.cells(np.array([1.7, 0.2]))[1]


def test_a_mirrored_homography_of_negative_determinant_gives_the_mirrored_mask(make_view):
    view = make_view(roll=4, pitch=-3)
    matrix = homography(view)
    mask = blotches(GRID.shape)
    assert np.linalg.det(matrix) > 0 > np.linalg.det(matrix @ MIRROR)
    plain = warp_to_image(mask, matrix, view.image_size)
    mirrored = warp_to_image(mask, matrix @ MIRROR, view.image_size)
    assert np.mean(mirrored != plain[:, ::-1]) < 1e-3
    assert plain.any()


def test_the_sign_decides_what_is_before_the_camera(make_view):
    view = make_view(pitch=-60)
    everywhere = np.ones(GRID.shape, np.uint8)
    assert warp_to_image(everywhere, homography(view), view.image_size).all()
    assert not warp_to_image(everywhere, -homography(view), view.image_size).any()


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
@pytest.mark.parametrize("warp", [warp_to_image, warp_to_bev])
def test_a_homography_that_is_not_finite_is_refused(warp, wrong):
    matrix = np.eye(3)
    matrix[1, 2] = wrong
    with pytest.raises(SettingsError, match="the homography is singular"):
        warp_to_bev(np.ones((8, 8), np.uint8), np.diag([1.0, 0.0, 1.0]), (8, 8))
    with pytest.raises(SettingsError, match="not finite"):
        warp(np.ones((4, 4), np.uint8), matrix, (4, 4))


def test_masks_that_some_opencv_does_not_warp_are_refused():
    with pytest.raises(SettingsError, match="40000 rows × 2 columns are too many"):
        warp_to_image(np.ones((40_000, 2), np.uint8), np.eye(3), (4, 4))


def test_rasters_of_the_greatest_side_are_warped_and_longer_ones_refused():
    for shape in ((32_766, 2), (2, 32_766)):
        found = warp_to_image(np.ones(shape, np.uint8), np.eye(3), (3, 2))
        assert found[:2].all()
    for shape in ((32_767, 2), (2, 32_767)):
        with pytest.raises(SettingsError, match="at most 32766 on a side"):
            warp_to_image(np.ones(shape, np.uint8), np.eye(3), (3, 2))


@pytest.mark.parametrize(
    ("third_row", "shown"),
    [
        ([1, 0, 0], [".###", ".###", ".###"]),
        ([-1, 0, 3], ["###.", "###.", "###."]),
        ([0, 1, 0], ["....", "####", "####"]),
        ([0, -1, 2], ["####", "####", "...."]),
        ([1, 1, -3], ["....", "...#", "..##"]),
        ([-1, 0, 0.5], ["#...", "#...", "#..."]),
        ([1, 0, -2.5], ["...#", "...#", "...#"]),
    ],
)
def test_a_place_on_the_horizon_itself_is_background(third_row, shown):
    # All places with w > 0 lie in the source, which is set everywhere: w alone decides.
    source_from_result = np.array([[0.5, 0, 0], [0, 0.5, 0], third_row], float)
    found = warp_to_image(np.ones((9, 9), np.uint8), source_from_result, (3, 4))
    assert ["".join(".#"[value] for value in row) for row in found] == shown

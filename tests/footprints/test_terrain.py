import numpy as np
import pytest

from ogmkit.errors import SettingsError
from ogmkit.footprints.terrain import project_drivable
from ogmkit.footprints.view import View
from ogmkit.footprints.warp import warp_to_image
from ogmkit.geometry.se3 import inverse
from ogmkit.grid import GridSpec

GRID = GridSpec(0.25, 320, 240, 280.0, 110.0)
POSES = {
    "level": {},
    "rolled": {"roll": 20, "pitch": -4},
    "backwards": {"yaw": 180, "pitch": -20},
    "to the left": {"yaw": 55, "pitch": -9, "roll": 4},
    "to the right": {"yaw": -110, "pitch": -15},
    "steeply down": {"pitch": -60},
    "past its own feet": {"pitch": -85, "roll": 10},
}


def blotches(seed=0):
    rng = np.random.default_rng(seed)
    return np.kron(rng.integers(0, 2, (20, 15), dtype=np.uint8), np.ones((16, 16), np.uint8))


def plane(p0, p1, p2):
    return lambda places: p0 + places @ np.array([p1, p2])


def ridge(at_m, height_m, slant=0.0):
    return lambda places: height_m * np.exp(-((places[:, 0] - at_m - slant * places[:, 1]) ** 2) / 50)


def bev_from_image(view, p0, p1, p2):
    """Of a plane: three columns of the camera's matrix, by hand."""
    camera_from_level = inverse(view.level_from_camera)
    on_plane = np.array([[1, 0, 0], [0, 1, 0], [p1, p2, p0], [0, 0, 1]])
    return GRID.bev_from_level @ np.linalg.inv(view.intrinsics @ camera_from_level[:3] @ on_plane)


def marched(mask, height_m, view, farthest_m=140.0):
    """Every ray followed in steps of 0.5 % until it is below the ground, then back in proportion."""
    v, u = np.mgrid[: view.image_size[0], : view.image_size[1]]
    rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(view.intrinsics).T
    rays = (rays @ view.level_from_camera[:3, :3].T).reshape(-1, 3)
    rays /= np.hypot(rays[:, 0], rays[:, 1])[:, None]
    origin = view.level_from_camera[:3, 3]
    result, above_m = np.zeros(len(rays), np.uint8), np.full(len(rays), np.inf)
    for distance_m in 0.2 * 1.005 ** np.arange(np.log(farthest_m / 0.2) / np.log(1.005)):
        points = origin + distance_m * rays
        now_m = points[:, 2] - height_m(points[:, :2])
        met = np.flatnonzero((now_m <= 0) & (above_m > 0))
        share = now_m[met] / (above_m[met] - now_m[met])
        exact_m = distance_m * (1 + share * (1 - 1 / 1.005))
        column, row = np.round(GRID.cells(origin + exact_m[:, None] * rays[met])).astype(int).T
        inside = (column >= 0) & (column < GRID.columns) & (row >= 0) & (row < GRID.rows)
        result[met[inside]] = mask[row[inside], column[inside]]
        above_m[met] = -np.inf
        above_m[above_m > 0] = now_m[above_m > 0]
    return result.reshape(view.image_size)


@pytest.mark.parametrize("pose", POSES.values(), ids=POSES)
@pytest.mark.parametrize("tilt", [(0.0, 0.0, 0.0), (0.3, 0.03, -0.05)], ids=["flat", "tilted"])
def test_on_a_plane_it_is_the_homography_of_that_plane(make_view, iou, pose, tilt):
    view = make_view(**pose)
    drivable = blotches()
    found = project_drivable(drivable, GRID, plane(*tilt), view)
    expected = warp_to_image(drivable, bev_from_image(view, *tilt), view.image_size)
    if pose.get("pitch", 0) < -80:  # it looks past the point below it: drawn is what lies ahead
        v, u = np.mgrid[: view.image_size[0], : view.image_size[1]]
        rays = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(view.intrinsics).T
        ahead = rays @ view.level_from_camera[:3, :3].T @ [*view.level_from_camera[:2, 2], 0]
        expected[ahead <= 0.02] = found[ahead <= 0.02]
    assert expected.any()
    assert iou(found, expected) > 0.995  # OpenCV 4 interpolates in steps of 1/32


def test_the_far_end_of_the_grid_is_not_lost_to_the_sky_above(make_view, iou):
    view = make_view(roll=20, pitch=-4)
    far = np.zeros(GRID.shape, np.uint8)
    far[:20] = 1
    found = project_drivable(far, GRID, plane(0, 0, 0), view)
    assert iou(found, warp_to_image(far, bev_from_image(view, 0, 0, 0), view.image_size)) > 0.95


@pytest.mark.parametrize("slant", [0.0, 0.4])
def test_hills_are_drawn_as_rays_meet_them(make_view, iou, slant):
    view = make_view(roll=3)
    drivable = blotches()
    height_m = ridge(30, 2.6, slant)
    assert iou(project_drivable(drivable, GRID, height_m, view), marched(drivable, height_m, view)) > 0.99


def test_ground_behind_a_crest_is_hidden(make_view):
    view = make_view()
    rows = np.arange(GRID.rows)[:, None]
    behind = np.broadcast_to((GRID.positions_m(np.stack([rows * 0, rows], -1))[..., 0] > 33), GRID.shape)
    behind = behind.astype(np.uint8)
    assert project_drivable(behind, GRID, plane(0, 0, 0), view).any()
    assert not project_drivable(behind, GRID, ridge(30, 2.6), view).any()
    assert project_drivable(1 - behind, GRID, ridge(30, 2.6), view).any()


def test_a_hill_higher_than_the_camera_reaches_above_the_horizon(make_view):
    view = make_view()
    horizon = 0.48 * 120
    everywhere = np.ones(GRID.shape, np.uint8)
    flat = np.flatnonzero(project_drivable(everywhere, GRID, plane(0, 0, 0), view).any(axis=1))
    hilly = np.flatnonzero(project_drivable(everywhere, GRID, ridge(30, 2.6), view).any(axis=1))
    assert hilly.min() < horizon < flat.min()
    crest = horizon - 150 * (2.6 - 1.5) / (30 - 1.7)
    assert hilly.min() == pytest.approx(crest, abs=1.5)


def test_there_is_nothing_outside_the_grid(make_view):
    view = make_view(yaw=180)
    ahead_only = GridSpec(0.25, 200, 200, 200.0, 100.0)
    everywhere = np.ones(ahead_only.shape, np.uint8)
    assert not project_drivable(everywhere, ahead_only, plane(0, 0, 0), view).any()


def test_a_camera_that_looks_at_the_sky_or_straight_down_is_no_error(make_view):
    everywhere = np.ones(GRID.shape, np.uint8)
    for pitch in (60, 80):
        assert not project_drivable(everywhere, GRID, plane(0, 0, 0), make_view(pitch=pitch)).any()
    down = project_drivable(everywhere, GRID, plane(0, 0, 0), make_view(pitch=-90))
    assert down[:45].all()  # rays that fall less than 12 m in a metre: v < 0.48 · 120 − 150 / 12 = 45.1
    assert not down[46:].any()


def test_rasters_that_some_opencv_does_not_warp_are_refused(make_view):
    grid = GridSpec(0.1, 40_000, 2, 40_000.0, 1.0)
    with pytest.raises(SettingsError, match="too many"):
        project_drivable(np.ones(grid.shape, np.uint8), grid, plane(0, 0, 0), make_view())


@pytest.mark.parametrize("pose", [{"pitch": -60}, {"pitch": -40, "roll": 9}, {"pitch": -35, "yaw": -30}])
@pytest.mark.parametrize("image_size", [(120, 200), (61, 37)])
def test_every_pixel_below_the_horizon_shows_ground_to_the_image_s_border(make_view, pose, image_size):
    view = make_view(**pose, image_size=image_size)
    everywhere = np.ones(GRID.shape, np.uint8)
    assert project_drivable(everywhere, GRID, plane(0, 0, 0), view).all()


def test_the_nearest_cell_is_shown_on_either_side(make_view, iou):
    # Cells in a view of a steep camera are many pixels wide: half a cell off would be seen.
    view = make_view(pitch=-50, yaw=35)
    grid = GridSpec(1.0, 14, 11, 12.0, 4.0)
    drivable = np.random.default_rng(4).integers(0, 2, grid.shape, dtype=np.uint8)
    camera_from_level = inverse(view.level_from_camera)
    image_from_level = view.intrinsics @ camera_from_level[:3][:, [0, 1, 3]]
    expected = warp_to_image(drivable, grid.bev_from_level @ np.linalg.inv(image_from_level), view.image_size)
    assert iou(project_drivable(drivable, grid, plane(0, 0, 0), view), expected) > 0.995


def test_of_a_camera_exactly_straight_down_x_is_ahead(iou):
    level_from_camera = np.eye(4)
    level_from_camera[:3] = [[0, -1, 0, 1.5], [-1, 0, 0, -0.5], [0, 0, -1, 30]]
    view = View(np.array([[100.0, 0, 80], [0, 100, 90], [0, 0, 1]]), level_from_camera, (120, 200))
    drivable = blotches()
    expected = warp_to_image(drivable, bev_from_image(view, 0, 0, 0), view.image_size)
    found = project_drivable(drivable, GRID, plane(0, 0, 0), view)
    v, u = np.mgrid[:120, :200]
    ahead = (90 - v) / 100
    inner = (ahead * 11 > 1) & (ahead * 11 > np.abs(u - 80) / 100)  # neither steep nor aside
    assert iou(found[inner], expected[inner]) > 0.95  # the ground is cut most coarsely when seen from above
    assert expected[inner].any()
    assert not expected[inner].all()

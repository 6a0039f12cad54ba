import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ogmkit.grid import GridSpec
from ogmkit.raster.field_of_view import field_of_view_mask

_INTRINSICS = np.array([[633.0, 0.0, 408.2], [0.0, 633.0, 245.8], [0.0, 0.0, 1.0]])
_GRID = GridSpec(m_per_cell=0.5, rows=90, columns=130, ego_row=60, ego_column=50)


def _level_from_camera(heading, pitch=0.0, roll=0.0, height_m=1.5):
    pose = np.eye(4)
    ahead = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    pose[:3, :3] = Rotation.from_euler("ZYX", [heading, pitch, roll]).as_matrix() @ ahead
    pose[:3, 3] = [1.7, 0.2, height_m]
    return pose


def _margin_by_projection(grid, level_from_camera, height, width):
    """How far, in pixels, each cell's centre projects inside the image; negative = outside or behind."""
    rows, columns = np.mgrid[: grid.rows, : grid.columns]
    x = grid.m_per_cell * (grid.ego_row - 0.5 - rows)
    y = grid.m_per_cell * (grid.ego_column - 0.5 - columns)
    level = np.stack([x, y, np.zeros_like(x), np.ones_like(x)], axis=-1)
    camera = level @ np.linalg.inv(level_from_camera).T
    u, v, depth = np.moveaxis(camera[..., :3] @ _INTRINSICS.T, -1, 0)
    u, v = u / depth, v / depth
    margin = np.minimum.reduce([u + 0.5, width - 0.5 - u, v + 0.5, height - 0.5 - v])
    return np.where(depth > 0, margin, -np.inf)


@given(st.floats(-3.2, 3.2), st.floats(-0.4, 0.8), st.floats(-0.3, 0.3), st.floats(0.5, 20))
def test_it_agrees_with_projecting_every_cell(heading, pitch, roll, height_m):
    level_from_camera = _level_from_camera(heading, pitch, roll, height_m)
    mask = field_of_view_mask(_GRID, _INTRINSICS, level_from_camera, (450, 800))
    margin = _margin_by_projection(_GRID, level_from_camera, 450, 800)
    decided = abs(margin) > 1e-6
    np.testing.assert_array_equal(mask[decided], (margin > 0)[decided])


def test_a_front_camera_sees_a_wedge_ahead_and_a_camera_to_the_left_sees_the_left():
    front = field_of_view_mask(_GRID, _INTRINSICS, _level_from_camera(0.0), (450, 800))
    left = field_of_view_mask(_GRID, _INTRINSICS, _level_from_camera(np.pi / 2), (450, 800))
    ego_row, ego_column = 60, 50
    assert front[ego_row - 40, ego_column]
    assert not front[ego_row + 5 :].any()
    assert not front[ego_row - 10, [0, -1]].any()
    assert left[ego_row - 4, 5]
    assert not left[:, ego_column + 2 :].any()


def test_a_camera_straight_down_sees_a_rectangle_of_the_size_by_hand():
    # 10 m up, f = 633: the image of 800 × 450 pixels covers 12.64 m × 7.11 m of ground.
    down = np.eye(4)
    down[:3, :3] = [[0, -1, 0], [-1, 0, 0], [0, 0, -1]]
    down[:3, 3] = [0, 0, 10]
    grid = GridSpec(m_per_cell=0.01, rows=2000, columns=2000, ego_row=1000, ego_column=1000)
    mask = field_of_view_mask(grid, _INTRINSICS, down, (450, 800))
    assert abs(mask.sum() - 1264 * 711) < 1264 + 711
    assert set(mask.sum(axis=0)) <= {0, 710, 711}


def test_a_camera_that_looks_up_sees_no_ground():
    up = _level_from_camera(0.0, pitch=-1.2)
    assert not field_of_view_mask(_GRID, _INTRINSICS, up, (450, 800)).any()


def test_the_paper_s_grid_shows_the_share_that_real_front_cameras_show():
    intrinsics = np.array([[1266.4, 0, 816.3], [0, 1266.4, 491.5], [0, 0, 1]])
    mask = field_of_view_mask(GridSpec(), intrinsics, _level_from_camera(0.0), (900, 1600))
    assert 0.70 < mask.mean() < 0.82


def _picture_from_above(first_column, first_row, turned=False):
    """A camera 10 m up that looks down; one pixel a cell, u = column − first_column, v = row − first_row.

    `turned` by a quarter: u = row − first_row, v = column − first_column.
    """
    grid = GridSpec(m_per_cell=0.5, rows=7, columns=9, ego_row=5.5, ego_column=2.5)
    down = np.eye(4)
    down[:3, :3] = [[0, -1, 0], [-1, 0, 0], [0, 0, -1]]
    if turned:
        down[:3, :3] = [[-1, 0, 0], [0, -1, 0], [0, 0, -1]]
    down[:3, 3] = [0.5 * (5 - first_row), 0.5 * (2 - first_column), 10]
    intrinsics = np.diag([20.0, 20.0, 1.0])
    mask = field_of_view_mask(grid, intrinsics, down, (3, 5))
    return ["".join(".#"[cell] for cell in row) for row in mask]


def test_an_image_of_three_by_five_cells_is_seen_from_above():
    empty = ["........."]
    assert _picture_from_above(2, 3) == [*empty * 3, *["..#####.."] * 3, *empty]
    assert _picture_from_above(-1, -1) == [*["####....."] * 2, *empty * 5]
    assert _picture_from_above(6, 5) == [*empty * 5, *["......###"] * 2]
    assert _picture_from_above(4, 1, turned=True) == [*empty, *["....###.."] * 5, *empty]


def test_a_centre_on_the_left_or_upper_border_is_seen():
    # The image's borders run through the centres of columns 2 and 7, and of row 2.
    assert _picture_from_above(2.5, 2.5)[2] == "..#####.."
    assert _picture_from_above(1.5, 4.5, turned=True)[4:] == [".###.....", ".###.....", ".###....."]

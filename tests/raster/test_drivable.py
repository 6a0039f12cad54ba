import numpy as np
import pytest

from ogmkit.geometry.se3 import level_from_global, pose_matrix
from ogmkit.grid import GridSpec
from ogmkit.raster.drivable import drivable_mask

# On the map north is up: an F to be recognised however it is turned.
_MAP = [
    "..........",
    "..........",
    "..........",
    "..........",
    "....####..",
    "....#.....",
    "....###...",
    "....#.....",
    "....#.....",
    "..........",
]


def _level_from_global(x, y, heading):
    turn = [np.cos(heading / 2), 0, 0, np.sin(heading / 2)]
    return level_from_global(pose_matrix([x, y, 0], turn))


def _picture(raster):
    return ["".join(".#"[cell] for cell in row) for row in raster]


def _devkit_rule(grid, x, y, heading, mask):
    """The devkit's `MapMask.to_pixel_coords` and `is_on_mask` at every cell's centre, in plain numpy.

    As is_on_mask, but a bounding window of the mask stands in for all of it.
    """
    rows, columns = np.mgrid[: grid.rows, : grid.columns]
    forward = grid.m_per_cell * (grid.ego_row - 0.5 - rows)
    left = grid.m_per_cell * (grid.ego_column - 0.5 - columns)
    global_x = x + np.cos(heading) * forward - np.sin(heading) * left
    global_y = y + np.sin(heading) * forward + np.cos(heading) * left
    column = np.round(global_x / 0.1).astype(np.int32)
    row = np.round(mask.shape[0] - global_y / 0.1).astype(np.int32)
    on_map = (column >= 0) & (column < mask.shape[1]) & (row >= 0) & (row < mask.shape[0])
    if not on_map.any():
        return on_map
    row0, column0 = row[on_map].min(), column[on_map].min()
    window = mask.window(row0, row[on_map].max() + 1, column0, column[on_map].max() + 1)
    result = np.zeros(grid.shape, np.uint8)
    result[on_map] = window[row[on_map] - row0, column[on_map] - column0]
    return result


def _random_poses(mask, count, seed):
    """Poses on the drivable area and, one in four, anywhere on the map, its borders included."""
    rng = np.random.default_rng(seed)
    while count:
        column, row = rng.integers(mask.shape[1]), rng.integers(mask.shape[0])
        if count % 4 == 0 or mask.window(row, row + 1, column, column + 1)[0, 0]:
            x, y = 0.1 * (column + rng.uniform()), 0.1 * (mask.shape[0] - row + rng.uniform())
            yield x, y, rng.uniform(-np.pi, np.pi)
            count -= 1


@pytest.mark.parametrize(
    ("position", "heading", "expected"),
    [
        # Cell (r, c) is 0.1·(3.5 − r) ahead and 0.1·(1.5 − c) to the left. Facing north, it shows the map's
        # pixel (4 + r, 4 + c); east, (4 + c, 9 − r); west, (8 − c, 4 + r).
        ((0.55, 0.25), np.pi / 2, ["###", "#..", "###", "#.."]),
        ((0.55, 0.45), 0, ["...", "...", "#..", "#.#"]),
        ((0.75, 0.35), np.pi, ["###", "..#", "..#", "..."]),
    ],
)
def test_an_f_on_the_map_turns_with_the_ego(mask_of, position, heading, expected):
    mask = mask_of(np.array([[cell == "#" for cell in row] for row in _MAP]))
    grid = GridSpec(m_per_cell=0.1, rows=4, columns=3, ego_row=4, ego_column=2)
    assert _picture(drivable_mask(grid, _level_from_global(*position, heading), mask)) == expected


@pytest.mark.parametrize(
    "grid",
    [
        GridSpec(),
        GridSpec(m_per_cell=0.25, rows=300, columns=170, ego_row=250, ego_column=40),
        GridSpec(m_per_cell=0.0371, rows=120, columns=501, ego_row=-30.5, ego_column=700.25),
        GridSpec(m_per_cell=2.0, rows=500, columns=350, ego_row=250, ego_column=100),
        GridSpec(m_per_cell=40.0, rows=9, columns=14, ego_row=5, ego_column=7),
    ],
    ids=lambda grid: f"{grid.m_per_cell} m",
)
def test_any_grid_follows_the_devkit_s_rule(mask_of, grid):
    rng = np.random.default_rng(7)
    blocks = rng.uniform(size=(60, 75)) < 0.5
    mask = mask_of(np.kron(blocks, np.ones((40, 40)))[:, :-13])
    for _ in range(6):
        x, y = rng.uniform(-30, 330), rng.uniform(-30, 270)
        heading = rng.uniform(-np.pi, np.pi)
        raster = drivable_mask(grid, _level_from_global(x, y, heading), mask)
        expected = _devkit_rule(grid, x, y, heading, mask)
        # Random blocks have far more border than roads: rounding may move a cell in some thousand.
        assert (raster == expected).mean() >= 0.999
        assert raster.shape == grid.shape


def test_a_map_beyond_the_warp_s_32767_pixels_is_sampled_to_its_end(mask_of):
    blocks = np.random.default_rng(7).uniform(size=(8, 500)) < 0.5
    mask = mask_of(np.kron(blocks, np.ones((80, 80), np.uint8)))
    grid = GridSpec(m_per_cell=1.0, rows=4100, columns=70, ego_row=4050, ego_column=33)
    raster = drivable_mask(grid, _level_from_global(3.33, 31.47, 0.001), mask)
    expected = _devkit_rule(grid, 3.33, 31.47, 0.001, mask)
    assert (raster == expected).mean() >= 0.999
    assert raster[:100].any()


def test_nothing_is_drivable_off_the_map(mask_of):
    mask = mask_of(np.ones((30, 50)))
    grid = GridSpec(m_per_cell=0.5, rows=20, columns=24, ego_row=10, ego_column=12)
    on_map = drivable_mask(grid, _level_from_global(2.51, 1.51, 0.0), mask)
    assert on_map.sum() == 6 * 10
    for far in (-1e3, 1e9):
        assert not drivable_mask(grid, _level_from_global(far, 1.5, 0.3), mask).any()


def test_pitch_roll_and_height_of_the_ego_change_nothing(mask_of):
    mask = mask_of(np.kron(np.eye(8), np.ones((25, 25))))
    grid = GridSpec(m_per_cell=0.1, rows=90, columns=70, ego_row=45, ego_column=30)
    w, x, y, z = 0.96, 0.03, -0.05, 0.27
    tilted = pose_matrix([10, 10, 4], [w, x, y, z])
    heading = np.arctan2(tilted[1, 0], tilted[0, 0])
    raster = drivable_mask(grid, level_from_global(tilted), mask)
    np.testing.assert_array_equal(raster, drivable_mask(grid, _level_from_global(10, 10, heading), mask))


@pytest.mark.parametrize("m_per_cell", [0.03, 0.7, 9.0])
def test_no_cell_is_lost_at_the_raster_s_border_however_the_ego_turns(mask_of, m_per_cell):
    mask = mask_of(np.ones((2500, 2900)))
    grid = GridSpec(m_per_cell=m_per_cell, rows=9, columns=13, ego_row=5.25, ego_column=7)
    for heading in np.linspace(-np.pi, np.pi, 9):
        assert drivable_mask(grid, _level_from_global(150.02, 120.07, heading), mask).all()


def test_cells_of_kilometres_are_sampled_one_by_one(mask_of):
    drivable = np.zeros((300, 40_000), np.uint8)
    drivable[100:200, 38_000:38_100] = drivable[:, 2900:3100] = 1
    mask = mask_of(drivable)
    # Centres, facing east: row 0 at 3805 m, row 1 at 305 m; 15 m north.
    grid = GridSpec(m_per_cell=3500.0, rows=2, columns=1, ego_row=1.5, ego_column=0.5)
    np.testing.assert_array_equal(drivable_mask(grid, _level_from_global(305, 15, 0.0), mask), [[1], [1]])
    np.testing.assert_array_equal(drivable_mask(grid, _level_from_global(305, 25, 0.0), mask), [[0], [1]])
    np.testing.assert_array_equal(drivable_mask(grid, _level_from_global(295, 15, 0.0), mask), [[0], [1]])


@pytest.mark.parametrize("name", ["36092f0b", "37819e65", "53992ee3"])
@pytest.mark.slow
def test_random_poses_on_the_real_masks_follow_the_devkit_s_rule(real_dataroot, mask_store, name):
    (png,) = (real_dataroot / "maps").glob(f"{name}*.png")
    mask = mask_store.open(png)
    grid = GridSpec()
    shares = []
    for x, y, heading in _random_poses(mask, count=12, seed=int(name, 16)):
        raster = drivable_mask(grid, _level_from_global(x, y, heading), mask)
        assert (raster == _devkit_rule(grid, x, y, heading, mask)).mean() >= 0.9999
        shares.append(raster.mean())
    assert np.mean(shares) > 0.1

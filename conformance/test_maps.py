"""The drivable raster against the devkit's `MapMask.is_on_mask`, on the real masks from random poses."""

import numpy as np
import pytest
from nuscenes.utils.map_mask import MapMask

from ogmkit.geometry.se3 import inverse, level_from_global, pose_matrix, transform_points
from ogmkit.grid import GridSpec
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.raster.drivable import drivable_mask

POSES = 16
LEAST_AGREEMENT = 0.9999
MASKS = (
    "36092f0b03a857c6a3403e25b4b7aab3",
    "37819e65e09e5547b8a3ceaefba56bb2",
    "53992ee3023e5494b90c316c183be829",
)
GRIDS = (
    GridSpec(),
    GridSpec(m_per_cell=0.25, rows=400, columns=220, ego_row=330.0, ego_column=71.5),
    GridSpec(rows=300, columns=700, ego_row=120.25, ego_column=650.0),
)


@pytest.fixture(scope="module", params=MASKS)
def both_masks(request, real_dataroot, cache_dir):
    """One mask as ogmkit's and as the devkit's, which keeps only one decoded: hence by module."""
    path = real_dataroot / "maps" / f"{request.param}.png"
    return MaskStore(cache_dir).open(path), MapMask(str(path))


def random_poses(generator, devkits, number):
    """Poses with roll and pitch: half of them on the drivable area, half anywhere, also beyond the edges."""
    height_px, width_px = devkits.mask().shape
    anywhere = generator.uniform(-60, [width_px / 10 + 60, height_px / 10 + 60], (100_000, 2))
    drivable = anywhere[devkits.is_on_mask(anywhere[:, 0], anywhere[:, 1])]
    centres = np.concatenate([drivable[: number // 2], anywhere[: number - number // 2]])
    half_heading = generator.uniform(-np.pi, np.pi, number) / 2
    tilt = generator.normal(0, 0.02, (number, 2))
    rotations = np.column_stack([np.cos(half_heading), tilt, np.sin(half_heading)])
    return pose_matrix(np.column_stack([centres, np.zeros(number)]), rotations)


def centres_global(grid, level):
    """Global (x, y) of all cells' centres, row by row."""
    rows, columns = np.indices(grid.shape)
    centres = grid.positions_m(np.stack([columns.ravel(), rows.ravel()], axis=-1))
    return transform_points(inverse(level), np.column_stack([centres, np.zeros(len(centres))]))[:, :2]


@pytest.mark.parametrize("grid", GRIDS, ids=["default", "coarse", "wide"])
def test_random_poses_agree_with_is_on_mask(both_masks, grid):
    ours, devkits = both_masks
    for global_from_ego in random_poses(np.random.default_rng(grid.rows), devkits, POSES):
        level = level_from_global(global_from_ego)
        expected = devkits.is_on_mask(*centres_global(grid, level).T).reshape(grid.shape)
        assert np.mean(drivable_mask(grid, level, ours) == expected) >= LEAST_AGREEMENT

"""Parts of the grid that figures are given for (design.md §3)."""

from collections.abc import Mapping

import numpy as np

from ogmkit.grid import GridSpec
from ogmkit.typing import BoolArray

REGIONS = ("full", "close", "far")
"""The whole grid; up to 50 m ahead and 10 m to each side; over 50 m ahead. The last two don't overlap."""

CLOSE_AHEAD_M = 50.0
CLOSE_ASIDE_M = 10.0

_SLACK_CELLS = 1e-6  # of rounding: metres by cell size, both decimal fractions


def region_masks(grid: GridSpec) -> Mapping[str, BoolArray]:
    """The cells of each region: those whose whole extent lies in it.

    Args:
        grid: any grid.

    Returns:
        Name, in the order of `REGIONS`, → (rows, columns) bool.
    """
    ahead = CLOSE_AHEAD_M / grid.m_per_cell
    aside = CLOSE_ASIDE_M / grid.m_per_cell
    # Of each cell in cells from the ego: its near and its far border ahead, its right and its left one.
    near = grid.ego_row - np.arange(1, grid.rows + 1)[:, None]
    right = grid.ego_column - np.arange(1, grid.columns + 1)
    within = (near >= -_SLACK_CELLS) & (near + 1 <= ahead + _SLACK_CELLS)
    beside = (right >= -aside - _SLACK_CELLS) & (right + 1 <= aside + _SLACK_CELLS)
    beyond = np.broadcast_to(near >= ahead - _SLACK_CELLS, grid.shape)
    return {"full": np.ones(grid.shape, np.bool_), "close": within & beside, "far": beyond}

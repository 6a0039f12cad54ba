"""Left and right changing places: of an image's pixels, and of a grid's cells."""

import numpy as np

from ogmkit.grid import GridSpec
from ogmkit.typing import FloatArray


def image_mirror(width: int) -> FloatArray:
    """(3, 3) map of homogeneous pixels u, v to those of the mirrored image of this width; its own inverse."""
    return _mirror(width - 1)


def bev_mirror(grid: GridSpec) -> FloatArray:
    """(3, 3) map of homogeneous cells to those of the world whose y has changed sign; its own inverse."""
    return _mirror(2 * (grid.ego_column - 0.5))


def _mirror(sum_of_both: float) -> FloatArray:
    return np.array([[-1.0, 0.0, sum_of_both], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])

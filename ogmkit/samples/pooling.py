"""The parts that masks are averaged over before a planner sees them."""

from math import isqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ogmkit.grid import GridSpec
from ogmkit.typing import Float32Array, UInt8Array

Counts = NDArray[np.unsignedinteger[Any]]
"""Numbers of cells, in the smallest type that holds a part's."""


def pooled_shape(shape: tuple[int, int], cells: int) -> tuple[int, int]:
    """Rows and columns of so many parts at most, by a map's own aspect.

    The shorter side has √(cells · shorter / longer) parts, rounded, and the longer side as many as fit: maps
    of any aspect give nearly the same number of parts, which are nearly square.

    Args:
        shape: (rows, columns) of the map.
        cells: parts at most, 1 or more.

    Returns:
        (rows, columns) of the parts; those of the map where it has no more cells than that.
    """
    short, long = sorted(shape)
    if cells >= short * long:
        return shape
    few = max(1, (isqrt(4 * cells * short // long) + 1) // 2)  # a root rounded, in whole numbers
    many = min(long, cells // few)
    return (few, many) if shape[0] == short else (many, few)


def equal_parts(grid: GridSpec, parts: tuple[int, int]) -> bool:
    """Whether (rows, columns) of parts are of one size, and a flip about the ego takes each to another."""
    if min(parts) < 1 or grid.rows % parts[0] or grid.columns % parts[1]:
        return False
    return float(2 * grid.ego_column * parts[1] / grid.columns).is_integer()


def part_counts(masks: UInt8Array, parts: tuple[int, int]) -> Counts:
    """(..., rows, columns) of 0/1 → (..., r, c) how many cells of each of r × c equal parts are 1."""
    *leading, rows, columns = masks.shape
    height, width = rows // parts[0], columns // parts[1]
    by_rows = masks.reshape(*leading, parts[0], height, columns)
    strips = by_rows.sum(axis=-2, dtype=np.min_scalar_type(height))
    counts: Counts = strips.reshape(*leading, *parts, width).sum(
        axis=-1, dtype=np.min_scalar_type(height * width)
    )
    return counts


def shares(counts: Counts, shape: tuple[int, int]) -> Float32Array:
    """(..., r, c) counts of a map of (rows, columns) as shares of each part's cells, float32."""
    cells = shape[0] // counts.shape[-2] * (shape[1] // counts.shape[-1])
    found: Float32Array = np.divide(counts, cells, dtype=np.float32)
    return found

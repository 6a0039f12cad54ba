"""The parts that masks are averaged over before a planner sees them."""

from math import isqrt


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

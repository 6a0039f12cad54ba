"""Lines cut with a convex polygon to the same last bit on every machine.

Where a label cuts coordinates toward zero, that bit decides between two cells. GEOS rounds intersections
otherwise from 3.11 on; this is the arithmetic of 3.10, about the middle of what both segments' bounds share.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from ogmkit.typing import FloatArray

_NOISE = 1e-9
"""Metres², of the middle of a piece that runs along the border."""


def cut_line(points: FloatArray, polygon: FloatArray) -> Iterator[FloatArray]:
    """The parts of a line inside a convex polygon, its border included.

    Args:
        points: (K, 2) float64.
        polygon: (J, 2) corners counter-clockwise, not closed.

    Yields:
        (L, 2) float64 of two points or more.
    """
    part: list[FloatArray] = []
    sides = _sides(points, polygon)
    apart = np.any((sides[:-1] < 0) & (sides[1:] < 0), axis=1)
    within = np.all(sides >= 0, axis=1)
    for row, (start, end) in enumerate(pairwise(points)):
        whole = within[row] and within[row + 1]
        for one, other in [(start, end)] if whole else [] if apart[row] else _split(start, end, polygon):
            if part and (part[-1] != one).any():
                yield np.array(part)
                part = []
            part = [*part, other] if part else [one, other]
    if part:
        yield np.array(part)


def _split(start: FloatArray, end: FloatArray, polygon: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """The pieces of a segment inside."""
    stops = [start, *_crossings(start, end, polygon), end]
    pieces = pairwise(stops)
    return [
        (one, other)
        for one, other in pieces
        if (one != other).any() and (_sides((one + other)[None] / 2, polygon) >= -_NOISE).all()
    ]


def _crossings(start: FloatArray, end: FloatArray, polygon: FloatArray) -> list[FloatArray]:
    """Points where a segment crosses edges of the polygon, from its start on."""
    found = []
    for corner, following in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        sides = _side(start, corner, following) * _side(end, corner, following)
        if sides < 0 and _side(corner, start, end) * _side(following, start, end) <= 0:
            found.append(_intersection(start, end, corner, following))
    return sorted(found, key=lambda point: float(np.abs(point - start).sum()))


def _intersection(p1: FloatArray, p2: FloatArray, q1: FloatArray, q2: FloatArray) -> FloatArray:
    """Where two lines cross, by homogeneous coordinates."""
    low = np.maximum(np.minimum(p1, p2), np.minimum(q1, q2))
    high = np.minimum(np.maximum(p1, p2), np.maximum(q1, q2))
    middle = (low + high) / 2
    (p1x, p1y), (p2x, p2y) = p1 - middle, p2 - middle
    (q1x, q1y), (q2x, q2y) = q1 - middle, q2 - middle
    px, py, pw = p1y - p2y, p2x - p1x, p1x * p2y - p2x * p1y
    qx, qy, qw = q1y - q2y, q2x - q1x, q1x * q2y - q2x * q1y
    weight = px * qy - qx * py
    result: FloatArray = middle + np.array([py * qw - qy * pw, qx * pw - px * qw]) / weight
    return result


def _side(point: FloatArray, start: FloatArray, end: FloatArray) -> float:
    """Positive to the left of a segment."""
    (dx, dy), (x, y) = end - start, point - start
    return float(dx * y - dy * x)


def _sides(points: FloatArray, polygon: FloatArray) -> FloatArray:
    """(K, J) positive where a point is to the left of an edge."""
    edges = np.roll(polygon, -1, axis=0) - polygon
    dx, dy = np.moveaxis(points[:, None] - polygon, -1, 0)
    result: FloatArray = edges[:, 0] * dy - edges[:, 1] * dx
    return result

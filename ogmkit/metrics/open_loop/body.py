"""The ego's box along a plan, whose points are positions alone: headings follow the path."""

import numpy as np

from ogmkit.metrics.open_loop.definition import EgoBox
from ogmkit.typing import FloatArray

LEAST_MOTION_M = 0.05
"""Motion a step, below which a heading is that of the point before: it would be one of noise."""


def headings(points: FloatArray) -> FloatArray:
    """Headings at a plan's points, by the parabola through neighbouring ones.

    The plan begins at (0, 0) with heading 0. Of the two headings that a direction of motion allows, ahead or
    in reverse, it is the one nearer to that of the point before.

    Args:
        points: (..., T, 2) metres, a step apart; NaN from some point on.

    Returns:
        (..., T) radians, NaN where points are.
    """
    path = np.concatenate([np.zeros_like(points[..., :1, :]), points], axis=-2)
    found = np.empty(points.shape[:-1])
    before = np.zeros(points.shape[:-2])
    for step in range(1, path.shape[-2]):
        x, y = np.moveaxis(_motion(path, step), -1, 0)
        direction = np.arctan2(y, x)
        reverse = np.cos(direction - before) < 0
        heading = np.where(reverse, direction + np.pi, direction)
        before = np.where(np.hypot(x, y) < LEAST_MOTION_M, before, heading)
        found[..., step - 1] = np.where(np.isnan(path[..., step, 0]), np.nan, before)
    return found


def _motion(path: FloatArray, step: int) -> FloatArray:
    """(..., 2) metres a step at one of (..., T, 2) points; at the last one there is, by those before."""
    here, before = path[..., step, :], path[..., step - 1, :]
    further = path[..., step - 2, :] if step > 1 else 2 * before - here
    at_the_end: FloatArray = (3 * here - 4 * before + further) / 2
    if step + 1 == path.shape[-2]:
        return at_the_end
    between = (path[..., step + 1, :] - before) / 2
    return np.where(np.isnan(between), at_the_end, between)


def placed(
    points: FloatArray, box: EgoBox, outline: FloatArray, known: FloatArray | None = None
) -> FloatArray:
    """Points of the ego's box along plans.

    Args:
        points: (..., T, 2) metres.
        box: whose.
        outline: (P, 2) metres ahead of and to the left of the box's centre.
        known: (..., T) headings in radians, as of what was driven; NaN, or None, where the path gives them.

    Returns:
        (..., T, P, 2) metres, in the plans' frame.
    """
    heading = headings(points) if box.turned else np.where(np.isnan(points[..., 0]), np.nan, 0.0)
    if known is not None:
        heading = np.where(np.isnan(known), heading, known)
    ahead, left = outline[:, 0] + box.centre_ahead_m, outline[:, 1]
    cos, sin = np.cos(heading)[..., None], np.sin(heading)[..., None]
    turned = np.stack([cos * ahead - sin * left, sin * ahead + cos * left], axis=-1)
    found: FloatArray = points[..., None, :] + turned
    return found


def corners(box: EgoBox) -> FloatArray:
    """(4, 2) corners in order round a box, as `placed` takes them."""
    return np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) * (box.length_m / 2, box.width_m / 2)


def outline(box: EgoBox, apart_m: float) -> FloatArray:
    """(P, 2) points round a box, at most so far apart, as `placed` takes them."""
    sides = []
    ends = corners(box)
    for start, end in zip(ends, np.roll(ends, -1, axis=0), strict=True):
        count = int(np.ceil(np.linalg.norm(end - start) / apart_m))
        sides.append(start + np.arange(count)[:, None] / count * (end - start))
    return np.concatenate(sides)

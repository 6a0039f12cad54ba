"""Which rectangles on the ground overlap (separating axes; Ericson: Real-Time Collision Detection, 5.2.1)."""

import numpy as np

from ogmkit.typing import BoolArray, FloatArray, IntArray


def overlaps(poses: FloatArray, sizes_m: FloatArray) -> BoolArray:
    """Pairs of rectangles that share more than a border.

    Args:
        poses: (N, 3) x, y and heading of the middles.
        sizes_m: (N, 2) width and length.

    Returns:
        (N, N) symmetric, false on the diagonal.
    """
    between = poses[None, :, :2] - poses[:, None, :2]
    reach_m = np.linalg.norm(sizes_m, axis=1) / 2
    near = np.sum(between**2, axis=-1) < (reach_m[:, None] + reach_m[None]) ** 2
    np.fill_diagonal(near, val=False)
    first, second = np.nonzero(near)
    result = np.zeros_like(near)
    result[first, second] = ~_separated(between[first, second], poses, sizes_m, first, second)
    both: BoolArray = result & result.T
    return both


def _separated(
    between: FloatArray, poses: FloatArray, sizes_m: FloatArray, first: IntArray, second: IntArray
) -> BoolArray:
    """Whether the first rectangle's own axes separate the pairs; (P,)."""
    heading, other = poses[first, 2], poses[second, 2]
    along = between[:, 0] * np.cos(heading) + between[:, 1] * np.sin(heading)
    across = -between[:, 0] * np.sin(heading) + between[:, 1] * np.cos(heading)
    cosine, sine = np.abs(np.cos(other - heading)), np.abs(np.sin(other - heading))
    width, length = sizes_m[first].T / 2
    other_width, other_length = sizes_m[second].T / 2
    apart_along = np.abs(along) >= length + other_length * cosine + other_width * sine
    apart_across = np.abs(across) >= width + other_length * sine + other_width * cosine
    separated: BoolArray = apart_along | apart_across
    return separated

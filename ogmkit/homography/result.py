"""What a fit gives: matrices of several variants of one frame, and the finished homography of one."""

from dataclasses import dataclass, replace

import numpy as np

from ogmkit.grid import GridSpec
from ogmkit.homography.projective import apply, determinants, inverse_or_nan
from ogmkit.typing import BoolArray, FloatArray, IntArray

# Below this share of its largest entry, h33 can't serve as the scale: the horizon runs through pixel (0, 0).
_MIN_SCALE = 1e-12


@dataclass(frozen=True, eq=False)
class Estimates:
    """Fits to B variants of one frame: whole, or with one box left out.

    Attributes:
        level_from_image: (B, 3, 3) float64, pixels to metres (x, y) of the level frame, of any scale, w > 0
            for ground in front of the camera; NaN where refused.
        reasons: B strings, empty where the fit is valid.
        points_used: (B,) int64 corners, or evidence points of `surface`.
        plane: (B, 3) float64 where the fit is a plane z = p0 + p1·x + p2·y of the level frame, else None.
    """

    level_from_image: FloatArray
    reasons: tuple[str, ...]
    points_used: IntArray
    plane: FloatArray | None = None

    @property
    def valid(self) -> BoolArray:
        """(B,) variants with an answer."""
        return np.array([not reason for reason in self.reasons], dtype=bool)


@dataclass(frozen=True, eq=False)
class Homography:
    """The homography of one frame (design.md §2).

    Attributes:
        bev_from_image: (3, 3) float64, pixel to cell; |h33| = 1, w > 0 for ground in front; NaN if invalid.
        valid: whether there is one.
        reason: why not; empty if valid.
        points_used: number of corners or evidence points it rests on.
        rms_px: in the image, over the corners of all usable boxes, used or not (so that methods compare);
            NaN without corners, infinite where one of them has no image.
        rms_cells: the same in the BEV.
        plane: (3,) float64 if it is a plane z = p0 + p1·x + p2·y of the level frame, metres, else None.
    """

    bev_from_image: FloatArray
    valid: bool
    reason: str
    points_used: int
    rms_px: float
    rms_cells: float
    plane: FloatArray | None = None


def estimates(
    level_from_image: FloatArray,
    reasons: list[str],
    points_used: IntArray,
    probe_px: FloatArray,
    probed: BoolArray,
    plane: FloatArray | None = None,
) -> Estimates:
    """Give fits their sign by pixels that are known to see the ground, and refuse those that can't be right.

    Args:
        level_from_image: (B, 3, 3) of any sign.
        reasons: B reasons known so far, empty where none.
        points_used: (B,).
        probe_px: (..., N, 2) pixels of ground in front of the camera.
        probed: (B, N) which of them hold for which variant.
        plane: as in `Estimates`.
    """
    _, w = apply(level_from_image, probe_px)
    sign = np.where((w * probed).sum(-1) < 0, -1.0, 1.0)
    signed = level_from_image * sign[:, None, None]
    split = probed & ~(w * sign[:, None] > 0)
    # From above, an image is not mirrored; (x, y) → (column, row) of the BEV turns the sign once more.
    mirrored = determinants(signed) >= 0
    refused = list(reasons)
    for b, reason in enumerate(reasons):
        if reason:
            continue
        if not np.isfinite(signed[b]).all():
            refused[b] = "the fit did not converge"
        elif split[b].any():
            refused[b] = "the horizon would run through the corners"
        elif mirrored[b]:
            refused[b] = "the ground would be seen from below"
    result = Estimates(signed, tuple(refused), points_used, plane)
    return replace(result, level_from_image=np.where(result.valid[:, None, None], signed, np.nan))


def finished(found: Estimates, grid: GridSpec, corners_px: FloatArray, corners_m: FloatArray) -> Homography:
    """The homography of the first variant, in cells, with its residuals at (N, 2) corners in both planes."""
    reason = found.reasons[0]
    matrix = grid.bev_from_level @ found.level_from_image[0]
    if not reason and abs(matrix[2, 2]) < _MIN_SCALE * np.abs(matrix).max():
        reason = "the horizon runs through pixel (0, 0)"
    image_from_bev = inverse_or_nan(matrix[None])[0]
    if not reason and not np.isfinite(image_from_bev).all():
        reason = "the homography is singular"
    if reason:
        nothing = np.full((3, 3), np.nan)
        return Homography(nothing, False, reason, int(found.points_used[0]), np.nan, np.nan)
    scale = abs(matrix[2, 2])
    cells = grid.cells(corners_m)
    return Homography(
        bev_from_image=matrix / scale,
        valid=True,
        reason="",
        points_used=int(found.points_used[0]),
        rms_px=_rms(image_from_bev, cells, corners_px),
        rms_cells=_rms(matrix, corners_px, cells),
        plane=None if found.plane is None else found.plane[0],
    )


def _rms(homography: FloatArray, source: FloatArray, destination: FloatArray) -> float:
    """Root mean square distance between mapped (N, 2) points and where they belong."""
    if not len(source):
        return float("nan")
    mapped, w = apply(homography, source)
    if not (w > 0).all():
        return float("inf")
    return float(np.sqrt(((mapped - destination) ** 2).sum(-1).mean()))

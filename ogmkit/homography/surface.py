"""The homography that fits a ground surface best: not flat, but seen as if it were."""

from dataclasses import dataclass

import numpy as np

from ogmkit.homography.corners import least_spread_m
from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.ground import Ground, fit_ground, viewing_direction
from ogmkit.homography.least_squares import homography_model, homography_of, minimise, parameters_of
from ogmkit.homography.plane import level_from_image
from ogmkit.homography.projective import apply, determinants, inverse_or_nan, normalisation, similar
from ogmkit.homography.result import Estimates, estimates
from ogmkit.homography.settings import FitSettings
from ogmkit.typing import BoolArray, FloatArray, IntArray

# design.md §2's figures.
_GRID_X_M = np.arange(4.0, 80.1, 4.0)
_GRID_Y_M = np.arange(-44.0, 44.1, 4.0)
_NEAREST_M, _FARTHEST_M = 6.0, 62.0
_EVIDENCE_WEIGHT = 3.0
_LEAST_VARIANCE = 0.05**2
_MIN_DEPTH_M = 1.0
_MAX_PLANE_ERROR_M = 30.0
_STEPS = 6
# A homography can't follow a bend: beyond this error a place counts by its distance, not its square. Measured
# on real left-out boxes: 1.0 ± 0.3 % less error (geometric mean), the same tail; so too on simulated hills.
_SOFT_L1_M = 1.0
# A very narrow view shows the grid as a line, too little for a homography: the plane's answer stands.
_LEAST_SPREAD_M = 2.0


@dataclass(frozen=True, eq=False)
class _Samples:
    """Ground points of the B variants of a frame; S of each, some of weight 0.

    Attributes:
        places_m: (S, 2) in the level frame.
        weights: (B, S) w of design.md §2.
        heights_m: (B, S).
        pixels: (B, S, 2) where the camera sees them.
        depth_m: (B, S).
    """

    places_m: FloatArray
    weights: FloatArray
    heights_m: FloatArray
    pixels: FloatArray
    depth_m: FloatArray


def estimate(frame: FrameGeometry, left_out: IntArray, settings: FitSettings) -> Estimates:
    """Method `surface`: the ground of `fit_ground`, then the homography with the least error on it.

    It answers on every frame whose camera sees the ground, boxes or none.
    """
    del settings
    ground = fit_ground(frame)
    samples = _sample(frame, ground, left_out)
    planes = level_from_image(frame, _weighted_planes(samples))
    visible = _visible(samples, planes)
    pixels = np.where(visible[..., None], samples.pixels, 0.0)
    matrix = _refined(samples, planes, pixels, visible)
    reasons = [
        "" if seen else "the camera does not see the ground" for seen in np.any(visible, axis=1).tolist()
    ]
    used = (~ground.struck(left_out)).sum(axis=1)
    return estimates(matrix, reasons, used, pixels, visible)


def _sample(frame: FrameGeometry, ground: Ground, left_out: IntArray) -> _Samples:
    """Sample the surface on a grid inside the camera's cone and at the evidence there."""
    view_from_level = viewing_direction(frame)
    grid = np.stack(np.meshgrid(_GRID_X_M, _GRID_Y_M, indexing="ij"), axis=-1).reshape(-1, 2)
    grid = grid[_in_cone(frame, grid)] @ view_from_level
    near = _in_cone(frame, ground.places_m @ view_from_level.T)
    places = np.concatenate([grid, ground.places_m[near]])
    heights, variances = ground.height_without_m(places, left_out)
    emphasis = np.concatenate([np.ones(len(grid)), np.full(near.sum(), _EVIDENCE_WEIGHT)])
    weights = np.hypot(places[:, 0], places[:, 1]) / 20 * emphasis / np.sqrt(variances + _LEAST_VARIANCE)
    weights[:, len(grid) :] *= ~ground.struck(left_out)[:, near]
    points = np.concatenate([np.broadcast_to(places, (*heights.shape, 2)), heights[..., None]], axis=-1)
    pixels, depth_m = frame.project_level(points)
    return _Samples(places, weights, heights, pixels, depth_m)


def _in_cone(frame: FrameGeometry, places_view: FloatArray) -> BoolArray:
    """(S,) places, x along the viewing direction, in range and between the image's left and right borders."""
    focal_px, centre_px = frame.intrinsics[0, 0], frame.intrinsics[0, 2]
    x, y = places_view.T
    range_m, angle = np.hypot(x, y), np.arctan2(y, x)
    left = np.arctan2(centre_px, focal_px)
    right = -np.arctan2(frame.image_size[1] - centre_px, focal_px)
    cone: BoolArray = (range_m >= _NEAREST_M) & (range_m <= _FARTHEST_M) & (angle <= left) & (angle >= right)
    return cone


def _weighted_planes(samples: _Samples) -> FloatArray:
    """(B, 3) planes through the samples, by weighted least squares of the height."""
    basis = np.concatenate([np.ones((len(samples.places_m), 1)), samples.places_m], axis=1)
    weighted_t = basis.T * (samples.weights**2)[:, None, :]
    normal = weighted_t @ basis
    # A camera may see a single line of the grid, or nothing of it: what is not determined stays level.
    normal += np.eye(3) * (1e-12 * np.trace(normal, axis1=1, axis2=2) + 1e-12)[:, None, None]
    planes: FloatArray = np.linalg.solve(normal, weighted_t @ samples.heights_m[..., None])[..., 0]
    return planes


def _visible(samples: _Samples, planes: FloatArray) -> BoolArray:
    """(B, S) samples that the camera sees and that the plane's homography maps near to their place."""
    mapped, w = apply(planes, samples.pixels)
    offset = mapped - samples.places_m
    with np.errstate(invalid="ignore"):
        near = np.hypot(offset[..., 0], offset[..., 1]) < _MAX_PLANE_ERROR_M
    visible: BoolArray = near & (w > 0) & (samples.depth_m > _MIN_DEPTH_M) & (samples.weights > 0)
    return visible


def _refined(samples: _Samples, planes: FloatArray, pixels: FloatArray, visible: BoolArray) -> FloatArray:
    """Least squares of each sample's error over its range, from the planes; (B, 3, 3)."""
    count = visible.astype(np.float64)
    places = np.broadcast_to(samples.places_m, pixels.shape)
    image_norm, level_norm = normalisation(pixels, count), normalisation(places, count)
    start = level_norm @ planes @ inverse_or_nan(image_norm)
    range_m = np.hypot(samples.places_m[:, 0], samples.places_m[:, 1])
    weights = count * (2 * samples.weights / range_m) ** 2
    model = homography_model(similar(image_norm, pixels), similar(level_norm, places))
    turn = _SOFT_L1_M * level_norm[:, 0, 0]
    refined = homography_of(minimise(parameters_of(start), model, weights, steps=_STEPS, soft_l1=turn))
    best = np.asarray(np.linalg.solve(level_norm, refined @ image_norm), dtype=np.float64)
    _, w = apply(best, pixels)
    sound = (
        (least_spread_m(samples.places_m, visible) >= _LEAST_SPREAD_M)
        & ((w > 0) | ~visible).all(axis=1)
        & (determinants(best) < 0)
    )
    return np.where(sound[:, None, None], best, planes)

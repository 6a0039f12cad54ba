"""Height of the ground round the ego: a Gaussian process through boxes' bottoms and the ego's wheels."""

from dataclasses import dataclass

import numpy as np

from ogmkit.homography.frame import FrameGeometry
from ogmkit.typing import BoolArray, FloatArray, IntArray

# All figures are design.md §2's; standard deviations in metres unless another unit stands in the name.
_MATERN_LENGTH_M = 60.0
_MATERN_VARIANCE = 1.0
_SLOPE_VARIANCE = 0.05**2 + 0.002**2  # of the plane through the ego; slopes without unit
_OFFSET_VARIANCE = 0.3**2 + 0.15**2
_BOX_VARIANCE = 0.06**2 + 0.07**2
_BOX_STD_AT_50_M = 0.05
_CONTACT_VARIANCE = 0.1**2 + 0.07**2
_MAX_RANGE_M = 80.0


@dataclass(frozen=True, eq=False)
class Ground:
    """Posterior of the ground's height in the level frame, given n pieces of evidence.

    Attributes:
        places_m: (n, 2) x, y of the evidence; the ego's contact point (0, 0) is the first.
        box: (n,) index of the frame's box that each comes from; −1 for the contact point.
        precision: (n, n) inverse of the evidence's covariance, noise included.
        pull: (n,) precision @ heights.
    """

    places_m: FloatArray
    box: IntArray
    precision: FloatArray
    pull: FloatArray

    def height_m(self, points_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Height of the ground under points (Rasmussen & Williams, equations 2.25 and 2.26).

        Args:
            points_m: (..., 2) x, y in the level frame.

        Returns:
            (...) mean in metres and (...) variance in m², of the ground itself, without the boxes' noise.
        """
        flat = points_m.reshape(-1, 2)
        mean, variance = self.height_without_m(flat, np.array([-1]))
        return mean.reshape(points_m.shape[:-1]), variance.reshape(points_m.shape[:-1])

    def struck(self, left_out: IntArray) -> BoolArray:
        """(B, n) evidence that is lost when box `left_out[b]` is left out; −1 leaves out none."""
        lost: BoolArray = (self.box == left_out[:, None]) & (self.box >= 0)
        return lost

    def height_without_m(self, points_m: FloatArray, left_out: IntArray) -> tuple[FloatArray, FloatArray]:
        """The same with one box left out: exact, without another factorisation.

        Striking a row and its column out of a matrix changes its inverse by one rank (R & W, appendix A.3).

        Args:
            points_m: (S, 2).
            left_out: (B,) indices of boxes; −1, or a box that is not evidence, leaves out none.

        Returns:
            (B, S) means in metres and (B, S) variances in m².
        """
        cross = _covariance(points_m, self.places_m)
        influence = cross @ self.precision
        mean = cross @ self.pull
        variance = _prior_variance(points_m) - np.einsum("sn,sn->s", influence, cross)
        struck = self.struck(left_out)
        diagonal = np.diagonal(self.precision)
        influence_out = struck @ influence.T
        scale = np.where(struck.any(axis=1), struck @ (1 / diagonal), 0.0)[:, None]
        means = mean - influence_out * scale * (struck @ self.pull)[:, None]
        variances = variance + influence_out**2 * scale
        return means, np.maximum(variances, 0.0)


def fit_ground(frame: FrameGeometry) -> Ground:
    """Fit the ground to a frame: boxes of all categories before the camera, and the ego's contact point.

    The frame may well hold no box at all: then the contact point and the prior answer.
    """
    box = np.flatnonzero(_is_evidence(frame))
    bottoms = frame.bottoms_level[box]
    places = np.concatenate([np.zeros((1, 2)), bottoms[:, :2]])
    heights = np.concatenate([[0.0], bottoms[:, 2]])
    range_m = np.hypot(bottoms[:, 0], bottoms[:, 1])
    noise = np.concatenate([[_CONTACT_VARIANCE], _BOX_VARIANCE + (_BOX_STD_AT_50_M * range_m / 50) ** 2])
    covariance = _covariance(places, places) + np.diag(noise)
    precision = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
    return Ground(places, np.concatenate([[-1], box]), precision, precision @ heights)


def viewing_direction(frame: FrameGeometry) -> FloatArray:
    """(2, 2) rotation `view_from_level`: x turned to where the camera looks over the ground."""
    x, y = frame.level_from_camera[:2, 2]
    length = np.hypot(x, y)
    if length == 0:
        return np.eye(2)
    turned: FloatArray = np.array([[x, y], [-y, x]]) / length
    return turned


def _is_evidence(frame: FrameGeometry) -> BoolArray:
    """(M,) boxes whose bottoms say something of the ground that the camera sees (design.md §2)."""
    x, y = (frame.bottoms_level[:, :2] @ viewing_direction(frame).T).T
    evidence: BoolArray = (x > 0) & (np.hypot(x, y) < _MAX_RANGE_M) & (np.abs(y) < np.maximum(25, x + 10))
    return evidence


def _covariance(first_m: FloatArray, second_m: FloatArray) -> FloatArray:
    """Prior covariance of heights at (S, 2) and (n, 2) places: Matérn-5/2, a tilted plane and an offset."""
    offset = first_m[:, None] - second_m
    scaled = np.hypot(offset[..., 0], offset[..., 1]) * (np.sqrt(5) / _MATERN_LENGTH_M)
    matern = _MATERN_VARIANCE * (1 + scaled + scaled**2 / 3) * np.exp(-scaled)
    covariance: FloatArray = matern + _SLOPE_VARIANCE * (first_m @ second_m.T) + _OFFSET_VARIANCE
    return covariance


def _prior_variance(points_m: FloatArray) -> FloatArray:
    square = np.einsum("si,si->s", points_m, points_m)
    return np.asarray(_MATERN_VARIANCE + _SLOPE_VARIANCE * square + _OFFSET_VARIANCE)

"""Plans that are linear in the past, and the destination where told, by least squares over sequences."""

from dataclasses import dataclass

import numpy as np

from ogmkit.typing import FloatArray

LINEAR = "linear"
"""The name that tables have for the one of past and destination."""
EGO_STATUS = "ego-status"
"""The name that tables have for the one of the past alone: position, speed and acceleration, all it sees."""
_LEAST_SPREAD = 1e-6
"""Directions in which past and destination spread less, as a share of the largest: rounding of float32."""


@dataclass(frozen=True, eq=False)
class LinearPlan:
    """Coordinates of the points 1 … T, each an affine function of those of past and destination.

    All are in the level frame of the last image, so that a plan turns and moves with the ego. It is not
    mirrored with the past, nor is traffic: x and y each depend on x and y of all places, and on a constant.

    Attributes:
        centre: (F,) means of the features in training: x, y of K past places, then of the destination, if it
            is told.
        weights: (F, 2 T) of features about their means, for x, y of each point.
        middle: (2 T,) means of the points.
    """

    centre: FloatArray
    weights: FloatArray
    middle: FloatArray

    def __call__(self, past: FloatArray, destination: FloatArray | None) -> FloatArray:
        """Plan from (N, K, 2) and (N, 2) metres: (N, T, 2) positions; None as it was fitted."""
        about_centre = _features(past, destination) - self.centre
        return (about_centre @ self.weights + self.middle).reshape(len(past), -1, 2)


def fit_linear_plan(past: FloatArray, destination: FloatArray | None, points: FloatArray) -> LinearPlan:
    """The plan with the least squared errors over some sequences.

    The constant is that of centred data: a sequence like the mean of all gets the mean of their plans. Of
    several solutions, as where there are fewer sequences than unknowns, it is the one whose weights' squares
    have the least sum (the pseudo-inverse's; Golub & Van Loan, Matrix Computations, 5.5).

    Args:
        past: (N, K, 2) metres, N ≥ 1, level frame.
        destination: (N, 2) metres; None for a plan that isn't told it.
        points: (N, T, 2) metres, what was driven.
    """
    features, targets = _features(past, destination), points.reshape(len(points), -1)
    centre, middle = features.mean(axis=0), targets.mean(axis=0)
    weights = np.linalg.lstsq(features - centre, targets - middle, rcond=_LEAST_SPREAD)[0]
    return LinearPlan(centre, weights, middle)


def _features(past: FloatArray, destination: FloatArray | None) -> FloatArray:
    flat = past.reshape(len(past), -1)
    return flat if destination is None else np.concatenate([flat, destination], axis=1)

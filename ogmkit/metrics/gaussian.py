"""Bivariate Gaussians in closed form (Bishop, Pattern Recognition and Machine Learning, 2.3)."""

import math

import numpy as np

from ogmkit.typing import FloatArray


def mahalanobis_squared(offset: FloatArray, sigma: FloatArray, rho: FloatArray) -> FloatArray:
    """Squared Mahalanobis distances.

    As two squares, no difference of large numbers: y given x is a Gaussian of its own.

    Args:
        offset: (..., 2) from the mean.
        sigma: (..., 2) standard deviations of x and y.
        rho: (...) correlation.
    """
    x, y = np.moveaxis(offset / sigma, -1, 0)
    result: FloatArray = x**2 + (y - rho * x) ** 2 / ((1 - rho) * (1 + rho))
    return result


def negative_log_likelihood(offset: FloatArray, sigma: FloatArray, rho: FloatArray) -> FloatArray:
    """−log of the density, in nats; arguments as of `mahalanobis_squared`."""
    log_scale = np.log(sigma).sum(axis=-1) + (np.log1p(-rho) + np.log1p(rho)) / 2
    result: FloatArray = math.log(2 * math.pi) + log_scale + mahalanobis_squared(offset, sigma, rho) / 2
    return result


def ellipse_radius_squared(share: float) -> float:
    """Squared Mahalanobis distance within which a share of a distribution lies: χ² of two degrees."""
    return -2 * math.log1p(-share)


def ellipse(mean: FloatArray, sigma: FloatArray, rho: float, share: float, points: int = 72) -> FloatArray:
    """The ellipse that holds a share of a distribution.

    Args:
        mean: (2,).
        sigma: (2,) standard deviations of x and y.
        rho: correlation.
        share: between 0 and 1.
        points: of the outline.

    Returns:
        (points, 2) round the outline.
    """
    angle = np.linspace(0, 2 * math.pi, points, endpoint=False)
    u, v = np.cos(angle), np.sin(angle)
    circle = np.stack([u, rho * u + math.sqrt((1 - rho) * (1 + rho)) * v], axis=-1)  # by Cholesky's factor
    outline: FloatArray = mean + math.sqrt(ellipse_radius_squared(share)) * sigma * circle
    return outline

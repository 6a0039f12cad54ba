"""The methods by name, and the one call that fits a frame."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.homography import calibration, dlt, ego_plane, four_point, plane, robust, surface
from ogmkit.homography.corners import usable_corners
from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.result import Estimates, Homography, finished
from ogmkit.homography.settings import FitSettings
from ogmkit.homography.sources import METHOD_NAMES
from ogmkit.typing import IntArray

Estimator = Callable[[FrameGeometry, IntArray, FitSettings], Estimates]
"""Frame, (B,) index of the box that each variant leaves out (−1: none), settings → B estimates."""

METHODS: Mapping[str, Estimator] = MappingProxyType(
    dict(
        zip(
            METHOD_NAMES,
            (module.estimate for module in (surface, dlt, robust, plane, four_point, calibration, ego_plane)),
            strict=True,
        )
    )
)
"""By the names that the command line and the shards use; the default first."""

_WHOLE = np.array([-1])


def estimator(method: str) -> Estimator:
    """The estimator of that name.

    Raises:
        SettingsError: there is none.
    """
    if method not in METHODS:
        raise SettingsError(f"homography method {method!r} is unknown: choose from {', '.join(METHODS)}")
    return METHODS[method]


def fit(method: str, frame: FrameGeometry, grid: GridSpec, settings: FitSettings) -> Homography:
    """Fit one frame.

    A frame that the method can't answer for is not an error: the result is invalid and says why.

    Args:
        method: a key of `METHODS`.
        frame: camera and boxes.
        grid: the cells of `bev_from_image`.
        settings: which corners count.

    Raises:
        SettingsError: the method is unknown.
    """
    corners = usable_corners(frame, settings)
    found = estimator(method)(frame, _WHOLE, settings)
    return finished(found, grid, corners.pixels, corners.positions_m)

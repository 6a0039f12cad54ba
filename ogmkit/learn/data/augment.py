"""Augmentation of samples: colours, turned cameras, and a mirrored world that stays true to its geometry."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.learn.data.turn import turned
from ogmkit.samples.arrays import SampleArrays, scaled
from ogmkit.samples.mirrors import bev_mirror, image_mirror
from ogmkit.typing import UInt8Array

_Part = TypeVar("_Part")
_Value = TypeVar("_Value", bound=np.generic)
_Float = TypeVar("_Float", bound=np.floating)

_GREY = np.array([0.299, 0.587, 0.114])
"""Luma of red, green and blue (ITU-R BT.601)."""
_LEVEL_MIRROR = np.diag([1.0, -1.0, 1.0, 1.0])
_CAMERA_MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])


@dataclass(frozen=True)
class Augmentation:
    """What is done to training samples at random.

    Attributes:
        colour: brightness, contrast and saturation each change by a factor within 1 ± this.
        flip: probability that left and right change places.
        pitch_deg: angle, in degrees, that the camera is turned up or down by at most.
        roll_deg: the same about its optical axis.

    Raises:
        SettingsError: a value is not within 0 … 1, or of the angles 0 … 45.
    """

    colour: float = 0.2
    flip: float = 0.5
    pitch_deg: float = 0.0
    roll_deg: float = 0.0

    def __post_init__(self) -> None:
        for name, most in (("colour", 1), ("flip", 1), ("pitch_deg", 45), ("roll_deg", 45)):
            value = getattr(self, name)
            if not 0 <= value <= most:
                raise SettingsError(f"augmentation: {name} {value} is not within 0 … {most}")

    @property
    def turns(self) -> bool:
        """Whether cameras are turned, which takes their intrinsics."""
        return self.pitch_deg > 0 or self.roll_deg > 0

    @property
    def moves(self) -> bool:
        """Whether it changes more than colours."""
        return self.turns or self.flip > 0

    def require_grid(self, grid: GridSpec) -> None:
        """Check that this can be done on a grid.

        Raises:
            SettingsError: mirrored cells would not be cells: the ego is neither on a cell's edge nor centre.
        """
        if self.flip > 0 and not float(2 * grid.ego_column).is_integer():
            raise SettingsError(
                f"augmentation: the ego's column {grid.ego_column:g} is not a whole or half number, so a "
                "flip would shift the grid; set flip to 0"
            )

    def apply(self, sample: SampleArrays, grid: GridSpec, seed: int) -> SampleArrays:
        """Change a sample, all its frames alike; the seed alone decides how.

        A sample whose cameras are turned needs `intrinsics`.
        """
        rng = np.random.default_rng(seed)
        flips = rng.random() < self.flip
        brightness, contrast, saturation = rng.uniform(1 - self.colour, 1 + self.colour, 3)
        if sample.image is not None and self.colour:
            frames = [jittered(frame, brightness, contrast, saturation) for frame in sample.image]
            sample = replace(sample, image=np.stack(frames))
        if self.turns:
            most_rad = np.radians([self.pitch_deg, self.roll_deg])
            sample = turned(sample, *rng.uniform(-most_rad, most_rad))
        return flipped(sample, grid) if flips else sample


def jittered(image: UInt8Array, brightness: float, contrast: float, saturation: float) -> UInt8Array:
    """Change the colours of an RGB image, in that order, each by a factor; (h, w, 3) uint8 in and out.

    Contrast is about the image's mean grey, saturation about each pixel's; only the end is cut to 0 … 255.
    """
    mean_grey = float(np.dot(cv2.mean(image)[:3], _GREY))
    mixed = saturation * np.eye(3) + (1 - saturation) * _GREY
    offset = np.full((3, 1), (1 - contrast) * brightness * mean_grey)  # grey: saturation leaves it alone
    return np.asarray(cv2.transform(image, np.hstack([brightness * contrast * mixed, offset])), np.uint8)


def flipped(sample: SampleArrays, grid: GridSpec) -> SampleArrays:
    """The sample as it were in a mirrored world: y of the level frame and u of the image change sides.

    Args:
        sample: is left as it is.
        grid: of `bev`; twice its ego column is whole. Cells mirrored from outside the grid are 0 and unknown.
            A flip takes each of `bev_parts` to another (`ogmkit.samples.pooling.equal_parts`).
    """
    image_mirrors = np.stack([image_mirror(width) for width in sample.image_size[:, 1]])
    return replace(
        sample,
        image=_of(sample.image, lambda image: image[:, :, ::-1]),
        masks=_of(sample.masks, lambda masks: masks[..., ::-1]),
        known_pixels=_of(sample.known_pixels, lambda known: known[..., ::-1]),
        bev=_of(sample.bev, lambda bev: _mirrored_columns(bev, grid.ego_column)),
        bev_parts=_of(sample.bev_parts, lambda parts: _mirrored_parts(parts, grid)),
        known_columns=_of(sample.known_columns, lambda known: _mirrored_columns(known, grid.ego_column)),
        bev_from_image=_of(
            sample.bev_from_image, lambda matrix: scaled(bev_mirror(grid) @ matrix @ image_mirrors)
        ),
        # u' = W − 1 − u and x' = −x of the camera: together the focal length keeps its sign.
        intrinsics=_of(sample.intrinsics, lambda matrix: image_mirrors @ matrix @ _CAMERA_MIRROR[:3, :3]),
        level_from_camera=_of(sample.level_from_camera, lambda pose: _LEVEL_MIRROR @ pose @ _CAMERA_MIRROR),
        points_level=_of(sample.points_level, lambda points: tuple(map(_mirrored_y, points))),
        past=_of(sample.past, _mirrored_y),
        future=_of(sample.future, _mirrored_y),
        positions=_of(sample.positions, _mirrored_y),
        features=_of(sample.features, lambda features: features[:, ::-1]),
        mirrored=not sample.mirrored,
    )


def _of(value: _Part | None, function: Callable[[_Part], _Part]) -> _Part | None:
    return None if value is None else function(value)


def _mirrored_parts(parts: NDArray[_Value], grid: GridSpec) -> NDArray[_Value]:
    """(..., c) averages over equal parts of the grid, as of its mirrored columns."""
    return _mirrored_columns(parts, grid.ego_column * parts.shape[-1] / grid.columns)


def _mirrored_columns(cells: NDArray[_Value], ego_column: float) -> NDArray[_Value]:
    """(..., columns) mirrored about the ego's; 0 where the mirror shows cells outside the grid."""
    columns = cells.shape[-1]
    both = round(2 * ego_column) - 1  # a column and its mirror image add up to this
    first, last = max(0, both - columns + 1), min(columns - 1, both)
    result = np.zeros_like(cells)
    if first <= last:
        result[..., first : last + 1] = cells[..., both - last : both - first + 1][..., ::-1]
    return result


def _mirrored_y(points: NDArray[_Float]) -> NDArray[_Float]:
    """(..., 2 or more) points with the sign of y changed."""
    result = points.copy()
    result[..., 1] = -points[..., 1]
    return result

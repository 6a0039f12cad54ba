"""A calibrated image over the ground, at any size."""

from dataclasses import dataclass
from functools import cached_property

from ogmkit.geometry.camera import image_from_resized
from ogmkit.geometry.se3 import inverse
from ogmkit.typing import FloatArray


@dataclass(frozen=True, eq=False)
class View:
    """Where a camera stands and what its image takes in.

    Attributes:
        intrinsics: (3, 3) float64, for images of this size.
        level_from_camera: (4, 4) float64.
        image_size: (height, width) in pixels.
    """

    intrinsics: FloatArray
    level_from_camera: FloatArray
    image_size: tuple[int, int]

    @cached_property
    def camera_from_level(self) -> FloatArray:
        """(4, 4) float64."""
        return inverse(self.level_from_camera)

    def resized(self, image_size: tuple[int, int]) -> "View":
        """The same view on a copy of its image of another (height, width)."""
        resized_from_image = image_from_resized(image_size, self.image_size)
        return View(resized_from_image @ self.intrinsics, self.level_from_camera, image_size)

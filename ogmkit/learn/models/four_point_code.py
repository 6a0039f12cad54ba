"""Homographies as the places in the image of four points of the ground."""

from itertools import product
from operator import itemgetter

import torch
from torch import Tensor

from ogmkit.errors import TrainingError
from ogmkit.grid import GridSpec
from ogmkit.learn.models.homography_code import LEAST_SHARE, HomographyCode
from ogmkit.learn.models.projective import apply, inverse_or_nan, through_four_points, unit_h33

_NEAR_SHARES_U = (0.15, 0.85)
_FAR_SHARES_U = (0.28, 0.72)
_NEAR_SHARES_V = (0.95, 0.90, 0.85, 0.80, 0.75, 0.70)
_FAR_SHARES_V = tuple(0.56 + 0.02 * step for step in range(17))
"""Pixels whose ground may be taken for the four points, as shares of the image's width and height."""


class FourPointCode(HomographyCode):
    """Where four fixed places of the ground appear in the image (DeTone, Malisiewicz & Rabinovich 2016).

    The places are what the mean homography makes of four pixels, a near pair and a far one; the code is their
    eight pixel coordinates, each less its mean and divided by its spread over the training split. Of several
    pairs of image rows those are taken whose places keep steadiest: homographies that were fitted to ground
    further away may do anything below the car's bonnet, and nothing holds above the horizon.
    """

    size = 8
    places_bev: Tensor
    mean_px: Tensor
    scale_px: Tensor

    def __init__(self, cameras: int, image_size: tuple[int, int], grid: GridSpec) -> None:
        super().__init__(cameras, image_size, grid)
        for name in ("places_bev", "mean_px", "scale_px"):
            self.register_buffer(name, torch.full((cameras, 4, 2), torch.nan, dtype=torch.float64))

    def fit_camera(self, index: int, bev_from_image: Tensor, mirrored: Tensor) -> None:
        """Choose the places; mean and standard deviation of where they appear, mirrored back."""
        bev_from_image = self.mirrored_where(bev_from_image, mirrored)
        height, width = self.image_size
        found = []
        for near, far in product(_NEAR_SHARES_V, _FAR_SHARES_V):
            shares = [(u, near) for u in _NEAR_SHARES_U] + [(u, far) for u in _FAR_SHARES_U]
            pixels = bev_from_image.new_tensor(shares) * bev_from_image.new_tensor(
                [width - 1.0, height - 1.0]
            )
            seen = _places(bev_from_image, pixels) if far < near else None
            if seen is not None:
                found.append((_unsteadiness(seen[1]), *seen))
        if not found:
            raise TrainingError(
                f"camera {index}: no four pixels see ground in all training frames; regress entries instead"
            )
        _, places_bev, places_px = min(found, key=itemgetter(0))
        self.places_bev[index] = places_bev
        self.mean_px[index] = places_px.mean(0)
        self.scale_px[index] = places_px.std(0, correction=0).clamp(min=LEAST_SHARE * height)

    def encode(self, bev_from_image: Tensor, camera: Tensor, mirrored: Tensor | None = None) -> Tensor:
        """See `HomographyCode.encode`; left and right places of mirrored samples change roles."""
        self.require_known(camera)
        matrices = self.mirrored_where(bev_from_image.double(), mirrored)
        seen, _ = apply(inverse_or_nan(matrices), self.places_bev[camera])
        offsets = (seen - self.mean_px[camera]) / self.scale_px[camera]
        if mirrored is not None:
            offsets = torch.where(mirrored[:, None, None], _sides_changed(offsets), offsets)
        return offsets.flatten(1).float()

    def decode(self, code: Tensor, camera: Tensor) -> Tensor:
        """See `HomographyCode.decode`."""
        self.require_known(camera)
        offsets = code.double().reshape(-1, 4, 2) * self.scale_px[camera]
        return unit_h33(through_four_points(self.mean_px[camera] + offsets, self.places_bev[camera]))


def _places(bev_from_image: Tensor, pixels: Tensor) -> tuple[Tensor, Tensor] | None:
    """Ground that the mean of homographies sees at (4, 2) pixels, and where each homography has it.

    Returns:
        (4, 2) cells and (N, 4, 2) pixels; None where one of the homographies has no ground there.
    """
    _, depths = apply(bev_from_image, pixels)
    places_bev, _ = apply(bev_from_image.mean(0, keepdim=True), pixels)
    places_px, w = apply(inverse_or_nan(bev_from_image), places_bev)
    return (places_bev[0], places_px) if bool((depths > 0).all() and (w > 0).all()) else None


def _sides_changed(offsets: Tensor) -> Tensor:
    """(B, 4, 2) offsets of places as their mirror images have them: right for left, to the other side."""
    return offsets[:, [1, 0, 3, 2]] * offsets.new_tensor([-1.0, 1.0])


def _unsteadiness(places_px: Tensor) -> float:
    """How far (N, 4, 2) places stray, for their distance: what tilts a plane through them."""
    rows = places_px[..., 1].mean(0)
    return float(places_px.std(0, correction=0).square().mean().sqrt() / (rows[:2].mean() - rows[2:].mean()))

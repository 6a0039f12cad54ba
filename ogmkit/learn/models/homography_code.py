"""What a network regresses in place of a homography, and back: standardised entries, or four points."""

from abc import ABC, abstractmethod
from itertools import product
from operator import itemgetter
from typing import Self

import torch
from torch import Tensor, nn

from ogmkit.errors import SettingsError, TrainingError
from ogmkit.grid import GridSpec
from ogmkit.learn.models.projective import apply, inverse_or_nan, through_four_points, unit_h33
from ogmkit.samples.mirrors import bev_mirror, image_mirror

_LEAST_SHARE = 1e-3
"""No factor is smaller than this share of what is typical: what never varies must not be blown up."""
_NEAR_SHARES_U = (0.15, 0.85)
_FAR_SHARES_U = (0.28, 0.72)
_NEAR_SHARES_V = (0.95, 0.90, 0.85, 0.80, 0.75, 0.70)
_FAR_SHARES_V = tuple(0.56 + 0.02 * step for step in range(17))
"""Pixels whose ground may be taken for the four points, as shares of the image's width and height."""


class HomographyCode(ABC, nn.Module):
    """A code of fixed length for homographies, with factors fixed from the training split, one set a camera.

    They are buffers, so that they travel with the weights. Before `fit` or `load_state_dict` they are NaN.
    Homographies of mirrored samples are standardised by mirrored factors: a camera that looks to one side, or
    whose principal point is off the centre, would otherwise have its mirror image many deviations away.

    Args:
        cameras: how many there are.
        image_size: (height, width) of the images whose pixels homographies map.
        grid: whose cells they map to.
    """

    size: int
    bev_mirror: Tensor
    image_mirror: Tensor

    def __init__(self, cameras: int, image_size: tuple[int, int], grid: GridSpec) -> None:
        super().__init__()
        self.cameras = cameras
        self.image_size = image_size
        mirrors = {"bev_mirror": bev_mirror(grid), "image_mirror": image_mirror(image_size[1])}
        for name, mirror in mirrors.items():
            self.register_buffer(name, torch.from_numpy(mirror), persistent=False)

    @classmethod
    def fit(
        cls,
        bev_from_image: Tensor,
        camera: Tensor,
        cameras: int,
        image_size: tuple[int, int],
        grid: GridSpec,
        mirrored: Tensor | None = None,
    ) -> Self:
        """The code with the factors of a training split.

        Args:
            bev_from_image: (N, 3, 3) float64; those that are not finite don't count.
            camera: (N,) int64.
            cameras: how many there are.
            image_size: (height, width) of the images.
            grid: whose cells homographies map to.
            mirrored: (N,) bool, which of them are of mirrored samples; None for none.

        Raises:
            SettingsError: a camera's index is unknown.
            TrainingError: a camera has no homography, or none that the code can be made from.
        """
        code = cls(cameras, image_size, grid)
        code.require_known(camera)
        finite = torch.isfinite(bev_from_image).all(-1).all(-1)
        flipped = torch.zeros_like(finite) if mirrored is None else mirrored
        for index in range(cameras):
            chosen = finite & (camera == index)
            if not bool(chosen.any()):
                raise TrainingError(f"camera {index} has no valid homography in the training split")
            code.fit_camera(index, unit_h33(bev_from_image[chosen].double()), flipped[chosen])
        return code

    @abstractmethod
    def fit_camera(self, index: int, bev_from_image: Tensor, mirrored: Tensor) -> None:
        """Fix the factors of one camera from its (N, 3, 3) homographies, |h33| = 1, (N,) of them mirrored."""

    @abstractmethod
    def encode(self, bev_from_image: Tensor, camera: Tensor, mirrored: Tensor | None = None) -> Tensor:
        """What is regressed.

        Args:
            bev_from_image: (B, 3, 3) float64.
            camera: (B,) int64.
            mirrored: (B,) bool, which of them are of mirrored samples; None for none.

        Returns:
            (B, size) float32, about 0 on average and 1 in spread.

        Raises:
            SettingsError: a camera's index is unknown.
        """

    @abstractmethod
    def decode(self, code: Tensor, camera: Tensor) -> Tensor:
        """(B, size) and (B,) cameras → (B, 3, 3) float64, |h33| = 1, w > 0 on the ground; NaN where singular.

        Raises:
            SettingsError: a camera's index is unknown.
        """

    def mirror(self, bev_from_image: Tensor) -> Tensor:
        """(B, 3, 3) homographies of the mirrored samples, |h33| = 1; twice is once back."""
        return unit_h33(self.bev_mirror @ bev_from_image.double() @ self.image_mirror)

    def mirrored_where(self, bev_from_image: Tensor, mirrored: Tensor | None) -> Tensor:
        """(B, 3, 3) homographies, mirrored where (B,) says so."""
        if mirrored is None:
            return bev_from_image
        return torch.where(mirrored[:, None, None], self.mirror(bev_from_image), bev_from_image)

    def require_known(self, camera: Tensor) -> None:
        """Refuse indices that no factors are there for.

        Raises:
            SettingsError: there is one.
        """
        if bool(((camera < 0) | (camera >= self.cameras)).any()):
            raise SettingsError(
                f"cameras {sorted(set(camera.tolist()))}: only 0 to {self.cameras - 1} are known"
            )


class EntriesCode(HomographyCode):
    """The nine entries, |h33| = 1, each less its mean and divided by its spread over the training split.

    The paper rescales entries by constant factors that it does not name; to take off the mean is ours. An
    entry is never divided by another.
    """

    size = 9
    mean: Tensor
    scale: Tensor

    def __init__(self, cameras: int, image_size: tuple[int, int], grid: GridSpec) -> None:
        super().__init__(cameras, image_size, grid)
        for name in ("mean", "scale"):
            self.register_buffer(name, torch.full((cameras, 3, 3), torch.nan, dtype=torch.float64))

    def fit_camera(self, index: int, bev_from_image: Tensor, mirrored: Tensor) -> None:
        """Mean of each entry, and its standard deviation, of mirrored ones about the mirrored mean.

        A deviation counts at least a thousandth of the entry's natural unit: what it would be if it made up
        all of its row's largest term at the image's far corner.
        """
        height, width = self.image_size
        reach = bev_from_image.new_tensor([width, height, 1.0])
        self.mean[index] = mean = self.mirrored_where(bev_from_image, mirrored).mean(0)
        offsets = bev_from_image - self.mirrored_where(mean.expand_as(bev_from_image), mirrored)
        natural = (bev_from_image.abs() * reach).amax(-1).mean(0)[:, None] / reach
        self.scale[index] = offsets.square().mean(0).sqrt().maximum(_LEAST_SHARE * natural)

    def encode(self, bev_from_image: Tensor, camera: Tensor, mirrored: Tensor | None = None) -> Tensor:
        """See `HomographyCode.encode`."""
        self.require_known(camera)
        mean = self.mirrored_where(self.mean[camera], mirrored)
        return ((unit_h33(bev_from_image.double()) - mean) / self.scale[camera]).flatten(1).float()

    def decode(self, code: Tensor, camera: Tensor) -> Tensor:
        """See `HomographyCode.decode`."""
        self.require_known(camera)
        return unit_h33(code.double().reshape(-1, 3, 3) * self.scale[camera] + self.mean[camera])


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
        self.scale_px[index] = places_px.std(0, correction=0).clamp(min=_LEAST_SHARE * height)

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

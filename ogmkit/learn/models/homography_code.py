"""What a network regresses in place of a homography, and back: standardised entries, or four points."""

from abc import ABC, abstractmethod
from typing import Self

import torch
from torch import Tensor, nn

from ogmkit.errors import SettingsError, TrainingError
from ogmkit.grid import GridSpec
from ogmkit.learn.models.projective import unit_h33
from ogmkit.samples.mirrors import bev_mirror, image_mirror

LEAST_SHARE = 1e-3
"""No factor is smaller than this share of what is typical: what never varies must not be blown up."""


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
        self.scale[index] = offsets.square().mean(0).sqrt().maximum(LEAST_SHARE * natural)

    def encode(self, bev_from_image: Tensor, camera: Tensor, mirrored: Tensor | None = None) -> Tensor:
        """See `HomographyCode.encode`."""
        self.require_known(camera)
        mean = self.mirrored_where(self.mean[camera], mirrored)
        return ((unit_h33(bev_from_image.double()) - mean) / self.scale[camera]).flatten(1).float()

    def decode(self, code: Tensor, camera: Tensor) -> Tensor:
        """See `HomographyCode.decode`."""
        self.require_known(camera)
        return unit_h33(code.double().reshape(-1, 3, 3) * self.scale[camera] + self.mean[camera])

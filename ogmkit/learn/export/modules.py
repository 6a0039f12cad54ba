"""Systems as they are exported: from an image to the answer, in operations that ONNX has."""

import torch
from torch import Tensor, nn

from ogmkit.errors import SettingsError
from ogmkit.learn.models.four_point_code import FourPointCode
from ogmkit.learn.models.homography_code import EntriesCode
from ogmkit.learn.models.projective import unit_h33
from ogmkit.learn.systems.base import System
from ogmkit.learn.systems.footprints import FootprintSystem
from ogmkit.learn.systems.homography import HomographySystem

_CYCLIC = ((1, 2, 0), (2, 0, 1))
"""Places of the factors of a cross product."""


class ExportedFootprints(nn.Module):
    """Probabilities of drivable area and vehicles in camera view."""

    output = "probabilities"

    def __init__(self, system: FootprintSystem) -> None:
        super().__init__()
        self.net = system.net

    def forward(self, image: Tensor) -> Tensor:
        """(B, 3, h, w) RGB, 0 … 1 → (B, 2, h, w) float32."""
        result: Tensor = self.net(image).sigmoid()
        return result


class ExportedHomography(nn.Module):
    """Homographies of the resized image's pixels, of scale |h33| = 1.

    ONNX has neither inverses nor solvers, so that the four-point head's answer is worked out in closed form.
    """

    output = "bev_from_image"

    def __init__(self, system: HomographySystem) -> None:
        super().__init__()
        self.net = system.net
        self.code = system.code

    def forward(self, image: Tensor, camera: Tensor | None = None) -> Tensor:
        """(B, 3, h, w) RGB, 0 … 1, and (B,) int64 cameras (None: the only one) → (B, 3, 3) float32."""
        if camera is None:
            camera = torch.zeros_like(image[:, 0, 0, 0], dtype=torch.int64)
        code = self.net(image).double()
        if isinstance(self.code, FourPointCode):
            seen = code.reshape(-1, 4, 2) * self.code.scale_px[camera] + self.code.mean_px[camera]
            matrix = through_four_points(seen, self.code.places_bev[camera])
        elif isinstance(self.code, EntriesCode):
            matrix = code.reshape(-1, 3, 3) * self.code.scale[camera] + self.code.mean[camera]
        else:
            raise SettingsError(f"homographies coded by {type(self.code).__name__} can't be exported")
        return unit_h33(matrix).float()


def exported(system: System) -> ExportedFootprints | ExportedHomography:
    """The module that is exported.

    Raises:
        SettingsError: the system can't be exported.
    """
    if isinstance(system, FootprintSystem):
        return ExportedFootprints(system)
    if isinstance(system, HomographySystem):
        return ExportedHomography(system)
    raise SettingsError(
        f"a run of {system.settings.system} can't be exported, only footprints and homography"
    )


def through_four_points(source: Tensor, destination: Tensor) -> Tensor:
    """The homographies that take four points to four others, in closed form (Hartley & Zisserman, 2.3).

    Each side's points are the images of the projective basis (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1); one
    map continues from where the other ended. The same as
    `ogmkit.learn.models.projective.through_four_points`, without a solver, and without its answer of NaN
    where points are on a line.

    Args:
        source: (B, 4, 2) float64, all in front of the camera.
        destination: (B, 4, 2) float64.

    Returns:
        (B, 3, 3) float64 of any scale, w > 0 at the sources.
    """
    source, source_centre = _centred(source)
    destination, destination_centre = _centred(destination)
    inner = _from_basis(destination) @ _adjugate(_from_basis(source))
    w = inner[:, 2, 2]  # at the mean of the sources, which lies in front as they do
    inner = inner / w[:, None, None]
    # (x, y) → (x + w·cx, y + w·cy) on the left, (x − cx, y − cy) on the right.
    last = inner[:, 2:]
    moved = torch.cat([inner[:, :2] + destination_centre.transpose(1, 2) * last, last], dim=1)
    third = moved[:, :, 2:] - moved[:, :, :2] @ source_centre.transpose(1, 2)
    return torch.cat([moved[:, :, :2], third], dim=2)


def _centred(points: Tensor) -> tuple[Tensor, Tensor]:
    """(B, 4, 2) points about their mean, and (B, 1, 2) means."""
    centre = points.mean(1, keepdim=True)
    return points - centre, centre


def _from_basis(points: Tensor) -> Tensor:
    """(B, 3, 3) that takes the projective basis to (B, 4, 2) points."""
    homogeneous = torch.cat([points, torch.ones_like(points[..., :1])], dim=-1)
    columns = homogeneous[:, :3].transpose(1, 2)
    weights = _adjugate(columns) @ homogeneous[:, 3:].transpose(1, 2)
    return columns * weights.transpose(1, 2)


def _adjugate(matrices: Tensor) -> Tensor:
    """(B, 3, 3) inverses times determinants: cross products of the columns, as rows."""
    first, second, third = matrices.unbind(2)
    return torch.stack([_cross(second, third), _cross(third, first), _cross(first, second)], dim=1)


def _cross(left: Tensor, right: Tensor) -> Tensor:
    """(B, 3) cross products, by entries: ONNX has no such operation."""
    ahead, behind = _CYCLIC
    return torch.stack(
        [left[:, i] * right[:, j] - left[:, j] * right[:, i] for i, j in zip(ahead, behind, strict=True)],
        dim=1,
    )

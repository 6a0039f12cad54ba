"""Perspective warps of maps to BEV, with gradients (paper, Footprint segmentation)."""

import torch
from kornia.geometry.transform import remap
from torch import Tensor

from ogmkit.geometry.camera import image_from_resized
from ogmkit.learn.models.projective import inverse_or_nan, unit_h33

_OUTSIDE_PX = -2.0
"""No pixel reaches so far, bilinear or nearest."""


def warp_to_bev(
    maps: Tensor, bev_from_image: Tensor, shape: tuple[int, int], *, mode: str = "bilinear"
) -> Tensor:
    """Lay camera-view maps on the grid by a homography: each cell takes what its centre sees in the image.

    Integers are centres of pixels and cells, as `cv2.warpPerspective` has it (`align_corners=True`).
    Coordinates are worked out in float64: entries of a homography span six orders of magnitude.

    Args:
        maps: (B, C, h, w) float.
        bev_from_image: (B, 3, 3) float64, of the maps' pixels, w > 0 for ground in front of the camera.
        shape: (rows, columns) of the grid.
        mode: `bilinear` or `nearest`.

    Returns:
        (B, C, rows, columns), float32 at least. Cells behind the camera (whose pixel would be above the
        horizon) or out of the image are 0, and so is a whole frame whose homography is singular or not
        finite; no gradient comes from there.
    """
    u, v = _pixels(bev_from_image, shape)
    maps = maps.to(torch.promote_types(maps.dtype, torch.float32))  # half-precision places are off by pixels
    height, width = maps.shape[-2:]
    u, v = u.clamp(_OUTSIDE_PX, width + 1).to(maps.dtype), v.clamp(_OUTSIDE_PX, height + 1).to(maps.dtype)
    return remap(maps, u, v, mode=mode, padding_mode="zeros", align_corners=True)


def rescaled(bev_from_image: Tensor, image_size: tuple[int, int], resized: tuple[int, int]) -> Tensor:
    """The homography of a resized image's pixels: the paper's S, put right (design.md §2).

    Args:
        bev_from_image: (B, 3, 3) float64.
        image_size: (height, width) of the image whose pixels it is of.
        resized: (height, width) of the resized copy.

    Returns:
        (B, 3, 3) float64 with |h33| = 1 again.
    """
    return unit_h33(bev_from_image @ bev_from_image.new_tensor(image_from_resized(image_size, resized)))


def _pixels(bev_from_image: Tensor, shape: tuple[int, int]) -> tuple[Tensor, Tensor]:
    """(B, rows, columns) u and v float64 of all cells' centres; out of any image where there is no pixel."""
    image_from_bev = inverse_or_nan(bev_from_image)
    regular = torch.isfinite(image_from_bev).all(-1).all(-1)[:, None, None]
    entries = torch.where(regular, image_from_bev, 1.0)[..., None, None]
    row = torch.arange(shape[0], dtype=entries.dtype, device=entries.device)[:, None]
    column = torch.arange(shape[1], dtype=entries.dtype, device=entries.device)
    u, v, w = (
        entries[:, axis, 0] * column + (entries[:, axis, 1] * row + entries[:, axis, 2]) for axis in range(3)
    )
    # The third coordinate of the inverse is 1/w: of the same sign.
    seen = regular & (w > 0)
    w = torch.where(seen, w, 1.0)
    return torch.where(seen, u / w, _OUTSIDE_PX), torch.where(seen, v / w, _OUTSIDE_PX)

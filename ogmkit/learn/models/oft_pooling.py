"""Image features averaged over the places of voxels in the image (Roddick, Kendall & Cipolla, BMVC 2019)."""

import torch
from torch import Tensor
from torch.nn import functional

from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec

_NEAREST_M = 0.1
_SMALLEST = 0.125
"""Side of the smallest box, in features: a difference of float32 sums over less would be noise. Features are
constant over their pixels, so that more than this changes nothing but at their edges."""


def voxel_corners(grid: GridSpec, heights_m: tuple[float, ...]) -> Tensor:
    """Corners of the voxels that stand on the grid's cells.

    Args:
        grid: of K cells.
        heights_m: L + 1 boundaries of the layers, above z = 0 of the level frame, upwards.

    Returns:
        (L + 1, rows + 1, columns + 1, 3) float64, metres in the level frame.

    Raises:
        SettingsError: there is no layer, or heights don't rise.
    """
    heights = torch.tensor(heights_m, dtype=torch.float64)
    if len(heights) < 2 or bool((heights.diff() <= 0).any()):
        raise SettingsError(f"heights of voxels {heights_m} are not two or more that rise")
    # An index is its cell's centre; corners are half a cell off.
    row = torch.arange(grid.rows + 1, dtype=torch.float64) - 0.5
    column = torch.arange(grid.columns + 1, dtype=torch.float64) - 0.5
    cells = torch.stack(torch.meshgrid(column, row, indexing="xy"), dim=-1)
    ground = torch.from_numpy(grid.positions_m(cells.numpy()))
    above = heights[:, None, None, None].expand(-1, *ground.shape[:2], 1)
    return torch.cat([ground.expand(len(heights), -1, -1, -1), above], dim=-1)


def voxel_boxes(corners_level: Tensor, intrinsics: Tensor, level_from_camera: Tensor) -> Tensor:
    """Boxes around the voxels' eight corners in the image.

    Args:
        corners_level: (L + 1, rows + 1, columns + 1, 3) float64, as `voxel_corners` gives them.
        intrinsics: (B, 3, 3) float64.
        level_from_camera: (B, 4, 4) float64.

    Returns:
        (B, L, rows, columns, 4) float64: left, top, right and bottom in pixels, counted from the image's top
        left *corner*, since a mean over pixels has to do with their edges. A voxel that reaches behind the
        camera (or within 0.1 m of its plane) has an empty box, all 0.
    """
    offsets = corners_level - level_from_camera[:, None, None, None, :3, 3]
    # A row vector times R is Rᵀ times it: camera from level.
    image_from_offset = level_from_camera[:, :3, :3] @ intrinsics.transpose(1, 2)
    places = offsets @ image_from_offset[:, None, None]
    depth_m = places[..., 2:]
    pixels = places[..., :2] / depth_m.clamp(min=_NEAREST_M) + 0.5
    # The eight corners of a voxel are a 2 × 2 × 2 window.
    extremes = torch.cat([-pixels, pixels, -depth_m], dim=-1).movedim(-1, 1)
    extremes = functional.max_pool3d(extremes, 2, stride=1)
    boxes = torch.cat([-extremes[:, :2], extremes[:, 2:4]], dim=1)
    in_front = extremes[:, 4:] < -_NEAREST_M
    return torch.where(in_front, boxes, 0.0).movedim(1, -1)


def integral_image(features: Tensor) -> Tensor:
    """Sums over all rectangles from the top left corner (Viola & Jones 2001).

    Args:
        features: (B, C, h, w).

    Returns:
        (B, C, h + 1, w + 1), float32 at least: [i, j] is the sum of features[:i, :j].
    """
    exact = features.to(torch.promote_types(features.dtype, torch.float32))
    return functional.pad(exact.cumsum(-1).cumsum(-2), (1, 0, 1, 0))


def box_means(integral: Tensor, boxes: Tensor, size: tuple[float, float]) -> Tensor:
    """Means over boxes; a feature counts by the share of its place that is in the box.

    That is exact: features being constant over their places, their integral is bilinear between its samples.

    Args:
        integral: (B, C, h + 1, w + 1), as `integral_image` gives it.
        boxes: (B, rows, columns, 4) left, top, right, bottom, in features counted from the top left corner.
        size: (height, width) ≤ (h, w) that boxes are clipped to: the image's, which the map's padding is not
            part of.

    Returns:
        (B, C, rows, columns); 0 where nothing of the box is inside.
    """
    limit = boxes.new_tensor([size[1], size[0]])
    low, high = boxes[..., :2].clamp(min=0), torch.minimum(boxes[..., 2:], limit)
    seen = (high > low).all(-1)
    middle, half = (low + high) / 2, ((high - low) / 2).clamp(min=_SMALLEST / 2)
    low, high = (middle - half).clamp(min=0), torch.minimum(middle + half, limit)
    area = torch.where(seen, (high - low).prod(-1), 1.0)
    (left, top), (right, bottom) = low.unbind(-1), high.unbind(-1)
    sums = (
        _sampled(integral, right, bottom)
        - _sampled(integral, left, bottom)
        - _sampled(integral, right, top)
        + _sampled(integral, left, top)
    )
    return sums * (seen / area)[:, None].to(sums.dtype)


def _sampled(integral: Tensor, x: Tensor, y: Tensor) -> Tensor:
    """(B, C, rows, columns) bilinear samples at (B, rows, columns) places."""
    height, width = (side - 1 for side in integral.shape[-2:])
    places = torch.stack([2 * x / width - 1, 2 * y / height - 1], dim=-1).to(integral.dtype)
    return functional.grid_sample(integral, places, padding_mode="border", align_corners=True)

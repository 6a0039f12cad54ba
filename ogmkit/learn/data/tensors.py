"""Samples as tensors, by the names that networks know.

Levels and masks are bytes until they are where networks are: a quarter of what floats take to move.
"""

import cv2
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ogmkit.grid import GridSpec
from ogmkit.samples.arrays import SampleArrays
from ogmkit.samples.coarse import majority
from ogmkit.samples.lidar_image import lidar_image
from ogmkit.typing import UInt8Array

Sample = dict[str, Tensor]

_PER_LEVEL = float(np.float32(1 / 255))


def as_float(sample: Sample) -> Sample:
    """The sample, or batch, with levels 0 … 255 of images as 0 … 1, and masks as 0 and 1, float32."""
    floats = {name: value.float() for name, value in sample.items() if value.dtype == torch.uint8}
    if "image" in floats:
        floats["image"] *= _PER_LEVEL
    return sample | floats


def per_frame_tensors(arrays: SampleArrays, own_grid: GridSpec | None, factor: int) -> Sample:
    """The parts that belong to an image, with a leading axis of T; levels and masks are uint8.

    Args:
        arrays: what was read.
        own_grid: of BEV truth and LiDAR images.
        factor: cells of the shard's grid along the side of one of the own grid's.
    """
    sample: Sample = {}
    if arrays.image is not None:
        sample["image"] = _image_tensor(arrays.image)
    if arrays.masks is not None:
        sample["masks"] = _bytes(arrays.masks)
    if arrays.known_pixels is not None:
        sample["masks_known"] = _bytes(arrays.known_pixels)
    if arrays.bev is not None and arrays.known_columns is not None:
        sample["bev"] = _bytes(majority(arrays.bev, factor))
        known = _bytes(np.all(arrays.known_columns.reshape(-1, factor), axis=1))
        frames, _, rows, columns = sample["bev"].shape
        sample["bev_known"] = known.expand(frames, rows, columns)
    if arrays.bev_parts is not None:
        sample["bev_parts"] = float32_tensor(arrays.bev_parts)
    if arrays.points_level is not None and own_grid is not None:
        images = np.stack([lidar_image(points, own_grid) for points in arrays.points_level])
        sample["lidar"] = torch.from_numpy(images)
    for name in ("bev_from_image", "homography_valid", "intrinsics", "level_from_camera"):
        value = getattr(arrays, name)
        if value is not None:
            sample[name] = torch.from_numpy(value)
    if arrays.features is not None:
        sample["features"] = float32_tensor(arrays.features[:, 0])
    return sample


def trajectory_tensors(arrays: SampleArrays) -> Sample:
    """Past and future of the last frame."""
    if arrays.past is None or arrays.future is None or arrays.trajectory_valid is None:
        return {}
    return {
        "past": float32_tensor(arrays.past),
        "future": float32_tensor(arrays.future),
        "trajectory_valid": torch.tensor(bool(arrays.trajectory_valid)),
    }


def positions_tensor(arrays: SampleArrays) -> Sample:
    """Where the ego was at each image."""
    return {} if arrays.positions is None else {"positions": float32_tensor(arrays.positions)}


def _image_tensor(images: UInt8Array) -> Tensor:
    """(T, 3, h, w) uint8 of (T, h, w, 3): by plane, since numpy is slow over every third byte."""
    frames, height, width, channels = images.shape
    planes = np.empty((frames, channels, height, width), np.uint8)
    for image, own in zip(images, planes, strict=True):
        cv2.split(image, list(own))
    return torch.from_numpy(planes)


def _bytes(array: NDArray[np.generic]) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(array, np.uint8))


def float32_tensor(array: NDArray[np.generic]) -> Tensor:
    """Converted by numpy: the pages that it takes are large, so a raster's are mapped much faster."""
    return torch.from_numpy(array.astype(np.float32, order="C"))

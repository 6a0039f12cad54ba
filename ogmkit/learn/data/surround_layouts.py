"""Samples round the vehicle by the names and shapes that networks of other repositories take.

Names, shapes and orders are read from these repositories' loaders. What differs from them: pixels are resized
corner on corner and their centres are integers, so matrices have the half pixel that theirs leave out; each
camera's transform leads through its own ego pose to that of the sweep, which theirs do in cross-view
transformers only.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ogmkit.geometry.se3 import inverse
from ogmkit.labels.centres import array_from_plane
from ogmkit.labels.definition import Definition
from ogmkit.learn.data.tensors import Sample, float32_tensor
from ogmkit.samples.images import IMAGENET_STATISTICS
from ogmkit.samples.surround_reading import SurroundArrays
from ogmkit.samples.surround_spec import Layout
from ogmkit.typing import FloatArray

_Value = TypeVar("_Value", bound=np.generic)

EYE_M = 1.5
"""Height of the virtual camera that Simple-BEV's grid hangs on."""
_LEAST_VISIBLE = 2
"""Visibility level from which on Simple-BEV counts the cells of a box."""


def ogmkit_layout(arrays: SurroundArrays, definition: Definition) -> Sample:
    """As `SurroundDataset` describes it."""
    del definition
    return {
        "image": _images(arrays),
        "intrinsics": torch.from_numpy(arrays.cropped_intrinsics),
        "reference_from_camera": torch.from_numpy(arrays.reference_from_camera),
        "labels": float32_tensor(arrays.labels),
        "visibility": torch.from_numpy(arrays.visibility),
        "nearness": torch.from_numpy(arrays.nearness),
        "seen": torch.from_numpy(arrays.seen),
    }


def lss_layout(arrays: SurroundArrays, definition: Definition) -> Sample:
    """What `nv-tlabs/lift-splat-shoot` takes, in its order: `imgs, rots, …, binimg, _ = batch.values()`.

    - `imgs`: (C, 3, h, w) float32, less ImageNet's mean, by its deviation.
    - `rots`: (C, 3, 3) and `trans`: (C, 3) float32, from the camera to the frame of reference.
    - `intrins`: (C, 3, 3) float32 of the image files.
    - `post_rots`: (C, 3, 3) and `post_trans`: (C, 3) float32, from pixels of the files to those of `imgs`.
    - `binimg`: (K, rows, columns) float32 0/1; rows grow ahead, columns to the left.
    """
    mean, deviation = (torch.tensor(IMAGENET_STATISTICS[name])[:, None, None] for name in ("mean", "std"))
    post_rots, post_trans = arrays.cropped_from_image.copy(), arrays.cropped_from_image[:, :, 2].copy()
    post_rots[:, :2, 2] = post_trans[:, 2] = 0.0
    return {
        "imgs": (_images(arrays) - mean) / deviation,
        "rots": float32_tensor(arrays.reference_from_camera[:, :3, :3]),
        "trans": float32_tensor(arrays.reference_from_camera[:, :3, 3]),
        "intrins": float32_tensor(arrays.intrinsics),
        "post_rots": float32_tensor(post_rots),
        "post_trans": float32_tensor(post_trans),
        "binimg": float32_tensor(_turned(arrays.labels, definition, 1, 1)),
    }


def cvt_layout(arrays: SurroundArrays, definition: Definition) -> Sample:
    """What `bradyz/cross_view_transformers` takes.

    - `image`: (C, 3, h, w) float32, 0 … 1; `intrinsics`: (C, 3, 3) float32 of it.
    - `extrinsics`: (C, 4, 4) float32, from the frame of reference to the camera.
    - `bev`: (K, rows, columns) float32 0/1; rows lead back, columns to the right.
    - `view`: (3, 3) float32, from (x, y, 1) in metres to (column, row, 1) of `bev`.
    - `center`: (1, rows, columns) float32 exp(−d²), d cells from a box's centre; 0 without one.
    - `visibility`: (rows, columns) uint8, the level of the box drawn last, 255 for none.
    """
    return {
        "image": _images(arrays),
        "intrinsics": float32_tensor(arrays.cropped_intrinsics),
        "extrinsics": float32_tensor(inverse(arrays.reference_from_camera)),
        "bev": float32_tensor(_turned(arrays.labels, definition, -1, -1)),
        "view": float32_tensor(_turn(definition, -1, -1) @ array_from_plane(definition)),
        "center": float32_tensor(_turned(arrays.nearness[None], definition, -1, -1)),
        "visibility": torch.from_numpy(_turned(arrays.visibility, definition, -1, -1)),
    }


def simple_bev_layout(arrays: SurroundArrays, definition: Definition) -> Sample:
    """What `aharley/simple_bev` takes: the arguments of its `Segnet` by their names, and what its loss takes.

    Its grid hangs on a camera that it chooses at random. Here that is a virtual one, level and `EYE_M` over
    the frame of reference's origin, that looks ahead; no image is its.

    - `rgb_camXs`: (C, 3, h, w) float32, −0.5 … 0.5.
    - `pix_T_cams`: (C, 4, 4) float32, intrinsics of it.
    - `cam0_T_camXs`: (C, 4, 4) float32, from the camera to the virtual one: x right, y down, z ahead.
    - `seg_bev_g`: (K, Z, X) float32 0/1; rows grow ahead, columns to the right.
    - `valid_bev_g`: (1, Z, X) float32 0/1, 0 on boxes of visibility 1.
    """
    cameras = len(arrays.intrinsics)
    pix_from_camera = np.tile(np.eye(4), (cameras, 1, 1))
    pix_from_camera[:, :3, :3] = arrays.cropped_intrinsics
    eye_from_reference = np.array([[0, -1, 0, 0], [0, 0, -1, EYE_M], [1, 0, 0, 0], [0, 0, 0, 1.0]])
    visibility = _turned(arrays.visibility, definition, 1, -1)
    return {
        "rgb_camXs": _images(arrays) - 0.5,
        "pix_T_cams": float32_tensor(pix_from_camera),
        "cam0_T_camXs": float32_tensor(eye_from_reference @ arrays.reference_from_camera),
        "seg_bev_g": float32_tensor(_turned(arrays.labels, definition, 1, -1)),
        "valid_bev_g": float32_tensor((visibility >= _LEAST_VISIBLE)[None]),
    }


LAYOUTS: Mapping[Layout, Callable[[SurroundArrays, Definition], Sample]] = MappingProxyType(
    {"ogmkit": ogmkit_layout, "lss": lss_layout, "cvt": cvt_layout, "simple-bev": simple_bev_layout}
)
"""Layout → what makes its tensors of a sample."""


def _images(arrays: SurroundArrays) -> Tensor:
    """(C, 3, h, w) float32, 0 … 1."""
    return float32_tensor(arrays.image.transpose(0, 3, 1, 2)) / 255


def _turned(
    array: NDArray[_Value], definition: Definition, row_sign: int, column_sign: int
) -> NDArray[_Value]:
    """(…, rows, columns) with the coordinates of rows and columns growing, or falling, as signs say."""
    axes = (definition.grid.rows, row_sign), (definition.grid.columns, column_sign)
    down, across = (1 if axis.step_m * sign > 0 else -1 for axis, sign in axes)
    return np.ascontiguousarray(array[..., ::down, ::across])


def _turn(definition: Definition, row_sign: int, column_sign: int) -> FloatArray:
    """(3, 3) from (column, row, 1) of an array to those of the same turned."""
    matrix = np.eye(3)
    for place, axis, sign in ((0, definition.grid.columns, column_sign), (1, definition.grid.rows, row_sign)):
        if axis.step_m * sign < 0:
            matrix[place, place], matrix[place, 2] = -1.0, axis.cells - 1.0
    return matrix

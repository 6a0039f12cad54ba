"""Cameras turned about their own centre: what they would see with another pitch and roll."""

from dataclasses import replace
from math import cos, sin
from typing import Any

import cv2
import numpy as np

from ogmkit.samples.arrays import SampleArrays, scaled
from ogmkit.typing import FloatArray, UInt8Array


def turned(sample: SampleArrays, pitch_rad: float, roll_rad: float) -> SampleArrays:
    """The sample with each camera turned; the world stays where it is.

    A turn about the centre of projection moves pixels by K · R · K⁻¹, whatever they show (Hartley &
    Zisserman, 8.4.2). Pixels that come from outside repeat the image's edge, and `known_pixels` is 0 there.

    Args:
        sample: with `intrinsics`; is left as it is.
        pitch_rad: downwards, about the camera's x axis.
        roll_rad: clockwise as the camera sees it, about its z axis.
    """
    new_from_old = _camera_rotation(pitch_rad, roll_rad)
    intrinsics = np.asarray(sample.intrinsics, np.float64)
    maps = intrinsics @ new_from_old @ np.linalg.inv(intrinsics)
    changes: dict[str, Any] = {}
    if sample.image is not None:
        changes["image"] = _each_seen(sample.image, maps, cv2.INTER_LINEAR, cv2.BORDER_REPLICATE)
    if sample.masks is not None:
        known = np.ones((len(maps), *sample.masks.shape[-2:]), np.uint8)
        pictures = np.concatenate([sample.masks, known[:, None]], axis=1)
        seen = np.stack(
            [
                _each_seen(layers, [matrix] * len(layers), cv2.INTER_NEAREST, cv2.BORDER_CONSTANT)
                for layers, matrix in zip(pictures, maps, strict=True)
            ]
        )
        changes["masks"], changes["known_pixels"] = seen[:, :-1], seen[:, -1]
    if sample.bev_from_image is not None:
        changes["bev_from_image"] = scaled(sample.bev_from_image @ np.linalg.inv(maps))
    if sample.level_from_camera is not None:
        old_from_new = np.eye(4)
        old_from_new[:3, :3] = new_from_old.T
        changes["level_from_camera"] = sample.level_from_camera @ old_from_new
    return replace(sample, **changes)


def _camera_rotation(pitch_rad: float, roll_rad: float) -> FloatArray:
    """(3, 3) points in the turned camera from points in the camera: x right, y down, z ahead."""
    pitch = [[1, 0, 0], [0, cos(pitch_rad), -sin(pitch_rad)], [0, sin(pitch_rad), cos(pitch_rad)]]
    roll = [[cos(roll_rad), sin(roll_rad), 0], [-sin(roll_rad), cos(roll_rad), 0], [0, 0, 1]]
    rotation: FloatArray = np.array(roll) @ np.array(pitch)
    return rotation


def _each_seen(
    pictures: UInt8Array, maps: FloatArray | list[FloatArray], interpolation: int, border: int
) -> UInt8Array:
    """(T, h, w[, C]) pictures, each through its (3, 3) map of old pixels to new."""
    size = pictures.shape[2], pictures.shape[1]
    seen = [
        cv2.warpPerspective(picture, matrix, size, flags=interpolation, borderMode=border)
        for picture, matrix in zip(pictures, maps, strict=True)
    ]
    return np.asarray(np.stack(seen), np.uint8)

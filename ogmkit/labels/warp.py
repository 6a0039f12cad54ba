"""Motion between frames and maps warped by it, in float32 as FIERY computes them."""

import numpy as np
from numpy.typing import NDArray

from ogmkit.typing import Float32Array, FloatArray, IntArray

_HALF_EXTENT_M = 50.0


def egomotion(global_from_ego: FloatArray, global_from_next: FloatArray) -> Float32Array:
    """(4, 4) float32 from a frame into the next, from absolute poses in float32: errors reach 0.4 mm."""
    here, there = global_from_ego.astype(np.float32), global_from_next.astype(np.float32)
    motion: Float32Array = inverted(there) @ here
    motion[3] = [0, 0, 0, 1]
    return motion


def inverted(pose: Float32Array) -> Float32Array:
    """The inverse of a (4, 4) float32 pose, in float32."""
    result = np.eye(4, dtype=np.float32)
    result[:3, :3] = pose[:3, :3].T
    result[:3, 3] = -(pose[:3, :3].T @ pose[:3, 3])
    return result


def vector_of(matrix: Float32Array) -> Float32Array:
    """(6,) float32 of a (4, 4) pose: translation, then the angles of R = Rx·Ry·Rz."""
    rx = np.arctan2(-matrix[1, 2], matrix[2, 2])
    ry = np.arctan2(matrix[0, 2], np.sqrt(matrix[1, 2] ** 2 + matrix[2, 2] ** 2))
    rz = np.arctan2(-matrix[0, 1], matrix[0, 0])
    return np.array([*matrix[:3, 3], rx, ry, rz], dtype=np.float32)


def matrix_of(vector: Float32Array) -> Float32Array:
    """The inverse of `vector_of`."""
    result = np.eye(4, dtype=np.float32)
    rx, ry, rz = vector[3:]
    about_x = _turn(rx, (1, 2))
    about_y = _turn(ry, (2, 0))
    about_z = _turn(rz, (0, 1))
    result[:3, :3] = about_x @ about_y @ about_z
    result[:3, 3] = vector[:3]
    return result


def warped(array: IntArray, vector: Float32Array) -> IntArray:
    """A (rows, columns) map moved by a motion: nearest cells, 0 where they lie outside.

    It turns about the array's middle, half a cell from the point that labels turn about.
    """
    rows, columns = array.shape
    step = np.float32(2)
    y = ((step * np.arange(rows, dtype=np.float32) + 1) / rows - 1)[:, None]
    x = ((step * np.arange(columns, dtype=np.float32) + 1) / columns - 1)[None, :]
    cos, sin = np.cos(vector[5]), np.sin(vector[5])
    u = cos * x - sin * y + vector[1] / np.float32(_HALF_EXTENT_M)
    w = sin * x + cos * y - vector[0] / np.float32(_HALF_EXTENT_M)
    column, row = _nearest(u, columns), _nearest(w, rows)
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    moved: IntArray = np.where(inside, array[np.where(inside, row, 0), np.where(inside, column, 0)], 0)
    return moved


def _nearest(share: Float32Array, cells: int) -> NDArray[np.int64]:
    result: NDArray[np.int64] = np.round(((share + 1) * cells - 1) / 2).astype(np.int64)
    return result


def _turn(angle: np.float32, axes: tuple[int, int]) -> Float32Array:
    """(3, 3) float32: from the first axis toward the second."""
    result = np.eye(3, dtype=np.float32)
    one, other = axes
    result[one, one] = result[other, other] = np.cos(angle)
    result[other, one] = np.sin(angle)
    result[one, other] = -np.sin(angle)
    return result

"""The frame's LiDAR points, moved to the camera's time (design.md §5)."""

from pathlib import Path

import numpy as np

from ogmkit.base.files import fault_of, is_lfs_pointer, read_bytes
from ogmkit.errors import DataFileError, FrameFileError
from ogmkit.frames import FrameRecord
from ogmkit.geometry.se3 import transform_points
from ogmkit.nuscenes.paths import resolve
from ogmkit.typing import Float32Array, FloatArray

_VALUES = 5  # x, y, z, intensity, ring
_BYTES_PER_POINT = 4 * _VALUES


def lidar_points_level(frame: FrameRecord) -> Float32Array:
    """Read the frame's sweep and move it through `global` into the frame's level coordinates.

    The sweep has a pose of its own, some tens of milliseconds from the camera's.

    Returns:
        (P, 4) float32: x, y, z in metres, level frame, and intensity; points that are not finite left out.

    Raises:
        FrameFileError: the frame has no sweep, or its file is absent, empty or not a whole number of points.
        DataFileError: the system refuses to read it.
    """
    if frame.lidar is None:
        raise FrameFileError(
            f"sample {frame.sample_token}: has no LiDAR sweep; extract without --lidar and --seen lidar",
            kind="LiDAR sweep is absent",
        )
    path = resolve(frame.dataroot, frame.lidar.path)
    remedy = (
        f"restore the sweep of sample {frame.sample_token}, or leave out such scenes (--only-complete), such "
        "frames (--skip-bad-frames) or all points: extract without --lidar and --seen lidar"
    )
    return moved_points(frame.level_from_global @ frame.lidar.global_from_lidar, read_points(path, remedy))


def read_points(path: Path, remedy: str) -> Float32Array:
    """Read a sweep in nuScenes' layout: five little-endian float32 a point.

    Args:
        path: the file.
        remedy: what messages tell to do.

    Returns:
        (P, 4) float32: x, y, z in metres, LiDAR frame, and intensity; points that are not finite left out.

    Raises:
        FrameFileError: the file is absent, empty or not a whole number of points.
        DataFileError: the system refuses to read it.
    """
    try:
        data = read_bytes(path)
    except OSError as error:
        state = fault_of(error)
        fault = DataFileError if state == "unreadable" else FrameFileError
        raise fault(
            f"{path}: can't be read ({error.strerror}); {remedy}", kind=f"LiDAR sweep is {state}"
        ) from error
    if is_lfs_pointer(data):
        raise FrameFileError(f"{path}: a git-LFS pointer; run git lfs pull", kind="LiDAR sweep is absent")
    if not data or len(data) % _BYTES_PER_POINT:
        raise FrameFileError(
            f"{path}: {len(data)} bytes are not whole points of 5 float32; {remedy}",
            kind="LiDAR sweep is damaged",
        )
    points: Float32Array = np.frombuffer(data, "<f4").reshape(-1, _VALUES)[:, :4]
    return points[np.isfinite(points).all(axis=1)]


def moved_points(level_from_lidar: FloatArray, points: Float32Array) -> Float32Array:
    """(P, 4) points of the LiDAR frame in the level frame, by a (4, 4) transform; intensities stay."""
    # In float64: global coordinates reach kilometres, the result is centimetres and small again.
    points_level = transform_points(level_from_lidar, points[:, :3].astype(np.float64))
    return np.column_stack([points_level, points[:, 3]]).astype(np.float32)

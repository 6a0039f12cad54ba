"""Reading frames of a camera from a shard, at the size that is wanted."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from ogmkit.base.files import read_bytes
from ogmkit.errors import DataFileError
from ogmkit.geometry.camera import image_from_resized
from ogmkit.geometry.se3 import transform_points
from ogmkit.nuscenes.paths import resolve
from ogmkit.samples.arrays import SampleArrays, scaled
from ogmkit.samples.images import decode_resized
from ogmkit.samples.pooling import Counts, part_counts, shares
from ogmkit.samples.spec import TARGETS, SampleSpec
from ogmkit.shards.faults import damaged
from ogmkit.shards.reader import Shard
from ogmkit.typing import Float32Array, IntArray, UInt8Array


@dataclass(frozen=True, eq=False)
class Rows:
    """Frames of a camera in an open shard.

    Attributes:
        shard: the open shard.
        camera: channel.
        rows: which of the camera's frames, in temporal order.
    """

    shard: Shard
    camera: str
    rows: Sequence[int]

    def column(self, name: str) -> Any:  # noqa: ANN401  # arrays of several dtypes
        """The frames' rows of a dataset."""
        return self.shard.dataset(self.camera, name)[self._selection]

    def texts(self, name: str) -> tuple[str, ...]:
        """The frames' rows of a text dataset."""
        return self.shard.strings(self.camera, name, self._selection)

    def places(self) -> tuple[str, ...]:
        """What messages call the frames."""
        return tuple(f"{self.shard.path}: {self.camera} frame {frame}" for frame in self.rows)

    @cached_property
    def _selection(self) -> slice | list[int]:
        """What h5py reads: a slice, much the faster, where frames are evenly spaced."""
        distances = {later - earlier for earlier, later in pairwise(self.rows)} or {1}
        if len(distances) > 1:
            return list(self.rows)
        return slice(self.rows[0], self.rows[-1] + 1, distances.pop())


Pixels = dict[str, UInt8Array]
"""`image` (T, h, w, 3) and `masks` (T, 2, h, w), as far as they are wanted."""


def read_pixels(frames: Rows, spec: SampleSpec, image_root: Path | None) -> Pixels:
    """Read images and masks, which take most of a sample's time; arguments and errors as of `read_sample`."""
    with _damage_named(frames):
        return _pixels(frames, spec, image_root, *_sizes(frames, spec))


def read_sample(
    frames: Rows, spec: SampleSpec, image_root: Path | None, pixels: Pixels | None = None
) -> SampleArrays:
    """Read what a specification asks for, and no more.

    Args:
        frames: of the sample; trajectories are the last one's.
        spec: what to read.
        image_root: where paths of images begin; None where shards hold the images themselves.
        pixels: what `read_pixels` gives of the frames, where it is there already.

    Raises:
        ShardError: the shard is damaged or lacks something.
        DataFileError: an image is absent, damaged or of another size than its record.
    """
    with _damage_named(frames):
        source_size, size = _sizes(frames, spec)
        found = _pixels(frames, spec, image_root, source_size, size) if pixels is None else pixels
        parts: dict[str, Any] = {**found}
        if spec.bev:
            parts["bev"] = _bev(frames, spec.rasters)
            parts["known_columns"] = np.ones(parts["bev"].shape[-1], np.bool_)
        if spec.bev_parts is not None:
            bev = _bev(frames, TARGETS)
            parts["bev_parts"] = shares(part_counts(bev, spec.bev_parts), bev.shape[-2:])
        if spec.lidar:
            parts["points_level"] = _points(frames)
        return SampleArrays(
            size, **parts, **_geometry(frames, spec, source_size, size), **_motion(frames, spec)
        )


def read_part_counts(frames: Rows, parts: tuple[int, int]) -> Counts:
    """(T, 2, r, c) how many cells of each of r × c equal parts of the grid are drivable, and vehicles.

    Raises:
        ShardError: the shard is damaged or lacks something.
    """
    with _damage_named(frames):
        return part_counts(_bev(frames, TARGETS), parts)


@contextmanager
def _damage_named(frames: Rows) -> Iterator[None]:
    try:
        yield
    except (OSError, RuntimeError) as error:
        raise damaged(frames.shard.path, error) from error


def _pixels(
    frames: Rows, spec: SampleSpec, image_root: Path | None, source_size: IntArray, size: IntArray
) -> Pixels:
    pixels: Pixels = {}
    if spec.image_size is not None and spec.image:
        pixels["image"] = _images(frames, image_root, source_size, spec.image_size)
    if spec.masks is not None:
        pixels["masks"] = _masks(frames, spec.masks, size)
    return pixels


def _sizes(frames: Rows, spec: SampleSpec) -> tuple[IntArray, IntArray]:
    """(T, 2) heights and widths of the images as they are, and as they are wanted."""
    source_size = frames.column("image_size")
    wanted = source_size if spec.image_size is None else np.tile(spec.image_size, (len(source_size), 1))
    return source_size, wanted


def _bev(frames: Rows, names: Sequence[str]) -> UInt8Array:
    """(T, K, rows, columns) of K rasters."""
    return np.stack([frames.column(name) for name in names], axis=1)


def _images(
    frames: Rows, image_root: Path | None, source_size: IntArray, size: tuple[int, int]
) -> UInt8Array:
    if image_root is None:
        files, places = frames.column("image"), frames.places()
    else:
        paths = [resolve(image_root, name) for name in frames.texts("image_path")]
        files, places = [_file(path) for path in paths], tuple(map(str, paths))
    images = np.empty((len(source_size), *size, 3), np.uint8)
    for image, file, source, place in zip(images, files, source_size, places, strict=True):
        image[...] = decode_resized(file, _pair(source), size, place)
    return images


def _file(path: Path) -> UInt8Array:
    try:
        return np.frombuffer(read_bytes(path), np.uint8)
    except OSError as error:
        raise DataFileError(
            f"{path}: image can't be read ({error.strerror}); bring the dataset back, or extract with "
            "--images bytes"
        ) from error


def _masks(frames: Rows, name: str, size: IntArray) -> UInt8Array:
    """(T, 2, h, w): of each resized pixel's centre, the nearest pixel of the set's masks."""
    masks = np.stack([frames.column(f"footprints/{name}/{target}") for target in TARGETS], axis=1)
    height, width = _pair(size[0])
    if (height, width) == masks.shape[-2:]:
        return masks
    resized = np.empty((*masks.shape[:2], height, width), np.uint8)
    for place in np.ndindex(masks.shape[:2]):
        cv2.resize(masks[place], (width, height), resized[place], interpolation=cv2.INTER_NEAREST_EXACT)
    return resized


def _points(frames: Rows) -> tuple[Float32Array, ...]:
    """Each frame's points."""
    offsets, points = (frames.shard.dataset(frames.camera, f"lidar/{name}") for name in ("offsets", "points"))
    return tuple(points[slice(*offsets[row : row + 2])] for row in frames.rows)


def _geometry(frames: Rows, spec: SampleSpec, source_size: IntArray, size: IntArray) -> dict[str, Any]:
    """Homographies and calibration of the resized images."""
    parts: dict[str, Any] = {}
    pairs = zip(source_size, size, strict=True)
    image_from_pixels = np.stack([image_from_resized(_pair(source), _pair(own)) for source, own in pairs])
    if spec.homography is not None:
        group = f"homography/{spec.homography}"
        parts["bev_from_image"] = scaled(frames.column(f"{group}/bev_from_image") @ image_from_pixels)
        parts["homography_valid"] = frames.column(f"{group}/valid")
    if spec.calibration:
        to_level, to_global, to_ego = (
            frames.column(name) for name in ("level_from_global", "global_from_ego", "ego_from_camera")
        )
        parts["intrinsics"] = np.linalg.inv(image_from_pixels) @ frames.column("intrinsics")
        parts["level_from_camera"] = to_level @ to_global @ to_ego
    return parts


def _motion(frames: Rows, spec: SampleSpec) -> dict[str, Any]:
    """Past and future of the last frame, and where the ego was at each."""
    if not spec.trajectory:
        return {}
    positions_global = frames.column("global_from_ego")[:, :3, 3]
    level_from_global = frames.column("level_from_global")[-1]
    return {
        "past": frames.column("trajectory/past")[-1],
        "future": frames.column("trajectory/future")[-1],
        "trajectory_valid": frames.column("trajectory/valid")[-1],
        "positions": transform_points(level_from_global, positions_global)[:, :2],
    }


def _pair(size: IntArray) -> tuple[int, int]:
    height, width = (int(side) for side in size)
    return height, width

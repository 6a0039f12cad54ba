"""What one frame of a shard shows: read for drawing, with poses already in the camera's frame."""

import io
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from ogmkit.base.files import read_bytes
from ogmkit.errors import DataFileError
from ogmkit.geometry.se3 import inverse
from ogmkit.nuscenes.paths import resolve
from ogmkit.shards.faults import REMEDY
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema_further import further_rasters
from ogmkit.typing import FloatArray, UInt8Array


@dataclass(frozen=True, eq=False)
class View:
    """One frame, ready to be drawn; M boxes.

    Attributes:
        index: place among the camera's frames.
        time_s: since the camera's first frame.
        image: (h, w, 3) uint8 RGB, perhaps reduced; None where the shard holds no image.
        image_size: (height, width) that the intrinsics refer to.
        intrinsics: (3, 3).
        camera_from_box: (M, 4, 4).
        size_wlh: (M, 3) metres.
        category: M full names.
        drivable: (rows, columns) uint8 0/1; all 0 where the shard was made without maps.
        vehicles: (rows, columns) uint8 0/1.
        field_of_view: as `vehicles`.
        past: (6, 2) metres in the level frame, oldest first; NaN where there is none.
        future: (6, 2), as `past`.
        further: rasters beside the paper's, by their names in the shard; none unless asked for.
    """

    index: int
    time_s: float
    image: UInt8Array | None
    image_size: tuple[int, int]
    intrinsics: FloatArray
    camera_from_box: FloatArray
    size_wlh: FloatArray
    category: tuple[str, ...]
    drivable: UInt8Array
    vehicles: UInt8Array
    field_of_view: UInt8Array
    past: FloatArray
    future: FloatArray
    further: Mapping[str, Any] = field(default_factory=dict)


def evenly(count: int, of: int) -> tuple[int, ...]:
    """At most `count` indices below `of`: the middles of equal parts, since the ends lack past or future."""
    count = min(count, of)
    return tuple((2 * part + 1) * of // (2 * count) for part in range(count))


def read_view(
    shard: Shard, camera: str, index: int, *, dataroot: Path | None = None, further: bool = False
) -> View:
    """Read one frame.

    Args:
        shard: an open shard.
        camera: channel.
        index: the frame's place among the camera's.
        dataroot: where images are found that the shard only refers to; None leaves them out.
        further: read what lies beside the paper's targets, too.

    Raises:
        ShardError: the shard lacks something.
        DataFileError: an image is absent, or no JPEG of the size that the shard says.
        TableError: an image's path leaves `dataroot`.
        OSError: a part of the shard is damaged.
    """

    def row(name: str) -> Any:  # noqa: ANN401  # arrays and scalars of several dtypes
        return shard.dataset(camera, name)[index]

    boxes, drivable = shard.boxes(camera, index), shard.drivable(camera, index)
    names = further_rasters(shard.settings.targets) if further else ()
    height, width = row("image_size").tolist()
    first_us = int(shard.dataset(camera, "timestamp_us")[0])
    return View(
        index=index,
        time_s=(int(row("timestamp_us")) - first_us) / 1e6,
        image=_image(shard, camera, index, (height, width), dataroot),
        image_size=(height, width),
        intrinsics=row("intrinsics"),
        camera_from_box=inverse(row("global_from_ego") @ row("ego_from_camera")) @ boxes.global_from_box,
        size_wlh=boxes.size_wlh,
        category=boxes.category,
        drivable=np.zeros(shard.grid.shape, np.uint8) if drivable is None else drivable,
        vehicles=row("vehicles"),
        field_of_view=row("field_of_view"),
        past=row("trajectory/past"),
        future=row("trajectory/future"),
        further={name: row(name) for name in names},
    )


def _image(
    shard: Shard, camera: str, index: int, size: tuple[int, int], dataroot: Path | None
) -> UInt8Array | None:
    """The frame's picture from the shard, else from the dataset, else None."""
    found = _file(shard, camera, index, dataroot)
    return None if found is None else _decode(size, *found)


def image_file(
    shard: Shard, camera: str, index: int, size: tuple[int, int], dataroot: Path | None
) -> bytes | None:
    """The frame's JPEG file from the shard, else from the dataset, else None; it is whole.

    Args:
        shard: an open shard.
        camera: channel.
        index: the frame's place among the camera's.
        size: (height, width) that it must have.
        dataroot: where images are found that the shard only refers to.

    Raises:
        ShardError, DataFileError, TableError: as of `read_view`.
    """
    found = _file(shard, camera, index, dataroot)
    if found is None:
        return None
    _decode(size, *found)
    return found[0]


def _file(shard: Shard, camera: str, index: int, dataroot: Path | None) -> tuple[bytes, str, str] | None:
    """An image file's bytes, where they are from, and what to do where they are bad."""
    stored = shard.image(camera, index)
    if stored is not None:
        return stored.tobytes(), f"{shard.path}: {camera}/image[{index}]", REMEDY
    if dataroot is None:
        return None
    path = resolve(dataroot, shard.strings(camera, "image_path", slice(index, index + 1))[0])
    remedy = "restore it, or leave --dataroot out"
    try:
        return read_bytes(path), str(path), remedy
    except OSError as error:
        raise DataFileError(f"{path}: {error.strerror}; {remedy}") from error


def _decode(size: tuple[int, int], data: bytes, place: str, remedy: str) -> UInt8Array:
    """RGB pixels of a JPEG; its header is checked before anything of its size is allocated."""
    try:
        with Image.open(io.BytesIO(data), formats=("JPEG",)) as picture:
            found = picture.height, picture.width
            if found == size:
                return np.asarray(picture.convert("RGB"))
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:
        reason = getattr(error, "strerror", None) or "is not a whole JPEG or PNG"
        raise DataFileError(f"{place}: {reason}; {remedy}") from error
    shown, expected = (f"{width} × {height}" for height, width in (found, size))
    raise DataFileError(f"{place}: is {shown} pixels, by its record {expected}; {remedy}")

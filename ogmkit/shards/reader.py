"""Reading a shard: its attributes checked, its datasets by name."""

import json
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np

from ogmkit.errors import SettingsError, ShardError
from ogmkit.frames import Boxes
from ogmkit.grid import GridSpec
from ogmkit.shards import schema
from ogmkit.shards.conformity import departures, mask_sizes, sizes
from ogmkit.shards.faults import REMEDY
from ogmkit.shards.fields import LEFT_OUT, Field
from ogmkit.shards.labels_stored import holds_labels_only, stored_sizes
from ogmkit.shards.opening import open_h5, refuse_links
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.stored import Stored, reading
from ogmkit.typing import UInt8Array


class Shard:
    """An open shard; a context manager.

    Args:
        path: the shard's file.

    Attributes:
        path: the shard's file.
        h5: the open HDF5 file.

    Raises:
        ShardError: the file is absent, damaged, no shard, or of another format version.
        UnreadableShardError: the system refuses to read it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.h5 = open_h5(path)
        self._sound: set[str] = set()
        self._sizes: dict[str, dict[str, int]] = {}
        try:
            self._require_format()
            with reading(path):
                refuse_links(path, self.h5)
        except BaseException:
            self.h5.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        with reading(self.path):
            self.h5.close()

    @property
    def scene(self) -> str:
        """The scene's name."""
        return str(self._attribute("scene"))

    @property
    def location(self) -> str:
        """The map's name."""
        return str(self._attribute("location"))

    @property
    def log(self) -> str:
        """Token of the drive that the scene is cut from; empty where the shard doesn't say."""
        return str(self._attribute("log") or "")

    @property
    def dataset_version(self) -> str:
        """The source's tables, such as `v1.0-trainval`."""
        return str(self._attribute("dataset_version"))

    @cached_property
    def settings(self) -> ExtractSettings:
        """The settings it was extracted with."""
        try:
            values = json.loads(str(self._attribute("settings")))
            return ExtractSettings.from_dict(values)
        except (SettingsError, ValueError, TypeError) as error:
            raise ShardError(f"{self.path}: attribute `settings` is damaged ({error}); {REMEDY}") from error

    @property
    def grid(self) -> GridSpec:
        """The grid of all its rasters."""
        return self.settings.targets.grid

    @property
    def cameras(self) -> tuple[str, ...]:
        """Channels, sorted; not those whose groups hold labels alone."""
        with reading(self.path):
            return tuple(sorted(name for name in self.h5 if not holds_labels_only(self.h5[name])))

    @property
    def rows(self) -> int:
        """Frames over all cameras; without any, the samples of its labels."""
        with reading(self.path):
            groups = self.cameras or sorted(self.h5)[:1]
        return sum(map(self.frames, groups))

    def frames(self, camera: str) -> int:
        """Number of a camera's frames."""
        return len(self.dataset(camera, "sample_token"))

    def left_out(self, camera: str) -> int:
        """Number of frames that a camera has lost, since a file was absent or bad."""
        return self.sizes(camera)[LEFT_OUT]

    def sizes(self, camera: str) -> dict[str, int]:
        """The values of the schema's symbols for a camera, such as N, its frames."""
        with reading(self.path):
            if camera not in self._sizes:
                self._sizes[camera] = sizes(self.h5[camera], self.grid)
            return dict(self._sizes[camera])

    def dataset(self, camera: str, name: str) -> Stored:
        """A camera's dataset, nothing of it read yet.

        Args:
            camera: channel.
            name: below the camera's group, such as `boxes/offsets` (see `schema.FIELDS`).

        Raises:
            ShardError: the camera or dataset is missing, or isn't as the schema says.
        """
        place = f"{camera}/{name}"
        with reading(self.path):
            if place in self._sound:
                return Stored(self.path, self.h5[place])
            found, field = self.h5.get(place), schema.field_of(name)
            if not isinstance(found, h5py.Dataset) or field is None:
                raise ShardError(f"{self.path}: has no dataset {place}; it has {', '.join(self.cameras)}")
            self._require_sound(camera, found, field)
            self._sound.add(place)
            return Stored(self.path, found)

    def strings(self, camera: str, name: str, rows: slice | list[int] = slice(None)) -> tuple[str, ...]:
        """Rows of a text dataset."""
        return self.dataset(camera, name).texts(rows)

    def attributes(self, place: str) -> dict[str, Any]:
        """The attributes of a group.

        Args:
            place: the group's, such as `CAM_FRONT` or `CAM_FRONT/homography/surface`.

        Raises:
            ShardError: the group is missing or damaged.
        """
        with reading(self.path):
            return dict(self.h5[place].attrs)

    def added(self, camera: str, kind: str) -> tuple[str, ...]:
        """Names of the groups that were added below a camera's, sorted.

        Args:
            camera: channel.
            kind: what they are: a name of `schema.ADDED`, such as `homography`.
        """
        with reading(self.path):
            found = self.h5.get(f"{camera}/{kind}")
            return tuple(sorted(found)) if isinstance(found, h5py.Group) else ()

    def image(self, camera: str, frame: int) -> UInt8Array | None:
        """The image file of a frame (JPEG or PNG) as uint8; None where the shard keeps no images."""
        with reading(self.path):
            if f"{camera}/image" not in self.h5:
                return None
        data: UInt8Array = self.dataset(camera, "image")[frame]
        return data

    def drivable(self, camera: str, frame: int) -> UInt8Array | None:
        """A frame's drivable area, (rows, columns) uint8 0/1; None where the shard was made without maps."""
        if self.settings.targets.no_map:
            return None
        data: UInt8Array = self.dataset(camera, "drivable")[frame]
        return data

    def boxes(self, camera: str, frame: int) -> Boxes:
        """All boxes of a frame."""
        first, stop = self.dataset(camera, "boxes/offsets")[frame : frame + 2]
        return self._boxes(camera, slice(int(first), int(stop)))

    def boxes_by_frame(self, camera: str) -> tuple[Boxes, ...]:
        """The boxes of all frames, read at once: for whoever needs most of them."""
        boxes, bounds = self._boxes(camera, slice(None)), self.dataset(camera, "boxes/offsets")[:].tolist()
        return tuple(boxes.part(first, stop) for first, stop in pairwise(bounds))

    def _boxes(self, camera: str, rows: slice) -> Boxes:
        def read(name: str) -> Any:  # noqa: ANN401  # arrays of several dtypes
            return self.dataset(camera, f"boxes/{name}")[rows]

        return Boxes(
            annotation_token=self.strings(camera, "boxes/annotation_token", rows),
            instance_token=self.strings(camera, "boxes/instance_token", rows),
            category=self.strings(camera, "boxes/category", rows),
            global_from_box=read("global_from_box"),
            size_wlh=read("size_wlh"),
            visibility=read("visibility"),
            num_lidar_pts=read("num_lidar_pts"),
        )

    def _require_format(self) -> None:
        if self._attribute("format") != schema.FORMAT:
            raise ShardError(f"{self.path}: is HDF5, but no ogmkit shard; move it elsewhere")
        version = self._attribute("format_version")
        if version != schema.FORMAT_VERSION:
            raise ShardError(
                f"{self.path}: has shard format {version}, not {schema.FORMAT_VERSION}; {REMEDY}"
            )

    def _require_sound(self, camera: str, dataset: h5py.Dataset, field: Field) -> None:
        symbols, parent = self.sizes(camera) | stored_sizes(self.path, dataset), dataset.parent
        for kind in schema.ADDED:
            if field in kind.fields:
                symbols |= mask_sizes(kind, parent)
        for problem in departures(dataset, field, symbols):
            raise ShardError(f"{self.path}: {dataset.name} {problem}; {REMEDY}")

    def _attribute(self, name: str) -> object:
        with reading(self.path):
            value = self.h5.attrs.get(name)
        return value.item() if isinstance(value, np.generic) else value

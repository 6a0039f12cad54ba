"""What a dataset or attribute of a shard is described by; `schema` lists them all."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import h5py
import numpy as np

from ogmkit.target_settings import TargetSettings

_PaperPart = Literal["core", "map", "no map", "image", "lidar", "left out", "optional"]
_FurtherPart = Literal["rays", "reach", "layers", "classes", "instances", "flow", "future"]
Part = _PaperPart | _FurtherPart
Storage = Literal["whole", "rasters", "bytes", "rows"]
Dimension = str | int

FRAMES, FRAMES_AND_END, BOXES, POINTS = "N", "N + 1", "M", "P"
INSTANCES, FUTURE = "I", "n"
LEFT_OUT, LEFT_OUT_GROUP = "L", "left_out"
ROWS, COLUMNS = "rows", "columns"
HEIGHT, WIDTH = "height", "width"


@dataclass(frozen=True)
class Field:
    """One dataset of a camera's group, or of a group added to it.

    Attributes:
        name: below the group, such as `boxes/size_wlh`.
        dtype: a numpy name, `text` (UTF-8) or `bytes` (a variable number of uint8 a row).
        shape: sizes, or symbols: N frames, M boxes, P points, L frames that are left out, I instances, n
            future key frames, rows, columns, a mask's height and width.
        description: what a row means.
        units: of the values; empty where they have none.
        frame: coordinate frame of the values; empty where they have none.
        part: stored always (`core`), by the settings (`reach` by `--seen lidar`), where frames are left out,
            or where there are such values (`optional`).
    """

    name: str
    dtype: str
    shape: tuple[Dimension, ...]
    description: str
    units: str = ""
    frame: str = ""
    part: Part = "core"

    @property
    def storage(self) -> Storage:
        """How it is laid out: at once, a compressed chunk a frame, bytes a frame, or appended rows."""
        if self.dtype == "bytes":
            return "bytes"
        if self.shape[0] == POINTS:
            return "rows"
        return "rasters" if self.shape[-2:] in ((ROWS, COLUMNS), (HEIGHT, WIDTH)) else "whole"

    @property
    def h5_dtype(self) -> np.dtype[Any]:
        """The dtype that h5py stores."""
        special: dict[str, np.dtype[Any]] = {"text": h5py.string_dtype(), "bytes": h5py.vlen_dtype(np.uint8)}
        return special[self.dtype] if self.dtype in special else np.dtype(self.dtype)

    @property
    def memory_dtype(self) -> np.dtype[Any]:
        """The dtype of its values as numpy holds them: text and bytes are objects."""
        return np.dtype(object if self.dtype in ("text", "bytes") else self.dtype)

    def resolved(self, sizes: Mapping[str, int]) -> tuple[int, ...]:
        """The shape with its symbols replaced."""
        return tuple(sizes[size] if isinstance(size, str) else size for size in self.shape)


@dataclass(frozen=True)
class Attribute:
    """One attribute of the file or of a group; its part as of a `Field`."""

    name: str
    kind: type[str] | type[int] | type[float]
    description: str
    part: Part = "core"

    def problem(self, value: object) -> str:
        """What is wrong with a stored value, where None is an absent one; empty if nothing is."""
        stored = {str: str, int: np.integer, float: np.floating}[self.kind]
        if isinstance(value, stored):
            return ""
        return "missing" if value is None else f"{value!r}, not a {self.kind.__name__}"


@dataclass(frozen=True)
class AddedKind:
    """A kind of groups that later commands add below a camera's, each with a name of its own.

    Attributes:
        name: of the group that holds them, such as `homography`.
        member: what one of them is called, such as `source`.
        fields: datasets of each.
        attributes: of each.
    """

    name: str
    member: str
    fields: tuple[Field, ...]
    attributes: tuple[Attribute, ...]

    def field(self, name: str) -> Field:
        """One of its fields."""
        return next(field for field in self.fields if field.name == name)


def parts_of(settings: TargetSettings, *, left_out: bool = False) -> frozenset[Part]:
    """The parts of the schema that a shard holds.

    Args:
        settings: that it is made with.
        left_out: of a camera, whether it has lost frames.
    """
    conditions: dict[Part, bool] = {
        "core": True,
        "map": not settings.no_map,
        "no map": settings.no_map,
        "image": settings.images == "bytes",
        "lidar": settings.lidar,
        "rays": "rays" in settings.seen,
        "reach": "lidar" in settings.seen,
        "left out": left_out,
        "layers": bool(settings.layers),
        "classes": bool(settings.classes),
        "instances": settings.instances,
        "flow": settings.flow,
        "future": settings.future > 0,
    }
    return frozenset(part for part, holds in conditions.items() if holds)

"""Map expansion files, version 1.3: polygons and lines by layer, as they stand there."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ogmkit.base.files import read_text
from ogmkit.errors import MALFORMED, DataFileError
from ogmkit.typing import FloatArray

Layer = Literal[
    "drivable_area",
    "lane",
    "road_segment",
    "ped_crossing",
    "walkway",
    "stop_line",
    "carpark_area",
    "road_divider",
    "lane_divider",
]
"""Layers that cells can be made of."""
LINES = ("road_divider", "lane_divider")
"""Those that hold lines; the others hold polygons."""
_REMEDY = (
    "unpack nuScenes' map expansion v1.3 into maps/expansion, or leave out --layers and labels' map classes "
    "(--no-map)"
)


@dataclass(frozen=True, eq=False)
class Area:
    """One polygon of a map.

    Attributes:
        outer: (K, 2) float64 x, y in metres, global frame; not closed.
        holes: the same of each hole.
    """

    outer: FloatArray
    holes: tuple[FloatArray, ...]


@dataclass(frozen=True, eq=False)
class Expansion:
    """A location's map expansion.

    Attributes:
        path: its file.
        content: what the file holds.
    """

    path: Path
    content: Mapping[str, Any]

    @cached_property
    def _nodes(self) -> dict[str, tuple[float, float]]:
        return {node["token"]: (node["x"], node["y"]) for node in self.content["node"]}

    @cached_property
    def _polygons(self) -> dict[str, Mapping[str, Any]]:
        return {one["token"]: one for one in self.content["polygon"]}

    @cached_property
    def _areas(self) -> dict[str, tuple[Area, ...]]:
        """Those that were asked for."""
        return {}

    @cached_property
    def _drawn(self) -> dict[str, tuple[FloatArray, ...]]:
        """Likewise of lines."""
        return {}

    @cached_property
    def _lines(self) -> dict[str, Mapping[str, Any]]:
        return {one["token"]: one for one in self.content["line"]}

    def areas(self, layer: str) -> tuple[Area, ...]:
        """The polygons of a layer, in the file's order; a drivable area's own in theirs.

        Raises:
            DataFileError: the file lacks the layer, or a record of it is damaged.
        """
        if layer not in self._areas:
            try:
                tokens = [token for record in self.content[layer] for token in _polygon_tokens(record)]
                self._areas[layer] = tuple(self._area(self._polygons[token]) for token in tokens)
            except MALFORMED as error:
                raise self._damaged(layer, error) from error
        return self._areas[layer]

    def lines(self, layer: str) -> tuple[FloatArray, ...]:
        """The lines of a layer, (K, 2) float64 each; those of fewer than two points are left out.

        Raises:
            DataFileError: as `areas`.
        """
        if layer not in self._drawn:
            try:
                lines = [self._lines[record["line_token"]]["node_tokens"] for record in self.content[layer]]
                self._drawn[layer] = tuple(self._points(tokens) for tokens in lines if len(tokens) > 1)
            except MALFORMED as error:
                raise self._damaged(layer, error) from error
        return self._drawn[layer]

    def _area(self, record: Mapping[str, Any]) -> Area:
        holes = tuple(self._points(hole["node_tokens"]) for hole in record["holes"] if hole["node_tokens"])
        return Area(self._points(record["exterior_node_tokens"]), holes)

    def _points(self, tokens: list[str]) -> FloatArray:
        points = np.array([self._nodes[token] for token in tokens], dtype=np.float64).reshape(-1, 2)
        if not np.isfinite(points).all():
            raise ValueError("a node that is not finite")
        return points

    def _damaged(self, layer: str, error: Exception) -> DataFileError:
        return DataFileError(f"{self.path}: layer {layer} is absent or damaged ({error!r}); {_REMEDY}")


def _polygon_tokens(record: Mapping[str, Any]) -> list[str]:
    """A drivable area's record has several."""
    several: list[str] | None = record.get("polygon_tokens")
    return [record["polygon_token"]] if several is None else several


def expansion_path(dataroot: Path, location: str) -> Path:
    """The file of a location's map expansion."""
    return dataroot / "maps" / "expansion" / f"{location}.json"


def file_state(path: Path) -> int:
    """What changes when the file does.

    Raises:
        DataFileError: the file is absent.
    """
    try:
        return path.stat().st_mtime_ns
    except OSError as error:
        raise _unreadable(path, error) from error


def open_expansion(dataroot: Path, location: str) -> Expansion:
    """Read the map expansion of a location, once for many scenes; it stays in memory.

    Args:
        dataroot: the dataset's root.
        location: the map's name.

    Raises:
        DataFileError: the file is absent, or no JSON object.
    """
    path = expansion_path(dataroot, location)
    return _kept(path, file_state(path))


@lru_cache(maxsize=4)
def _kept(path: Path, state: int) -> Expansion:
    del state  # part of the key: a file that changed is read again
    return read_expansion(path)


def read_expansion(path: Path) -> Expansion:
    """Read a file of a map expansion.

    Raises:
        DataFileError: it can't be read, or is no JSON object.
    """
    try:
        content = json.loads(read_text(path))
    except OSError as error:
        raise _unreadable(path, error) from error
    except ValueError as error:
        raise DataFileError(f"{path}: no sound JSON ({error}); {_REMEDY}") from error
    if not isinstance(content, dict):
        raise DataFileError(f"{path}: no JSON object; {_REMEDY}")
    return Expansion(path, content)


def _unreadable(path: Path, error: OSError) -> DataFileError:
    return DataFileError(
        f"{path}: can't be read ({error.strerror}); {_REMEDY}", kind="map expansion is absent"
    )

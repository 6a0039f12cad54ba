"""The truth of one frame at a time, whatever the order they are asked for in."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from ogmkit.metrics.iou import code_of
from ogmkit.shards.faults import damaged
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema_seen import SEEN
from ogmkit.typing import UInt8Array

Place = tuple[str, str, int]
"""Scene, camera, and the frame's place among the camera's."""


@dataclass(frozen=True, eq=False)
class Frame:
    """What is true of one frame.

    Attributes:
        shard: its shard, open.
        scene: the scene's name.
        camera: channel.
        index: place among the camera's frames.
        truth: (rows, columns) code of both rasters.
        field_of_view: (rows, columns) uint8 0/1.
        seen: further kinds of cells that the shard has → (rows, columns) uint8 0/1.
    """

    shard: Shard
    scene: str
    camera: str
    index: int
    truth: UInt8Array
    field_of_view: UInt8Array
    seen: Mapping[str, UInt8Array]


class FrameReader:
    """Reads frames, one shard open at a time; a context manager.

    Args:
        paths: scene → its shard's file.
    """

    def __init__(self, paths: Mapping[str, Path]) -> None:
        self._paths = paths
        self._shard: Shard | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._close()

    def shard(self, scene: str) -> Shard:
        """A scene's shard, open until another one is asked for."""
        path = self._paths[scene]
        if self._shard is None or self._shard.path != path:
            self._close()
            self._shard = Shard(path)
        return self._shard

    def truth(self, place: Place) -> UInt8Array:
        """A frame's code alone.

        Raises:
            ShardError: the shard is absent, damaged, or lacks something.
        """
        scene, camera, index = place
        shard = self.shard(scene)
        drivable, vehicles = (row(shard, camera, name, index) for name in ("drivable", "vehicles"))
        return code_of(drivable, vehicles)

    def frame(self, place: Place) -> Frame:
        """A frame's truth and field of view; errors as of `truth`."""
        scene, camera, index = place
        shard = self.shard(scene)
        view = row(shard, camera, "field_of_view", index)
        kinds: tuple[str, ...] = shard.settings.targets.seen[1:]
        seen = {kind: row(shard, camera, f"{SEEN}/{kind}", index) for kind in kinds}
        return Frame(shard, scene, camera, index, self.truth(place), view, seen)

    def _close(self) -> None:
        if self._shard is not None:
            self._shard.close()
            self._shard = None


def row(shard: Shard, camera: str, name: str, index: int) -> UInt8Array:
    """A frame's row of a dataset of masks.

    Raises:
        ShardError: there is none, or it is damaged.
    """
    try:
        return np.asarray(shard.dataset(camera, name)[index], dtype=np.uint8)
    except (OSError, RuntimeError, ValueError) as error:
        raise damaged(shard.path, error) from error

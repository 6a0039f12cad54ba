"""Shards that stay open between samples, in every process its own."""

import os
from collections import OrderedDict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ogmkit.shards.reader import Shard
from ogmkit.shards.stored import Stored

MAX_OPEN = 64
"""Shards that one process keeps open: well below the 1024 files that systems allow."""


class PooledShard(Shard):
    """A shard whose small datasets stay at hand: to look one up takes longer than to read its rows."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._at_hand: dict[tuple[str, str], Stored] = {}

    def dataset(self, camera: str, name: str) -> Stored:
        """As `Shard`'s."""
        found = self._at_hand.get((camera, name))
        if found is None:
            found = super().dataset(camera, name)
            if found.chunks is None:  # of rasters and points, HDF5 would keep a chunk in memory for each
                self._at_hand[camera, name] = found
        return found


class ShardPool:
    """Opens shards when they are asked for, and keeps those that were used last.

    HDF5's handles must not cross into another process: a forked one drops what it inherited and opens its
    own, and pickling leaves them out.

    Args:
        paths: the shards' files.
        max_open: how many stay open.

    Attributes:
        paths: the shards' files.
    """

    def __init__(self, paths: Sequence[Path], max_open: int = MAX_OPEN) -> None:
        self.paths = tuple(paths)
        self._max_open = max_open
        self._open: OrderedDict[int, PooledShard] = OrderedDict()
        self._process = os.getpid()

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_open": OrderedDict()}

    def shard(self, number: int) -> Shard:
        """An open shard; use it before asking for others, which may close it.

        Args:
            number: its place among `paths`.

        Raises:
            ShardError: see `Shard`.
        """
        if self._process != os.getpid():
            self.close()
            self._process = os.getpid()
        shard = self._open.pop(number, None) or PooledShard(self.paths[number])
        self._open[number] = shard
        if len(self._open) > self._max_open:
            _, oldest = self._open.popitem(last=False)
            oldest.close()
        return shard

    def close(self) -> None:
        """Close all that is open in this process."""
        while self._open:
            _, shard = self._open.popitem()
            shard.close()

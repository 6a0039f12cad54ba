"""A dataset of an open shard, which tells damage and refusals as everything in ogmkit does."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ogmkit.errors import OgmkitError
from ogmkit.shards.faults import H5_ERRORS, damaged


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn what HDF5 raises inside into an error that names the shard.

    Raises:
        ShardError: the shard is damaged.
        UnreadableShardError: the system refuses to read it.
    """
    try:
        yield
    except OgmkitError:
        raise
    except H5_ERRORS as error:
        raise damaged(path, error) from error


class Stored:
    """A dataset that has proved to be as the schema says.

    Args:
        path: the shard's file, for messages.
        dataset: the dataset.
    """

    def __init__(self, path: Path, dataset: h5py.Dataset) -> None:
        self._path = path
        self._dataset = dataset

    @property
    def shape(self) -> tuple[int, ...]:
        """Its sides."""
        sides: tuple[int, ...] = self._dataset.shape
        return sides

    @property
    def dtype(self) -> np.dtype[Any]:
        """Its values' kind."""
        kind: np.dtype[Any] = self._dataset.dtype
        return kind

    @property
    def size(self) -> int:
        """Number of its values."""
        return int(self._dataset.size)

    @property
    def chunks(self) -> tuple[int, ...] | None:
        """Sides of a chunk; None where the values lie in one piece."""
        sides: tuple[int, ...] | None = self._dataset.chunks
        return sides

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, rows: Any) -> Any:  # noqa: ANN401  # h5py's selections, arrays of several dtypes
        """Read values.

        Raises:
            ShardError: they are damaged, or the system refuses to read them.
        """
        with reading(self._path):
            return self._dataset[rows]

    def texts(self, rows: slice | list[int]) -> tuple[str, ...]:
        """Read rows of text; errors as of reading values."""
        with reading(self._path):
            return tuple(self._dataset.asstr()[rows])

"""Grids that another network wrote: HDF5 or npz with `sample_token` and one array a class."""

import json
import zipfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ogmkit.base.files import file_status
from ogmkit.base.names import unknown
from ogmkit.errors import DataFileError, SettingsError
from ogmkit.labels.names import NAMES
from ogmkit.typing import BoolArray

TOKENS, DEFINITION = "sample_token", "definition"
_ERRORS = (OSError, KeyError, ValueError, TypeError, RuntimeError, zipfile.BadZipFile)


@dataclass(frozen=True, eq=False)
class Predictions:
    """What a file holds.

    Attributes:
        path: the file.
        rows: sample token → row of each array.
        arrays: class → (N, rows, columns) of an npz file, or a dataset of an open HDF5 file.
        definition: name of the definition that the file says its grids follow; None where it says nothing.
        record: that definition's record; None where the file gives no more than a name.
    """

    path: Path
    rows: Mapping[str, int]
    arrays: Mapping[str, Any]
    definition: str | None
    record: Mapping[str, Any] | None

    def mask(self, name: str, token: str, threshold: float) -> BoolArray:
        """(rows, columns) where the class is predicted: set, or over the threshold where it is a number.

        Raises:
            DataFileError: the array is damaged.
        """
        try:
            values = np.asarray(self.arrays[name][self.rows[token]])
        except _ERRORS as error:
            raise _unreadable(self.path, error) from error
        result: BoolArray = values > (threshold if values.dtype.kind == "f" else 0)
        return result


def read_predictions(path: Path, classes: tuple[str, ...], shape: tuple[int, int]) -> Predictions:
    """Open a file of grids.

    Args:
        path: an .npz file; any other is read as HDF5, and stays open for reading.
        classes: the definition's; the file has at least one of them.
        shape: rows and columns of the definition's arrays.

    Raises:
        DataFileError: the file is absent, or neither HDF5 nor npz.
        SettingsError: it lacks `sample_token`, names a sample twice, or has an array of another name or
            shape.
    """
    try:
        file_status(path)
        content, said = _npz(path) if path.suffix == ".npz" else _hdf5(path)
    except _ERRORS as error:
        raise _unreadable(path, error) from error
    if TOKENS not in content:
        raise SettingsError(f"{path}: has no {TOKENS}; it has {', '.join(sorted(content)) or 'nothing'}")
    tokens = [one.decode() if isinstance(one, bytes) else str(one) for one in content.pop(TOKENS)[:].tolist()]
    rows = {token: row for row, token in enumerate(tokens)}
    if len(rows) != len(tokens):
        raise SettingsError(f"{path}: {TOKENS} names a sample twice")
    _require_arrays(path, content, classes, (len(tokens), *shape))
    return Predictions(path, rows, content, *_definition(path, said))


def _npz(path: Path) -> tuple[dict[str, Any], str | None]:
    with np.load(path, allow_pickle=False) as archive:
        content = {name: archive[name] for name in archive.files}
    said = content.pop(DEFINITION, None)
    return content, None if said is None else str(said)


def _hdf5(path: Path) -> tuple[dict[str, Any], str | None]:
    file = h5py.File(path, "r", locking=False)
    said = file.attrs.get(DEFINITION)
    return dict(file), None if said is None else str(said)


def _require_arrays(
    path: Path, content: Mapping[str, Any], classes: tuple[str, ...], shape: tuple[int, int, int]
) -> None:
    if not content:
        raise SettingsError(f"{path}: has no array of a class; there are {', '.join(classes)}")
    for name, array in content.items():
        if name not in classes:
            raise SettingsError(f"{path}: {unknown('class', name, classes)}")
        if array.shape != shape:
            raise SettingsError(f"{path}: {name} has shape {array.shape}, not {shape} as its definition")


def _definition(path: Path, said: str | None) -> tuple[str | None, Mapping[str, Any] | None]:
    """Name and record of the definition that a file says it follows."""
    if said is None or said in NAMES:
        return said, None
    with suppress(ValueError, KeyError, TypeError):
        record = json.loads(said)
        return str(record["name"]), {**record, "classes": list(record["classes"])}
    raise SettingsError(f"{path}: its {DEFINITION} is neither a name ({', '.join(NAMES)}) nor a record")


def _unreadable(path: Path, error: Exception) -> DataFileError:
    reason = error.strerror if isinstance(error, OSError) and error.strerror else error
    if "Object arrays" in str(error):
        reason = "it holds Python objects: save tokens as text, with .astype('U')"
    return DataFileError(f"{path}: can't be read ({reason}); give an HDF5 or npz file of grids")

"""Files of predictions: HDF5 with a row a frame, or a PNG picture a mask."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeVar

import cv2
import h5py
import numpy as np
from numpy.typing import NDArray

from ogmkit import __version__
from ogmkit.base.atomic import output_errors, replacing
from ogmkit.errors import OutputError
from ogmkit.learn.predict.form import FORMAT, FORMAT_VERSION
from ogmkit.learn.predict.run import Run
from ogmkit.samples.spec import TARGETS
from ogmkit.shards.sink import ShardFile, create
from ogmkit.typing import Float32Array, UInt8Array

Format = Literal["hdf5", "png"]

_MAPS = ("bev", "image")
_DESCRIPTIONS: Mapping[str, str] = {
    "sample_token": "token of the key frame",
    "sample_data_token": "token of the camera's image",
    "file": "the input's name",
    "frame": "place among the camera's frames in the scene, from 0",
    "bev": "probabilities of drivable area and vehicles, on the grid",
    "image": "probabilities of drivable area and vehicles, at the network's image size",
    "homography_valid": "whether there is a homography that leads to the grid; bev is 0 where not",
    "bev_from_image": "the homography: pixel of the input to cell; NaN where not valid",
}

Value = str | int | bool | NDArray[Any]
Item = TypeVar("Item")


@dataclass(frozen=True, eq=False)
class Row:
    """One frame's prediction, as files hold it.

    Attributes:
        stem: how names of its pictures begin.
        values: name of the dataset → its row; names are keys of the table of descriptions.
    """

    stem: str
    values: Mapping[str, Value]


@dataclass(frozen=True, eq=False)
class Group:
    """The rows of one group of an HDF5 file.

    Attributes:
        place: of the group in the file: a camera, or empty for the file itself.
        count: how many rows there are.
        rows: one after the other; all groups may share one source.
    """

    place: str
    count: int
    rows: Iterator[Row]


def attributes(run: Run, homography: str | None) -> dict[str, str | int | float]:
    """What a file says of its origin.

    Args:
        run: that predicted.
        homography: where those come from that masks were warped by; None where none took part.
    """
    grid = {f"grid_{name}": value for name, value in vars(run.grid).items()}
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "package_version": __version__,
        "system": run.system,
        "checkpoint_sha256": run.sha256,
        "homography": homography or "",
        **grid,
    }


def write_h5(path: Path, about: Mapping[str, str | int | float], groups: Iterable[Group]) -> None:
    """Write an HDF5 file, whole or not at all; one of the same name is replaced.

    Raises:
        OutputError: the disk is full or refuses otherwise.
    """
    with replacing(path) as part, create(part) as file:
        with file.writing() as h5:
            h5.attrs.update(about)
        for group in groups:
            _write_group(file, group)


def write_pngs(folder: Path, row: Row) -> tuple[Path, ...]:
    """Write `<stem>_{bev,image}_{drivable,vehicles}.png`, 8-bit greyscale, 255 for a probability of 1.

    Returns:
        The files.

    Raises:
        OutputError: the disk is full or refuses otherwise.
    """
    paths = []
    for kind in _MAPS:
        for channel, target in enumerate(TARGETS):
            if kind in row.values:
                path = folder / f"{row.stem}_{kind}_{target}.png"
                _write_grey(path, np.asarray(row.values[kind])[channel])
                paths.append(path)
    return tuple(paths)


def reported(
    items: Iterator[Item], total: int, on_progress: Callable[[int, int], None] | None
) -> Iterator[Item]:
    """The same items, each one told of as (items so far, items in all)."""
    for done, item in enumerate(items, start=1):
        if on_progress is not None:
            on_progress(done, total)
        yield item


def open_folder(out: Path) -> None:
    """Make the folder where it isn't there yet.

    Raises:
        OutputError: it is a file, or can't be made.
    """
    if out.exists() and not out.is_dir():
        raise OutputError(f"{out}: is a file; choose a folder")
    with output_errors(out):
        out.mkdir(parents=True, exist_ok=True)


def _write_group(file: ShardFile, group: Group) -> None:
    datasets: dict[str, h5py.Dataset] = {}
    for number in range(group.count):
        row = next(group.rows)
        with file.writing() as h5:
            if not datasets:
                place = h5.require_group(group.place or "/")
                datasets = {name: _new(place, name, value, group.count) for name, value in row.values.items()}
            for name, value in row.values.items():
                datasets[name][number] = value


def _new(group: h5py.Group, name: str, value: Value, count: int) -> h5py.Dataset:
    """A dataset for rows like this one."""
    shape = (count, *np.shape(value))
    if name in _MAPS:
        dataset = group.create_dataset(
            name, shape, np.float16, chunks=(1, *shape[1:]), compression="gzip", compression_opts=1
        )
    else:
        dtype = h5py.string_dtype() if isinstance(value, str) else np.asarray(value).dtype
        dataset = group.create_dataset(name, shape, dtype)
    dataset.attrs["description"] = _DESCRIPTIONS[name]
    return dataset


def _write_grey(path: Path, probabilities: Float32Array) -> None:
    pixels: UInt8Array = np.rint(probabilities * 255).astype(np.uint8)
    _, data = cv2.imencode(".png", pixels)
    with replacing(path) as part:
        part.write_bytes(data.tobytes())

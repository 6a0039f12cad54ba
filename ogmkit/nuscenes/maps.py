"""Drivable-area masks: each decoded once per machine into bits that all workers map into memory."""

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ogmkit.base.files import file_status
from ogmkit.base.news import Waiting, tell
from ogmkit.errors import DataFileError
from ogmkit.nuscenes.decoded import (
    TILE_BYTES,
    TILE_ROWS,
    Header,
    decoded_parts,
    read_checksums,
    tile_checksums,
)
from ogmkit.nuscenes.mask_cache import cache_folder, decoding, readable_header
from ogmkit.nuscenes.mask_faults import refuse_vector_map, unreadable
from ogmkit.nuscenes.mask_files import read_mask
from ogmkit.typing import BoolArray, UInt8Array

_KEPT_OPEN = 8
"""Decoded masks that a process keeps mapped into memory."""


@dataclass(frozen=True)
class MapMask:
    """A decoded mask, opened on first use and light to pickle; row 0 is the map's northern edge.

    Attributes:
        path: the decoded file.
        shape: (rows, columns) in pixels.
    """

    path: Path
    shape: tuple[int, int]

    @cached_property
    def _header(self) -> Header:
        with _reading(self.path):
            header = Header.read(self.path)
        if header is None or (header.rows, header.columns) != self.shape:
            raise DataFileError(f"{self.path}: decoded map mask was removed or changed in use; run again")
        return header

    @cached_property
    def _bits(self) -> UInt8Array:
        with _reading(self.path):
            return np.memmap(self.path, np.uint8, "r", Header.SIZE, self._header.bits_shape)

    @cached_property
    def _checksums(self) -> NDArray[np.uint32]:
        with _reading(self.path):
            return read_checksums(self.path, self._header)

    @cached_property
    def _sound(self) -> BoolArray:
        """Which tiles have been compared with their checksums."""
        return np.zeros(self._header.tiles, np.bool_)

    def __reduce__(self) -> tuple[type["MapMask"], tuple[Path, tuple[int, int]]]:
        """Pickle without the memory map, which would be copied whole."""
        return MapMask, (self.path, self.shape)

    def window(self, row0: int, row1: int, column0: int, column1: int) -> UInt8Array:
        """Unpack rows row0 … row1 − 1 and columns column0 … column1 − 1, all inside the mask.

        Returns:
            (row1 − row0, column1 − column0) uint8, 1 = drivable.

        Raises:
            DataFileError: the decoded file was removed or changed, or is damaged there.
        """
        first_byte, last_byte = column0 // 8, -(-column1 // 8)
        self._require_sound(slice(row0, row1), slice(first_byte, last_byte))
        packed = self._bits[row0:row1, first_byte:last_byte]
        return np.unpackbits(packed, axis=1)[:, column0 - 8 * first_byte : column1 - 8 * first_byte]

    def _require_sound(self, rows: slice, columns: slice) -> None:
        """Compare the tiles of some rows and bytes with their checksums, each once."""
        across = slice(columns.start // TILE_BYTES, -(-columns.stop // TILE_BYTES))
        for row in range(rows.start // TILE_ROWS, -(-rows.stop // TILE_ROWS)):
            if self._sound[row, across].all():
                continue
            first, last = across.start * TILE_BYTES, across.stop * TILE_BYTES
            found = tile_checksums(self._bits[row * TILE_ROWS : (row + 1) * TILE_ROWS, first:last])
            if found != self._checksums[row, across].tolist():
                raise DataFileError(
                    f"{self.path}: decoded map mask is damaged; remove it (`ogmkit cache --clear`), then run "
                    "again"
                )
            self._sound[row, across] = True


@dataclass(frozen=True)
class MaskStore:
    """Decoded masks in a folder that all workers and runs share.

    Attributes:
        cache_dir: that folder; None means the one that OGMKIT_CACHE_DIR names, else the platform's cache
            folder for ogmkit.
    """

    cache_dir: Path | None = None

    def open(self, png: Path) -> MapMask:
        """Open a mask, decoding it first unless its present state has been decoded before.

        Any number of processes may do so at once: one decodes, the others wait and find its work.

        Args:
            png: greyscale PNG (255 = drivable, as in the devkit's `MapMask`), or another PNG or JPEG in black
                and white (`ogmkit.nuscenes.mask_files`).

        Raises:
            DataFileError: the mask is absent, damaged, no such picture, or over 2^31 pixels (over 2^29, where
                it is no greyscale PNG).
            OutputError: the cache folder can't be written.
        """
        refuse_vector_map(png)
        try:
            source = file_status(png)
        except OSError as error:
            raise unreadable(png, error) from error
        state = (source.st_size, source.st_mtime_ns)
        decoded = self._decoded_path(png)
        header = _current_header(decoded, state)
        if header is None:
            tell(Waiting(f"decoding map {png.name}"))
            with decoding(decoded.parent):
                header = _current_header(decoded, state) or _decode(png, decoded, state)
        now = file_status(decoded)
        return _opened(decoded, (header.rows, header.columns), (now.st_ino, now.st_mtime_ns))

    def _decoded_path(self, png: Path) -> Path:
        name = hashlib.sha256(os.fsencode(png.resolve())).hexdigest()[:16]
        return cache_folder(self.cache_dir) / f"{name}.mask"


@lru_cache(maxsize=_KEPT_OPEN)
def _opened(decoded: Path, shape: tuple[int, int], state: tuple[int, int]) -> MapMask:
    """A decoded file in a state: one for all scenes of a process, so that each tile is compared once."""
    del state
    return MapMask(decoded, shape)


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Turn what the system refuses while a decoded mask is read into a DataFileError that names it."""
    try:
        yield
    except OSError as error:
        raise DataFileError(
            f"{path}: decoded map mask can't be read ({error.strerror or error}); check the disk and "
            "permissions"
        ) from error


def _current_header(decoded: Path, state: tuple[int, int]) -> Header | None:
    """The header of a decoded mask, if that is whole and made from the source's present state."""
    header = readable_header(decoded)
    return header if header is not None and header.source_state == state else None


def _decode(png: Path, decoded: Path, state: tuple[int, int]) -> Header:
    """Decode a mask into a file beside the target, which then takes its place whole."""
    image = read_mask(png)
    header = Header(image.height, image.width, *state)
    partial = decoded.with_suffix(".partial")  # one name: what a killed run left is overwritten
    try:
        with partial.open("wb") as file:
            for part in decoded_parts(image, header):
                file.write(part)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(decoded)
    finally:
        partial.unlink(missing_ok=True)
    return header

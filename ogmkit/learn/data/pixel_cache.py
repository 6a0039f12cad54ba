"""Decoded, resized images and masks of a training's frames, in one file that all its processes share."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ogmkit.learn.data.frame_files import make_file
from ogmkit.samples.index import FrameIndex
from ogmkit.samples.reading import Pixels
from ogmkit.samples.spec import TARGETS, SampleSpec
from ogmkit.typing import UInt8Array


class PixelCache:
    """A file with a place for each frame, filled when the frame is first read; the system keeps it in memory.

    The last byte of a place says whether it is filled. Two processes that fill one at once write the same.

    Args:
        path: of the file, which is made; whoever asks for it removes it.
        index: which frames; one of several sequences has one place.
        spec: what their samples hold; images and masks at one size.

    Raises:
        OutputError: the disk is too full, or can't be written to.
    """

    def __init__(self, path: Path, index: FrameIndex, spec: SampleSpec) -> None:
        height, width = spec.image_size or (0, 0)
        self._shapes = {
            name: shape
            for name, shape, wanted in (
                ("image", (height, width, 3), spec.image),
                ("masks", (len(TARGETS), height, width), spec.masks is not None),
            )
            if wanted
        }
        frames, self._place = index.single_frames()
        self._shape = len(frames), sum(int(np.prod(shape)) for shape in self._shapes.values()) + 1
        self._path = path
        self._file: UInt8Array | None = None
        size = self._shape[0] * self._shape[1]
        make_file(path, size, "--cache-samples", "leave it out, or make images smaller")

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_file": None}

    def read(self, i: int, read: Callable[[], Pixels]) -> Pixels:
        """Images and masks of sample i, which `read` reads where one of its frames is new."""
        if self._file is None:
            self._file = np.memmap(self._path, np.uint8, "r+", shape=self._shape)
        places = self._file[self._place[i]]
        if not places[:, -1].all():
            found = read()
            kept = np.concatenate([found[name].reshape(len(places), -1) for name in self._shapes], axis=1)
            self._file[self._place[i], :-1] = kept
            self._file[self._place[i], -1] = 1
            return found
        sizes = np.cumsum([int(np.prod(shape)) for shape in self._shapes.values()])
        parts = np.split(places[:, :-1], sizes[:-1], axis=1)
        return {
            name: np.ascontiguousarray(part).reshape(-1, *shape)
            for part, (name, shape) in zip(parts, self._shapes.items(), strict=True)
        }

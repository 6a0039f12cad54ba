"""What a frozen network makes of a training's frames, computed once."""

from pathlib import Path
from typing import Any

import numpy as np

from ogmkit.learn.data.frame_files import make_file
from ogmkit.samples.index import FrameIndex
from ogmkit.typing import BoolArray, Float32Array, IntArray

_MIRRORS = 2
"""A frame as it is, and its mirror image."""


class FrameFeatures:
    """A file with the features of each frame, and of its mirror image.

    Args:
        path: of the file.
        index: whose samples are made of the frames.
        width: features of a frame.

    Attributes:
        path: see above.
        frames: the frames, each once.
    """

    def __init__(self, path: Path, index: FrameIndex, width: int) -> None:
        self.path = path
        self.frames, self._place = index.single_frames()
        self._shape = len(self.frames), _MIRRORS, width
        self._file: Float32Array | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_file": None}

    def make(self) -> None:
        """Make the file, whose features are 0 until they are written.

        Raises:
            OutputError: there is no room, or the system refuses to write.
        """
        size = int(np.prod(self._shape)) * np.dtype(np.float32).itemsize
        make_file(self.path, size, "looking at each image once", "make room, or lower --pool-cells")

    def write(self, frames: IntArray, mirrored: BoolArray, features: Float32Array) -> None:
        """Write features.

        Args:
            frames: (B,) places among `frames`.
            mirrored: (B,) whether of the mirror image.
            features: (B, width).
        """
        self._opened()[frames, mirrored.astype(int)] = features

    def read(self, i: int) -> Float32Array:
        """(T, 2, width) features of the frames of the index's sample i, and of their mirror images."""
        found: Float32Array = self._opened()[self._place[i]]
        return found

    def _opened(self) -> Float32Array:
        if self._file is None:
            self._file = np.memmap(self.path, np.float32, "r+", shape=self._shape)
        return self._file

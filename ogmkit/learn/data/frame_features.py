"""What a frozen network makes of a training's frames, computed once."""

from pathlib import Path
from typing import Any

import numpy as np

from ogmkit.learn.data.frame_files import make_file
from ogmkit.samples.index import FrameIndex
from ogmkit.typing import BoolArray, Float32Array, IntArray


class FrameFeatures:
    """A file with the features of each frame and, where frames are mirrored, of its mirror image.

    Args:
        path: of the file.
        index: whose samples are made of the frames.
        width: features of a frame.
        mirrors: 2 with mirror images, else 1.

    Attributes:
        path: see above.
        frames: the frames, each once.
        mirrors: see above.
    """

    def __init__(self, path: Path, index: FrameIndex, width: int, mirrors: int) -> None:
        self.path = path
        self.mirrors = mirrors
        self.frames, self._place = index.single_frames()
        self._shape = len(self.frames), mirrors, width
        self._file: Float32Array | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_file": None}

    def make(self) -> None:
        """Make the file, whose features are 0 until they are written.

        Raises:
            OutputError: the disk is too full, or can't be written to.
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
        """(T, mirrors, width) features of the frames of the index's sample i, and of their mirror images."""
        found: Float32Array = self._opened()[self._place[i]]
        return found

    def _opened(self) -> Float32Array:
        if self._file is None:
            self._file = np.memmap(self.path, np.float32, "r+", shape=self._shape)
        return self._file

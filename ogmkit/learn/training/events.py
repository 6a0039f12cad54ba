"""What TensorBoard shows of a training: figures and pictures, in a file of events.

Lightning's logger writes in a thread: a full disk would end there, with a traceback and without a word.
"""

import os
import socket
import time
from pathlib import Path
from typing import Any, BinaryIO

from lightning.pytorch.loggers import Logger
from lightning.pytorch.utilities import rank_zero_only
from tensorboard.compat.proto.event_pb2 import Event, SessionLog
from tensorboard.summary.writer.record_writer import RecordWriter
from torch import Tensor
from torch.utils.tensorboard.summary import image, scalar

from ogmkit.base.atomic import output_errors


class Events(Logger):
    """Appends to a file of this process; what a killed run wrote later than `step` is hidden.

    Args:
        folder: gets the file.
        step: where the training begins or resumes.
    """

    def __init__(self, folder: Path, step: int) -> None:
        super().__init__()
        self._folder = folder
        self._step = step
        self._file: BinaryIO | None = None

    @property
    def name(self) -> str:
        """Of the logger: the folder's."""
        return self._folder.name

    @property
    def version(self) -> str:
        """Empty: a folder holds one training."""
        return ""

    @rank_zero_only
    def log_metrics(self, metrics: dict[str, float], step: int | None = None) -> None:
        """Write figures.

        Raises:
            OutputError: the system refuses to write.
        """
        for name, value in metrics.items():
            self._write(summary=scalar(name, value), step=step)  # type: ignore[no-untyped-call]

    @rank_zero_only
    def log_hyperparams(self, params: object, *arguments: object, **more: object) -> None:
        """Nothing: config.yaml has them."""

    @rank_zero_only
    def log_picture(self, name: str, picture: Tensor, step: int) -> None:
        """Write (3, h, w) values 0 … 1.

        Raises:
            OutputError: the system refuses to write.
        """
        shown = image(name, picture, dataformats="CHW")  # type: ignore[no-untyped-call]
        self._write(summary=shown, step=step)

    @rank_zero_only
    def finalize(self, status: str) -> None:
        """Close the file."""
        if self._file is not None:
            with output_errors(self._folder):
                self._file.close()
            self._file = None

    def _write(self, **event: Any) -> None:  # noqa: ANN401  # of `Event`
        with output_errors(self._folder):
            if self._file is None:
                self._file = self._begin()
            _append(self._file, **event)

    def _begin(self) -> BinaryIO:
        """Begin a file, by the name that TensorBoard looks for."""
        self._folder.mkdir(exist_ok=True)
        name = f"events.out.tfevents.{time.time_ns()}.{socket.gethostname()}.{os.getpid()}"
        file = (self._folder / name).open("wb")
        _append(file, file_version="brain.Event:2")
        _append(file, step=self._step, session_log=SessionLog(status=SessionLog.START))
        return file


def _append(file: BinaryIO, **event: Any) -> None:  # noqa: ANN401  # of `Event`
    RecordWriter(file).write(Event(wall_time=time.time(), **event).SerializeToString())
    file.flush()

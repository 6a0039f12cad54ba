"""What an evaluation needs of a trained run; `ogmkit.learn.predict.run.Run` is one, and needs torch."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Protocol

from ogmkit.grid import GridSpec
from ogmkit.learn.catalogue import Output
from ogmkit.metrics.plan import PlannedFrame
from ogmkit.samples.index import FrameIndex
from ogmkit.typing import Float32Array


class PredictedGrids(Protocol):
    """Probabilities of one frame."""

    @property
    def scene(self) -> str:
        """The scene's name."""

    @property
    def camera(self) -> str:
        """Channel."""

    @property
    def frame(self) -> int:
        """Place among the camera's frames."""

    @property
    def bev(self) -> Float32Array | None:
        """(2, rows, columns) on the grid; None for a system without."""

    @property
    def image(self) -> Float32Array | None:
        """(2, h, w) in camera view; None for a system without."""


class OpenRun(Protocol):
    """A trained run, opened once."""

    @property
    def path(self) -> Path:
        """What it was opened by."""

    @property
    def checkpoint(self) -> Path:
        """The checkpoint's file."""

    @property
    def system(self) -> str:
        """The system's name."""

    @property
    def name(self) -> str:
        """The system's name as tables have it."""

    @property
    def output(self) -> Output:
        """What it predicts."""

    @property
    def masks(self) -> str | None:
        """The set of camera-view masks that its grids come from; None for a system without."""

    @property
    def thresholds(self) -> Sequence[float] | None:
        """Of drivable and vehicles, chosen on the validation of the training; None for a system without."""

    @property
    def grid(self) -> GridSpec:
        """Of its predictions."""

    @property
    def step_s(self) -> float:
        """Time between the images that it plans from, and between the points that it plans."""

    @property
    def cameras(self) -> Sequence[str]:
        """Channels that it was trained on."""

    def warps_by(self, homography: str | None) -> str | None:
        """The source that a planner warps by if asked for one; None for one that warps nothing."""

    def frames(
        self, index: FrameIndex, homography: str | None, *, batch_size: int, workers: int
    ) -> Iterator[PredictedGrids]:
        """Grids of every frame of an index, in order."""

    def plans(
        self, index: FrameIndex, homography: str | None, *, batch_size: int, workers: int
    ) -> Iterator[PlannedFrame]:
        """Plans of every sequence of an index, in order."""

"""Trained runs: opened once, checked against what they are to predict."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from torch import Tensor

from ogmkit.base.differences import differences
from ogmkit.base.news import Waiting, tell
from ogmkit.errors import CheckpointError, SettingsError
from ogmkit.grid import GridSpec
from ogmkit.homography.sources import sources_of
from ogmkit.learn.catalogue import CATALOGUE, Output
from ogmkit.learn.checkpoints import Card, read_checkpoint, system_of
from ogmkit.learn.devices import best_device, device_name
from ogmkit.learn.perception_settings import ImageTraining
from ogmkit.learn.runs import checkpoint_file
from ogmkit.learn.systems.base import System
from ogmkit.metrics.plan import PlannedFrame
from ogmkit.samples.index import FrameIndex
from ogmkit.shards.manifest import file_sha256, read_manifest

if TYPE_CHECKING:
    from ogmkit.learn.predict.frames import FramePrediction


@dataclass(frozen=True, eq=False)
class Run:
    """A trained system, opened.

    Attributes:
        path: the RUN folder or checkpoint that it was opened by.
        checkpoint: the file itself.
        card: what the checkpoint says of itself.
        weights: the checkpoint's, which stay in the file until a network takes them.
    """

    path: Path
    checkpoint: Path
    card: Card
    weights: Mapping[str, Tensor]

    @cached_property
    def model(self) -> System:
        """The network, on the device that it works on; built when first asked for.

        Raises:
            CheckpointError: the weights are not this system's.
        """
        return system_of(self.checkpoint, self.card, self.weights).to(best_device())

    def release(self) -> None:
        """Let the network go; it is built again when asked for."""
        self.__dict__.pop("model", None)

    @property
    def system(self) -> str:
        """The system's name."""
        return self.card.settings.system

    @property
    def output(self) -> Output:
        """What the system predicts."""
        return CATALOGUE[self.system].output

    @property
    def name(self) -> str:
        """The system's name as tables have it: `-np` for a planner without the past."""
        return self.card.settings.label

    @property
    def masks(self) -> str | None:
        """The set of camera-view masks that its grids come from; None for a system without."""
        return self.card.settings.masks_learnt if self.output == "grids" else None

    @property
    def thresholds(self) -> tuple[float, ...] | None:
        """Of drivable and vehicles, chosen on the validation; None for a system without masks."""
        found = self.weights.get("thresholds")
        return None if found is None else tuple(round(value, 2) for value in found.tolist())

    @property
    def image_size(self) -> tuple[int, int]:
        """(height, width) that images are resized to.

        Raises:
            CheckpointError: the system sees no images.
        """
        settings = self.card.settings
        if not isinstance(settings, ImageTraining):
            raise CheckpointError(f"{self.path}: {self.system} sees no images; choose another run")
        return settings.image_size

    @property
    def grid(self) -> GridSpec:
        """Of the shards that it was trained on, and of its predictions."""
        return self.card.grid

    @property
    def step_s(self) -> float:
        """Of the shards that it was trained on: time from one image or point of a plan to the next."""
        return self.card.step_s

    @property
    def cameras(self) -> tuple[str, ...]:
        """Channels that it was trained on."""
        return self.card.cameras

    @property
    def sha256(self) -> str:
        """The checkpoint's checksum, hexadecimal."""
        return file_sha256(self.checkpoint)

    def warps_by(self, homography: str | None) -> str | None:
        """The source that a planner warps by: the one asked for, else its own; None if it warps nothing."""
        own = tuple(self.card.settings.homographies_read.values()) if self.output == "plan" else ()
        return (homography or own[0]) if own else None

    def frames(
        self, index: FrameIndex, homography: str | None, *, batch_size: int, workers: int
    ) -> Iterator["FramePrediction"]:
        """What the run says of every frame of an index; lets the network go afterwards.

        Args:
            index: of frames of the run's grid.
            homography: source that masks in camera view are warped by, or one for the drivable area and one
                for the vehicles, which predicts twice; None leaves them there.
            batch_size: frames at a time.
            workers: processes that read.

        Raises:
            OgmkitError: as `predict_frames`.
        """
        from ogmkit.learn.predict.frames import of_both, predict_frames  # noqa: PLC0415  # they need Run

        try:
            tell(Waiting(f"{self.path} on {device_name()}"))
            specs = map(self.model.prediction_spec, self._sources(homography))
            passes = [
                predict_frames(self, index, spec, batch_size=batch_size, workers=workers) for spec in specs
            ]
            for drivable, *vehicles in zip(*passes, strict=True):
                yield of_both(drivable, vehicles[0]) if vehicles else drivable
        finally:
            self.release()

    def _sources(self, homography: str | None) -> tuple[str | None, ...]:
        """The sources that a pass each is made with."""
        if homography is None or self.masks is None:
            return (homography,)
        return tuple(dict.fromkeys(sources_of(homography)))

    def plans(
        self, index: FrameIndex, homography: str | None, *, batch_size: int, workers: int
    ) -> Iterator[PlannedFrame]:
        """What a planner plans for every sequence of an index; lets the network go afterwards.

        Arguments and errors as of `frames`, and of `ogmkit.learn.predict.plans.inference.predict_plans`.
        """
        from ogmkit.learn.predict.plans.inference import predict_plans  # noqa: PLC0415  # it needs Run

        try:
            tell(Waiting(f"{self.path} on {device_name()}"))
            spec = self.model.prediction_spec(homography)
            yield from predict_plans(self, index, spec, batch_size=batch_size, workers=workers)
        finally:
            self.release()


def open_run(path: Path) -> Run:
    """Open a trained system.

    Args:
        path: a RUN folder, whose best checkpoint is used, or a checkpoint.

    Raises:
        CheckpointError: there is none, or it is damaged or foreign.
    """
    file = checkpoint_file(path)
    card, content = read_checkpoint(file, mapped=True)
    return Run(path, file, card, content["state_dict"])


def require_system(run: Run, *systems: str) -> None:
    """Refuse a run of another system.

    Raises:
        CheckpointError: it is of none of these.
    """
    if run.system not in systems:
        raise CheckpointError(
            f"{run.path}: is a run of {run.system}, not of {' or '.join(systems)}; choose another"
        )


def require_planner(run: Run) -> None:
    """Refuse a run that predicts masks or homographies.

    Raises:
        CheckpointError: it plans nothing.
    """
    if run.output != "plan":
        raise CheckpointError(
            f"{run.path}: is a run of {run.system}, which plans nothing; choose a planner's"
        )


def require_grid(run: Run, shards: Path) -> None:
    """Refuse shards of another grid than the run was trained on.

    Raises:
        SettingsError: the grids differ; names how.
        ShardError: the folder has no manifest.
    """
    require_same_grid(run, read_manifest(shards).settings.targets.grid, shards)


def require_same_grid(run: Run, grid: GridSpec, owner: Path) -> None:
    """Refuse another grid than the run was trained on.

    Args:
        run: the run.
        grid: the other one.
        owner: what has it, for messages.

    Raises:
        SettingsError: the grids differ; names how.
    """
    different = differences({"grid": vars(run.grid)}, {"grid": vars(grid)})
    if different:
        raise SettingsError(
            f"{run.path}: was trained on another grid than {owner} has: {', '.join(different)}; "
            "extract with the same grid, or train again"
        )


def require_cameras(run: Run, cameras: Sequence[str]) -> None:
    """Refuse cameras that the run was not trained on.

    Raises:
        SettingsError: names the first of them.
    """
    unknown = [camera for camera in cameras if camera not in run.cameras]
    if unknown:
        known = ", ".join(run.cameras)
        raise SettingsError(f"{run.path}: does not know {unknown[0]}: it was trained on {known}")

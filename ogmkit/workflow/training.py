"""Steps that train a network."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ogmkit.base.news import Progress
from ogmkit.learn.perception_settings import EncoderTraining
from ogmkit.learn.settings import TrainSettings
from ogmkit.shards.manifest import file_sha256
from ogmkit.workflow.config import ELSEWHERE, Config, Training
from ogmkit.workflow.steps import (
    EXTRACT,
    Call,
    Made,
    first_gone,
    letting_go,
    maker_of,
    rendering,
    training,
)

if TYPE_CHECKING:
    from ogmkit.learn.training.train import TrainSummary

_HOW = {"workers", "cache_samples", "checkpoint_every", *ELSEWHERE}
"""Settings that don't decide what comes out."""


@dataclass(frozen=True)
class TrainCall:
    """A training to be called in any process.

    Attributes:
        settings: what to train.
        shards: what from.
        run: its folder.
        overwrite: start over.
    """

    settings: TrainSettings
    shards: Path
    run: Path
    overwrite: bool

    def __call__(self, on_progress: Progress) -> "TrainSummary | None":
        """Train, or resume."""
        from ogmkit.learn.training.train import train  # noqa: PLC0415  # torch

        return train(self.settings, self.shards, self.run, overwrite=self.overwrite, on_progress=on_progress)


@dataclass(frozen=True)
class Train:
    """One training.

    Attributes:
        config: the whole configuration.
        training: which.
    """

    config: Config
    training: Training

    @property
    def name(self) -> str:
        """The command and the RUN."""
        return training(self.training.name)

    @property
    def needs(self) -> tuple[str, ...]:
        """Shards, and of what is added to them or trained before, what the system learns from."""
        settings, found = self.training.settings, [EXTRACT]
        found += map(maker_of, settings.homographies_read.values())
        if settings.masks_learnt is not None:
            found.append(rendering(settings.masks_learnt))
        found += map(training, sorted(self._trained_here & {*settings.runs_read.values()}))
        return tuple(dict.fromkeys(found))

    @property
    def settings(self) -> Mapping[str, Any]:
        """The training's; of weights that come from elsewhere, their checksum."""
        settings = self.training.settings
        values = {name: value for name, value in settings.to_dict().items() if name not in _HOW}
        weights = settings.encoder_weights if isinstance(settings, EncoderTraining) else None
        if weights is not None and Path(weights).is_file():
            values["encoder_weights"] = file_sha256(Path(weights))
        from ogmkit.learn.runs import checkpoint_file  # noqa: PLC0415  # YAML

        for name, run in settings.runs_read.items():
            if run not in self._trained_here:
                values[name] = file_sha256(checkpoint_file(Path(run)))
        return values

    @property
    def exact(self) -> bool:
        """Not on every machine: the checkpoint tells one training from another."""
        return False

    def missing(self, files: Sequence[str]) -> str:
        """The checkpoint that others take; it stands first."""
        return first_gone(self.config.out, files[:1])

    def run(self, call: Call) -> Made:
        """Train, or resume."""
        return self.made(self.work(overwrite=call.overwrite)(letting_go(call)))

    def work(self, *, overwrite: bool) -> TrainCall:
        """The training; its folder is cleared before the first step."""
        return TrainCall(self._settings(), self.config.shards, self.run_folder, overwrite)

    def made(self, result: "TrainSummary | None") -> Made:
        """The files, with the checkpoint's checksum."""
        from ogmkit.learn.runs import checkpoint_file  # noqa: PLC0415  # YAML

        best = checkpoint_file(self.run_folder)
        note = "" if result is None else f"{result.steps} steps"
        if result is not None and result.score is not None:
            note += f", best {result.score_name} {result.score:.4g}"
        return Made(self._files(best), note=note, identity=file_sha256(best))

    @property
    def run_folder(self) -> Path:
        """The training's folder."""
        return self.config.run_folder(self.training.name)

    @property
    def _trained_here(self) -> frozenset[str]:
        """Trainings of this configuration that others may start from."""
        return frozenset(one.name for one in self.config.grids)

    def _settings(self) -> TrainSettings:
        """With the places of the runs that it starts from instead of their names."""
        settings = self.training.settings
        places: dict[str, Any] = {
            name: str(self.config.run_folder(run))
            for name, run in settings.runs_read.items()
            if run in self._trained_here
        }
        return dataclasses.replace(settings, **places)

    def _files(self, best: Path) -> tuple[str, ...]:
        """What the training wrote, its best checkpoint first."""
        from ogmkit.learn import runs  # noqa: PLC0415  # YAML

        run = self.run_folder
        names = (runs.BEST, runs.LAST, runs.CONFIG, runs.SPLITS, runs.METRICS, runs.SAMPLES)
        named = (run / name for name in names)
        others = (*named, *sorted((run / runs.TENSORBOARD).glob("*")))
        paths = (best, *(path for path in others if path != best and path.is_file()))
        return tuple(path.relative_to(self.config.out).as_posix() for path in paths)

"""Training a system on shards: from settings to a folder of checkpoints, figures and pictures."""

import logging
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path

import torch
from lightning.pytorch import Callback, Trainer, seed_everything

from ogmkit.base.news import Found, Waiting, listening, tell
from ogmkit.base.parts import part_of
from ogmkit.learn.checkpoints import AtomicCheckpointIO, Card
from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.module import Loading, ShardDataModule
from ogmkit.learn.devices import arithmetic
from ogmkit.learn.perception_settings import ImageTraining
from ogmkit.learn.runs import LAST, METRICS, SAMPLES, TENSORBOARD, open_folder
from ogmkit.learn.settings import TrainSettings
from ogmkit.learn.systems.base import System
from ogmkit.learn.systems.registry import build_system
from ogmkit.learn.training.events import Events
from ogmkit.learn.training.found import first_line, slow_warning
from ogmkit.learn.training.interrupts import Interrupted
from ogmkit.learn.training.looking import LookingOnce, looks_once
from ogmkit.learn.training.plan import plan_training
from ogmkit.learn.training.processes import LostProcessError, connected, helps
from ogmkit.learn.training.progress import Progress
from ogmkit.learn.training.resuming import resumed_from
from ogmkit.learn.training.saving import Checkpoints
from ogmkit.learn.training.warm_start import require_perception, warm_start
from ogmkit.learn.training.watching import Metrics, Samples
from ogmkit.samples.splits import Division


@dataclass(frozen=True)
class TrainSummary:
    """What a training did.

    Attributes:
        system: its name.
        frames: that it learnt from; of a planner, sequences.
        val_frames: that it was scored on.
        steps: of the optimiser, over all runs.
        resumed_step: where this run resumed; 0 where it began.
        score_name: of the score.
        score: the best one; None where there was none.
        seconds: wall time of this run.
    """

    system: str
    frames: int
    val_frames: int
    steps: int
    resumed_step: int
    score_name: str
    score: float | None
    seconds: float


def train(
    settings: TrainSettings,
    shards: Path,
    run: Path,
    *,
    split_file: Path | None = None,
    overwrite: bool = False,
    on_progress: Callable[[int, int], None] | None = None,
) -> TrainSummary | None:
    """Train a system, or resume one that was cut short.

    Killed at any moment, the same call again resumes from the last checkpoint, with the same batches and the
    same random numbers: on a CPU the weights come out as of a training that nothing disturbed.

    Args:
        settings: what to train, and how.
        shards: a folder that an extraction finished.
        run: the training's folder.
        split_file: JSON of split → scenes, instead of the shards' splits.
        overwrite: start over where a training exists.
        on_progress: called with (steps done, steps in all).

    Returns:
        What was done; None in the processes that help the first one, where there are several devices.

    Raises:
        SettingsError: settings and shards don't go together.
        ShardError: shards lack what the system learns from, or a split is empty.
        TrainingError: no frame can be learnt from, or the loss is not finite.
        OutputError: `run` holds something else, can't be written, or another training is under way there.
        CheckpointError: the checkpoint to resume from is damaged or not this training's.
        LostProcessError: where there are several devices, another one's process has ended.
        KeyboardInterrupt: Ctrl-C, after the step was finished and saved.
    """
    started = time.monotonic()
    plan = plan_training(settings, shards, run, split_file=split_file, overwrite=overwrite)
    full = require_perception(plan.settings, plan.grid)
    with _quiet(), listening(None) if helps() else nullcontext():
        seed_everything(full.seed, verbose=False)
        system = build_system(full, plan.grid, full.cameras)
        system.freeze_parts()
        data = _data(full, shards, plan.division, system)
        folder = open_folder(run, full, plan.division.splits(), overwrite=overwrite)
        if helps():
            with suppress(KeyboardInterrupt, LostProcessError):  # the first process tells
                _fit(system, data, run, plan.division, None)
            return None
        with folder:
            saving = _fit(system, data, run, plan.division, on_progress)
    return TrainSummary(
        system=full.system,
        frames=len(data.train_set),
        val_frames=len(data.val_set),
        steps=saving.step,
        resumed_step=saving.resumed_step,
        score_name=system.score_name,
        score=saving.best,
        seconds=time.monotonic() - started,
    )


def _data(settings: TrainSettings, shards: Path, division: Division, system: System) -> ShardDataModule:
    augmentation = (
        Augmentation(settings.colour, settings.flip, settings.pitch_deg, settings.roll_deg)
        if isinstance(settings, ImageTraining)
        else Augmentation(0, settings.flip)
    )
    loading = Loading(
        settings.batch_size,
        settings.workers,
        settings.seed,
        None if augmentation == Augmentation(0, 0) else augmentation,
    )
    return ShardDataModule(
        shards,
        division.train,
        division.val,
        settings.cameras,
        system.spec,
        loading=loading,
        limit_frames=settings.limit_frames,
        sequences=system.plans,
    )


def _fit(
    system: System,
    data: ShardDataModule,
    run: Path,
    division: Division,
    on_progress: Callable[[int, int], None] | None,
) -> Checkpoints:
    settings, last = system.settings, run / LAST
    fresh = Card(settings, system.grid, system.cameras, data.train_set.step_s)
    card, step = resumed_from(last, fresh)
    data.train_batches.epoch, data.train_batches.skip = card.epoch, card.batches
    tell(Found(first_line(settings, data, division, run, step)))
    if warning := slow_warning(settings, len(data.train_set)):
        tell(Found(warning))
    if not last.exists():
        _begin(system, data)
    saving = Checkpoints(run, card, data.train_batches)
    watching: list[Callback] = [Metrics(run / METRICS), Samples(run / SAMPLES), Progress(on_progress)]
    looking = LookingOnce(run, saving.interrupts)
    trainer = _trainer(settings, run, step, [looking, saving, *watching])
    try:
        with _kept(system, data, run), looking, saving.interrupts.held(), connected():
            trainer.fit(system, datamodule=data, ckpt_path=last if last.exists() else None)
    except Interrupted as interrupted:
        raise KeyboardInterrupt from interrupted
    return saving


@contextmanager
def _kept(system: System, data: ShardDataModule, run: Path) -> Iterator[None]:
    """Inside, decoded images and masks are kept in two files, by names that mark them as this process's.

    Not where the settings don't ask for it, or each image is seen only once.
    """
    if not system.settings.cache_samples or looks_once(system):
        yield
        return
    sets = {"train": data.train_set, "val": data.val_set}
    paths = {name: part_of(run / f"samples-{name}") for name in sets}
    try:
        for name, samples in sets.items():
            samples.keep_pixels(paths[name])
        yield
    finally:
        for path in paths.values():
            path.unlink(missing_ok=True)


def _begin(system: System, data: ShardDataModule) -> None:
    """Give a fresh system what it begins with."""
    warm_start(system)
    if (spec := system.prepare_spec) is not None:
        tell(Waiting("reading the training samples once, for their statistics"))
        system.prepare(data.statistics(spec, system.prepare_rounds))


def _trainer(settings: TrainSettings, run: Path, step: int, callbacks: list[Callback]) -> Trainer:
    """Lightning's trainer; a resumed training starts at `step`."""
    return Trainer(
        accelerator="auto" if torch.cuda.is_available() else "cpu",
        devices=settings.devices or 1,
        precision=arithmetic(settings.precision),
        max_epochs=settings.epochs,
        max_steps=settings.max_steps or -1,
        accumulate_grad_batches=settings.accumulate,
        gradient_clip_val=settings.clip_norm or None,
        num_sanity_val_steps=1,
        log_every_n_steps=10,
        logger=Events(run / TENSORBOARD, step),
        callbacks=callbacks,
        plugins=[AtomicCheckpointIO()],
        default_root_dir=run,
        use_distributed_sampler=False,
        enable_checkpointing=False,
        enable_progress_bar=False,
        enable_model_summary=False,
    )


@contextmanager
def _quiet() -> Iterator[None]:
    """Lightning's hints are for people who write modules; the library never prints."""
    names = ("lightning.pytorch", "lightning.fabric", "lightning")
    levels = {name: logging.getLogger(name).level for name in names}
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module=r"lightning\..*")
        warnings.filterwarnings("ignore", message=".*torch.jit.*")
        for name in names:
            logging.getLogger(name).setLevel(logging.ERROR)
        try:
            yield
        finally:
            for name, level in levels.items():
                logging.getLogger(name).setLevel(level)

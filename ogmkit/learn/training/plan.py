"""What a training is going to do, checked as far as that takes no torch and a look at the shards."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from ogmkit.errors import SettingsError, TrainingError
from ogmkit.grid import GridSpec
from ogmkit.learn.catalogue import entry_of
from ogmkit.learn.choices import completed
from ogmkit.learn.perception_settings import ImageTraining
from ogmkit.learn.planner_settings import HolisticTraining
from ogmkit.learn.runs import checkpoint_file, require_resumable
from ogmkit.learn.settings import TrainSettings
from ogmkit.samples.requirements import require_drivable, require_extracted, valid_frames
from ogmkit.samples.spec import SampleSpec
from ogmkit.samples.splits import TRAIN, VAL, Division, divide_scenes, split_scenes
from ogmkit.shards.listed import listed_shard
from ogmkit.shards.manifest import Manifest, read_manifest


@dataclass(frozen=True)
class TrainingPlan:
    """A training that may begin.

    Attributes:
        settings: with cameras and masks filled in.
        grid: the shards'.
        division: which scenes are for what.
    """

    settings: TrainSettings
    grid: GridSpec
    division: Division


def plan_training(
    settings: TrainSettings,
    shards: Path,
    run: Path,
    *,
    split_file: Path | None = None,
    overwrite: bool = False,
) -> TrainingPlan:
    """Check what a training needs, by the manifest and one shard of each split; writes nothing.

    Arguments as of `ogmkit.learn.training.train.train`.

    Raises:
        SettingsError: settings and shards don't go together.
        TableError: the split file is absent or malformed.
        ShardError: shards lack what the system learns from.
        TrainingError: a split is empty.
        OutputError: `run` holds something else, or a training with other settings or scenes.
        CheckpointError: a run to start from is missing.
    """
    manifest = read_manifest(shards)
    full = completed(settings, shards, manifest)
    division = _division(full, shards, manifest, split_file)
    for path in full.runs_read.values():
        checkpoint_file(Path(path))
    _require_made(full, shards, manifest, division)
    if not overwrite:
        require_resumable(run, full, division.splits())
    return TrainingPlan(full, manifest.settings.targets.grid, division)


def _division(settings: TrainSettings, shards: Path, manifest: Manifest, split_file: Path | None) -> Division:
    """The scenes to learn from and to choose the checkpoint by, both there and none in common."""
    division = divide_scenes(
        shards,
        manifest,
        train=settings.train_split,
        val=settings.val_split,
        split_file=split_file,
        ratio=settings.split_ratio,
        seed=settings.seed,
    )
    names = (TRAIN, VAL) if settings.split_ratio is not None else settings.splits
    for name, scenes in zip(names, (division.train, division.val), strict=True):
        if not scenes:
            raise TrainingError(
                f"split {name!r} has no scene among the shards (there is {_known(manifest, split_file)}); "
                "choose others, or divide them by --split-ratio"
            )
    shared = set(division.train) & set(division.val)
    if shared:
        raise SettingsError(f"scene {min(shared)} is in both splits, {names[0]} and {names[1]}")
    return division


def _known(manifest: Manifest, split_file: Path | None) -> str:
    """Names of the splits that have scenes."""
    splits = split_scenes(manifest, split_file=split_file)
    return ", ".join(sorted(split for split, found in splits.items() if found)) or "none"


def _require_made(settings: TrainSettings, shards: Path, manifest: Manifest, division: Division) -> None:
    """Look for masks and homographies in the first shard of each split; the index looks at all."""
    entries = {entry.scene: entry for entry in manifest.shards}
    if settings.learns_drivable:
        require_drivable(shards, manifest)
    for needs in _needs(settings):
        require_extracted(shards, manifest, needs)
        for names in (division.train, division.val):
            with listed_shard(shards, entries[names[0]]) as shard:
                for camera in settings.cameras:
                    valid_frames(shard, camera, needs)


def _needs(settings: TrainSettings) -> Iterator[SampleSpec]:
    """What samples need of the shards, as far as the settings say."""
    image_size = settings.image_size if isinstance(settings, ImageTraining) else None
    frozen = isinstance(settings, HolisticTraining) and settings.freezes_perception
    masks = None if frozen else settings.masks_learnt
    needs = SampleSpec(image_size, masks, lidar=entry_of(settings.system).inputs == "lidar")
    yield needs
    for source in settings.homographies_read.values():
        yield replace(needs, homography=source)

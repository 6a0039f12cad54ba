"""What the steps of a run need and no step makes: checked before anything is done.

That a step makes the homographies and masks that a training learns from, `read_trainings` has checked.
"""

from collections.abc import Mapping, Sequence

from ogmkit.errors import SettingsError
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.needed_files import extractable, needed_files
from ogmkit.pipeline.selection import require_known_names, select_scenes
from ogmkit.samples.splits import TEST, VAL
from ogmkit.workflow import steps
from ogmkit.workflow.config import Config, Training
from ogmkit.workflow.engine import named

_Splits = Mapping[str, Sequence[str]]


def require_needs(config: Config) -> None:
    """Refuse a configuration that some step would fail with, hours later.

    Args:
        config: the configuration.

    Raises:
        TableError: the dataset is missing, or its tables or the split file are damaged.
        SettingsError: the dataset lacks a scene, camera, category or split that a step asks for, or the
            shards would lack images or the drivable area that a network sees. The step's name is in front.
    """
    with named(steps.EXTRACT):
        splits = _extracted(config)
    for training in config.trainings:
        with named(steps.training(training.name)):
            _require_inputs(config, training)
            _require_splits(splits, _splits_of(training))
    for name, scored in ((steps.PERCEPTION, config.grids), (steps.PLANNING, config.planners)):
        if scored:
            with named(name):
                _require_splits(splits, {"split": config.evaluate.split or (TEST if TEST in splits else VAL)})


def _extracted(config: Config) -> _Splits:
    """The scenes of each split that will be in the shards; splits without one are left out."""
    source = config.source
    with Dataset(source.data, source.version) as dataset:
        chosen = select_scenes(dataset, source.scenes, source.splits, source.split_file)
        require_known_names(dataset, config.extract, chosen)
        if config.extract.leaves_out:
            chosen = extractable(needed_files(dataset, config.extract, chosen), config.extract, chosen)
        splits = dataset.splits(source.split_file)
    found = {split: [name for name in names if name in chosen] for split, names in splits.items()}
    return {split: names for split, names in found.items() if names}


def _splits_of(training: Training) -> dict[str, str]:
    """Setting → split that a training reads."""
    return dict(zip(("train_split", "val_split"), training.settings.splits, strict=True))


def _require_splits(splits: _Splits, wanted: Mapping[str, str]) -> None:
    for setting, split in wanted.items():
        if split not in splits:
            there = ", ".join(f"{name} ({len(scenes)})" for name, scenes in splits.items()) or "none"
            raise SettingsError(
                f"split {split!r} has no scene among those to extract; splits with scenes: {there}; "
                f"change {setting}, scenes, splits or split_file"
            )


def _require_inputs(config: Config, training: Training) -> None:
    """Refuse cameras that aren't extracted, and shards without the images that a network sees."""
    extract = config.extract
    for camera in training.settings.cameras:
        if camera not in extract.cameras:
            there = ", ".join(extract.cameras)
            raise SettingsError(f"camera {camera} is not extracted, only {there}; add it to `cameras`")
    if CATALOGUE[training.settings.system].inputs == "images" and extract.targets.images == "none":
        raise SettingsError("learns from images, which `images: none` leaves out; remove it from extract")
    if training.settings.learns_drivable and extract.targets.no_map:
        raise SettingsError(
            "needs the drivable area, which `no_map: true` leaves out; remove it from extract"
        )

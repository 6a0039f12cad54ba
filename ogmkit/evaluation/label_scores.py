"""Grids of other networks scored against labels by name."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ogmkit.base.names import with_number
from ogmkit.errors import SettingsError, ShardError
from ogmkit.evaluation.label_predictions import Predictions, read_predictions
from ogmkit.evaluation.label_result import LabelEvaluation, LabelFigure
from ogmkit.labels.catalogue import definition as named
from ogmkit.labels.definition import Definition, differing_fields
from ogmkit.labels.names import PAPER
from ogmkit.samples.splits import split_scenes
from ogmkit.shards.folder import ShardFolder
from ogmkit.shards.labels_stored import stored_record
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema_labels import LABELS
from ogmkit.typing import BoolArray

Counts = dict[str, "np.ndarray[tuple[int], np.dtype[np.int64]]"]
"""Class → cells of both, and of either."""


def score_predictions(
    shards: Path,
    name: str,
    files: Sequence[Path],
    *,
    split: str | None = None,
    split_file: Path | None = None,
    camera: str = "CAM_FRONT",
    threshold: float = 0.5,
    on_progress: Callable[[int, int], None] | None = None,
) -> LabelEvaluation:
    """Score files of grids against the labels of one definition; all files share a table.

    Args:
        shards: a folder that an extraction finished, with these labels.
        name: the definition's.
        files: each a row.
        split: its scenes are scored whole; by default, the samples that the first file has.
        split_file: a JSON file of split → scene names instead of the shards' own.
        camera: whose frames the paper's labels are taken of.
        threshold: what probabilities must exceed.
        on_progress: called with (scenes done, scenes in all).

    Raises:
        SettingsError: the shards lack these labels, a file follows another definition or lacks samples, or
            the split is unknown.
        DataFileError: a file can't be read.
        ShardError: a shard is damaged, or its labels were made by another definition.
    """
    folder = ShardFolder(shards)
    definition = _definition(folder, name)
    classes, shape = definition.class_names, definition.grid.shape
    opened = [read_predictions(path, classes, shape) for path in files]
    for one in opened:
        require_definition(one.path, definition, one.definition, one.record)
    scenes = folder.scenes if split is None else _scenes(folder, split, split_file)
    counts: list[Counts] = [{} for _ in opened]
    scored = there = 0
    for done, scene in enumerate(scenes, start=1):
        with folder.shard(scene) as shard:
            place = camera if name == PAPER else definition.place
            _require_labels(shard, definition, place)
            tokens = shard.strings(place, "sample_token")
            wanted = [i for i, token in enumerate(tokens) if split is not None or token in opened[0].rows]
            there, scored = there + (len(tokens) if wanted else 0), scored + len(wanted)
            for row in wanted:
                truth = _truth(shard, definition, place, row)
                for predictions, count in zip(opened, counts, strict=True):
                    _add(count, predictions, truth, tokens[row], threshold)
        if on_progress is not None:
            on_progress(done, len(scenes))
    _require_samples(opened[0], scored, split)
    figures = tuple(
        figure
        for predictions, count in zip(opened, counts, strict=True)
        for figure in _figures(definition, predictions, count, scored)
    )
    systems = tuple(one.path.name for one in opened)
    return LabelEvaluation(
        name, definition.version, definition.counted, scored, there, threshold, classes, systems, figures
    )


def require_definition(
    path: Path, definition: Definition, name: str | None, record: Mapping[str, Any] | None
) -> None:
    """Refuse grids that follow another definition than the labels they would be scored by.

    Args:
        path: where the grids are from, for the message.
        definition: the labels'.
        name: of the grids' own; None where nothing is said.
        record: its record; None for today's of that name.

    Raises:
        SettingsError: they differ; the first field that does is named.
    """
    if name is None or (record is None and name == definition.name):
        return
    there = named(name).to_dict() if record is None else dict(record)
    if definition.name != PAPER and there == named(definition.name).to_dict():
        return  # the labels may be without a map
    for different in differing_fields(there, definition.to_dict()):
        together = f"{name}, which can't share a column with {definition.name}"
        raise SettingsError(f"{path}: follows definition {together}: {different}")


def require_one_table(shards: Path, name: str, runs: Sequence[Path]) -> None:
    """Refuse runs of ogmkit's own systems beside grids: they are scored by the paper's definition.

    Args:
        shards: the folder.
        name: the definition that grids are scored by.
        runs: folders or checkpoints.

    Raises:
        SettingsError: there is a run; names the first field that differs, where the definition is another.
    """
    folder = ShardFolder(shards)
    paper = named(PAPER, folder.manifest.settings.targets)
    for run in runs:
        require_definition(run, _definition(folder, name), PAPER, paper.to_dict())
        raise SettingsError(f"{run}: is scored in a table of its own; leave --predictions out")


def _definition(folder: ShardFolder, name: str) -> Definition:
    """The definition as these shards have it, which may be without a map."""
    settings = folder.manifest.settings
    if name not in settings.definitions:
        there = ", ".join(settings.definitions)
        raise SettingsError(
            f"{folder.path}: has no labels {name!r}, only {there}; extract with --definition {name}"
        )
    if name == PAPER:
        return named(name, settings.targets)
    return next(one for one in settings.labels if one.name == name)


def _scenes(folder: ShardFolder, split: str, split_file: Path | None) -> tuple[str, ...]:
    splits = split_scenes(folder.manifest, split_file=split_file)
    if not splits.get(split):
        raise SettingsError(f"{folder.path}: no scene is in split {split!r}; there is {', '.join(splits)}")
    return splits[split]


def _require_labels(shard: Shard, definition: Definition, place: str) -> None:
    """Refuse labels that were made by another definition than the name stands for today."""
    if definition.name == PAPER:
        if place not in shard.cameras:
            raise SettingsError(f"{shard.path}: has no {place}; choose a --camera")
        return
    group = shard.h5[f"{place}/{LABELS}/{definition.name}"]
    for different in differing_fields(stored_record(shard.path, group), definition.to_dict()):
        raise ShardError(f"{shard.path}: labels {definition.name} are by another definition: {different}")


def _truth(
    shard: Shard, definition: Definition, place: str, row: int
) -> dict[str, tuple[BoolArray, BoolArray]]:
    """Class → (rows, columns) where it is, and which cells count."""
    below = "" if definition.name == PAPER else f"{LABELS}/{definition.name}/"

    def read(name: str) -> Any:  # noqa: ANN401  # arrays of several dtypes
        return shard.dataset(place, f"{below}{name}")[row]

    everywhere = np.ones(definition.grid.shape, dtype=np.bool_)
    counted = everywhere
    if definition.counted == "visibility-2":
        counted = read("visibility") >= 2  # background is 255
    elif definition.counted == "valid":
        counted = read("valid") > 0
    elif definition.counted == "not-ignored":
        counted = read("ignore") == 0
    boxes = {one.name for one in definition.classes if one.categories}
    boxes |= {one.name for one in definition.classes if set(one.unites) & boxes}
    by_boxes = definition.counted == "visibility-2"
    return {
        name: (read(name) > 0, counted if name in boxes or not by_boxes else everywhere)
        for name in definition.class_names
    }


def _add(
    counts: Counts,
    predictions: Predictions,
    truth: Mapping[str, tuple[BoolArray, BoolArray]],
    token: str,
    threshold: float,
) -> None:
    if token not in predictions.rows:
        raise SettingsError(f"{predictions.path}: has no sample {token}; give grids of all that are scored")
    for name in predictions.arrays:
        label, counted = truth[name]
        predicted = predictions.mask(name, token, threshold)
        both = np.count_nonzero(predicted & label & counted)
        either = np.count_nonzero((predicted | label) & counted)
        counts[name] = counts.get(name, np.zeros(2, dtype=np.int64)) + np.array([both, either])


def _figures(
    definition: Definition, predictions: Predictions, counts: Counts, frames: int
) -> Iterator[LabelFigure]:
    for name in definition.class_names:
        both, either = counts.get(name, np.zeros(2, dtype=np.int64)).tolist()
        yield LabelFigure(
            system=predictions.path.name,
            definition=definition.name,
            version=definition.version,
            target=name,
            cells=definition.counted,
            metric="foreground_iou",
            frames=frames,
            value=both / either if either else float("nan"),
        )


def _require_samples(predictions: Predictions, scored: int, split: str | None) -> None:
    """Refuse a file whose samples the shards lack: it would be scored on fewer than it says."""
    lost = len(predictions.rows) - scored
    if split is None and lost:
        samples = with_number(lost, "sample")
        raise SettingsError(f"{predictions.path}: {samples} of {len(predictions.rows)} are not in the shards")

"""Score trained runs, and rows for free, on the frames of a split."""

from collections.abc import Sequence
from pathlib import Path

from ogmkit.errors import SettingsError
from ogmkit.evaluation.baselines import ALL_DRIVABLE, MEAN_MAP, Ceilings
from ogmkit.evaluation.bootstrap import interval_notes
from ogmkit.evaluation.entrants import Entrant, open_entrants, predictions
from ogmkit.evaluation.progress import Progress, spread, ticker
from ogmkit.evaluation.result import Evaluation
from ogmkit.evaluation.scope import TRAINING, Scope, scope_of
from ogmkit.evaluation.scoring import Scored, Scorer


def evaluate(
    shards: Path,
    runs: Sequence[Path] = (),
    *,
    split: str = "val",
    split_file: Path | None = None,
    homography: str | None = None,
    ceilings: Sequence[str] | None = None,
    cameras: Sequence[str] = (),
    threshold: float = 0.5,
    scale: float = 2.0,
    batch_size: int = 8,
    workers: int = 0,
    limit: int | None = None,
    samples: int = 0,
    on_progress: Progress | None = None,
) -> Evaluation:
    """Evaluate runs on a split of a folder of shards, beside rows that need no run.

    A frame without a valid homography counts as predicted empty where masks are warped by it.

    Args:
        shards: a folder that an extraction finished.
        runs: RUN folders, or checkpoints, of systems that predict grids; torch is needed only if there are
            any.
        split: the split to evaluate on; the mean map comes from `train`.
        split_file: a JSON file of split → scene names instead of the manifest's splits.
        homography: the source that masks in camera view are warped by; by default `network` if all shards
            have it, else `surface`.
        ceilings: the sources that get a row of true footprints warped by them; None means all that all
            shards have.
        cameras: channels; none means all.
        threshold: what probabilities must exceed, from 0 and below 1.
        scale: image size / mask size of the ceilings.
        batch_size: frames predicted at a time.
        workers: processes that read for the networks.
        limit: frames of each split at most, evenly spread.
        samples: predictions of each run to keep, of evenly spread frames.
        on_progress: called with (frames done, frames in all), each frame counted once a pass.

    Raises:
        SettingsError: a setting is out of range or names something unknown, or a run doesn't fit the shards.
        TableError: the split file is absent or malformed.
        ShardError: a shard or the manifest is absent, damaged, or lacks something.
        TrainingError: the split has no frame.
        CheckpointError: a run is absent, damaged, or predicts no grids.
    """
    if not 0 <= threshold < 1:
        raise SettingsError(f"threshold: {threshold:g} is not from 0 and below 1")
    scope = scope_of(
        shards,
        split=split,
        split_file=split_file,
        cameras=cameras,
        homography=homography,
        sources=ceilings,
        limit=limit,
    )
    training = 0 if scope.training is None else len(scope.training)
    warped = Ceilings(scope.sources, scope.homography, scale)
    fixed = (ALL_DRIVABLE, *((MEAN_MAP,) if training else ()), *warped.names)
    entrants = open_entrants(runs, scope, fixed) if runs else ()
    tick = ticker(on_progress, training + len(scope.index) * (len(entrants) + 1))
    scorer = Scorer(scope, threshold, tick)
    for_free = scorer.fixed(fixed, warped)  # first: it is quick, and finds what is wrong with the shards
    kept = spread(samples, len(scope.index))
    # One after the other: only one network is held at a time.
    scored = [
        scorer.run(one, predictions(one, scope, batch_size=batch_size, workers=workers, limit=limit), kept)
        for one in entrants
    ]
    tallies = (*(one.tally for one in scored), *for_free)
    return Evaluation(
        split=split,
        scenes=len(scope.scenes),
        frames=len(scope.index),
        cameras=scope.index.cameras,
        grid=scope.grid,
        homography=scope.homography,
        threshold=threshold,
        scale=scale,
        systems=tuple(entrant.name for entrant in entrants),
        fixed=fixed,
        figures=tuple(figure for tally in tallies for figure in tally.figures()),
        separations=tuple(tally.separation() for tally in tallies),
        notes=(*map(_run_note, entrants, scored), *_notes(scope)),
        samples=tuple(sample for one in scored for sample in one.samples),
    )


def _run_note(entrant: Entrant, scored: Scored) -> str:
    if not scored.unmasked:
        return entrant.note
    return f"{entrant.note}; {scored.unmasked} frames have no masks and don't count there"


def _notes(scope: Scope) -> list[str]:
    """What is to be known of the frames."""
    notes = [*interval_notes(len(scope.scenes))]
    notes += [
        f"{count} of {len(scope.index)} frames have no valid {source} homography: predicted empty there"
        for source, count in scope.invalid.items()
        if count and (source in scope.sources or source == scope.homography)
    ]
    if not scope.invalid:
        notes.append("no ceilings: the shards have no homographies")
    if scope.training is None:
        notes.append(f"no {MEAN_MAP}: there is no split {TRAINING!r} to take it from")
    elif {*scope.training.scenes} & {*scope.scenes}:
        notes.append(f"{MEAN_MAP} has seen scenes of this split")
    return notes

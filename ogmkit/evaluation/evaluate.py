"""Score trained runs, and rows for free, on the frames of a split."""

from collections.abc import Sequence
from pathlib import Path

from ogmkit.base.names import with_number
from ogmkit.base.news import Found, tell
from ogmkit.evaluation.baselines import ALL_DRIVABLE, Ceilings
from ogmkit.evaluation.controls import Controls, control_notes, mean_mask_set
from ogmkit.evaluation.entrants import Entrant, entrants_of
from ogmkit.evaluation.near import near_training
from ogmkit.evaluation.progress import Progress, spread, ticker
from ogmkit.evaluation.result import Evaluation
from ogmkit.evaluation.runs import OpenRun
from ogmkit.evaluation.scope import Scope, each_source, scope_of
from ogmkit.evaluation.scoring import Scored, Scorer
from ogmkit.evaluation.seen import seen_by
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.metrics.bootstrap import interval_notes


def evaluate(
    shards: Path,
    runs: Sequence[OpenRun] = (),
    settings: EvaluateSettings | None = None,
    *,
    split_file: Path | None = None,
    cameras: Sequence[str] = (),
    ceilings: Sequence[str] | None = None,
    workers: int = 0,
    on_progress: Progress | None = None,
) -> Evaluation:
    """Evaluate runs on a split of a folder of shards, beside rows that need no run.

    A frame without a valid homography counts as predicted empty where masks are warped by it.

    Args:
        shards: a folder that an extraction finished.
        runs: of systems that predict grids, as `ogmkit.learn.predict.run.open_run` gives them.
        settings: how they are scored; the controls' means come from the scenes to learn from.
        split_file: a JSON file of split → scene names instead of the manifest's splits.
        cameras: channels; none means all.
        ceilings: the sources that get a row of true footprints warped by them; None means all that all
            shards have.
        workers: processes that read for the networks.
        on_progress: called with (frames done, frames in all), each frame counted once a pass.

    Raises:
        SettingsError: a setting names something unknown, or a run doesn't fit the shards.
        TableError: the split file is absent or malformed.
        ShardError: a shard or the manifest is absent, damaged, or lacks something.
        TrainingError: the split has no frame.
        CheckpointError: a run predicts no grids, or its weights don't fit.
    """
    chosen = settings or EvaluateSettings()
    scope = scope_of(
        shards,
        split=chosen.split,
        split_file=split_file,
        cameras=cameras,
        homography=chosen.homography,
        sources=ceilings,
        limit=chosen.limit,
    )
    masks, mask_note = mean_mask_set(scope, [run.masks for run in runs if run.masks is not None])
    controls = Controls(scope, masks, chosen.threshold)
    warped = Ceilings(scope.sources, scope.homography, chosen.scale)
    fixed = (ALL_DRIVABLE, *controls.names, *warped.names)
    entrants = entrants_of(runs, scope, fixed)
    seen = seen_by({one.name: one.run.checkpoint for one in entrants}, scope.scenes)
    tell(Found(f"{scope.index.counted('frame')}; {with_number(len(entrants), 'run')}"))
    tick = ticker(on_progress, controls.frames + len(scope.index) * (len(entrants) + 1))
    scorer = Scorer(scope, chosen.threshold, tick)
    # First: it is quick, and finds what is wrong with the shards.
    for_free = scorer.fixed(fixed, controls, warped)
    kept = spread(chosen.samples, len(scope.index))
    # One after the other: only one network is held at a time.
    scored = [
        scorer.run(
            one,
            one.run.frames(scope.index, scope.homography, batch_size=chosen.batch_size, workers=workers),
            kept,
        )
        for one in entrants
    ]
    tallies = (*(one.tally for one in scored), *for_free)
    return Evaluation(
        split=scope.split,
        scenes=len(scope.scenes),
        frames=len(scope.index),
        cameras=scope.index.cameras,
        grid=scope.grid,
        homography=scope.homography,
        threshold=chosen.threshold,
        scale=chosen.scale,
        systems=tuple(entrant.name for entrant in entrants),
        fixed=fixed,
        figures=tuple(figure for tally in tallies for figure in tally.figures()),
        notes=(
            *map(_run_note, entrants, scored),
            *seen.notes(),
            *_notes(scope),
            *control_notes(scope, controls.names),
            *([mask_note] if mask_note else []),
        ),
        samples=tuple(sample for one in scored for sample in one.samples),
        chosen_on_reported=tuple(seen.chosen),
        learnt_from_reported=tuple(seen.learnt),
        definition=scope.definition,
        near_training=near_training(shards, scope.scenes, scope.training.scenes if scope.training else ()),
        by_scene={tally.system: tally.by_scene() for tally in tallies},
    )


def _run_note(entrant: Entrant, scored: Scored) -> str:
    if not scored.unmasked:
        return entrant.note
    return f"{entrant.note}; {scored.unmasked} frames have no masks and don't count there"


def _notes(scope: Scope) -> list[str]:
    """What is to be known of the frames."""
    notes = [scope.note] if scope.note else []
    notes += interval_notes(len(scope.scenes))
    notes += [
        f"{count} of {len(scope.index)} frames have no valid {source} homography: predicted empty there"
        for source, count in scope.invalid.items()
        if count and source in (*scope.sources, *each_source(scope.homography))
    ]
    if not scope.invalid:
        notes.append("no ceilings: the shards have no homographies")
    return notes

"""Score trained planners, and rows for free, on the sequences of a split."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ogmkit.base.names import with_number
from ogmkit.base.news import Found, tell
from ogmkit.evaluation.near import near_training
from ogmkit.evaluation.planning.fixed import FIXED, fixed_plans, linear_note, untold_points
from ogmkit.evaluation.planning.named import named_figures
from ogmkit.evaluation.planning.planners import planners_of, plans_of
from ogmkit.evaluation.planning.result import PlanEvaluation, PlanFigure, PlanSample
from ogmkit.evaluation.planning.sequences import Sequences, sequences_of, training_sequences
from ogmkit.evaluation.planning.surroundings import surrounding_values
from ogmkit.evaluation.planning.unbeaten import told_notes, untold_notes
from ogmkit.evaluation.progress import Progress, Tick, spread, ticker
from ogmkit.evaluation.runs import OpenRun
from ogmkit.evaluation.seen import seen_by
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.metrics.bootstrap import estimate, interval_notes
from ogmkit.metrics.displacement import (
    METRICS,
    READINGS,
    horizons_s,
    means_of,
    own_values,
    scene_sums,
)
from ogmkit.metrics.linear import EGO_STATUS
from ogmkit.metrics.plan import Plan
from ogmkit.metrics.plans import Plans, columns_of
from ogmkit.shards.manifest import read_manifest


def evaluate_plans(
    shards: Path,
    runs: Sequence[OpenRun] = (),
    settings: EvaluateSettings | None = None,
    *,
    split_file: Path | None = None,
    cameras: Sequence[str] = (),
    workers: int = 0,
    on_progress: Progress | None = None,
) -> PlanEvaluation:
    """Evaluate planners on a split of a folder of shards, beside controls that need no run.

    Of planners that aren't told the destination, `figures` are of the points before it, as of all others.

    All rows are scored on the same sequences: all with a valid trajectory and six images without a gap. An
    image without a valid homography counts as warped to nothing. The linear control is fitted to the split
    `train`, and to no scene that is evaluated; without such a scene there is none.

    Args:
        shards: a folder that an extraction finished.
        runs: of planners, as `ogmkit.learn.predict.run.open_run` gives them.
        settings: how they are scored; threshold and scale take no part.
        split_file: a JSON file of split → scene names instead of the manifest's splits.
        cameras: channels; none means all.
        workers: processes that read for the networks.
        on_progress: called with (sequences done, sequences in all), each one counted once a pass.

    Raises:
        SettingsError: a setting names something unknown, or a run doesn't fit the shards.
        TableError: the split file is absent or malformed.
        ShardError: a shard or the manifest is absent, damaged, or lacks something, or a pose is not finite.
        TrainingError: the split has no sequence.
        CheckpointError: a run doesn't plan, its weights don't fit, or it plans what is not finite.
    """
    chosen = settings or EvaluateSettings()
    sequences = sequences_of(
        shards, split=chosen.split, split_file=split_file, cameras=cameras, limit=chosen.limit
    )
    training = training_sequences(shards, sequences, limit=chosen.limit)
    reserved = (*FIXED, EGO_STATUS)
    planners = planners_of(runs, shards, sequences, homography=chosen.homography, reserved=reserved)
    seen = seen_by({one.name: one.run.checkpoint for one in planners}, sequences.scene_names)
    tell(Found(f"{sequences.index.counted('sequence')}; {with_number(len(planners), 'run')}"))
    passes = 2 + len(planners) + bool(planners)
    tick = ticker(on_progress, passes * len(sequences))
    # The rows for free first: that is quick, and finds what is wrong with the shards.
    for_free = dict(fixed_plans(sequences, training))
    fixed = tuple(_figures(sequences, for_free, tick))
    # One after the other: only one network is held at a time.
    planned = {
        one.name: plans_of(one, sequences, batch_size=chosen.batch_size, workers=workers, tick=tick)
        for one in planners
    }
    columns = {name: columns_of(plans) for name, plans in planned.items()}
    on_the_way = {name: plans.on_the_way for name, plans in columns.items()}
    figures = (tuple(_figures(sequences, on_the_way, tick)) if columns else ()) + fixed
    free = {name: plans.mean for name, plans in columns.items() if not plans.told}
    controls = untold_points(sequences, training)
    untold = {**free, **controls}
    told = {name: plans.mean for name, plans in (columns | for_free).items() if name not in untold}
    named = tuple(named_figures(sequences, {**told, **untold}, tick))
    return PlanEvaluation(
        split=sequences.split,
        scenes=sequences.scenes,
        sequences=len(sequences),
        cameras=sequences.index.cameras,
        systems=tuple(planned),
        fixed=tuple(for_free),
        figures=figures,
        notes=(
            *(one.note for one in planners),
            *seen.notes(),
            *([sequences.reported.note] if sequences.reported.note else []),
            linear_note(training),
            *interval_notes(sequences.scenes),
            *_unknown(shards),
            *told_notes(figures, [name for name in columns if name in told], for_free),
            *untold_notes(named, list(free), controls),
        ),
        samples=tuple(_samples(sequences, planned, chosen.samples)),
        chosen_on_reported=tuple(seen.chosen),
        learnt_from_reported=tuple(seen.learnt),
        definition=sequences.definition,
        named=named,
        untold=tuple(untold),
        near_training=near_training(shards, sequences.scene_names, sequences.reported.training),
    )


def _samples(sequences: Sequences, planned: Mapping[str, Sequence[Plan]], count: int) -> Iterator[PlanSample]:
    """So many plans of each run, of evenly spread sequences."""
    for name, plans in planned.items():
        for number in sorted(spread(count, len(sequences))):
            yield PlanSample(name, sequences.index.place(number), plans[number])


def _figures(sequences: Sequences, rows: Mapping[str, Plans], tick: Tick) -> Iterator[PlanFigure]:
    """All figures of some rows."""
    points = np.stack([plans.mean for plans in rows.values()])
    around = surrounding_values(sequences, points, tick)
    axes = METRICS, horizons_s(sequences.index.step_s), READINGS
    for number, (system, plans) in enumerate(rows.items()):
        values = np.concatenate([own_values(plans, sequences.truth), around[:, number]])
        found = estimate(scene_sums(values, sequences.scene, sequences.scenes), means_of)
        for place in np.ndindex(found.value.shape):
            names = (each[at] for each, at in zip(axes, place, strict=True))
            values_there = (float(one[place]) for one in (found.value, found.low, found.high))
            yield PlanFigure(system, *names, *values_there, definition=sequences.definition)


def _unknown(shards: Path) -> Iterator[str]:
    """What the shards can't tell of plans."""
    if read_manifest(shards).settings.targets.no_map:
        yield "off drivable is not known: the shards were made with --no-map"

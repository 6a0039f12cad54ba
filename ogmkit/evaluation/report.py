"""An evaluation as tables: the paper's layout, once for each kind of IoU and of cells."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from ogmkit.evaluation.near import near_told
from ogmkit.evaluation.result import Evaluation, Figure, labels_told
from ogmkit.evaluation.tables import NOTHING, WITH_INTERVAL, Report, Table, counted, further_tables, shown
from ogmkit.metrics.iou import CELLS, IOUS, TUNED_IOU
from ogmkit.metrics.regions import CLOSE_AHEAD_M, CLOSE_ASIDE_M, REGIONS
from ogmkit.metrics.separation import MAX_DISTANCE_M, PAIR_METRICS
from ogmkit.samples.spec import TARGETS

_IOU_NAMES = {
    "foreground_iou": "foreground IoU",
    "mean_iou": "mean of foreground and background IoU",
    TUNED_IOU: "foreground IoU at each run's own thresholds",
}
_CELL_NAMES = {
    "all": "all cells",
    "fov": "cells in the field of view",
    "rays": "cells in view that no box hides",
    "lidar": "cells in view as far as LiDAR points",
}
_COLUMNS = {
    ("camera", "full"): "camera",
    **{("bev", region): "BEV full" if region == "full" else region for region in REGIONS},
}
"""View and region → what the column is called."""
_LEFT_OUT = (
    "the mean of foreground and background IoU, cells in the field of view only, and neighbouring vehicles "
    "told apart"
)


def iou_report(evaluation: Evaluation, all_tables: bool) -> Report:
    """The foreground's IoU over all cells; all tables: the other IoUs, intervals, neighbouring vehicles.

    Args:
        evaluation: what was found.
        all_tables: False leaves the headline alone.
    """
    several = evaluation.scenes > 1
    headline = _headline(evaluation)
    left_out = f"95 % intervals, {_LEFT_OUT}" if several else _LEFT_OUT
    return Report(
        heading(evaluation),
        (headline, *_rest(evaluation, several)) if all_tables else (headline,),
        "" if all_tables else left_out,
        tuple(_explanations(evaluation, all_tables and several)),
    )


def heading(evaluation: Evaluation) -> str:
    """What all figures were found on, in one line."""
    grid = evaluation.grid
    homography = evaluation.homography or "none"
    return (
        f"{labels_told(evaluation.definition)}split {evaluation.split}: "
        f"{counted(evaluation.frames, 'frame')} in {counted(evaluation.scenes, 'scene')}, "
        f"{', '.join(evaluation.cameras)}; "
        f"homography {homography}; threshold {evaluation.threshold:g}; "
        f"{grid.rows} × {grid.columns} cells of {grid.m_per_cell:g} m; ceilings at 1:{evaluation.scale:g}"
    )


def _explanations(evaluation: Evaluation, intervals: bool) -> Iterator[str]:
    yield (
        f"close: in BEV, up to {CLOSE_AHEAD_M:g} m ahead and {CLOSE_ASIDE_M:g} m to each side; far: over "
        f"{CLOSE_AHEAD_M:g} m ahead; camera: all pixels."
    )
    if _tuned(evaluation):
        yield "A run's own thresholds are those that had the best IoU on its training's validation frames."
    if intervals:
        yield "Intervals come from resampling scenes."
    yield from near_told(evaluation.near_training)
    yield from evaluation.notes


def _headline(evaluation: Evaluation) -> Table:
    """The foreground's IoU over all cells; of each run also at thresholds that it has chosen itself."""
    table = _iou_table(evaluation, IOUS[0], CELLS[0], intervals=False)
    if not _tuned(evaluation):
        return table
    tuned = _iou_table(evaluation, TUNED_IOU, CELLS[0], intervals=False).systems
    rows = [
        row
        for plain, (name, *cells) in zip(table.systems, tuned, strict=True)
        for row in (plain, (f"{name}, own thresholds", *cells))
        if set(row[1:]) != {NOTHING}
    ]
    return replace(table, systems=tuple(rows))


def _tuned(evaluation: Evaluation) -> bool:
    """Whether a run has thresholds of its own."""
    return any(one.metric == TUNED_IOU and not math.isnan(one.value) for one in evaluation.figures)


def _rest(evaluation: Evaluation, intervals: bool) -> Iterator[Table]:
    """All tables but the headline."""
    kinds = dict.fromkeys(one.cells for one in evaluation.figures if one.view == "bev")
    readings = [_iou_table(evaluation, metric, cells, intervals) for metric in IOUS for cells in kinds]
    yield from further_tables(readings, intervals)
    yield _pairs_table(evaluation, intervals)


def _iou_table(evaluation: Evaluation, metric: str, cells: str, intervals: bool) -> Table:
    """One reading of the IoU, with the paper's columns."""
    figures = {
        (one.system, one.target, one.view, one.region): one
        for one in evaluation.figures
        if one.metric == metric and (one.cells == cells or one.view == "camera")
    }

    def rows(names: Sequence[str]) -> Iterator[tuple[str, ...]]:
        for name in names:
            chosen = (figures[name, target, *column] for target in TARGETS for column in _COLUMNS)
            yield name, *(_percent(one, intervals) for one in chosen)

    return Table(
        f"{_IOU_NAMES[metric]} in %{WITH_INTERVAL * intervals}, {_CELL_NAMES[cells]}",
        tuple((target, len(_COLUMNS)) for target in TARGETS),
        ("system", *(*_COLUMNS.values(),) * len(TARGETS)),
        tuple(rows(evaluation.systems)),
        tuple(rows(evaluation.fixed)),
    )


def _pairs_table(evaluation: Evaluation, intervals: bool) -> Table:
    """How often connected components tell neighbouring vehicles apart."""
    figures = {(one.system, one.metric): one for one in evaluation.figures}

    def rows(names: Sequence[str]) -> Iterator[tuple[str, ...]]:
        for name in names:
            pairs, found, separated = (figures[name, metric] for metric in PAIR_METRICS)
            yield name, *(f"{one.value:.0f}" for one in (pairs, found)), _percent(separated, intervals)

    return Table(
        f"neighbouring vehicles (at most {MAX_DISTANCE_M:g} m apart) told apart by connected components",
        (),
        ("system", "pairs", "found", f"told apart, in % of found{WITH_INTERVAL * intervals}"),
        tuple(rows(evaluation.systems)),
        tuple(rows(evaluation.fixed)),
    )


def _percent(one: Figure, interval: bool) -> str:
    return shown(one, 1, factor=100, interval=interval)

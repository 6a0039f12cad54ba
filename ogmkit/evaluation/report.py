"""An evaluation as tables: the paper's layout, once for each kind of IoU and of cells."""

from collections.abc import Iterator, Sequence
from dataclasses import fields

from ogmkit.evaluation.result import Evaluation, Figure, Separation
from ogmkit.evaluation.tables import Report, Table, counted, with_interval
from ogmkit.metrics.iou import CELLS, IOUS
from ogmkit.metrics.regions import CLOSE_AHEAD_M, CLOSE_ASIDE_M, REGIONS
from ogmkit.metrics.separation import MAX_DISTANCE_M
from ogmkit.samples.spec import TARGETS

_IOU_NAMES = {"foreground": "foreground IoU", "mean": "mean of foreground and background IoU"}
_CELL_NAMES = {"all": "all cells", "fov": "cells in the field of view only"}


def iou_report(evaluation: Evaluation) -> Report:
    """The IoU tables, then the one of neighbouring vehicles."""
    return Report(
        heading(evaluation),
        (*tables(evaluation), separation_table(evaluation)),
        explanations(evaluation),
        tuple(field.name for field in fields(Figure)),
        evaluation.figures,
    )


def heading(evaluation: Evaluation) -> str:
    """What all figures were found on, in one line."""
    grid = evaluation.grid
    homography = evaluation.homography or "none"
    return (
        f"split {evaluation.split}: {counted(evaluation.frames, 'frame')} in "
        f"{counted(evaluation.scenes, 'scene')}, {', '.join(evaluation.cameras)}; "
        f"homography {homography}; threshold {evaluation.threshold:g}; "
        f"{grid.rows} × {grid.columns} cells of {grid.m_per_cell:g} m; ceilings at 1:{evaluation.scale:g}"
    )


def explanations(evaluation: Evaluation) -> tuple[str, ...]:
    """Sentences to be read with the tables."""
    return (
        f"IoU in %, with its 95 % interval by resampling scenes. close: up to {CLOSE_AHEAD_M:g} m ahead and "
        f"{CLOSE_ASIDE_M:g} m to each side; far: over {CLOSE_AHEAD_M:g} m ahead; camera: all pixels.",
        *evaluation.notes,
    )


def tables(evaluation: Evaluation) -> tuple[Table, ...]:
    """The IoU tables: foreground and mean, of all cells and in the field of view."""
    return tuple(_iou_table(evaluation, kind, cells) for kind in IOUS for cells in CELLS)


def separation_table(evaluation: Evaluation) -> Table:
    """How often connected components tell neighbouring vehicles apart."""
    rows = {one.system: _separation_row(one) for one in evaluation.separations}
    return Table(
        f"Neighbouring vehicles (at most {MAX_DISTANCE_M:g} m apart) told apart by connected components, "
        "in % of pairs found",
        (),
        ("system", "pairs", "found", "told apart"),
        tuple(rows[name] for name in evaluation.systems),
        tuple(rows[name] for name in evaluation.fixed),
    )


def _iou_table(evaluation: Evaluation, kind: str, cells: str) -> Table:
    shown = {
        (one.system, one.target, one.view, one.region): one
        for one in evaluation.figures
        if one.iou == kind and (one.cells == cells or one.view == "camera")
    }
    columns = (("camera", "full"), *(("bev", region) for region in REGIONS))

    def rows(names: Sequence[str]) -> Iterator[tuple[str, ...]]:
        for name in names:
            yield name, *(_percent(shown[name, target, *column]) for target in TARGETS for column in columns)

    return Table(
        f"{_IOU_NAMES[kind]}, {_CELL_NAMES[cells]}",
        tuple((target, len(columns)) for target in TARGETS),
        ("system", *(("camera", *(f"BEV {region}" for region in REGIONS)) * len(TARGETS))),
        tuple(rows(evaluation.systems)),
        tuple(rows(evaluation.fixed)),
    )


def _separation_row(one: Separation) -> tuple[str, ...]:
    return one.system, str(one.pairs), str(one.found), _percent(one)


def _percent(one: Figure | Separation) -> str:
    return with_interval(one, 1, factor=100)

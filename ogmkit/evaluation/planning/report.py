"""An evaluation of planners as tables: the paper's layout for each reading, then what else was measured."""

from collections.abc import Iterator, Sequence
from dataclasses import fields

from ogmkit.evaluation.planning.evaluate import TRUTH
from ogmkit.evaluation.planning.result import PlanEvaluation, PlanFigure
from ogmkit.evaluation.tables import Report, Table, counted, with_interval
from ogmkit.metrics.displacement import HORIZONS_S, READINGS

_ERRORS = {"ade": "ADE", "l1_longitudinal": "L1 longitudinal", "l1_lateral": "L1 lateral"}
_READING_NAMES = {"at": " at the horizon", "mean": ", mean up to the horizon"}
_SHARES = {
    "inside_50": "inside 50 %",
    "inside_90": "inside 90 %",
    "off_drivable": "off drivable",
    "in_vehicle": "in vehicle",
}

_Shown = dict[tuple[str, str, float, str], PlanFigure]


def plan_report(evaluation: PlanEvaluation) -> Report:
    """The tables of displacements, then the one of distributions and surroundings."""
    shown = {(one.system, one.metric, one.horizon_s, one.reading): one for one in evaluation.figures}
    return Report(
        f"split {evaluation.split}: {counted(evaluation.sequences, 'sequence')} in "
        f"{counted(evaluation.scenes, 'scene')}, {', '.join(evaluation.cameras)}",
        (
            *(_error_table(evaluation, shown, reading) for reading in READINGS),
            _other_table(evaluation, shown),
        ),
        _explanations(evaluation),
        tuple(field.name for field in fields(PlanFigure)),
        evaluation.figures,
    )


def _explanations(evaluation: PlanEvaluation) -> tuple[str, ...]:
    return (
        "Figures stand with their 95 % intervals by resampling scenes. ADE: Euclidean distance to the truth; "
        "L1: its parts along (longitudinal) and across (lateral) the heading at the last image. Predictions "
        "are the means of distributions.",
        "NLL: −log of the truth's density; inside 50 %, 90 %: truths inside the ellipses that should hold so "
        "many; off drivable, in vehicle: predicted points on cells that are not drivable (points outside the "
        "grid don't count), or within a vehicle's box at their own time.",
        f"{TRUTH}: what was driven; constant-velocity: the last displacement goes on; straight-line: equal "
        "steps to the destination; cubic: the polynomial in time through the last two positions, the present "
        "one and the destination.",
        *evaluation.notes,
    )


def _error_table(evaluation: PlanEvaluation, shown: _Shown, reading: str) -> Table:
    def rows(names: Sequence[str]) -> Iterator[tuple[str, ...]]:
        for name in names:
            yield (
                name,
                *(
                    with_interval(shown[name, metric, horizon_s, reading], 2)
                    for metric in _ERRORS
                    for horizon_s in HORIZONS_S
                ),
            )

    return Table(
        f"displacement{_READING_NAMES[reading]}, in metres",
        tuple((text, len(HORIZONS_S)) for text in _ERRORS.values()),
        ("system", *(f"{horizon_s} s" for _ in _ERRORS for horizon_s in HORIZONS_S)),
        tuple(rows(evaluation.systems)),
        tuple(rows([name for name in evaluation.fixed if name != TRUTH])),
    )


def _other_table(evaluation: PlanEvaluation, shown: _Shown) -> Table:
    def rows(names: Sequence[str]) -> Iterator[tuple[str, ...]]:
        for name in names:
            figures = {metric: shown[name, metric, HORIZONS_S[-1], "mean"] for metric in ("nll", *_SHARES)}
            yield (
                name,
                with_interval(figures["nll"], 2, between=", "),
                *(with_interval(figures[metric], 1, factor=100) for metric in _SHARES),
            )

    return Table(
        f"distributions and surroundings, mean up to {HORIZONS_S[-1]} s: NLL in nats, shares in %",
        (),
        ("system", "NLL", *_SHARES.values()),
        tuple(rows(evaluation.systems)),
        tuple(rows(evaluation.fixed)),
    )

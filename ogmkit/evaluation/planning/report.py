"""An evaluation of planners as tables: the paper's layout for each reading, then what else was measured."""

from collections.abc import Iterator, Sequence

from ogmkit.evaluation.near import near_told
from ogmkit.evaluation.planning.fixed import TRUTH
from ogmkit.evaluation.planning.named_report import named_explanations, named_tables
from ogmkit.evaluation.planning.result import PlanEvaluation, PlanFigure
from ogmkit.evaluation.result import labels_told
from ogmkit.evaluation.tables import WITH_INTERVAL, Report, Table, counted, further_tables, shown
from ogmkit.metrics.displacement import READINGS

_ERRORS = {"ade": "ADE", "l1_longitudinal": "L1 longitudinal", "l1_lateral": "L1 lateral"}
_READING_NAMES = {"at": " at the horizon", "mean": ", mean up to the horizon"}
_SHARES = {
    "inside_50": "inside 50 %",
    "inside_90": "inside 90 %",
    "off_drivable": "off drivable",
    "in_vehicle": "in vehicle",
}

_LEFT_OUT = (
    "the mean up to each horizon, how good the distributions are, what lies where plans lead, and "
    "scores by name"
)

_Figures = dict[tuple[str, str, float, str], PlanFigure]


def plan_report(evaluation: PlanEvaluation, all_tables: bool) -> Report:
    """Displacements at the horizons; all tables: means up to them, intervals, distributions, surroundings.

    Args:
        evaluation: what was found.
        all_tables: False leaves the headline alone.
    """
    figures = {(one.system, one.metric, one.horizon_s, one.reading): one for one in evaluation.figures}
    several = evaluation.scenes > 1
    headline = _error_table(evaluation, figures, READINGS[0], intervals=False)
    left_out = f"95 % intervals, {_LEFT_OUT}" if several else _LEFT_OUT
    return Report(
        f"{labels_told(evaluation.definition)}split {evaluation.split}: "
        f"{counted(evaluation.sequences, 'sequence')} in "
        f"{counted(evaluation.scenes, 'scene')}, {', '.join(evaluation.cameras)}",
        (headline, *_rest(evaluation, figures, several)) if all_tables else (headline,),
        "" if all_tables else left_out,
        tuple(_explanations(evaluation, all_tables, all_tables and several)),
    )


def _explanations(evaluation: PlanEvaluation, all_tables: bool, intervals: bool) -> Iterator[str]:
    yield (
        "ADE: Euclidean distance to the truth; L1: its parts along (longitudinal) and across (lateral) the "
        "heading at the last image. Predictions are the means of distributions."
    )
    if all_tables:
        yield (
            "NLL: −log of the truth's density; inside 50 %, 90 %: truths inside the ellipses that should "
            "hold so many; off drivable, in vehicle: predicted points on cells that are not drivable (points "
            "outside the grid don't count), or within a vehicle's box at their own time; "
            f"{TRUTH}: what was driven."
        )
        yield from named_explanations(evaluation)
    if intervals:
        yield "Intervals come from resampling scenes."
    yield (
        "constant-velocity: the last displacement, repeated; straight-line: equal steps to the destination; "
        "cubic: the polynomial in time through the last two positions, the present one and the destination; "
        "linear: least squares from the past and the destination, over sequences of other scenes."
    )
    yield from near_told(evaluation.near_training)
    yield from evaluation.notes


def _rest(evaluation: PlanEvaluation, figures: _Figures, intervals: bool) -> tuple[Table, ...]:
    """All tables but the headline."""
    readings = [_error_table(evaluation, figures, reading, intervals) for reading in READINGS]
    tables = further_tables([*readings, _other_table(evaluation, figures, intervals)], intervals)
    return (*tables, *named_tables(evaluation))


def _error_table(evaluation: PlanEvaluation, figures: _Figures, reading: str, intervals: bool) -> Table:
    horizons_s = evaluation.horizons_s

    def rows(names: Sequence[str]) -> Iterator[tuple[str, ...]]:
        for name in names:
            chosen = (
                figures[name, metric, horizon_s, reading] for metric in _ERRORS for horizon_s in horizons_s
            )
            yield name, *(shown(one, 2, interval=intervals) for one in chosen)

    return Table(
        f"displacement{_READING_NAMES[reading]}, in metres{WITH_INTERVAL * intervals}",
        tuple((text, len(horizons_s)) for text in _ERRORS.values()),
        ("system", *(f"{horizon_s} s" for _ in _ERRORS for horizon_s in horizons_s)),
        tuple(rows(evaluation.systems)),
        tuple(rows([name for name in evaluation.fixed if name != TRUTH])),
    )


def _other_table(evaluation: PlanEvaluation, figures: _Figures, intervals: bool) -> Table:
    last_s = evaluation.horizons_s[-1]

    def rows(names: Sequence[str]) -> Iterator[tuple[str, ...]]:
        for name in names:
            nll, *shares = (figures[name, metric, last_s, "mean"] for metric in ("nll", *_SHARES))
            yield (
                name,
                shown(nll, 2, between=", ", interval=intervals),
                *(shown(one, 1, factor=100, interval=intervals) for one in shares),
            )

    return Table(
        f"mean up to {last_s} s, NLL in nats, shares in %{WITH_INTERVAL * intervals}",
        (("distributions", 3), ("surroundings", 2)),
        ("system", "NLL", *_SHARES.values()),
        tuple(rows(evaluation.systems)),
        tuple(rows(evaluation.fixed)),
    )

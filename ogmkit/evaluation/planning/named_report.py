"""Tables of planning scores by name: for plans that are told the destination, and for those that aren't."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ogmkit.evaluation.planning.fixed import TRUTH
from ogmkit.evaluation.planning.result import PlanEvaluation
from ogmkit.evaluation.tables import Table
from ogmkit.metrics.open_loop.catalogue import DEFINITIONS, EXACT, STP3, UNIAD, VAD
from ogmkit.metrics.open_loop.definition import PlanDefinition
from ogmkit.metrics.open_loop.scores import COLLISION, EDGE_CROSSING, L2

UNSCORED = "–"
"""Where a plan has no point of its own to score."""
_READINGS = {"at": "", "mean": "to ", "up-to": "by "}


@dataclass(frozen=True)
class _Group:
    """Three columns: of one figure, under a heading."""

    heading: str
    definition: PlanDefinition
    metric: str


@dataclass(frozen=True)
class _Kind:
    """A table's figures: what they are, what they are multiplied by, and its columns."""

    what: str
    factor: float
    groups: tuple[_Group, ...]


_L2 = _Kind("L2 in metres", 1, (_Group(UNIAD.name, UNIAD, L2), _Group(f"{STP3.name}, {VAD.name}", STP3, L2)))
_KINDS = (
    _L2,
    _Kind(
        "collisions of the ego's cells, in %",
        100,
        tuple(_Group(one.name, one, COLLISION) for one in (UNIAD, STP3, VAD)),
    ),
    _Kind(
        f"{EXACT.name}, in %",
        100,
        (_Group("collision", EXACT, COLLISION), _Group("drivable edge", EXACT, EDGE_CROSSING)),
    ),
)


def named_tables(evaluation: PlanEvaluation) -> tuple[Table, ...]:
    """Distances, collisions on cells, exact collisions and crossings, for each kind of plan."""
    names = tuple(dict.fromkeys(one.system for one in evaluation.named))
    untold = tuple(name for name in names if name in evaluation.untold)
    told = tuple(name for name in names if name not in untold)
    return tuple(
        _table(evaluation, kind, whose, rows)
        for whose, rows in (("told the point at 3 s", told), ("not told it", untold))
        for kind in _KINDS
        if rows
    )


def named_explanations(evaluation: PlanEvaluation) -> Iterator[str]:
    """What the names stand for, and what is wrong with each."""
    if not evaluation.named:
        return
    yield (
        "1 s: at that point; to 1 s: mean over the points up to it; by 1 s: share of plans with any such "
        "point up to it; drivable edge: the outline of the ego's box leaves the drivable area."
    )
    yield (
        f"{UNSCORED}: a plan that is told the point at 3 s has none of its own there, nor a mean up to it; "
        "what it has at 1 and 2 s does not compare with plans that are not told. ego-status: least squares "
        "from the past alone, fitted as linear is. All rows are scored on whole futures: no step is missing."
    )
    for name, one in DEFINITIONS.items():
        source = f" ({one.source})" if one.source else ""
        yield f"{name}{source}: {'; '.join(one.faults)}."


def _table(evaluation: PlanEvaluation, kind: _Kind, whose: str, names: Sequence[str]) -> Table:
    figures = {(one.system, one.definition, one.metric, one.horizon_s): one.value for one in evaluation.named}
    horizons = sorted({one.horizon_s for one in evaluation.named})
    columns = [(group, horizon) for group in kind.groups for horizon in horizons]

    def rows(runs: bool) -> Iterator[tuple[str, ...]]:
        for name in names:
            if (name in evaluation.systems) == runs and (name, kind) != (TRUTH, _L2):
                values = (figures[name, one.definition.name, one.metric, horizon] for one, horizon in columns)
                yield name, *(_shown(kind.factor * value) for value in values)

    return Table(
        f"plans {whose}: {kind.what}",
        tuple((group.heading, len(horizons)) for group in kind.groups),
        ("system", *(f"{_READINGS[one.definition.reading]}{horizon:g} s" for one, horizon in columns)),
        tuple(rows(runs=True)),
        tuple(rows(runs=False)),
    )


def _shown(value: float) -> str:
    return UNSCORED if math.isnan(value) else f"{value:.2f}"

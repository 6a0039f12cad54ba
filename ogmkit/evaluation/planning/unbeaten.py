"""Notes on planners: who is not told the destination, and which rows that cost nothing one does not beat."""

from collections.abc import Collection, Iterator, Mapping, Sequence

from ogmkit.evaluation.planning.fixed import TRUTH
from ogmkit.evaluation.planning.result import PlanFigure
from ogmkit.metrics.open_loop.catalogue import STP3
from ogmkit.metrics.open_loop.scores import L2


def told_notes(
    figures: Sequence[PlanFigure], runs: Sequence[str], controls: Collection[str]
) -> Iterator[str]:
    """Of planners that are told the destination, by the paper's figure.

    Args:
        figures: of all rows.
        runs: names of these planners.
        controls: names of rows for free.
    """
    last_s = max(one.horizon_s for one in figures)
    chosen = ("ade", last_s, "mean")
    errors = {one.system: one.value for one in figures if (one.metric, one.horizon_s, one.reading) == chosen}
    yield from _unbeaten(errors, runs, controls, f"ADE up to {last_s:g} s")


def untold_notes(
    named: Sequence[PlanFigure], runs: Sequence[str], controls: Collection[str]
) -> Iterator[str]:
    """Of planners that aren't, by the mean distance up to the last horizon.

    Args:
        named: figures of all rows by the names of their definitions.
        runs: names of these planners.
        controls: names of rows for free that aren't told it either.
    """
    last_s = max(one.horizon_s for one in named)
    chosen = (STP3.name, L2, last_s)
    errors = {one.system: one.value for one in named if (one.definition, one.metric, one.horizon_s) == chosen}
    for name in runs:
        yield f"{name}: is not told the destination; compare it with rows that aren't either"
    yield from _unbeaten(errors, runs, controls, f"mean L2 up to {last_s:g} s")


def _unbeaten(
    errors: Mapping[str, float], runs: Sequence[str], controls: Collection[str], figure: str
) -> Iterator[str]:
    for run in runs:
        better = [name for name in controls if name != TRUTH and errors[name] <= errors[run]]
        if better:
            yield f"{run} does not beat {', '.join(better)} by {figure}: no result"

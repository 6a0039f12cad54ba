"""Errors of homographies over all shards: what is kept of each, and the plot."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace

from ogmkit.drawing.palette import ThemeName, themed
from ogmkit.homography.leave_out import LeftOutErrors
from ogmkit.pictures.homography_plot import plot_svg
from ogmkit.pipeline.homography_fit import HomographySummary
from ogmkit.pipeline.homography_summary import MethodResults, MethodSummary, joined


@dataclass(frozen=True, eq=False)
class Homographies:
    """All sources.

    Attributes:
        methods: by name.
        shards: that have any.
    """

    methods: tuple[MethodSummary, ...]
    shards: int

    def svg(self, theme: ThemeName) -> str:
        """The plot of errors on boxes left out, as `homography-fit --plot` has it."""
        with themed(theme):
            return plot_svg(HomographySummary(self.methods, self.shards, self.shards, 0.0))


def measured(results: MethodResults) -> MethodResults:
    """Results without the boxes that were not measured."""
    kept = results.left_out.evaluated
    columns = {one.name: getattr(results.left_out, one.name)[kept] for one in fields(LeftOutErrors)}
    return replace(results, left_out=LeftOutErrors(**columns))


def collected(shards: Iterable[Mapping[str, MethodResults]]) -> Homographies:
    """The results of all shards by source."""
    found: dict[str, list[MethodResults]] = {}
    counts = Counter[bool]()
    for one in shards:
        counts[bool(one)] += 1
        for source, results in one.items():
            found.setdefault(source, []).append(results)
    methods = (MethodSummary(source, joined(parts)) for source, parts in sorted(found.items()))
    return Homographies(tuple(methods), counts[True])

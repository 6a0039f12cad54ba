"""What an evaluation of planners found."""

import math
from dataclasses import dataclass, field

from ogmkit.evaluation.frames import Place
from ogmkit.evaluation.result import PAPER
from ogmkit.metrics.plan import Plan


@dataclass(frozen=True)
class PlanFigure:
    """One figure with its interval; NaN where undefined.

    Attributes:
        system: the row of the table.
        definition: of the labels that it was measured by; of a score by name, that of
            `ogmkit.metrics.open_loop.catalogue.DEFINITIONS`.
        metric: a name of `ogmkit.metrics.displacement.METRICS`, or of `ogmkit.metrics.open_loop.scores`;
            metres, nats, or a share between 0 and 1.
        horizon_s: seconds from the last image.
        reading: `at` the horizon's point, `mean` over the points up to it, or `up-to` it, at any of them.
        value: over all sequences.
        low: lower end of the 95 % interval; NaN where there is one scene only.
        high: its upper end, likewise.
    """

    system: str
    definition: str = field(default=PAPER, kw_only=True)
    metric: str
    horizon_s: float
    reading: str
    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class PlanSample:
    """One plan, kept to be drawn.

    Attributes:
        system: the row of the table.
        place: the last frame of the sequence.
        plan: from there on.
    """

    system: str
    place: Place
    plan: Plan


@dataclass(frozen=True, eq=False)
class PlanEvaluation:
    """All figures, and what they were found on.

    Attributes:
        split: the split's name.
        scenes: scenes with sequences.
        sequences: over all scenes and cameras.
        cameras: channels.
        systems: names of the runs, in the order given.
        fixed: names of the rows that need no run.
        figures: system by system.
        notes: sentences to be read with the tables.
        samples: kept plans, run by run.
        chosen_on_reported: names of the runs whose checkpoint was chosen on scenes that are reported.
        learnt_from_reported: names of the runs that learnt from such scenes.
        definition: of the labels.
        named: figures by the names of their definitions, row by row.
        untold: names of the rows of `named` that aren't told the destination.
        near_training: share of the reported scenes' key frames near one of those to learn from, or NaN.
    """

    split: str
    scenes: int
    sequences: int
    cameras: tuple[str, ...]
    systems: tuple[str, ...]
    fixed: tuple[str, ...]
    figures: tuple[PlanFigure, ...]
    notes: tuple[str, ...]
    samples: tuple[PlanSample, ...]
    chosen_on_reported: tuple[str, ...] = ()
    learnt_from_reported: tuple[str, ...] = ()
    definition: str = PAPER
    named: tuple[PlanFigure, ...] = ()
    untold: tuple[str, ...] = ()
    near_training: float = math.nan

    @property
    def horizons_s(self) -> tuple[float, ...]:
        """The horizons of the figures in seconds, the nearest first."""
        return tuple(sorted({one.horizon_s for one in self.figures}))

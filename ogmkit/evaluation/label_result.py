"""What an evaluation of other networks' grids found."""

from dataclasses import dataclass


@dataclass(frozen=True)
class LabelFigure:
    """One figure.

    Attributes:
        system: the row of the table: the file's name.
        definition: of the labels that it was measured by.
        version: of that definition.
        target: the class.
        cells: the cells that count, by the definition.
        metric: `foreground_iou`.
        frames: that it was found on.
        value: a share between 0 and 1; NaN where neither grids nor labels have a cell, or the file lacks the
            class.
    """

    system: str
    definition: str
    version: int
    target: str
    cells: str
    metric: str
    frames: int
    value: float


@dataclass(frozen=True)
class LabelEvaluation:
    """All figures, by one definition.

    Attributes:
        definition: its name.
        version: its version.
        counted: the cells that count.
        frames: samples that were scored.
        frames_there: samples of the shards' scenes that these are of.
        threshold: what probabilities must exceed.
        classes: the columns.
        systems: the rows.
        figures: system by system.
    """

    definition: str
    version: int
    counted: str
    frames: int
    frames_there: int
    threshold: float
    classes: tuple[str, ...]
    systems: tuple[str, ...]
    figures: tuple[LabelFigure, ...]

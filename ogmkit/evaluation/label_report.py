"""An evaluation of other networks' grids as a table."""

import math

from ogmkit.evaluation.label_result import LabelEvaluation
from ogmkit.evaluation.tables import NOTHING, Report, Table, counted

_COUNTED = {
    "all": "all cells count",
    "visibility-2": "of boxes, cells count whose visibility is 2 or more, or that no box covers",
    "valid": "cells count that are valid",
    "not-ignored": "cells count that are not ignored",
}


def label_report(evaluation: LabelEvaluation) -> Report:
    """A row for each file and class; each names the definition that it was measured by."""
    by = f"{evaluation.definition} v{evaluation.version}"
    rows = tuple(
        (one.system, by, one.target, NOTHING if math.isnan(one.value) else f"{100 * one.value:.2f}")
        for one in evaluation.figures
    )
    heading = (
        f"labels {by}: {counted(evaluation.frames, 'sample')} of {evaluation.frames_there:,}; "
        f"threshold {evaluation.threshold:g}"
    )
    table = Table("foreground IoU in %", (), ("grids", "definition", "class", "IoU"), rows, ())
    explanations = (
        f"By this definition {_COUNTED[evaluation.counted]}; docs/definitions.md has all its fields.",
        "Figures by different definitions can't be compared.",
    )
    return Report(heading, (table,), "", explanations)

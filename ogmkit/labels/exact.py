"""The exact raster of a definition: the same frame, grid, classes and filters, by cell centres."""

from dataclasses import replace

from ogmkit.labels.definition import CellRule, Definition
from ogmkit.nuscenes.expansion import LINES

EXACT = "exact"
"""Its name."""


def exact_of(definition: Definition) -> Definition:
    """What the definition would draw if a cell counted where its nominal centre is inside.

    Lines have no area: classes of them are left out, as is what lies beside the classes but `visibility`.
    """
    lost = {one.name for one in definition.classes if set(one.layers) & set(LINES)}
    kept = tuple(
        one for one in definition.classes if one.name not in lost and not lost.intersection(one.unites)
    )
    beside = tuple(name for name in definition.beside if name == "visibility")
    return replace(definition, name=EXACT, cell=CellRule("centre"), classes=kept, beside=beside)

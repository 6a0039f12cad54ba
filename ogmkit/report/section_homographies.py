"""Errors of homographies on boxes left out, and frames without one."""

from ogmkit.base.names import listed
from ogmkit.drawing.palette import THEMES
from ogmkit.report.homographies import Homographies
from ogmkit.report.html import Html, element, joined
from ogmkit.report.sections import Section, number, sortable


def homographies_section(found: Homographies) -> Section:
    """The plot in each theme, then a table."""
    plots = (
        element(
            "div", Html(found.svg(name)), class_=f"plot only-{name}", role="img", aria_label="errors by range"
        )
        for name in THEMES
    )
    header = ("Method", "Valid", "Frames", "Residual, px", "Residual, cells", "Why others have none")
    rows = (
        (
            one.method,
            number(one.valid),
            number(one.frames),
            number(one.median_rms_px, 2),
            number(one.median_rms_cells, 2),
            listed([f"{reason} ({count:,})" for reason, count in one.reasons], 3),
        )
        for one in found.methods
    )
    note = "Each vehicle is left out of its frame’s fit, and measured. Residuals are medians over frames."
    return Section("homographies", "Homographies", note, joined((*plots, sortable(header, rows))))

"""Errors of homographies, as a table for terminals."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from .text import text_table, with_number

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ogmkit.homography.leave_out import RangeSummary
    from ogmkit.pipeline.homography_fit import HomographySummary
    from ogmkit.pipeline.homography_summary import MethodSummary

_REASONS = 5
"""Shown for each method; the rest is only counted."""


def summary_lines(summary: HomographySummary) -> Iterator[str]:
    """Counts, residuals, errors of left-out boxes, and why frames have no homography."""
    frames = summary.methods[0].frames
    yield (
        f"{with_number(frames, 'frame')} in {with_number(summary.shards, 'shard')} "
        f"({summary.kept} already complete), {summary.seconds:.1f} s"
    )
    yield ""
    header = ("method", "valid", "residual px", "residual cells")
    yield text_table(header, [_residuals(method) for method in summary.methods])
    yield ""
    yield "Left-out boxes by distance: median error / 90th percentile in metres / share refused"
    ranges = map(_range, summary.methods[0].ranges)
    yield text_table(("method", *ranges), [_errors(method) for method in summary.methods])
    for method in summary.methods:
        yield from _refusals(method)


def summary_values(summary: HomographySummary) -> dict[str, object]:
    """The same as plain values, for JSON."""
    return {
        "shards": summary.shards,
        "kept": summary.kept,
        "seconds": summary.seconds,
        "methods": [
            {
                "method": method.method,
                "frames": method.frames,
                "valid": method.valid,
                "residual_px": method.median_rms_px,
                "residual_cells": method.median_rms_cells,
                "left_out": method.ranges,
                "invalid": [{"reason": reason, "frames": count} for reason, count in method.reasons],
            }
            for method in summary.methods
        ],
    }


def _refusals(method: MethodSummary) -> Iterator[str]:
    """Why frames have no homography; reasons that carry a figure of the frame's own may be many."""
    for reason, count in method.reasons[:_REASONS]:
        yield f"{method.method}: no homography in {with_number(count, 'frame')}: {reason}"
    more = [count for _, count in method.reasons[_REASONS:]]
    if more:
        frames, reasons = with_number(sum(more), "frame"), with_number(len(more), "other reason")
        yield f"{method.method}: no homography in {frames}: {reasons}, each in the shard"


def _residuals(method: MethodSummary) -> tuple[str, ...]:
    return (
        method.method,
        f"{method.valid} of {method.frames}",
        f"{_figure(method.median_rms_px, '.2f'):>11}",
        f"{_figure(method.median_rms_cells, '.1f'):>14}",
    )


def _range(found: RangeSummary) -> str:
    return f"{found.from_m:.0f} to {found.to_m:.0f} m: {with_number(found.boxes, 'box')}"


def _errors(method: MethodSummary) -> tuple[str, ...]:
    return (
        method.method,
        *(
            f"{_figure(r.median_m, '.2f'):>5} / {_figure(r.p90_m, '.2f'):>5} / "
            f"{_figure(r.refused_share, '.1%'):>5}"
            for r in method.ranges
        ),
    )


def _figure(value: float, form: str) -> str:
    """A dash where nothing was measured."""
    return "–" if math.isnan(value) else format(value, form)

"""Errors of homography methods on left-out boxes by range, as a picture."""

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ogmkit.base.atomic import replacing
from ogmkit.drawing.canvas import Canvas, shortened, text_width
from ogmkit.drawing.palette import theme
from ogmkit.drawing.pdf import pdf_of
from ogmkit.drawing.png import write_png
from ogmkit.drawing.svg import svg_of
from ogmkit.drawing.vector import Drawing
from ogmkit.homography.leave_out import RangeSummary
from ogmkit.pipeline.homography_fit import HomographySummary
from ogmkit.pipeline.homography_summary import MethodSummary
from ogmkit.typing import UInt8Array

DOT_RADIUS = 7.0

_MARGIN, _TOP, _BOTTOM = 40, 222, 96
_NAMES, _PLOT, _REFUSED, _GAP = 184, 420, 104, 32
_ROW = 68
_PAD = 80  # at either end of an axis: a number beside the outermost dot
_TITLE_SIZE, _TEXT_SIZE, _SMALL_SIZE = 40, 22, 18
_TICKS_M = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
_DECADES_M = _TICKS_M[::3]
_WRITERS: Mapping[str, Callable[[Drawing], bytes]] = {".svg": svg_of, ".pdf": pdf_of}
_MOST_TICKS = 7  # beyond, their numbers would run into each other


class Axis:
    """A logarithmic axis of metres, `_PLOT` pixels long.

    Args:
        values_m: what it must hold; zero, infinite and missing ones don't count.

    Attributes:
        ticks_m: round values in order, at least two, powers of ten where there would be too many; all values
            lie between the first and the last, as far as a millimetre and a kilometre.
    """

    def __init__(self, values_m: Iterable[float]) -> None:
        known = [value for value in values_m if 0 < value < math.inf] or [1.0]
        ticks_m = _enclosing(_TICKS_M, min(known), max(known))
        self.ticks_m = (
            ticks_m if len(ticks_m) <= _MOST_TICKS else _enclosing(_DECADES_M, min(known), max(known))
        )

    def pixel(self, value_m: float) -> int:
        """Pixels from the left end of the axis; what lies beyond its ticks is drawn at the outermost."""
        first, last = self.ticks_m[0], self.ticks_m[-1]
        share = math.log(min(max(value_m, first), last) / first) / math.log(last / first)
        return round(_PAD + share * (_PLOT - 2 * _PAD))


def write_plot(path: Path, summary: HomographySummary) -> None:
    """Plot median and 90th percentile of left-out boxes' errors: a row a method, a column a range.

    Args:
        path: of an SVG or PDF file if its name ends so, else of a PNG file; what was there is replaced.
        summary: what `ogmkit.pipeline.homography_fit.fit_shards` found.

    Raises:
        OutputError: the file can't be written.
    """
    writer = _WRITERS.get(path.suffix.lower())
    if writer is None:
        write_png(path, draw(summary))
        return
    drawing = Drawing(*_size(summary))
    _draw(drawing, summary)
    with replacing(path) as part:
        part.write_bytes(writer(drawing))


def plot_svg(summary: HomographySummary) -> str:
    """The plot as an SVG element, to stand in a page."""
    drawing = Drawing(*_size(summary))
    _draw(drawing, summary)
    return svg_of(drawing).decode()


def draw(summary: HomographySummary) -> UInt8Array:
    """The plot as (h, w, 3) uint8 RGB."""
    canvas = Canvas(*_size(summary))
    _draw(canvas, summary)
    return canvas.pixels


def _size(summary: HomographySummary) -> tuple[int, int]:
    """(height, width) in pixels."""
    ranges = len(summary.methods[0].ranges)
    width = 2 * _MARGIN + _NAMES + ranges * (_PLOT + _REFUSED + _GAP) - _GAP
    return _TOP + _ROW * len(summary.methods) + _BOTTOM, width


def _draw(canvas: Canvas | Drawing, summary: HomographySummary) -> None:
    columns = tuple(zip(*(method.ranges for method in summary.methods), strict=True))
    axis = Axis(value for column in columns for one in column for value in (one.median_m, one.p90_m))
    _draw_heading(canvas, summary)
    for row, method in enumerate(summary.methods):
        _draw_name(canvas, method, _TOP + row * _ROW)
    for place, column in enumerate(columns):
        _draw_column(canvas, column, axis, _MARGIN + _NAMES + place * (_PLOT + _REFUSED + _GAP))
    _draw_legend(canvas, _size(summary)[0] - 24)


def _draw_heading(canvas: Canvas | Drawing, summary: HomographySummary) -> None:
    canvas.text("Left-out vehicles", _MARGIN, _MARGIN + 32, _TITLE_SIZE)
    frames, shards = summary.methods[0].frames, summary.shards
    note = (
        "error on the plane of a vehicle's ground corners, mapped by the homography fitted without it · "
        f"{frames} frame{'s' if frames != 1 else ''} in {shards} shard{'s' if shards != 1 else ''}"
    )
    canvas.text(note, _MARGIN, _MARGIN + 72, _TEXT_SIZE, theme().muted)


def _draw_name(canvas: Canvas | Drawing, method: MethodSummary, top: int) -> None:
    name = shortened(method.method, _TEXT_SIZE, _NAMES)
    canvas.text(name, _MARGIN, top + _ROW // 2 - 2, _TEXT_SIZE)
    frames = f"{method.valid} of {method.frames} frames"
    canvas.text(frames, _MARGIN, top + _ROW // 2 + 21, _SMALL_SIZE, theme().muted)


def _draw_column(canvas: Canvas | Drawing, ranges: Sequence[RangeSummary], axis: Axis, left: int) -> None:
    """Draw one range: an axis, and for each method its two dots and the share refused."""
    height = _ROW * len(ranges)
    shown = ranges[0]
    taken = canvas.text(f"{shown.from_m:g} to {shown.to_m:g} m", left, _TOP - 52, _TEXT_SIZE)
    boxes = f"{shown.boxes} vehicle{'' if shown.boxes == 1 else 's'}"
    canvas.text(boxes, left + taken + 12, _TOP - 52, _TEXT_SIZE, theme().muted)
    canvas.text("refused", left + _PLOT + _REFUSED, _TOP - 14, _SMALL_SIZE, theme().muted, "right")
    canvas.fill(left, _TOP, _PLOT, height, theme().empty)
    for tick in axis.ticks_m:
        x = left + axis.pixel(tick)
        canvas.fill(x, _TOP, 1, height, theme().line)
    for tick, text in _numbers(axis):
        canvas.text(text, left + axis.pixel(tick), _TOP - 14, _SMALL_SIZE, theme().muted, "centre")
    for row, one in enumerate(ranges):
        _draw_errors(canvas, one, axis, left, _TOP + row * _ROW + _ROW // 2)


def _draw_errors(canvas: Canvas | Drawing, errors: RangeSummary, axis: Axis, left: int, y: int) -> None:
    """Draw one method's dots in one range, joined, with their numbers outside; then the share refused."""
    baseline = y + 8
    if errors.boxes:
        refused = f"{100 * errors.refused_share:.1f} %"
        canvas.text(refused, left + _PLOT + _REFUSED, baseline, _TEXT_SIZE, theme().muted, "right")
    if math.isnan(errors.median_m):
        canvas.text("none measured", left + _PLOT // 2, baseline, _TEXT_SIZE, theme().muted, "centre")
        return
    median, p90 = (left + axis.pixel(value) for value in (errors.median_m, errors.p90_m))
    canvas.polyline(np.array([[median, y], [p90, y]], dtype=float), theme().muted, 3)
    canvas.dots(np.array([[p90, y]], dtype=float), theme().second, DOT_RADIUS, theme().empty)
    canvas.dots(np.array([[median, y]], dtype=float), theme().first, DOT_RADIUS, theme().empty)
    canvas.text(_metres(errors.median_m), median - 14, baseline, _TEXT_SIZE, theme().text, "right")
    canvas.text(_metres(errors.p90_m), p90 + 14, baseline, _TEXT_SIZE)


def _draw_legend(canvas: Canvas | Drawing, baseline: int) -> None:
    x = _MARGIN + _NAMES
    for label, colour in (("median", theme().first), ("90th percentile", theme().second)):
        canvas.dots(np.array([[x + DOT_RADIUS, baseline - 7.0]]), colour, DOT_RADIUS)
        x += 26
        x += canvas.text(label, x, baseline, _TEXT_SIZE, theme().muted) + 28
    canvas.text("metres, on a logarithmic scale", x, baseline, _TEXT_SIZE, theme().muted)


def _enclosing(ticks_m: Sequence[float], least_m: float, most_m: float) -> tuple[float, ...]:
    """Those ticks, of given ones, between which both values lie, as far as there are any."""
    first = max(bisect_right(ticks_m, least_m, hi=len(ticks_m) - 1) - 1, 0)
    last = min(bisect_right(ticks_m, most_m), len(ticks_m) - 1)
    return tuple(ticks_m[first : last + 1])


def _numbers(axis: Axis) -> list[tuple[float, str]]:
    """Ticks whose numbers have room, from the last on, with their text."""
    chosen: list[tuple[float, str]] = []
    free = math.inf
    for tick in reversed(axis.ticks_m):
        text = f"{tick:g}" if chosen else f"{tick:g} m"
        half = text_width(text, _SMALL_SIZE) / 2
        if axis.pixel(tick) + half <= free:
            chosen.append((tick, text))
            free = axis.pixel(tick) - half - _SMALL_SIZE / 2
    return chosen


def _metres(value: float) -> str:
    """About three significant digits; `inf` where a corner lies above the horizon."""
    decimals = 3 if value < 0.0995 else 2 if value < 9.995 else 1
    return f"{value:.{decimals}f}"

"""A plan on the plane: its points with their times, their ellipses, and the destination."""

from collections.abc import Sequence

import numpy as np

from ogmkit.drawing import legend
from ogmkit.drawing.bev_panel import DOT_RADIUS, Plan, draw_line, footer_kept
from ogmkit.drawing.canvas import Canvas, text_width
from ogmkit.drawing.palette import theme
from ogmkit.typing import FloatArray

_DIAMOND = np.array([[0.0, -9.0], [9.0, 0.0], [0.0, 9.0], [-9.0, 0.0]])
_LABEL_SIZE, _LABEL_GAP = 18, 10
_SWATCH = 20
_MIDDLE = (_SWATCH - 1) / 2


def draw_plan_marks(
    canvas: Canvas,
    plane: Plan,
    mean: FloatArray,
    future: FloatArray,
    *,
    labels: Sequence[str],
    outlines: Sequence[FloatArray] = (),
) -> None:
    """Draw a plan over past and future: ellipses thin, so that what they hold stays visible.

    Args:
        canvas: with the plane drawn.
        plane: where it lies.
        mean: (K, 2) metres, level frame.
        future: the true points of these times, then the destination where it is told: (K, 2) or (K + 1, 2).
        labels: of the K points, such as their times.
        outlines: (N, 2) of ellipses, in metres.
    """
    points, colour = plane.pixels(mean), theme().second
    with footer_kept(canvas):
        for outline in outlines:
            _draw_outline(canvas, plane.pixels(outline))
        _draw_labels(canvas, points, plane.pixels(future[: len(mean)]), labels)
        draw_line(canvas, plane.pixels(np.concatenate([np.zeros((1, 2)), mean])), colour)
        canvas.dots(points, colour, DOT_RADIUS + 1)
        for destination in future[len(mean) :]:
            canvas.polygon(plane.pixels(destination[None]) + _DIAMOND, theme().future)


def _draw_labels(canvas: Canvas, points: FloatArray, true: FloatArray, labels: Sequence[str]) -> None:
    """Write each point's label on the side away from the true path, where the one before leaves room."""
    taken = np.inf
    for label, (x, y), beside in zip(labels, points.tolist(), true[:, 0].tolist(), strict=True):
        if abs(taken - y) < _LABEL_SIZE:
            continue
        taken = y
        _write(canvas, label, (round(x), round(y)), to_left=x < beside)


def _write(canvas: Canvas, text: str, point: tuple[int, int], *, to_left: bool) -> None:
    """Write beside a point, on a plate of the page's colour."""
    x, y = point
    width, half = text_width(text, _LABEL_SIZE), _LABEL_SIZE // 2
    left = x - _LABEL_GAP - width
    if not to_left or left < 0:
        left = x + _LABEL_GAP
    canvas.fill(max(left - 2, 0), max(y - half, 0), width + 4, 2 * half, theme().page)
    canvas.text(text, left, y + _LABEL_SIZE // 3, _LABEL_SIZE, theme().second)


def _draw_outline(canvas: Canvas, outline: FloatArray) -> None:
    canvas.polyline(np.concatenate([outline, outline[:1]]), theme().second, 1)


def plan_group(*, told: bool, ellipses: bool) -> legend.Group:
    """The legend of plans: with a destination where one is told, and ellipses of distributions."""
    shown = (_destination_entry,) * told + (_planned_entry,) + (_ellipse_entry,) * ellipses
    return "Plan", lambda: [entry() for entry in shown]


def _destination_entry() -> legend.Entry:
    swatch = Canvas(_SWATCH, _SWATCH)
    swatch.polygon(_DIAMOND + _MIDDLE, theme().future)
    return swatch.pixels, "destination"


def _planned_entry() -> legend.Entry:
    swatch = Canvas(_SWATCH, _SWATCH)
    swatch.polyline(np.array([[0, _MIDDLE], [_SWATCH - 1, _MIDDLE]]), theme().second)
    swatch.dots(np.full((1, 2), _MIDDLE), theme().second, DOT_RADIUS)
    return swatch.pixels, "planned"


def _ellipse_entry() -> legend.Entry:
    angle = np.linspace(0, 2 * np.pi, 40)
    swatch = Canvas(_SWATCH, _SWATCH)
    _draw_outline(swatch, _MIDDLE * (1 + 0.85 * np.stack([np.cos(angle), np.sin(angle)], axis=1)))
    return swatch.pixels, "90 % of its distribution"

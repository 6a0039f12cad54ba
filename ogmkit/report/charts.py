"""Charts as SVG elements in the page's own colours: histograms, a map of counts, curves."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ogmkit.report.html import Html, element, joined
from ogmkit.typing import FloatArray, IntArray

_WIDTH, _HEIGHT = 340, 170
_LEFT, _RIGHT, _TOP, _BOTTOM = 44, 12, 12, 24
_STEPS = (1, 2, 5, 10)
STYLES = 6
"""Curves that can be told apart by colour; those after them are dashed."""


def histogram(counts: IntArray, edges: FloatArray, labels: Mapping[float, str]) -> Html:
    """Counts in bins, drawn as bars.

    Args:
        counts: (B,) int64.
        edges: (B + 1,) of the bins.
        labels: place on the axis → what is written there.
    """
    values = ticks(0, float(counts.max(initial=0)))
    top = values[-1]
    left, width = _x(edges, edges)[:-1].tolist(), (_WIDTH - _LEFT - _RIGHT) / len(counts)
    bars = (
        _bar((x + 0.5, _y(count, 0, top)), (width - 1, _HEIGHT - _BOTTOM - _y(count, 0, top)), title)
        for x, count, title in zip(left, counts.tolist(), _titles(counts, edges), strict=True)
        if count
    )
    return _svg(_WIDTH, _HEIGHT, _rules(values), *bars, _marks(labels, edges))


def heat(counts: IntArray, ahead: FloatArray, aside: FloatArray, scale: float = 4.6) -> Html:
    """A map of counts, forward up and left to the left, darker by the logarithm of a count.

    Args:
        counts: (A, B) int64.
        ahead: (A + 1,) edges, metres.
        aside: (B + 1,) edges, metres, to the left.
        scale: pixels a metre.
    """
    width, height = scale * float(aside[-1] - aside[0]), scale * float(ahead[-1] - ahead[0])
    most = math.log1p(float(counts.max(initial=0))) or 1.0
    cells = (
        _bar(
            (_LEFT + scale * (aside[-1] - aside[b + 1]), _TOP + scale * (ahead[-1] - ahead[a + 1])),
            (scale * (aside[b + 1] - aside[b]), scale * (ahead[a + 1] - ahead[a])),
            f"{ahead[a]:g} m ahead, {aside[b]:g} m to the left: {counts[a, b]:,}",
            opacity=0.08 + 0.92 * math.log1p(float(counts[a, b])) / most,
        )
        for a, b in np.argwhere(counts).tolist()
    )
    texts = [
        _text(f"{at} m", _LEFT - 8, _TOP + scale * (ahead[-1] - at) + 4, "end") for at in range(0, 61, 20)
    ]
    texts += [
        _text(text, _LEFT + scale * (aside[-1] - at), _TOP + height + 18, "middle")
        for at, text in ((20, "20 m left"), (0, "0"), (-20, "20 m right"))
    ]
    frame = element("rect", class_="frame", x=_LEFT, y=_TOP, width=f"{width:.1f}", height=f"{height:.1f}")
    return _svg(_LEFT + width + 2 * _RIGHT + 30, height + _TOP + _BOTTOM, frame, *cells, *texts)


def curves(series: Mapping[int, Sequence[tuple[float, float]]], names: Sequence[str]) -> Html:
    """Curves over steps.

    Args:
        series: number of the curve's name → its points (step, value); values that aren't finite are left out.
        names: of all that a page compares: each has its own colour, whatever else a chart shows.
    """
    known = {key: [one for one in points if math.isfinite(one[1])] for key, points in series.items()}
    points = [one for ones in known.values() for one in ones]
    if not points:
        return element("p", "no finite value", class_="note")
    last = max(step for step, _ in points)
    values = ticks(min(value for _, value in points), max(value for _, value in points))
    edges = np.array([0.0, max(last, 1)])
    lines = [
        _curve(key, ones, edges, (values[0], values[-1]), names[key]) for key, ones in known.items() if ones
    ]
    return _svg(_WIDTH, _HEIGHT, _rules(values), *lines, _marks({0: "0", last: f"{last:,} steps"}, edges))


def style_of(number: int) -> str:
    """The class of a curve by its number."""
    return f"line s{number % STYLES}" + (" dashed" if number >= STYLES else "")


def ticks(low: float, high: float) -> tuple[float, ...]:
    """Round values at equal steps, four to six of them, between which both ends lie; 0 is among them."""
    low, high = min(low, 0.0), max(high, 0.0)
    if low == high:
        high = 1.0
    span = high - low
    size = 10.0 ** math.floor(math.log10(span / 5))
    step = next(one * size for one in _STEPS if one * size >= span / 5 * (1 - 1e-9))
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return tuple(float(f"{step * place:.12g}") for place in range(first, last + 1))


def _curve(
    number: int,
    points: Sequence[tuple[float, float]],
    edges: FloatArray,
    ends: tuple[float, float],
    name: str,
) -> Html:
    places = [(float(_x(np.array([step]), edges)[0]), _y(value, *ends)) for step, value in points]
    title = element("title", f"{name}: {points[-1][1]:.4g} after {points[-1][0]:,} steps")
    x, y = places[-1]
    line = " ".join(f"{one:.1f},{other:.1f}" for one, other in places)
    return element(
        "g",
        title,
        element("polyline", points=line),
        element("circle", cx=f"{x:.1f}", cy=f"{y:.1f}", r=3),
        class_=style_of(number),
    )


def _rules(values: Sequence[float]) -> Html:
    """A rule at each value, which stands at the left."""
    return joined(_rule(_y(value, values[0], values[-1]), short(value)) for value in values)


def _rule(y: float, text: str) -> Html:
    line = element("line", class_="rule", x1=_LEFT, x2=_WIDTH - _RIGHT, y1=f"{y:.1f}", y2=f"{y:.1f}")
    return joined((line, _text(text, _LEFT - 8, y + 4, "end")))


def _bar(corner: tuple[float, float], size: tuple[float, float], title: str, opacity: float = 1) -> Html:
    """A rectangle (x, y), (width, height) that tells what it stands for."""
    (x, y), (width, height) = corner, size
    places = {"x": x, "y": y, "width": width, "height": height}
    stated = {name: f"{value:.1f}" for name, value in places.items()}
    return element("rect", element("title", title), class_="bar", fill_opacity=f"{opacity:.2g}", **stated)


def _titles(counts: IntArray, edges: FloatArray) -> list[str]:
    return [
        f"{low:g} to {high:g}: {count:,}"
        for low, high, count in zip(edges[:-1], edges[1:], counts.tolist(), strict=True)
    ]


def _marks(labels: Mapping[float, str], edges: FloatArray) -> Html:
    places = _x(np.array([*labels], dtype=float), edges)
    ends = {0: "start", len(labels) - 1: "end"}
    return joined(
        _text(text, place, _HEIGHT - 6, ends.get(number, "middle"))
        for number, (place, text) in enumerate(zip(places.tolist(), labels.values(), strict=True))
    )


def short(value: float) -> str:
    """A number of an axis: `1,200`, `25k`, `0.05`."""
    if abs(value) >= 10_000:
        return f"{value / 1000:g}k"
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:g}"


def _x(values: FloatArray, edges: FloatArray) -> FloatArray:
    share = (values - edges[0]) / (edges[-1] - edges[0])
    places: FloatArray = _LEFT + share * (_WIDTH - _LEFT - _RIGHT)
    return places


def _y(value: float, low: float, high: float) -> float:
    return _HEIGHT - _BOTTOM - (value - low) / (high - low) * (_HEIGHT - _TOP - _BOTTOM)


def _text(text: str, x: float, y: float, anchor: str) -> Html:
    return element("text", text, x=f"{x:.1f}", y=f"{y:.1f}", text_anchor=anchor)


def _svg(width: float, height: float, *content: object) -> Html:
    return element("svg", *content, viewBox=f"0 0 {width:.0f} {height:.0f}", role="img", class_="chart")

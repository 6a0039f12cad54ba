"""Shapes as SVG 1.1."""

from collections.abc import Mapping
from xml.sax.saxutils import escape, quoteattr

from ogmkit.drawing.palette import Colour
from ogmkit.drawing.vector import Align, Disc, Drawing, Line, Rectangle, Shape

_ANCHORS: Mapping[Align, str] = {"left": "start", "centre": "middle", "right": "end"}


def svg_of(drawing: Drawing) -> bytes:
    """The drawing as an SVG file; letters stay letters, in whatever sans-serif font its reader has."""
    width, height = drawing.width, drawing.height
    lines = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
        f'viewBox="0 0 {width} {height}" font-family="Helvetica, Arial, sans-serif">',
        *map(_element, drawing.shapes),
        "</svg>\n",
    )
    return "\n".join(lines).encode()


def _element(shape: Shape) -> str:
    ink = _hex(shape.colour)
    if isinstance(shape, Rectangle):
        place = f'x="{shape.left:g}" y="{shape.top:g}" width="{shape.width:g}" height="{shape.height:g}"'
        return f'<rect {place} fill="{ink}"/>'
    if isinstance(shape, Line):
        points = quoteattr(" ".join(f"{x:g},{y:g}" for x, y in shape.points))
        return f'<polyline points={points} fill="none" stroke="{ink}" stroke-width="{shape.thickness:g}"/>'
    if isinstance(shape, Disc):
        return f'<circle cx="{shape.x:g}" cy="{shape.y:g}" r="{shape.radius:g}" fill="{ink}"/>'
    place = f'x="{shape.x:g}" y="{shape.baseline:g}" font-size="{shape.size:g}"'
    return f'<text {place} text-anchor="{_ANCHORS[shape.align]}" fill="{ink}">{escape(shape.text)}</text>'


def _hex(colour: Colour) -> str:
    return "#" + "".join(f"{part:02x}" for part in colour)

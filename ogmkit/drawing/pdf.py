"""Shapes as PDF 1.4: one page, a point a pixel, letters in Helvetica, which every reader has."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

from ogmkit.drawing.palette import Colour
from ogmkit.drawing.vector import Align, Disc, Drawing, Letters, Line, Rectangle, Shape

_ARC = 0.5522847498
"""Of a radius: how far a quarter circle's Bézier handles reach."""
_SHARES: Mapping[Align, float] = {"left": 0, "centre": 0.5, "right": 1}
_WIDTHS = (
    *(278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278),
    *(*(556,) * 10, 278, 278, 584, 584, 584, 556, 1015),
    *(667, 667, 722, 722, 667, 611, 778, 722, 278, 500, 667, 556, 833, 722, 778, 667, 778, 722),
    *(667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469, 556, 333),
    *(556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556, 556, 556, 333),
    *(500, 278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584),
)
"""Of Helvetica's characters from space to tilde, in thousandths of the size (Adobe Font Metrics)."""
_OTHER_WIDTH = 278
"""Of the middle dot, the only other one in our plots."""


def pdf_of(drawing: Drawing) -> bytes:
    """The drawing as a PDF file."""
    content = "\n".join(_operators(shape, drawing.height) for shape in drawing.shapes).encode("latin-1")
    return _file(
        (
            b"<< /Type /Catalog /Pages 2 0 R >>",
            b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
            b"<< /Type /Page /Parent 2 0 R /Contents 4 0 R /Resources << /Font << /F 5 0 R >> >> "
            b"/MediaBox [0 0 %d %d] >>" % (drawing.width, drawing.height),
            b"<< /Length %d >>\nstream\n%b\nendstream" % (len(content), content),
            b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
        )
    )


def _file(objects: Sequence[bytes]) -> bytes:
    """Numbered objects, the first being the catalogue, with the table of their places."""
    data, places = b"%PDF-1.4\n", []
    for number, held in enumerate(objects, start=1):
        places.append(len(data))
        data += b"%d 0 obj\n%b\nendobj\n" % (number, held)
    table = b"0000000000 65535 f \n" + b"".join(b"%010d 00000 n \n" % place for place in places)
    size = len(objects) + 1
    end = b"trailer\n<< /Size %d /Root 1 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (size, len(data))
    return data + b"xref\n0 %d\n" % size + table + end


def _operators(shape: Shape, height: int) -> str:
    """A shape in PDF's operators; y grows upward there."""
    ink = _ink(shape.colour)
    if isinstance(shape, Rectangle):
        bottom = height - shape.top - shape.height
        return f"{ink} rg {shape.left:g} {bottom:g} {shape.width:g} {shape.height:g} re f"
    if isinstance(shape, Line):
        steps = (f"{x:g} {height - y:g} {'l' if place else 'm'}" for place, (x, y) in enumerate(shape.points))
        return f"{ink} RG {shape.thickness:g} w {' '.join(steps)} S"
    if isinstance(shape, Disc):
        return f"{ink} rg {_circle(shape.x, height - shape.y, shape.radius)} f"
    text, left = _text(shape)
    return f"BT {ink} rg /F {shape.size:g} Tf {left:.2f} {height - shape.baseline:g} Td ({text}) Tj ET"


def _circle(x: float, y: float, radius: float) -> str:
    """Four Bézier curves."""
    quarters = ((1, 0), (0, 1), (-1, 0), (0, -1), (1, 0))
    parts = [f"{x + radius:.2f} {y:.2f} m"]
    for (a, b), (c, d) in pairwise(quarters):
        handles = (a + _ARC * c, b + _ARC * d), (c + _ARC * a, d + _ARC * b), (c, d)
        parts.append(" ".join(f"{x + radius * u:.2f} {y + radius * v:.2f}" for u, v in handles) + " c")
    return " ".join(parts)


def _text(letters: Letters) -> tuple[str, float]:
    """Text as PDF wants it, without what Latin-1 lacks, and its left end."""
    plain = letters.text.encode("latin-1", "replace").decode("latin-1")
    width = sum(_WIDTHS[ord(c) - 32] if 32 <= ord(c) < 127 else _OTHER_WIDTH for c in plain)
    escaped = "".join("\\" + c if c in "()\\" else c for c in plain)
    return escaped, letters.x - _SHARES[letters.align] * width * letters.size / 1000


def _ink(colour: Colour) -> str:
    return " ".join(f"{part / 255:.3f}" for part in colour)

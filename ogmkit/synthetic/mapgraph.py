"""The nodes, lines and polygons that a map expansion's layers refer to."""

from collections.abc import Iterable

import numpy as np
from shapely.geometry import Polygon

from ogmkit.synthetic.plan import token
from ogmkit.typing import FloatArray

Record = dict[str, object]

_NODE_DIGITS = 12  # of a token: files are mostly nodes, and so half the size


class MapGraph:
    """Collects geometry; equal points become one node, so that neighbours share theirs.

    Attributes:
        node, line, polygon: the records so far.
    """

    def __init__(self, seed: int, location: str) -> None:
        self.node: list[Record] = []
        self.line: list[Record] = []
        self.polygon: list[Record] = []
        self._seed = seed
        self._location = location
        self._nodes: dict[tuple[float, float], str] = {}

    def token(self, layer: str, *indices: object) -> str:
        """The token of a record of a layer."""
        return token(self._seed, layer, self._location, *indices)

    def add_nodes(self, points: Iterable[FloatArray]) -> list[str]:
        """Tokens of the nodes at points (x, y), to the millimetre."""
        tokens = []
        for x, y in points:
            place = (round(float(x), 3), round(float(y), 3))
            if place not in self._nodes:
                self._nodes[place] = self.token("node", len(self.node))[:_NODE_DIGITS]
                self.node.append({"token": self._nodes[place], "x": place[0], "y": place[1]})
            tokens.append(self._nodes[place])
        return tokens

    def add_line(self, points: FloatArray) -> str:
        """Token of a line through (N, 2) points."""
        record = self.token("line", len(self.line))
        self.line.append({"token": record, "node_tokens": self.add_nodes(points)})
        return record

    def add_polygon(self, area: Polygon) -> str:
        """Token of a polygon with its holes; rings aren't closed by repetition."""
        record = self.token("polygon", len(self.polygon))
        rings = [self.add_nodes(np.asarray(ring.coords)[:-1]) for ring in (area.exterior, *area.interiors)]
        holes = [{"node_tokens": ring} for ring in rings[1:]]
        self.polygon.append({"token": record, "exterior_node_tokens": rings[0], "holes": holes})
        return record

"""Rows of scenes that are asked for one after the other, read for several scenes at once.

A query takes milliseconds to begin, whatever it finds: one for sixteen scenes takes little more time than
one for a single scene.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from numpy.typing import NDArray

from ogmkit.nuscenes.tables import Parameters, Tables

Columns = Mapping[str, NDArray[Any]]

_MOST = 16
"""Scenes at once."""


class ReadAhead:
    """Answers a query scene by scene.

    Whoever asks for scenes in order gets 1, 2, 4, … of them read at once; anybody else no more than one.

    Args:
        tables: that are queried.
        order: keys of all scenes, in the order in which they are likely to be asked for.
        sql: gives the rows of several scenes, in the order within each; the column `scene` has their keys.
        parameters: called with some keys, gives the statement's parameters.
    """

    def __init__(
        self, tables: Tables, order: Sequence[Any], sql: str, parameters: Callable[[list[Any]], Parameters]
    ) -> None:
        self._tables = tables
        self._order = order
        self._place = {key: place for place, key in enumerate(order)}
        self._sql = sql
        self._parameters = parameters
        self._read: dict[Any, Columns] = {}
        self._next = -1
        self._count = 1

    def rows(self, key: object) -> Columns:
        """The columns of a scene's rows."""
        place = self._place[key]
        if key not in self._read:
            self._count = min(2 * self._count, _MOST) if place == self._next else 1
            self._read = self._several(self._order[place : place + self._count])
        self._next = place + 1
        return self._read[key]

    def _several(self, keys: Sequence[Any]) -> dict[Any, Columns]:
        found = self._tables.arrays(self._sql, self._parameters([*keys]))
        scene = found.pop("scene")
        chosen = {key: scene == key for key in keys}
        return {key: {name: values[own] for name, values in found.items()} for key, own in chosen.items()}

"""What the numbers in masks and boxes of a recording mean, and their colours."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from ogmkit.drawing.further_cells import LAYERS
from ogmkit.drawing.palette import Colour, theme
from ogmkit.pictures.camera_panel import box_colour
from ogmkit.samples.spec import TARGETS

NOTHING, DRIVABLE, VEHICLE, UNSEEN = 0, 1, 2, 3
OF_TARGETS: Mapping[str, int] = MappingProxyType(dict(zip(TARGETS, (DRIVABLE, VEHICLE), strict=True)))
"""Target → its class."""
_KINDS: Mapping[str, int] = MappingProxyType({"vehicle": VEHICLE, "human": 4, "movable_object": 5})
"""First part of a category → the class of its boxes."""
_OTHER, _FIRST_NAMED = 6, 10
_MARKS = "vehicle", "first", "second", "future"
_UNSEEN_ALPHA = 150


@dataclass(frozen=True)
class Class:
    """A class.

    Attributes:
        number: in masks.
        name: as it is shown.
        colour: red, green, blue, and how opaque; 0 to 255.
    """

    number: int
    name: str
    colour: tuple[int, int, int, int]


def box_class(category: str) -> int:
    """The class of a box by its full category."""
    return _KINDS.get(category.partition(".")[0], _OTHER)


def numbered(rasters: Iterable[str]) -> dict[str, int]:
    """Names of further rasters, such as `layers/lane` → their class."""
    return {name: number for number, name in enumerate(rasters, start=_FIRST_NAMED)}


def classes(rasters: Iterable[str]) -> tuple[Class, ...]:
    """All classes in the theme's colours; the names of `rasters` are those of further ones."""
    colours = theme()
    solid = [
        (DRIVABLE, "drivable", colours.drivable),
        (VEHICLE, "vehicle", colours.vehicle),
        (_KINDS["human"], "human", box_colour("human")),
        (_KINDS["movable_object"], "movable object", box_colour("movable_object")),
        (_OTHER, "other", box_colour("")),
        *((number, name, _colour(name, number)) for name, number in numbered(rasters).items()),
    ]
    return (
        Class(NOTHING, "", (0, 0, 0, 0)),
        Class(UNSEEN, "not in view", (*colours.page, _UNSEEN_ALPHA)),
        *(Class(number, name, (*colour, 255)) for number, name, colour in solid),
    )


def _colour(name: str, number: int) -> Colour:
    """Of a layer its own; of others one of four."""
    mark = LAYERS.get(name.rpartition("/")[2], _MARKS[number % len(_MARKS)])
    found: Colour = getattr(theme(), mark)
    return found

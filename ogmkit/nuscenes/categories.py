"""Categories are chosen by the beginning of their names (design.md §3)."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError

OFFICIAL = (
    "animal",
    "human.pedestrian.adult",
    "human.pedestrian.child",
    "human.pedestrian.construction_worker",
    "human.pedestrian.personal_mobility",
    "human.pedestrian.police_officer",
    "human.pedestrian.stroller",
    "human.pedestrian.wheelchair",
    "movable_object.barrier",
    "movable_object.debris",
    "movable_object.pushable_pullable",
    "movable_object.trafficcone",
    "static_object.bicycle_rack",
    "vehicle.bicycle",
    "vehicle.bus.bendy",
    "vehicle.bus.rigid",
    "vehicle.car",
    "vehicle.construction",
    "vehicle.emergency.ambulance",
    "vehicle.emergency.police",
    "vehicle.motorcycle",
    "vehicle.trailer",
    "vehicle.truck",
)
"""nuScenes' 23 object categories."""


VEHICLE_WORD = r"(^|[._ -])(car|truck|bus|van|vehicle)([._ -]|$)"
"""Of a category's name in lower case, in Python and in DuckDB (RE2): converters call vehicles so."""


@dataclass(frozen=True)
class BoxClass:
    """A class of boxes by whole parts of category names.

    Attributes:
        name: the class's.
        parts: such as `car`, `bus.rigid` or `vehicle.car`.
    """

    name: str
    parts: tuple[str, ...]

    def shows(self, category: str) -> bool:
        """Whether one of the parts stands in a category's name, between its dots or ends."""
        return any(f".{part}." in f".{category}." for part in self.parts)


def box_class(text: str) -> BoxClass:
    """The class that a setting stands for.

    Args:
        text: `NAME`, which is the part too, or `NAME=PART+PART`; dots at a part's ends don't count.

    Raises:
        SettingsError: it is neither, or the name can't be a dataset's.
    """
    name, given, parts = text.partition("=")
    found = tuple(part.strip(".") for part in (parts if given else name).split("+"))
    if not re.fullmatch(r"\w[\w.-]*", name) or not all(found):
        raise SettingsError(f"class {text!r}: is neither NAME, such as car, nor NAME=PART+PART")
    return BoxClass(name, found)


def require_known_parts(classes: Sequence[str], known: Sequence[str], root: Path) -> None:
    """Check that each part of the classes stands in a category's name; arguments as of `require_known`.

    Raises:
        SettingsError: one doesn't.
    """
    everything = tuple(dict.fromkeys((*known, *OFFICIAL)))
    for part in (part for text in classes for part in box_class(text).parts):
        if not any(BoxClass(part, (part,)).shows(category) for category in everything):
            raise SettingsError(f"{root}: {unknown('category', part, everything)}")


def require_known(wanted: Sequence[str], known: Sequence[str], root: Path) -> None:
    """Check that each beginning of a name stands for at least one category.

    Args:
        wanted: full names or their beginnings, such as `vehicle.`.
        known: a dataset's categories; nuScenes' own count as known too, as small datasets list only some.
        root: the dataset's, for the message.

    Raises:
        SettingsError: nothing is wanted, a beginning fits no category, or none fits one of the dataset's own,
            which names its vehicles in another way.
    """
    if not wanted:
        raise SettingsError("no category chosen; give full names or prefixes such as vehicle.")
    everything = tuple(dict.fromkeys((*known, *OFFICIAL)))
    for name in wanted:
        if not name or not any(category.startswith(name) for category in everything):
            raise SettingsError(f"{root}: {unknown('category', name, everything)}")
    if not any(category.startswith(tuple(wanted)) for category in known):
        vehicles = [category for category in known if re.search(VEHICLE_WORD, category.lower())]
        if vehicles:
            raise SettingsError(
                f"{root}: no category begins with {' or '.join(wanted)}; the dataset's own names would fit: "
                f"--categories {','.join(vehicles)}"
            )

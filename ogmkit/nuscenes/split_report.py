"""What splits hold, and how near they lie to each other."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations

from ogmkit.nuscenes.places import Nearness, ScenePlaces, nearness

TAGS = ("night", "rain")
"""Words in a scene's description that are counted."""


@dataclass(frozen=True)
class SplitSize:
    """What a split holds.

    Attributes:
        name: the split's.
        scenes: how many.
        frames: key frames.
        locations: map → scenes.
        tags: word → scenes whose description has it.
    """

    name: str
    scenes: int
    frames: int
    locations: dict[str, int]
    tags: dict[str, int]


@dataclass(frozen=True)
class SplitReport:
    """Splits and the distances between any two.

    Attributes:
        near_m: distance up to which a key frame is near another.
        splits: of those that have a scene here.
        pairs: each split against each other one, both ways.
        left_out: scenes that are in no split, sorted.
    """

    near_m: float
    splits: tuple[SplitSize, ...]
    pairs: tuple[Nearness, ...]
    left_out: tuple[str, ...]


def report_splits(
    places: Sequence[ScenePlaces], splits: Mapping[str, Sequence[str]], near_m: float
) -> SplitReport:
    """Count what splits hold, and compare each with each.

    Args:
        places: of all scenes.
        splits: split → scenes; those without places don't count.
        near_m: distance up to which a key frame is near another.
    """
    by_name = {scene.name: scene for scene in places}
    there = {name: [one for one in scenes if one in by_name] for name, scenes in splits.items()}
    there = {name: scenes for name, scenes in there.items() if scenes}
    taken = {scene for scenes in there.values() for scene in scenes}
    return SplitReport(
        near_m,
        tuple(_size(name, [by_name[one] for one in scenes]) for name, scenes in there.items()),
        tuple(nearness(of, to, by_name, there, near_m) for of, to in permutations(there, 2)),
        tuple(sorted(by_name.keys() - taken)),
    )


def _size(name: str, scenes: Sequence[ScenePlaces]) -> SplitSize:
    said = [scene.description.lower() for scene in scenes]
    return SplitSize(
        name,
        len(scenes),
        sum(len(scene.xy_global) for scene in scenes),
        dict(sorted(Counter(scene.location for scene in scenes).items())),
        {tag: sum(tag in text for text in said) for tag in TAGS},
    )

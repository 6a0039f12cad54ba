"""Splits whose scenes lie apart on the map, for any dataset."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ogmkit.base.names import with_number
from ogmkit.errors import SettingsError
from ogmkit.nuscenes.disjoint_settings import DisjointSettings
from ogmkit.nuscenes.places import ScenePlaces

Zone = tuple[ScenePlaces, ...]
"""Scenes that stay together."""


@dataclass(frozen=True)
class Disjoint:
    """A division of scenes.

    Attributes:
        splits: split → names of its scenes, sorted.
        left_out: scenes of no split, sorted: they lie between two.
    """

    splits: dict[str, tuple[str, ...]]
    left_out: tuple[str, ...]


def divide_by_place(places: Sequence[ScenePlaces], settings: DisjointSettings) -> Disjoint:
    """Divide scenes so that no key frame of one split is near one of another.

    Scenes whose ways come near each other stay together. Where that makes a zone of more scenes than the
    smallest split should have, it is cut across its longer axis, through the middle of its scenes, and those
    at the cut are left out. Zones go to the splits in random order, the largest first, each to the split
    that lacks most.

    Args:
        places: of all scenes.
        settings: how.

    Raises:
        SettingsError: fewer zones are left than there are splits.
    """
    shares = settings.shares
    most = max(int(min(shares.values()) * len(places)), 1)
    zones = [
        zone for whole in _zones(places, settings.apart_m) for zone in _cut(whole, settings.apart_m, most)
    ]
    if len(zones) < len(shares):
        raise SettingsError(
            f"apart_m: {settings.apart_m:g} m leave {with_number(len(zones), 'zone')} for {len(shares)} "
            "splits; choose less, or fewer splits"
        )
    order = np.random.default_rng(settings.seed).permutation(len(zones)).tolist()
    found: dict[str, list[str]] = {name: [] for name in shares}
    for zone in sorted((zones[number] for number in order), key=len, reverse=True):
        lacking = max(shares, key=lambda name: _lack(name, found, shares, len(places)))
        found[lacking] += [scene.name for scene in zone]
    kept = {name for names in found.values() for name in names}
    left_out = sorted(scene.name for scene in places if scene.name not in kept)
    return Disjoint({name: tuple(sorted(names)) for name, names in found.items()}, tuple(left_out))


def _lack(name: str, found: Mapping[str, Sequence[str]], shares: Mapping[str, float], scenes: int) -> float:
    """Scenes that a split lacks, as a share of what it should have: an empty one comes first."""
    wanted = shares[name] * scenes
    return (wanted - len(found[name])) / wanted


def _zones(scenes: Sequence[ScenePlaces], apart_m: float) -> Iterator[Zone]:
    """Scenes that are connected by steps of less than a distance between their key frames."""
    touching = _touching(scenes, apart_m)
    unseen = dict.fromkeys(range(len(scenes)))
    while unseen:
        found, waiting = [], [next(iter(unseen))]
        del unseen[waiting[0]]
        while waiting:
            one = waiting.pop()
            found.append(one)
            new = [other for other in touching[one] if other in unseen]
            for other in new:
                del unseen[other]
            waiting += new
        yield tuple(scenes[number] for number in sorted(found))


def _touching(scenes: Sequence[ScenePlaces], apart_m: float) -> list[list[int]]:
    """Of each scene, those of the same map whose key frames come nearer than a distance."""
    ways = [shapely.MultiPoint(scene.xy_global) for scene in scenes]
    found: list[list[int]] = [[] for _ in scenes]
    pairs = shapely.STRtree(ways).query(ways, predicate="dwithin", distance=apart_m)
    for one, other in pairs.T.tolist():
        if scenes[one].location == scenes[other].location:
            found[one].append(other)
    return found


def _cut(zone: Zone, apart_m: float, most: int) -> Iterator[Zone]:
    """A zone, or parts of it that have so many scenes at most and lie apart."""
    if len(zone) <= most:
        yield zone
        return
    near, far = _halves(zone)
    there = shapely.MultiPoint(np.concatenate([scene.xy_global for scene in near]))
    clear = [
        scene for scene in far if not shapely.dwithin(shapely.MultiPoint(scene.xy_global), there, apart_m)
    ]
    for half in filter(None, (near, clear)):
        for part in _zones(half, apart_m):
            yield from _cut(part, apart_m, most)


def _halves(zone: Zone) -> tuple[Zone, Zone]:
    """The scenes on both sides of the middle, along the axis of the largest spread."""
    centres = np.stack([scene.xy_global.mean(axis=0) for scene in zone])
    about = centres - centres.mean(axis=0)
    along = about @ np.linalg.svd(about, full_matrices=False)[2][0]
    order = np.argsort(along, kind="stable").tolist()
    middle = len(order) // 2
    near, far = (tuple(zone[number] for number in half) for half in (order[:middle], order[middle:]))
    return near, far

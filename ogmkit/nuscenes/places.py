"""Where scenes were recorded, by poses alone, and how near those of two splits lie to each other."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ogmkit.nuscenes.tables import Tables
from ogmkit.typing import FloatArray

NEAR_M = 5.0
"""Of two key frames that see one place (Lilja et al., Localization Is All You Evaluate, CVPR 2024)."""

_POSES = """
SELECT coalesce(s.name, s.token), coalesce(l.location, ''), k.place
FROM (
    SELECT scene, sample_token, min(sample_timestamp) AS time_us, min_by(translation, timestamp) AS place
    FROM key_frame WHERE translation IS NOT NULL GROUP BY scene, sample_token
) k
JOIN scene s ON s.token = k.scene
LEFT JOIN log l ON l.token = s.log_token
ORDER BY 1, k.time_us
"""


@dataclass(frozen=True, eq=False)
class ScenePlaces:
    """Where the key frames of a scene were recorded.

    Attributes:
        name: the scene's.
        location: the map's name; places on two maps are not near each other.
        xy_global: (N, 2) metres, of the ego at each key frame.
        description: what the dataset says of the scene; empty where it says nothing.
    """

    name: str
    location: str
    xy_global: FloatArray
    description: str = ""


@dataclass(frozen=True)
class Nearness:
    """How near the key frames of one split lie to those of another.

    Attributes:
        of: the split whose frames are looked at.
        to: the other.
        frames: key frames of `of`.
        near_share: share of them that are near one of `to`; NaN without any.
        median_m: median distance to the nearest one of `to`; infinite where over half are on other maps.
    """

    of: str
    to: str
    frames: int
    near_share: float
    median_m: float


def read_places(tables: Tables) -> tuple[ScenePlaces, ...]:
    """All scenes that have a pose, sorted by name.

    Args:
        tables: loaded and prepared (`uses.prepare`).
    """
    said = _descriptions(tables)
    found: dict[tuple[str, str], list[Sequence[float]]] = {}
    for name, location, place in tables.stream(_POSES):
        found.setdefault((name, location), []).append(place[:2])
    places = {key: np.array(rows, dtype=np.float64).reshape(-1, 2) for key, rows in found.items()}
    sound = {key: xy[np.isfinite(xy).all(axis=1)] for key, xy in places.items()}
    return tuple(
        ScenePlaces(name, location, xy, said.get(name, ""))
        for (name, location), xy in sound.items()
        if len(xy)
    )


def nearest_m(of: Iterable[ScenePlaces], to: Iterable[ScenePlaces]) -> FloatArray:
    """(N,) distances in metres from each key frame of some scenes to the nearest one of others.

    Infinite where the others have none on the same map.
    """
    there: dict[str, list[FloatArray]] = {}
    for scene in to:
        there.setdefault(scene.location, []).append(scene.xy_global)
    trees = {name: shapely.STRtree(shapely.points(np.concatenate(xy))) for name, xy in there.items()}
    found = [_nearest_m(scene.xy_global, trees.get(scene.location)) for scene in of]
    return np.concatenate(found) if found else np.zeros(0)


def nearness(
    of: str, to: str, places: Mapping[str, ScenePlaces], splits: Mapping[str, Sequence[str]], near_m: float
) -> Nearness:
    """Compare two splits.

    Args:
        of: whose frames are looked at.
        to: the other.
        places: scene → its places; scenes without any don't count.
        splits: split → scenes.
        near_m: distance up to which a frame is near.
    """
    here, there = ([places[name] for name in splits[split] if name in places] for split in (of, to))
    distances = nearest_m(here, there)
    if not len(distances):
        return Nearness(of, to, 0, float("nan"), float("nan"))
    return Nearness(of, to, len(distances), float(np.mean(distances <= near_m)), float(np.median(distances)))


def _nearest_m(xy: FloatArray, tree: shapely.STRtree | None) -> FloatArray:
    distances = np.full(len(xy), np.inf)
    if tree is not None and len(tree) and len(xy):
        (own, _), found = tree.query_nearest(shapely.points(xy), return_distance=True, all_matches=False)
        distances[own] = found
    return distances


def _descriptions(tables: Tables) -> dict[str, str]:
    """Scene → its description, for those that have one."""
    records = (json.loads(text) for text in tables.objects("scene"))
    found = ((record.get("name"), record.get("description")) for record in records)
    return {name: text for name, text in found if isinstance(name, str) and isinstance(text, str)}

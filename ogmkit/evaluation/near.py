"""How many of the reported key frames lie at places that are learnt from."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ogmkit.nuscenes.places import NEAR_M, ScenePlaces, nearest_m
from ogmkit.shards.folder import ShardFolder


def near_training(shards: Path, reported: Sequence[str], training: Sequence[str]) -> float:
    """Share of the key frames of some scenes within `NEAR_M` of one of the scenes to learn from.

    Args:
        shards: the folder.
        reported: scenes, of which the first camera's frames are looked at.
        training: scenes to learn from.

    Returns:
        NaN where there is none to learn from, or none reported.

    Raises:
        ShardError: a shard is absent or damaged.
    """
    folder = ShardFolder(shards)
    distances = nearest_m(*([_places(folder, scene) for scene in scenes] for scenes in (reported, training)))
    if not training or not len(distances):
        return math.nan
    return float(np.mean(distances <= NEAR_M))


def near_told(share: float) -> Iterator[str]:
    """The sentence that tells it; none where it isn't known."""
    if not math.isnan(share):
        yield (
            f"{100 * share:.1f} % of the key frames lie within {NEAR_M:g} m of one of the scenes to learn "
            "from: places that a network may remember; `ogmkit splits` makes splits that lie apart."
        )


def _places(folder: ShardFolder, scene: str) -> ScenePlaces:
    with folder.shard(scene) as shard:
        poses = shard.dataset(shard.cameras[0], "global_from_ego")[:]
        return ScenePlaces(scene, shard.location, poses[:, :2, 3])

"""Which scenes a network learns from, which choose its checkpoint, and which are reported (design.md §3).

Always whole scenes, since neighbouring frames are alike. `split_scenes` looks splits up by their names,
`divide_scenes` decides what they are for; whoever trains or scores asks it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ogmkit.base.names import with_number
from ogmkit.errors import SettingsError
from ogmkit.nuscenes.splits import read_split_file
from ogmkit.shards.listed import listed_shard
from ogmkit.shards.manifest import Manifest, ShardEntry

TRAIN, VAL, TEST = "train", "val", "test"
"""Names of splits by default, and what the scenes of a division are for."""

HELD_OUT = 8
"""One scene of `train` in so many chooses the checkpoint, where no scenes of their own are there for that."""
_FEWEST_LOGS = 2
"""That must be left to learn from."""
_SEED = 0
"""The same for all trainings: a planner may begin with a perception, which must not know its `val`."""


@dataclass(frozen=True)
class Division:
    """The scenes of a folder by what they are for.

    Attributes:
        train: to learn from.
        val: to choose the best checkpoint by.
        test: to report; none where there are no scenes besides those that choose the checkpoint.
        note: how that differs from the splits of these names, in words; empty where it doesn't.
    """

    train: tuple[str, ...]
    val: tuple[str, ...]
    test: tuple[str, ...] = ()
    note: str = ""

    @property
    def reported(self) -> str:
        """Which scenes to report: `test`, or `val` where there are no such."""
        return TEST if self.test else VAL

    def splits(self) -> dict[str, tuple[str, ...]]:
        """Split → scenes, as a split file has them."""
        both = {TRAIN: self.train, VAL: self.val}
        return both | {TEST: self.test} if self.test else both


def divide_scenes(
    shards: Path,
    manifest: Manifest,
    *,
    train: str | None = None,
    val: str | None = None,
    split_file: Path | None = None,
    ratio: tuple[int, int] | None = None,
    seed: int = 0,
) -> Division:
    """Decide which scenes of a folder are learnt from, choose the checkpoint, and are reported.

    These are the splits `train`, `val` and `test`, if a scene of `test` has boxes. Otherwise, as in nuScenes,
    `val` is reported, and whole logs of `train` choose the checkpoint: about an eighth of its scenes, the
    same ones in whatever order they stand. Shards that don't say which log they are of count as one each.
    Where fewer than three logs are in `train`, or splits are named or come from a file, `val` does both.

    Args:
        shards: the folder.
        manifest: its manifest.
        train: the split to learn from; None for `train`.
        val: the split to choose by; None for `val`.
        split_file: a JSON file of split → scene names instead of the manifest's splits.
        ratio: instead of splits, learn from and choose by all scenes in this proportion, at random.
        seed: of that division.

    Returns:
        The division; a split that isn't there has no scenes.

    Raises:
        SettingsError, TableError: as `split_scenes`.
        ShardError: a shard of `train` or `test` is absent or damaged.
    """
    splits = split_scenes(manifest, split_file=split_file, ratio=ratio, seed=seed)
    learnt, chosen = (splits.get(name, ()) for name in (train or TRAIN, val or VAL))
    test = () if TEST in (train, val) else splits.get(TEST, ())
    entries = {entry.scene: entry for entry in manifest.shards}
    if any(_has_boxes(shards, entries[scene]) for scene in test):
        return Division(learnt, chosen, test)
    asked = (train, val, split_file, ratio) != (None, None, None, None)
    return Division(learnt, chosen) if asked or not chosen else _carved(shards, entries, learnt, chosen)


def held_out_logs(logs: Mapping[str, str]) -> tuple[str, ...]:
    """Scenes of whole logs that are kept from learning: about one in `HELD_OUT`, of one log at least.

    Args:
        logs: scene → its log.

    Returns:
        Scenes, sorted; none where fewer than two logs would be left.
    """
    scenes: dict[str, list[str]] = {}
    for scene, log in sorted(logs.items()):
        scenes.setdefault(log, []).append(scene)
    order = np.random.default_rng(_SEED).permutation(sorted(scenes)).tolist()
    most, found = max(round(len(logs) / HELD_OUT), 1), list[str]()
    for log in order[: len(order) - _FEWEST_LOGS]:
        found += scenes[log] if len(found) + len(scenes[log]) <= most else ()
    if not found and len(order) > _FEWEST_LOGS:
        found = min((scenes[log] for log in order), key=len)
    return tuple(sorted(found))


def split_scenes(
    manifest: Manifest,
    *,
    split_file: Path | None = None,
    ratio: tuple[int, int] | None = None,
    seed: int = 0,
) -> dict[str, tuple[str, ...]]:
    """Scenes by the names of their splits.

    Args:
        manifest: of the folder of shards.
        split_file: a JSON file of split → scene names instead of the manifest's splits; scenes that are not
            in the folder are left out.
        ratio: instead of both, divides all scenes at random into `train` and `val` in this proportion, such
            as the paper's (77, 9); each has at least one.
        seed: of that division.

    Returns:
        Split → names of scenes, sorted where they come from the manifest or the division.

    Raises:
        SettingsError: both file and ratio are given, the ratio is not of positive numbers, or there are
            fewer than two scenes to divide.
        TableError: the file is absent or malformed.
    """
    scenes = tuple(sorted(entry.scene for entry in manifest.shards))
    if split_file is not None and ratio is not None:
        raise SettingsError("splits: give a split file or a ratio, not both")
    if split_file is not None:
        listed = read_split_file(split_file)
        return {split: tuple(name for name in names if name in scenes) for split, names in listed.items()}
    if ratio is not None:
        return _divided(scenes, ratio, seed)
    splits = sorted({split for entry in manifest.shards for split in entry.splits})
    return {split: tuple(sorted(entry.scene for entry in manifest.split(split))) for split in splits}


def _divided(scenes: tuple[str, ...], ratio: tuple[int, int], seed: int) -> dict[str, tuple[str, ...]]:
    shown = "/".join(map(str, ratio))
    if min(ratio) < 1:
        raise SettingsError(f"split ratio {shown}: both parts must be at least 1")
    if len(scenes) < 2:
        raise SettingsError(f"split ratio {shown}: there are fewer than two scenes to divide")
    held_out = min(max(round(len(scenes) * ratio[1] / sum(ratio)), 1), len(scenes) - 1)
    shuffled = np.random.default_rng(seed).permutation(scenes).tolist()
    return {TRAIN: tuple(sorted(shuffled[held_out:])), VAL: tuple(sorted(shuffled[:held_out]))}


def _has_boxes(shards: Path, entry: ShardEntry) -> bool:
    with listed_shard(shards, entry) as shard:
        return any(len(shard.dataset(camera, "boxes/annotation_token")) for camera in shard.cameras)


def _carved(
    shards: Path, entries: Mapping[str, ShardEntry], train: Sequence[str], val: tuple[str, ...]
) -> Division:
    """`val` is reported, and some logs of `train` choose the checkpoint, if there are enough."""
    known = {scene: _log(shards, entries[scene]) for scene in train}
    logs = {scene: log or scene for scene, log in known.items()}
    held_out = held_out_logs(logs)
    if not held_out:
        return Division(tuple(train), val)
    part, whole = len({logs[scene] for scene in held_out}), with_number(len(set(logs.values())), "log")
    unknown = "" if all(known.values()) else "; shards that don't know their log count as one each"
    note = (
        f"no split test with boxes: val is reported, and {len(held_out)} of the "
        f"{with_number(len(train), 'scene')} in train ({part} of {whole}) "
        f"choose the checkpoint{unknown}"
    )
    learnt = tuple(scene for scene in train if scene not in held_out)
    return Division(learnt, held_out, val, note)


def _log(shards: Path, entry: ShardEntry) -> str:
    with listed_shard(shards, entry) as shard:
        return shard.log

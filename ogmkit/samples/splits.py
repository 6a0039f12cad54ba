"""Division of a folder's scenes for training: always by scene, since neighbouring frames are alike."""

from pathlib import Path

import numpy as np

from ogmkit.errors import SettingsError
from ogmkit.nuscenes.splits import read_split_file
from ogmkit.shards.manifest import Manifest


def split_scenes(
    manifest: Manifest,
    *,
    split_file: Path | None = None,
    ratio: tuple[int, int] | None = None,
    seed: int = 0,
) -> dict[str, tuple[str, ...]]:
    """Scenes by split.

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
    return {"train": tuple(sorted(shuffled[held_out:])), "val": tuple(sorted(shuffled[:held_out]))}

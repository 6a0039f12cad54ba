"""Splits: a split file, else the dataset's `splits.json`, else the official scene lists (design.md §7)."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from ogmkit.base.files import read_text
from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError, TableError

SPLITS_FILE = "splits.json"
_LIST = ".txt"

# Numbers of scene-NNNN, inclusive ranges. Source: nuscenes-devkit 1.2.0, nuscenes.utils.splits.
_OFFICIAL_NUMBERS = {
    "train": (
        "1-2 4-11 19-34 41-76 120-135 138-139 149-152 154-155 157-168 170-185 187-188 190-196 199-200 "
        "202-204 206-214 218-220 222 224-264 283-306 315-318 321 323-324 328 347-386 388-403 405-408 "
        "410-459 461-465 467-469 471-472 474-480 499-502 504-515 517-518 525-539 541-546 566 568 570-578 "
        "580 582-600 639-679 681 683-689 695-698 700-701 703-719 726-728 730-731 733-741 744 746-747 "
        "749-752 757-765 767-769 786-787 789-792 803-806 808-813 815-817 819-822 847-856 858 860-866 "
        "868-873 875-878 880 882-903 945 947 949 952-953 955-961 975-984 988-992 994-1025 1044-1058 "
        "1074-1102 1104-1110"
    ),
    "val": (
        "3 12-18 35-36 38-39 92-110 221 268-278 329-332 344-346 519-524 552-565 625-627 629-630 632-638 "
        "770-771 775 777-778 780-784 794-800 802 904-917 919-931 962-963 966-969 971-972 1059-1073"
    ),
    "test": (
        "77-91 111-119 140 142-148 265-266 279-282 307-314 333-343 481-498 547-551 601-604 606-624 827-831 "
        "833-842 844-846 932-933 935-943 1026-1043"
    ),
    "mini_train": "61 553 655 757 796 1077 1094 1100",
    "mini_val": "103 916",
}


def _scene_names(numbers: str) -> tuple[str, ...]:
    spans = [tuple(int(end) for end in span.split("-")) for span in numbers.split()]
    return tuple(f"scene-{number:04d}" for span in spans for number in range(span[0], span[-1] + 1))


OFFICIAL: dict[str, tuple[str, ...]] = {
    split: _scene_names(numbers) for split, numbers in _OFFICIAL_NUMBERS.items()
}
"""Split → scene names of nuScenes v1.0."""


def read_split_file(path: Path) -> dict[str, tuple[str, ...]]:
    """Read a split file: a JSON object of split → list of scene names; or published lists.

    Lists are published as text: a folder of files such as `train.txt`, or one such file, with a scene's name
    a line. A file's name, less its ending, is the split's.

    Raises:
        TableError: the file is absent, no JSON, or holds something else; or a folder holds no list.
    """
    if published(path):
        return _read_lists(path)
    try:
        content = json.loads(_text(path))
    except (ValueError, RecursionError) as error:
        raise TableError(
            f"{path}: split file is not JSON ({error}); give an object of split → scenes"
        ) from error
    if not isinstance(content, dict):
        raise TableError(f"{path}: split file holds no object of split → list of scene names; correct it")
    for split, scenes in content.items():
        if not isinstance(scenes, list) or not all(isinstance(scene, str) for scene in scenes):
            raise TableError(f"{path}: split {split!r} is not a list of scene names; correct it")
        if len(set(scenes)) != len(scenes):
            raise TableError(f"{path}: split {split!r} names a scene twice; correct it")
    return {split: tuple(scenes) for split, scenes in content.items()}


def published(path: Path) -> bool:
    """Whether a split file holds published lists: they name a whole dataset's scenes, parts may lack some."""
    return path.is_dir() or path.suffix == _LIST


def _read_lists(path: Path) -> dict[str, tuple[str, ...]]:
    files = sorted(path.glob(f"*{_LIST}")) if path.is_dir() else [path]
    if not files:
        raise TableError(f"{path}: holds no list of scenes, such as train{_LIST}; check the path")
    try:
        splits = {file.stem: tuple(_text(file).split()) for file in files}
    except ValueError as error:
        raise TableError(f"{path}: holds a list that is no text ({error}); give a scene a line") from error
    for split, scenes in splits.items():
        if len(set(scenes)) != len(scenes):
            raise TableError(f"{path}: split {split!r} names a scene twice; correct it")
    return splits


def _text(path: Path) -> str:
    try:
        return read_text(path)
    except OSError as error:
        raise TableError(f"{path}: split file can't be read ({error.strerror}); check the path") from error


def find_splits(
    root: Path, scene_names: Sequence[str], split_file: Path | None = None
) -> dict[str, tuple[str, ...]]:
    """The splits that hold for a dataset.

    The dataset's own, published and the official lists are cut down to the scenes that are there: a part of
    a dataset may well have kept the whole one's file. A JSON file that the user names must fit.

    Args:
        root: the dataset's root, which may hold `splits.json`.
        scene_names: the dataset's scenes.
        split_file: takes precedence.

    Returns:
        Split → scene names. Of the official ones, those that have a scene in the dataset.

    Raises:
        TableError: a split file is absent or malformed, or `split_file` names a scene that is not there.
    """
    if split_file is not None:
        found = read_split_file(split_file)
        if published(split_file):
            return _cut(found, scene_names)
        require_present(split_file, found, scene_names)
        return found
    own = root / SPLITS_FILE
    if own.exists():
        return _cut(read_split_file(own), scene_names)
    return {split: scenes for split, scenes in _cut(OFFICIAL, scene_names).items() if scenes}


def find_split(
    root: Path, scene_names: Sequence[str], split: str, split_file: Path | None = None
) -> tuple[str, ...]:
    """The scenes of one split; arguments as of `find_splits`.

    Raises:
        SettingsError: there is no such split, it has no scene here, or it is the official `test`.
        TableError: see `find_splits`.
    """
    splits = find_splits(root, scene_names, split_file)
    own = root / SPLITS_FILE
    official = split_file is None and not own.exists()
    source = root if official else split_file or own
    if official and split == "test":
        raise SettingsError(
            f"{source}: split test: the official test scenes have no annotations; choose train or val"
        )
    if split not in (OFFICIAL if official else splits):
        raise SettingsError(f"{source}: {unknown('split', split, tuple(splits))}")
    if not splits.get(split):
        listed = ", ".join(name for name, scenes in splits.items() if scenes) or "none"
        raise SettingsError(
            f"{source}: split {split}: none of its scenes is in this dataset; choose from: {listed}"
        )
    return splits[split]


def require_present(path: Path, splits: Mapping[str, Sequence[str]], scene_names: Sequence[str]) -> None:
    """Check that a dataset has all scenes that a split file names.

    Raises:
        TableError: it lacks one.
    """
    present = set(scene_names)
    for split, scenes in splits.items():
        for scene in scenes:
            if scene not in present:
                raise TableError(f"{path}: split {split!r}: {unknown('scene', scene, scene_names)}")


def _cut(splits: Mapping[str, Sequence[str]], scene_names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    present = set(scene_names)
    return {split: tuple(scene for scene in scenes if scene in present) for split, scenes in splits.items()}

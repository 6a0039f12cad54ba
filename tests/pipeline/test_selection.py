import json

import pytest

from ogmkit.errors import SettingsError
from ogmkit.pipeline.selection import select_scenes


@pytest.fixture
def split_file(tmp_path, dataset):
    first, second = dataset.scene_names()
    path = tmp_path / "splits.json"
    path.write_text(json.dumps({"one": [second], "other": [first], "both": [second, first]}))
    return path


@pytest.mark.parametrize(
    ("names", "splits", "expected"),
    [
        ((), (), (0, 1)),
        ((1, 0), (), (0, 1)),
        ((), ("one",), (1,)),
        ((), ("one", "other"), (0, 1)),
        ((0,), ("both",), (0,)),
    ],
)
def test_scenes_are_chosen_by_name_and_split(dataset, split_file, names, splits, expected):
    present = dataset.scene_names()
    chosen = select_scenes(dataset, [present[i] for i in names], splits, split_file)
    assert chosen == tuple(present[i] for i in expected)


def test_scenes_are_chosen_by_patterns(dataset):
    present = dataset.scene_names()
    assert select_scenes(dataset, ["scene-*"]) == present
    assert select_scenes(dataset, [f"*{present[1][-1]}", present[0]]) == present
    with pytest.raises(SettingsError, match=r"no scene matches 'scene-9\*'; did you mean scene-"):
        select_scenes(dataset, ["scene-9*"])


def test_nothing_left_is_an_error(dataset, split_file):
    first = dataset.scene_names()[0]
    with pytest.raises(SettingsError, match="none of the scenes is in split one; choose others"):
        select_scenes(dataset, [first], ["one"], split_file)


def test_unknown_names_are_errors(dataset, split_file):
    with pytest.raises(SettingsError, match="unknown scene 'scene-0000'"):
        select_scenes(dataset, ["scene-0000"])
    with pytest.raises(SettingsError, match="'none'"):
        select_scenes(dataset, splits=["none"], split_file=split_file)

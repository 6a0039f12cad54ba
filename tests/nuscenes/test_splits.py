import json

import pytest

from ogmkit.errors import SettingsError, TableError
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.splits import OFFICIAL, find_split, find_splits


def test_official_splits_are_the_thousand_scenes():
    """Counts and a few members as nuScenes documents them; the parts don't overlap."""
    assert {name: len(scenes) for name, scenes in OFFICIAL.items()} == {
        "train": 700,
        "val": 150,
        "test": 150,
        "mini_train": 8,
        "mini_val": 2,
    }
    assert len({*OFFICIAL["train"], *OFFICIAL["val"], *OFFICIAL["test"]}) == 1000
    assert OFFICIAL["mini_val"] == ("scene-0103", "scene-0916")
    assert OFFICIAL["train"][0] == "scene-0001"
    assert OFFICIAL["train"][-1] == "scene-1110"
    assert {*OFFICIAL["mini_val"], "scene-0003", "scene-1073"} <= set(OFFICIAL["val"])
    assert "scene-0077" in OFFICIAL["test"]


def test_official_splits_are_cut_down_to_what_is_there(real_dataroot):
    with Dataset(real_dataroot) as dataset:
        assert dataset.splits() == {
            "train": ("scene-0061",),
            "val": ("scene-0103",),
            "mini_train": ("scene-0061",),
            "mini_val": ("scene-0103",),
        }
        assert dataset.split("mini_val") == ("scene-0103",)


def test_the_datasets_own_splits_come_before_the_official(small_root):
    (small_root / "splits.json").write_text(json.dumps({"train": ["scene-0002"], "mine": ["scene-0001"]}))

    with Dataset(small_root) as dataset:
        assert dataset.splits() == {"train": ("scene-0002",), "mine": ("scene-0001",)}
        with pytest.raises(SettingsError, match=r"unknown split 'val'; there are: train, mine"):
            dataset.split("val")


def test_a_split_file_comes_first(small_root, tmp_path):
    (small_root / "splits.json").write_text(json.dumps({"train": ["scene-0002"]}))
    path = tmp_path / "own.json"
    path.write_text(json.dumps({"test": ["scene-0001"]}))

    with Dataset(small_root) as dataset:
        assert dataset.split("test", path) == ("scene-0001",)  # only the official test lacks annotations


def test_official_test_has_no_annotations(small_root):
    with Dataset(small_root) as dataset, pytest.raises(SettingsError, match="no annotations"):
        dataset.split("test")


def test_an_official_split_without_a_scene_here(small_root, damage):
    damage("scene", "scene-2", name="other")

    with Dataset(small_root) as dataset:
        assert dataset.split("train") == ("scene-0001",)
        with pytest.raises(
            SettingsError, match=r"split val: none of its scenes is in this dataset; choose from: train"
        ):
            dataset.split("val")
        with pytest.raises(SettingsError, match=r"unknown split 'trian'; did you mean train\?"):
            dataset.split("trian")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "not JSON"),
        ("<html>", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ('["scene-0001"]', "no object"),
        ('{"train": "scene-0001"}', "'train' is not a list"),
        ('{"train": [1]}', "'train' is not a list"),
        ('{"train": ["scene-0001", "scene-0001"]}', "names a scene twice"),
    ],
)
def test_a_malformed_split_file_is_named(tmp_path, content, words):
    path = tmp_path / "splits.json"
    path.write_text(content)

    with pytest.raises(TableError, match=words) as caught:
        find_splits(tmp_path, ("scene-0001", "scene-0002"))
    assert str(caught.value).startswith(f"{path}: ")


def test_a_part_of_a_dataset_may_keep_the_splits_of_the_whole(tmp_path):
    (tmp_path / "splits.json").write_text('{"train": ["scene-0001", "scene-0009"], "val": ["scene-0008"]}')

    assert find_splits(tmp_path, ("scene-0001",)) == {"train": ("scene-0001",), "val": ()}
    with pytest.raises(SettingsError, match="split val: none of its scenes is in this dataset") as caught:
        find_split(tmp_path, ("scene-0001",), "val")
    assert str(caught.value).startswith(f"{tmp_path / 'splits.json'}: ")


def test_a_split_file_with_an_unknown_scene_is_named(tmp_path):
    path = tmp_path / "mine.json"
    path.write_text('{"train": ["scene-1"]}')

    with pytest.raises(TableError, match="unknown scene 'scene-1'; did you mean scene-0001") as caught:
        find_splits(tmp_path, ("scene-0001", "scene-0002"), path)
    assert str(caught.value).startswith(f"{path}: split 'train': ")


def test_an_absent_split_file_is_named(tmp_path):
    with pytest.raises(TableError, match="can't be read"):
        find_splits(tmp_path, (), tmp_path / "gone.json")


def test_an_empty_split_cannot_be_chosen(small_root):
    (small_root / "splits.json").write_text(json.dumps({"train": [], "val": ["scene-0001"]}))

    with (
        Dataset(small_root) as dataset,
        pytest.raises(SettingsError, match=r"split train: none of its scenes .*; choose from: val"),
    ):
        dataset.split("train")


def test_published_lists_are_a_folder_of_scenes_a_line(small_root, tmp_path):
    lists = tmp_path / "geo"
    lists.mkdir()
    (lists / "train.txt").write_text("scene-0002\nscene-0999\n")
    (lists / "val.txt").write_text("scene-0001\n\n")

    with Dataset(small_root) as dataset:
        # They name a whole dataset's scenes: those that a part lacks are no error.
        assert dataset.splits(lists) == {"train": ("scene-0002",), "val": ("scene-0001",)}
        assert dataset.split("val", lists) == ("scene-0001",)
        assert dataset.splits(lists / "val.txt") == {"val": ("scene-0001",)}


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({}, r"geo: holds no list of scenes, such as train\.txt; check the path"),
        ({"val.txt": b"scene-0001\nscene-0001\n"}, "geo: split 'val' names a scene twice; correct it"),
        ({"val.txt": b"\xff\xfe"}, "geo: holds a list that is no text"),
    ],
)
def test_what_is_wrong_with_published_lists_is_told(small_root, tmp_path, files, message):
    lists = tmp_path / "geo"
    lists.mkdir()
    for name, content in files.items():
        (lists / name).write_bytes(content)

    with Dataset(small_root) as dataset, pytest.raises(TableError, match=message):
        dataset.splits(lists)

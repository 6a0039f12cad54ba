import dataclasses
import json

import pytest

from ogmkit.errors import SettingsError, TableError
from ogmkit.samples.splits import split_scenes
from ogmkit.shards.manifest import Manifest, ShardEntry
from ogmkit.shards.settings import ExtractSettings

NAMES = tuple(f"scene-{number:04d}" for number in range(86))


@pytest.fixture(scope="module")
def manifest():
    sample_shards = tuple(
        ShardEntry(name, f"{name}.h5", "here", 40, 1, "", ("val", "part") if i % 9 == 0 else ("train",))
        for i, name in enumerate(NAMES)
    )
    return Manifest("v1.0-trainval", "/data", ExtractSettings(), sample_shards)


def test_the_manifest_s_own(manifest):
    splits = split_scenes(manifest)

    assert set(splits) == {"train", "val", "part"}
    assert splits["val"] == splits["part"] == NAMES[::9]
    assert sorted(splits["train"] + splits["val"]) == list(NAMES)


def test_a_file_s_scenes_that_are_not_there_are_left_out(manifest, tmp_path):
    path = tmp_path / "splits.json"
    path.write_text(json.dumps({"a": ["scene-0005", "scene-9999", "scene-0001"], "b": ["scene-9998"]}))

    assert split_scenes(manifest, split_file=path) == {"a": ("scene-0005", "scene-0001"), "b": ()}


def test_a_random_division_is_of_whole_scenes_and_proportional(manifest):
    splits = split_scenes(manifest, ratio=(77, 9), seed=5)

    assert {split: len(scenes) for split, scenes in splits.items()} == {"train": 77, "val": 9}
    assert sorted(splits["train"] + splits["val"]) == list(NAMES)
    assert splits == split_scenes(manifest, ratio=(77, 9), seed=5)
    assert splits != split_scenes(manifest, ratio=(77, 9), seed=6)
    assert splits["val"] != NAMES[:9]


@pytest.mark.parametrize(("ratio", "held_out"), [((77, 9), 1), ((1, 99), 2), ((1, 1), 2)])
def test_neither_part_is_empty(manifest, ratio, held_out):
    few = dataclasses.replace(manifest, shards=manifest.shards[:3])

    splits = split_scenes(few, ratio=ratio)

    assert len(splits["val"]) == held_out
    assert len(splits["train"]) == 3 - held_out


def test_what_can_t_be_is_refused(manifest, tmp_path):
    one = dataclasses.replace(manifest, shards=manifest.shards[:1])
    with pytest.raises(SettingsError, match="split ratio 77/0: both parts must be at least 1"):
        split_scenes(manifest, ratio=(77, 0))
    with pytest.raises(SettingsError, match="split ratio 77/9: there are fewer than two scenes"):
        split_scenes(one, ratio=(77, 9))
    with pytest.raises(SettingsError, match="a split file or a ratio, not both"):
        split_scenes(manifest, split_file=tmp_path / "x.json", ratio=(77, 9))
    with pytest.raises(TableError, match=r"x\.json: split file can't be read"):
        split_scenes(manifest, split_file=tmp_path / "x.json")

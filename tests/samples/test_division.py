"""Which scenes of a folder are learnt from, choose the checkpoint, and are reported."""

import json
from dataclasses import replace

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.samples.splits import divide_scenes, held_out_logs
from ogmkit.shards.manifest import read_manifest, write_manifest

MANY = {f"train-{number}": ("train", f"log-{number // 2}") for number in range(8)}
"""Eight scenes of four logs."""


@pytest.fixture
def make(tmp_path, sample_shards, copy_scenes):
    """A folder of such scenes: `make({scene: (split, log)})`; returns the folder."""
    return lambda scenes: copy_scenes(sample_shards, tmp_path / "shards", scenes)


def divided(folder, **options):
    return divide_scenes(folder, read_manifest(folder), **options)


def forget_boxes(path):
    """Leave a shard without boxes, as one of a test that nobody has annotated."""
    with h5py.File(path, "r+") as h5:
        for camera in h5.values():
            boxes = camera["boxes"]
            boxes["offsets"][:] = 0
            for name in set(boxes) - {"offsets"}:
                empty = boxes[name][:0]
                kind = boxes[name].dtype
                del boxes[name]
                boxes.create_dataset(name, data=empty, dtype=kind)


@given(st.dictionaries(st.text("abcdef", min_size=1), st.integers(0, 9)), st.randoms())
def test_held_out_scenes_are_whole_logs_about_an_eighth_in_any_order(numbers, random):
    logs = {scene: f"log-{number}" for scene, number in numbers.items()}
    shuffled = list(logs.items())
    random.shuffle(shuffled)
    held_out = held_out_logs(dict(shuffled))

    assert held_out == held_out_logs(logs) == tuple(sorted(set(held_out)))
    names, held = {*logs.values()}, {logs[scene] for scene in held_out}
    assert {scene for scene in logs if logs[scene] in held} == {*held_out}
    assert bool(held_out) == (len(names) > 2)
    assert not held or len(names - held) >= 2
    smallest = min((sum(log == one for one in logs.values()) for log in names), default=0)
    assert len(held_out) <= max(round(len(logs) / 8), 1) or (len(held), len(held_out)) == (1, smallest)


def test_of_many_small_logs_an_eighth_is_held_out_and_not_the_first():
    logs = {f"scene-{number:04d}": f"log-{number:04d}" for number in range(700)}
    held_out = held_out_logs(logs)
    assert len(held_out) == 88  # 87.5
    assert 250 < np.mean([int(scene[-4:]) for scene in held_out]) < 450


def test_the_official_share_stays_within_an_eighth_where_logs_are_long():
    logs = {f"scene-{number:04d}": f"log-{number // 12}" for number in range(700)}
    assert len(held_out_logs(logs)) in (76, 84, 88)  # a last log has four scenes


def test_a_test_with_boxes_is_reported_as_it_is(make):
    division = divided(make(MANY | {"val": ("val", "log-8"), "test": ("test", "log-9")}))

    assert (division.train, division.val, division.test) == (tuple(sorted(MANY)), ("val",), ("test",))
    assert (division.reported, division.note) == ("test", "")
    assert division.splits() == {"train": tuple(sorted(MANY)), "val": ("val",), "test": ("test",)}


def test_one_scene_with_boxes_makes_a_test(make):
    folder = make({"a": ("train", "1"), "b": ("val", "2"), "c": ("test", "3"), "d": ("test", "4")})
    forget_boxes(folder / "c.h5")
    manifest = read_manifest(folder)
    sizes = [replace(entry, bytes=(folder / entry.file).stat().st_size) for entry in manifest.shards]
    write_manifest(folder, replace(manifest, shards=tuple(sizes)))
    assert divided(folder).test == ("c", "d")

    forget_boxes(folder / "d.h5")
    sizes = [replace(entry, bytes=(folder / entry.file).stat().st_size) for entry in manifest.shards]
    write_manifest(folder, replace(manifest, shards=tuple(sizes)))
    assert (divided(folder).test, divided(folder).reported) == ((), "val")


def test_without_a_test_one_log_of_train_chooses_and_val_is_reported(make):
    folder = make(MANY | {"val-0": ("val", "log-8"), "val-1": ("val", "log-8")})
    division = divided(folder)

    assert (division.test, division.reported) == (("val-0", "val-1"), "test")
    assert len(division.val) == 2
    assert {MANY[scene] for scene in division.val} == {MANY[division.val[0]]}
    assert sorted(division.train + division.val) == sorted(MANY)
    assert division.note == (
        "no split test with boxes: val is reported, and 2 of the 8 scenes in train (1 of 4 logs) choose the "
        "checkpoint"
    )
    manifest = read_manifest(folder)
    write_manifest(folder, replace(manifest, shards=manifest.shards[::-1]))
    assert divided(folder) == division


def test_scenes_of_unknown_logs_count_as_one_each_and_that_is_told(make):
    division = divided(make(dict.fromkeys(MANY, ("train", "")) | {"val": ("val", "")}))

    assert (len(division.train), len(division.val), division.test) == (7, 1, ("val",))
    assert division.note.endswith(
        "1 of the 8 scenes in train (1 of 8 logs) choose the checkpoint; shards that don't know their log "
        "count as one each"
    )


def test_too_few_logs_leave_val_for_both(make):
    division = divided(
        make({"a": ("train", "1"), "b": ("train", "1"), "c": ("train", "2"), "v": ("val", "3")})
    )
    assert (division.train, division.val, division.test) == (("a", "b", "c"), ("v",), ())
    assert (division.reported, division.note) == ("val", "")


def test_what_is_asked_for_is_not_divided_again(make, tmp_path):
    folder = make(MANY | {"val": ("val", "log-8")})
    path = tmp_path / "splits.json"

    path.write_text(json.dumps({"train": sorted(MANY), "val": ["val"]}))
    assert divided(folder, split_file=path).splits() == {"train": tuple(sorted(MANY)), "val": ("val",)}
    assert divided(folder, train="train").train == divided(folder, val="val").train == tuple(sorted(MANY))
    ratio = divided(folder, ratio=(2, 1), seed=3)
    assert (len(ratio.train), len(ratio.val), ratio.test) == (6, 3, ())
    named = divided(folder, train="val", val="train")
    assert (named.train, named.val) == (("val",), tuple(sorted(MANY)))


def test_a_division_as_a_split_file_is_the_same_division(make, tmp_path):
    folder = make(MANY | {"val": ("val", "log-8")})
    path = tmp_path / "splits.json"
    path.write_text(json.dumps(divided(folder).splits()))
    assert divided(folder, split_file=path) == replace(divided(folder), note="")


def test_a_test_that_chooses_the_checkpoint_is_not_reported(make):
    folder = make({"a": ("train", "1"), "b": ("val", "2"), "c": ("test", "3")})
    division = divided(folder, val="test")
    assert (division.train, division.val, division.test) == (("a",), ("c",), ())

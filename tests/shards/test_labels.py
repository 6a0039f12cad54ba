"""Labels by name in shards: written, read back, checked, and apart from the paper's."""

import json
import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest

from ogmkit.errors import SettingsError, ShardError, TableError
from ogmkit.frames import SceneRecord
from ogmkit.labels.catalogue import PRESETS, paper
from ogmkit.labels.definition import without_map
from ogmkit.labels.make import labels_of
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.expansion import open_expansion
from ogmkit.pipeline.amendment import chosen_cameras
from ogmkit.shards.contents import labels_in
from ogmkit.shards.labels_rows import sample_tokens
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.verify import verify_folder
from ogmkit.target_settings import TargetSettings

NAMES = ("lss", "fiery", "cvt", "pon", "bevfusion", "pointbev", "stp3")
CAMERAS = ("CAM_BACK", "CAM_FRONT")


@pytest.fixture(scope="module")
def make(extract_all, tiny_dataroot, sample_grid):
    """Extract the tiny dataset: `make(folder, *definitions, **targets)`, in `folder / "out"`."""

    def extract(folder, *definitions, **targets):
        settings = ExtractSettings(TargetSettings(sample_grid, **targets), CAMERAS, definitions=definitions)
        return extract_all(tiny_dataroot, folder, settings)

    return extract


@pytest.fixture(scope="module")
def labels(shared_folder, make):
    """All definitions but the paper's, in shards of their own; tests only read them."""
    return shared_folder("labels", lambda folder: make(folder, *NAMES)) / "out"


@pytest.fixture(scope="module")
def both(shared_folder, make):
    """The paper's labels and some others in the same shards; tests only read them."""
    return shared_folder("paper and labels", lambda folder: make(folder, "paper", "lss", "pon")) / "out"


@pytest.fixture
def damaged(labels, tmp_path):
    """A copy of the labels' first shard, to be changed, beside its manifest."""
    return shutil.copytree(labels, tmp_path / "out") / read_manifest(labels).shards[0].file


def messages(path):
    """What `verify` says of a shard, but of its checksum."""
    (path.parent / "manifest.json").unlink()
    return [one.message for one in verify_folder(path.parent) if one.file == path.name]


@pytest.fixture(scope="module")
def key_frames(tiny_dataroot):
    with Dataset(tiny_dataroot) as dataset:
        name = dataset.scene_names()[0]
        return dataset.key_frames(name, lidar="LIDAR_TOP", camera="CAM_FRONT")


@pytest.mark.parametrize("name", NAMES)
def test_what_is_stored_is_what_the_definition_draws(labels, key_frames, name):
    definition, row = PRESETS[name], 5
    expected = labels_of(
        key_frames[row], definition, open_expansion(key_frames[0].dataroot, key_frames[0].location)
    )
    with Shard(labels / read_manifest(labels).shards[0].file) as shard:
        assert shard.strings(definition.place, "sample_token")[row] == key_frames[row].sample_token
        for array, values in expected.items():
            stored = shard.dataset(definition.place, f"labels/{name}/{array}")
            assert stored.dtype == values.dtype
            assert stored.chunks == (1, *values.shape)
            np.testing.assert_array_equal(stored[row], values)
        record = json.loads(shard.attributes(f"{definition.place}/labels/{name}")["definition"])
    assert record == definition.to_dict()


def test_labels_alone_are_sound_and_hold_no_camera(labels):
    assert not verify_folder(labels)
    manifest = read_manifest(labels)
    assert [entry.frames for entry in manifest.shards] == [8, 8]
    with Shard(labels / manifest.shards[0].file) as shard:
        assert (shard.cameras, shard.rows, set(shard.h5)) == ((), 8, {"CAM_FRONT", "SURROUND"})
        assert set(shard.h5["CAM_FRONT"]) == {"sample_token", "labels"}
    with pytest.raises(SettingsError, match="holds labels alone; extract with --definition paper as well"):
        chosen_cameras(labels, manifest, ())


def test_no_camera_file_is_needed(make, tiny_dataroot, extract_all, tmp_path):
    root = shutil.copytree(tiny_dataroot, tmp_path / "world", ignore=shutil.ignore_patterns("*.jpg", "*.png"))
    out = extract_all(root, tmp_path, ExtractSettings(definitions=("lss", "pon")))
    assert not verify_folder(out)


def test_the_papers_datasets_are_as_without_labels_beside_them(both, sample_shards):
    for entry in read_manifest(both).shards:
        with h5py.File(sample_shards / entry.file) as alone, h5py.File(both / entry.file) as beside:
            for camera in CAMERAS:
                compare(beside[camera], alone[camera])
                assert json.loads(alone[camera].attrs["definition"])["name"] == "paper"
            assert set(alone) == set(CAMERAS)
            assert set(beside) == {*CAMERAS, "SURROUND"}
    assert not verify_folder(both)


def compare(here, there):
    """Require the same datasets, stored in the same way; labels by name are here alone."""
    names = []
    here.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
    names = [name for name in names if not name.startswith("labels/")]
    assert {"drivable", "vehicles", "field_of_view", "image", "trajectory/past"} <= set(names)
    for name in names:
        one, other = here[name], there[name]
        for layout in ("dtype", "shape", "chunks", "compression", "compression_opts", "shuffle"):
            assert getattr(one, layout) == getattr(other, layout)
        assert dict(one.attrs) == dict(other.attrs)
        if one.dtype == object:
            assert all(np.array_equal(a, b) for a, b in zip(one[:], other[:], strict=True))
        else:
            np.testing.assert_array_equal(one[:], other[:])


def test_the_papers_record_follows_the_settings(both, sample_grid):
    with Shard(both / read_manifest(both).shards[0].file) as shard:
        record = json.loads(shard.attributes("CAM_FRONT")["definition"])
    assert record == paper(TargetSettings(sample_grid)).to_dict()


def test_a_papers_record_that_contradicts_the_settings_is_told(both, tmp_path):
    path = shutil.copytree(both, tmp_path / "out") / read_manifest(both).shards[0].file
    with h5py.File(path, "r+") as h5:
        attributes = h5["CAM_BACK"].attrs
        attributes["definition"] = json.dumps(json.loads(attributes["definition"]) | {"version": 7})
    assert messages(path) == ["/CAM_BACK is by another definition: version is 1 here but 7 there"]


def test_labels_are_listed(both):
    with Shard(both / read_manifest(both).shards[0].file) as shard:
        pon, lss = labels_in(shard)
    assert (lss.place, lss.definition, lss.version, lss.samples) == ("SURROUND", "lss", 1, 8)
    assert lss.arrays == ("vehicle",)
    assert (pon.place, pon.definition) == ("CAM_FRONT", "pon")
    assert {"ignore", "has_sweep", "car"} <= set(pon.arrays)


def test_without_a_map_classes_of_it_are_left_out(make, tmp_path):
    out = make(tmp_path, "cvt", no_map=True)
    assert not verify_folder(out)
    with Shard(out / read_manifest(out).shards[0].file) as shard:
        stored = set(shard.h5["SURROUND/labels/cvt"])
    assert "vehicle" in stored
    assert not {"lane", "road"} & stored


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda h5: h5["SURROUND/labels/lss/vehicle"].write_direct(np.full((8, 200, 200), 2, np.uint8)),
         "/SURROUND/labels/lss/vehicle contradicts its definition in frame 0 and 7 more"),
        (lambda h5: h5["SURROUND/labels/cvt/road"].write_direct(np.zeros((8, 200, 200), np.uint8)),
         "/SURROUND/labels/cvt/road contradicts its definition in frame 0 and 7 more"),
        (lambda h5: h5["SURROUND/labels/pointbev/valid"].write_direct(np.zeros((8, 200, 200), np.uint8)),
         "/SURROUND/labels/pointbev/valid contradicts its definition in frame 0 and 7 more"),
        (lambda h5: h5.pop("SURROUND/labels/lss"), "/SURROUND/labels/lss is missing"),
        (lambda h5: h5.pop("SURROUND/labels/lss/vehicle"), "/SURROUND/labels/lss/vehicle is missing"),
        (lambda h5: h5.copy("SURROUND/labels/lss", "SURROUND/labels/mine"),
         "/SURROUND/labels/mine is not among the settings' definitions"),
        (lambda h5: h5["SURROUND/labels/lss"].create_dataset("more", data=[1]),
         "/SURROUND/labels/lss/more is not in the schema"),
        (lambda h5: h5["SURROUND"].create_dataset("more", data=[1]), "/SURROUND/more is not in the schema"),
        (lambda h5: h5["SURROUND/labels/lss"].attrs.pop("definition"),
         "/SURROUND/labels/lss attribute definition is missing"),
    ],
)  # fmt: skip
def test_verify_tells_what_is_wrong(damaged, change, said):
    with h5py.File(damaged, "r+") as h5:
        change(h5)
    assert said in messages(damaged)


def test_a_record_of_another_definition_is_told_by_field(damaged):
    with h5py.File(damaged, "r+") as h5:
        attributes = h5["SURROUND/labels/lss"].attrs
        record = json.loads(attributes["definition"])
        attributes["definition"] = json.dumps(record | {"frame": "lidar-ego-yaw"})
    (said,) = messages(damaged)
    assert said == (
        "/SURROUND/labels/lss is by another definition: frame is lidar-ego here but lidar-ego-yaw there"
    )


def test_a_record_that_cant_be_read_is_damage(damaged):
    with h5py.File(damaged, "r+") as h5:
        h5["SURROUND/labels/lss"].attrs["definition"] = "{}"
    with Shard(damaged) as shard, pytest.raises(ShardError, match="lss has no sound definition"):
        shard.dataset("SURROUND", "labels/lss/vehicle")


def test_settings_of_definitions():
    assert "definitions" not in ExtractSettings().to_dict()
    settings = ExtractSettings(definitions=("cvt", "paper"))
    assert ExtractSettings.from_dict(settings.to_dict()).definitions == ("paper", "cvt")
    alone = ExtractSettings(definitions=("cvt",))
    assert (alone.cameras, alone.paper) == ((), False)
    assert ExtractSettings.from_dict(alone.to_dict()) == alone
    for names, said in (((), "none: name at least one"), (("lss", "lss"), "each once"), (("ls",), "unknown")):
        with pytest.raises(SettingsError, match=said):
            ExtractSettings(definitions=names)


def test_a_sample_without_a_front_camera_has_no_row_before_it(key_frames):
    frames = (replace(key_frames[0], camera=None), *key_frames[1:])
    scene = SceneRecord("scene-0001", "here", {}, key_frames=frames)
    assert sample_tokens(scene, PRESETS["lss"]) == tuple(frame.sample_token for frame in frames)
    assert sample_tokens(scene, PRESETS["pon"]) == tuple(frame.sample_token for frame in frames[1:])
    with pytest.raises(TableError, match="has no frame of the front camera"):
        labels_of(frames[0], without_map(PRESETS["pon"]))

"""Layers, classes, instances and future in shards: stored, read back, checked, and apart from the paper's."""

import re
import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest

from ogmkit.errors import SettingsError
from ogmkit.further_targets import Around, following_boxes, further_targets, instance_numbers
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.raster.layers import open_layers
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema import field_of
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.verify import verify_folder
from ogmkit.target_settings import TargetSettings

CAMERAS = ("CAM_BACK", "CAM_FRONT")
GROUPS = ("layers", "classes", "instances", "future")


@pytest.fixture
def damaged(further_shards, tmp_path):
    """A copy of the first shard, to be changed, without its manifest."""
    out = shutil.copytree(further_shards, tmp_path / "out")
    path = out / read_manifest(out).shards[0].file
    (out / "manifest.json").unlink()
    return path


def messages(path):
    return [one.message for one in verify_folder(path.parent) if one.file == path.name]


def test_what_is_stored_is_what_is_drawn(further_shards, further_settings, tiny_dataroot, sample_grid):
    settings = TargetSettings(sample_grid, **further_settings)
    manifest = read_manifest(further_shards)
    with Dataset(tiny_dataroot) as dataset:
        scene = dataset.scene(manifest.shards[0].scene, CAMERAS)
    layers = open_layers(tiny_dataroot, scene.location, settings.layers, 1.0)  # two cells wide
    with Shard(further_shards / manifest.shards[0].file) as shard:
        for camera, frames in scene.cameras.items():
            numbers = instance_numbers((frame.boxes for frame in frames), settings)
            assert shard.strings(camera, "instances/token") == tuple(numbers)
            following = following_boxes(frames, settings)
            for row in (0, 5, 7):
                around = Around(layers, numbers, following[row])
                frame = frames[row]
                drawn = further_targets(frame.level_from_global, frame.boxes, settings, around)
                assert len(drawn) == 9
                for name, values in drawn.items():
                    stored = shard.dataset(camera, name)
                    assert stored.dtype == values.dtype
                    np.testing.assert_array_equal(stored[row], values)
                    if values.ndim > 1:
                        assert stored.chunks == (*(1,) * (values.ndim - 1), *sample_grid.shape)


def test_vehicles_are_the_cells_that_have_a_number(further_shards):
    with Shard(further_shards / read_manifest(further_shards).shards[0].file) as shard:
        numbers, vehicles = (shard.dataset("CAM_FRONT", name)[:] for name in ("instances/id", "vehicles"))
    assert vehicles.any()
    np.testing.assert_array_equal(numbers > 0, vehicles > 0)


def test_they_are_sound(further_shards):
    assert verify_folder(further_shards) == ()


def test_the_paper_s_datasets_are_as_without_them(further_shards, sample_shards):
    for entry in read_manifest(further_shards).shards:
        with h5py.File(further_shards / entry.file) as here, h5py.File(sample_shards / entry.file) as there:
            for camera in CAMERAS:
                assert dict(here[camera].attrs) == dict(there[camera].attrs)
                compare(here[camera], there[camera])


def compare(here, there):
    names = {"here": [], "there": []}
    here.visititems(lambda name, item: names["here"].append(name) if hasattr(item, "shape") else None)
    there.visititems(lambda name, item: names["there"].append(name) if hasattr(item, "shape") else None)
    own = {name for name in names["here"] if not name.startswith(GROUPS)}
    assert own == {name for name in names["there"] if not name.startswith(("homography", "footprints"))}
    assert len(set(names["here"]) - own) == 10
    for name in own:
        one, other = here[name], there[name]
        for layout in ("dtype", "shape", "chunks", "compression", "compression_opts", "shuffle", "fillvalue"):
            assert np.array_equal(getattr(one, layout), getattr(other, layout))
        assert dict(one.attrs) == dict(other.attrs)
        same = zip(one[:], other[:], strict=True) if one.dtype == object else [(one[:], other[:])]
        assert all(np.array_equal(a, b, equal_nan=a.dtype.kind == "f") for a, b in map(as_arrays, same))


def as_arrays(pair):
    return tuple(np.asarray(one) for one in pair)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("classes/car", 1),
        ("instances/id", 1),
        ("instances/offset", 1),
        ("instances/flow", 0),
        ("future/vehicles", 1),
        ("future/valid", 0),
    ],
)
def test_verify_makes_rasters_again(damaged, name, value):
    with h5py.File(damaged, "r+") as h5:
        h5["CAM_FRONT"][name][3] = value
    assert messages(damaged) == [f"/CAM_FRONT/{name} contradicts boxes or poses in frame 3"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda group: set_row(group["layers/drivable_area"], 3, 2),
         "layers/drivable_area holds other values than 0 and 1 in frame 3"),
        (lambda group: set_row(group["instances/token"], 0, "other"),
         "instances/token are not the vehicles among the boxes, as they appear"),
        (lambda group: group.pop("layers/lane_divider"), "layers/lane_divider is missing"),
        (lambda group: group.pop("instances/flow"), "instances/flow is missing"),
        (lambda group: group.copy("classes/car", "classes/bus"), "classes/bus is not in the schema"),
        (lambda group: narrow(group), "future/vehicles has shape (8, 1, 60, 40), not (8, 2, 60, 40)"),
    ],
)  # fmt: skip
def test_verify_tells_what_is_wrong(damaged, change, said):
    with h5py.File(damaged, "r+") as h5:
        change(h5["CAM_FRONT"])
    assert f"/CAM_FRONT/{said}" in messages(damaged)


def set_row(dataset, row, value):
    dataset[row] = value


def narrow(group):
    """Keep one future key frame only."""
    for name in ("future/vehicles", "future/valid"):
        values, attributes = group[name][:, :1], dict(group[name].attrs)
        del group[name]
        group.create_dataset(name, data=values).attrs.update(attributes)


def test_settings_survive_and_stand_in_shards_only_where_they_differ(further_settings):
    assert (
        not {"layers", "line_width_m", "classes", "instances", "flow", "future"}
        & ExtractSettings().to_dict().keys()
    )
    settings = ExtractSettings(TargetSettings(line_width_m=0.3, **further_settings))
    assert ExtractSettings.from_dict(settings.to_dict()) == settings
    turned = replace(
        settings.targets, layers=settings.targets.layers[::-1], classes=("large=bus+truck", "car")
    )
    assert ExtractSettings(turned).to_dict() == settings.to_dict()


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"layers": ("lanes",)}, "unknown layers 'lanes'; did you mean lane"),
        ({"layers": ("lane", "lane")}, "layers: lane, lane: name each once"),
        ({"classes": ("car", "car=truck")}, "classes: car, car: name each once"),
        ({"classes": ("a/b",)}, "class 'a/b': is neither NAME, such as car, nor NAME=PART+PART"),
        ({"classes": ("big=bus+",)}, "class 'big=bus+': is neither"),
        ({"flow": True}, "flow: is of instances; ask for them too (--instances)"),
        ({"future": 7}, "future: 7 is above 6"),
        ({"line_width_m": 0.0}, "line_width_m: 0.0 is not above 0"),
    ],
)  # fmt: skip
def test_settings_that_cant_be(settings, said):
    with pytest.raises(SettingsError, match=re.escape(said)):
        TargetSettings(**settings)


def test_they_lie_beside_the_paper_s_labels():
    with pytest.raises(SettingsError, match="add --definition paper"):
        ExtractSettings(TargetSettings(instances=True), definitions=("lss",))


def test_fields_are_known_by_their_names():
    assert field_of("layers/lane").dtype == "uint8"
    assert field_of("classes/anything").shape == field_of("vehicles").shape
    assert field_of("instances/id").dtype == "uint16"
    assert [field_of(name) for name in ("layers/lanes", "layers", "classes/", "more/lane")] == [None] * 4

"""Tar files, read back by the standard library: every value of the shards is there, as it was."""

import json
import tarfile
from collections import defaultdict

import cv2
import numpy as np
import pytest

from ogmkit.base.execution import Execution
from ogmkit.pipeline.exports import columns
from ogmkit.pipeline.exports.export import export_shards
from ogmkit.pipeline.exports.webdataset import write_tar
from ogmkit.shards.reader import Shard
from ogmkit.shards.stored import Stored


@pytest.fixture(scope="module")
def tars(tmp_path_factory, shards):
    out = tmp_path_factory.mktemp("tars") / "out"
    export_shards(shards, out, "webdataset")
    return out


def samples(path):
    """Key → suffix → content, in order; a sample's files must stand together."""
    found, last = defaultdict(dict), None
    with tarfile.open(path) as tar:
        for member in tar:
            key, _, suffix = member.name.partition(".")
            assert key == last or key not in found
            found[key][suffix] = tar.extractfile(member).read()
            last = key
    return found


def decoded(suffix, data):
    if suffix.endswith("npy"):
        import io

        return np.load(io.BytesIO(data))
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)


def assert_same(found, expected):
    expected = np.asarray(expected)
    if expected.dtype.kind == "f":
        np.testing.assert_array_equal(np.array(found, dtype=float).reshape(expected.shape), expected)
    else:
        assert np.asarray(found).reshape(expected.shape).tolist() == expected.tolist()


@pytest.mark.parametrize("scene", ["scene-0001", "scene-0002"])
def test_every_value_of_every_frame_comes_back(shards, stored, tars, scene):
    found = samples(tars / f"cameras/{scene}.tar")
    order = []
    for camera in ("CAM_BACK", "CAM_FRONT"):
        values = stored(shards, scene, camera)
        images = values.pop("image")
        for frame in range(8):
            order.append(f"{scene}-{camera}-{frame:06d}")
            files = found[order[-1]]
            small = json.loads(files["json"])
            assert (small["scene"], small["group"], small["frame"]) == (scene, camera, frame)
            assert small["splits"] == (["train"] if scene == "scene-0001" else ["val"])
            assert files["jpg"] == images[frame].tobytes()
            large = {name.replace("/", "."): name for name in values if name not in small}
            suffixes = {suffix.rpartition(".")[0]: suffix for suffix in files.keys() - {"json", "jpg"}}
            assert suffixes.keys() == large.keys()
            for stem, name in large.items():
                array = decoded(suffixes[stem], files[suffixes[stem]])
                assert array.dtype == values[name][frame].dtype
                np.testing.assert_array_equal(array, values[name][frame])
            for name in values.keys() & small.keys():
                assert_same(small[name], values[name][frame])
    assert list(found) == order


def test_labels_by_name_are_a_table_of_their_own(labelled, stored, tmp_path):
    export_shards(labelled, tmp_path / "out", "webdataset")
    values = stored(labelled, "scene-0001", "SURROUND")
    found = samples(tmp_path / "out/surround/scene-0001.tar")
    assert list(found) == [f"scene-0001-SURROUND-{frame:06d}" for frame in range(8)]
    for frame, files in enumerate(found.values()):
        small = json.loads(files.pop("json"))
        assert small["sample_token"] == values["sample_token"][frame]
        assert {f"{name.replace('/', '.')}.png" for name in values if name.startswith("labels")} == set(files)
        for name in ("labels/fiery/vehicle", "labels/fiery/instance"):
            array = decoded("png", files[f"{name.replace('/', '.')}.png"])
            assert array.dtype == values[name].dtype
            np.testing.assert_array_equal(array, values[name][frame])
    front = samples(tmp_path / "out/cameras/scene-0001.tar")["scene-0001-CAM_FRONT-000003"]
    pon = stored(labelled, "scene-0001", "CAM_FRONT")["labels/pon/car"][3]
    np.testing.assert_array_equal(decoded("png", front["labels.pon.car.png"]), pon)


def test_worker_processes_write_the_same_bytes(shards, tars, tmp_path, contents):
    export_shards(shards, tmp_path / "out", "webdataset", execution=Execution(2))
    assert contents(tmp_path / "out/cameras") == contents(tars / "cameras")


def test_large_values_are_read_a_frame_at_a_time(shards, tmp_path, monkeypatch):
    asked = []

    def get(self, rows):
        asked.append((self._dataset.name, rows))
        return read(self, rows)

    read = Stored.__getitem__
    monkeypatch.setattr(Stored, "__getitem__", get)
    with Shard(shards / "scene-0001.h5") as shard:
        write_tar(shard, "cameras", (), tmp_path / "one.tar")
    whole = {
        name.rpartition("/")[2] for name, rows in asked if isinstance(rows, slice) and rows == slice(None)
    }
    assert not whole & {"drivable", "vehicles", "field_of_view", "image", "points"}
    assert [rows for name, rows in asked if name == "/CAM_FRONT/drivable"] == list(range(8))


@pytest.mark.parametrize(
    ("value", "spelt"),
    [(np.array([1.5, np.nan]), [1.5, None]), (np.float64("-inf"), "-inf"), (np.array([[np.inf]]), [["inf"]])],
)
def test_what_json_has_no_word_for_can_be_restored(value, spelt):
    from ogmkit.pipeline.exports.webdataset import spelled

    found = spelled(columns.plain(value))
    assert found == spelt
    np.testing.assert_array_equal(np.array(found, dtype=float), value)

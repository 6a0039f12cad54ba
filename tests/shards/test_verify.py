import hashlib
import json
import os
import re
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

from ogmkit.base.execution import Execution
from ogmkit.errors import ShardError
from ogmkit.shards.manifest import Manifest, ShardEntry, write_manifest
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.summary import summarise
from ogmkit.shards.verify import verify_folder
from ogmkit.shards.writer import write_shard


def list_in_manifest(out, settings):
    """Write the manifest of what is there."""
    shards = tuple(
        ShardEntry(
            found.scene, f"{found.scene}.h5", found.location, found.frames, found.bytes, found.sha256, ()
        )
        for found in map(summarise, sorted(out.glob("*.h5")))
    )
    write_manifest(out, Manifest("v1.0-mini", "/data", settings, shards))


@pytest.fixture(scope="module")
def settings(small_settings):
    return ExtractSettings(small_settings, ("CAM_FRONT", "CAM_BACK"))


@pytest.fixture(scope="module")
def sound(tmp_path_factory, scene, settings, masks):
    out = tmp_path_factory.mktemp("sound")
    write_shard(out / "scene-0007.h5", scene, settings.targets, masks, dataset_version="v1.0-mini")
    list_in_manifest(out, settings)
    return out


@pytest.fixture
def out(tmp_path, sound):
    return shutil.copytree(sound, tmp_path / "out")


def sign(out):
    """Bring sizes and checksums in the manifest up to date: what is wrong shows in the contents alone."""
    content = json.loads((out / "manifest.json").read_text())
    del content["sha256"]  # or the change would be taken for damage
    for entry in content["shards"]:
        data = (out / entry["file"]).read_bytes()
        entry.update(bytes=len(data), sha256=hashlib.sha256(data).hexdigest())
    (out / "manifest.json").write_text(json.dumps(content))


def messages(out):
    return [f"{problem.file}: {problem.message}" for problem in verify_folder(out)]


def test_a_sound_folder(sound):
    progress = []
    execution = Execution(on_progress=lambda *counts: progress.append(counts))
    assert verify_folder(sound, execution=execution) == ()
    assert progress == [(1, 1)]


def set_values(name, values, rows=slice(None)):
    """An edit of one dataset of CAM_FRONT."""

    def edit(front):
        dataset = front[name]
        data = dataset[:]
        data[rows] = values
        dataset[:] = data

    return edit


def move(name, by, row=1):
    def edit(front):
        data = front[name][:]
        data[row] += by
        front[name][:] = data

    return edit


def delete(name):
    return lambda front: front.pop(name)


CONTRADICTIONS = {
    "drivable holds other values than 0 and 1 in frame 2": set_values("drivable", 3, 2),
    "drivable covers 0.0": set_values("drivable", 0),
    "vehicles contradicts boxes, poses or calibration in frame 2": set_values("vehicles", 0, slice(2, 4)),
    "field_of_view contradicts boxes, poses or calibration in frame 0": set_values("field_of_view", 1),
    "timestamp_us goes back after frame 3": set_values("timestamp_us", 1, 4),
    "sample_token has duplicates": set_values("sample_token", "same"),
    "ego_from_camera is not a rigid transform in frame 1": move("ego_from_camera", 0.1),
    "global_from_ego is not a rigid transform in frame 0 and 4 more": set_values("global_from_ego", np.nan),
    "intrinsics are singular in frame 0 and 4 more": set_values("intrinsics", 0),
    "trajectory/past contradicts past_valid in frame 0": set_values("trajectory/past", 0.0, 0),
    "trajectory/future contradicts the poses around frame 1": move("trajectory/future", 1e-3),
    "trajectory/valid contradicts past_valid and future_valid in frame 3": set_values(
        "trajectory/valid", True, 3
    ),
    "trajectory/valid counts 1 frames": set_values("trajectory/valid", True, 3),
    "boxes/offsets do not rise from 0 to 10": set_values("boxes/offsets", 0, 5),
    "boxes/annotation_token has duplicates": set_values("boxes/annotation_token", "same"),
    "boxes/global_from_box is not a rigid transform in box 1": move("boxes/global_from_box", np.inf),
    "boxes/size_wlh is not positive in box 4": set_values("boxes/size_wlh", 0, 4),
    "boxes/visibility is over 4 in box 9": set_values("boxes/visibility", 5, 9),
    "boxes/category is empty in box 2": set_values("boxes/category", "", 2),
    "image is not a whole JPEG or PNG in frame 3 (empty)": set_values("image", np.zeros(0, np.uint8), 3),
    "image contradicts image_size in frame 0": set_values("image_size", 7),
    "lidar/offsets do not rise from 0 to 110": move("lidar/offsets", 1, 0),
    "lidar/points are not finite in frame 1": set_values("lidar/points", np.nan, 30),
    "intrinsics is missing": delete("intrinsics"),
}


@pytest.mark.parametrize("message", CONTRADICTIONS)
def test_a_contradiction_is_named(out, message):
    with h5py.File(out / "scene-0007.h5", "r+") as file:
        CONTRADICTIONS[message](file["CAM_FRONT"])
    sign(out)
    found = messages(out)
    assert any(line.startswith(f"scene-0007.h5: /CAM_FRONT/{message}") for line in found), found
    assert not any("CAM_BACK" in line for line in found)


def test_a_level_frame_of_another_heading_is_named(out):
    with h5py.File(out / "scene-0007.h5", "r+") as file:
        poses = file["CAM_BACK/level_from_global"]
        poses[2] = poses[3]
    sign(out)
    assert any(
        "/CAM_BACK/level_from_global contradicts global_from_ego in frame 2" in m for m in messages(out)
    )


def test_departures_from_the_schema_are_named(out):
    with h5py.File(out / "scene-0007.h5", "r+") as file:
        front = file["CAM_FRONT"]
        front["extra"] = 1
        front["drivable"].attrs["units"] = "m"
        del front.attrs["drivable_share"]
        file.attrs["grid_rows"] = "60"
        del front["timestamp_us"], front["image_path"]
        front["timestamp_us"] = np.zeros(5, np.int32)
        front["image_path"] = np.zeros(4)
    sign(out)
    found = "\n".join(messages(out))
    for expected in (
        "/CAM_FRONT/extra is not in the schema",
        "/CAM_FRONT/drivable has units 'm', not ''",
        "/CAM_FRONT attribute drivable_share is missing",
        "/ attribute grid_rows is '60', not a int",
        "/CAM_FRONT/timestamp_us has dtype int32, not int64",
        "/CAM_FRONT/image_path has shape (4,), not (5,)",
        "/CAM_FRONT/image_path has dtype float64, not text",
    ):
        assert expected in found


@pytest.mark.parametrize(
    ("link", "message"),
    [
        (
            h5py.ExternalLink("other.h5", "/secret"),
            "/CAM_FRONT/intrinsics is a link to another place, not data",
        ),
        (h5py.SoftLink("/CAM_BACK/intrinsics"), "/CAM_FRONT/intrinsics is a link to another place, not data"),
    ],
)
def test_a_link_is_named(out, link, message):
    with h5py.File(out / "scene-0007.h5", "r+") as file:
        del file["CAM_FRONT/intrinsics"]
        file["CAM_FRONT/intrinsics"] = link
    sign(out)
    assert messages(out) == [f"scene-0007.h5: {message}; remove it and run `ogmkit extract` again"]


def test_data_in_another_file_is_named(out, tmp_path):
    data = np.zeros((5, 3, 3))
    data.tofile(tmp_path / "elsewhere")
    with h5py.File(out / "scene-0007.h5", "r+") as file:
        del file["CAM_FRONT/intrinsics"]
        place = [(tmp_path / "elsewhere", 0, data.nbytes)]
        file["CAM_FRONT"].create_dataset("intrinsics", data.shape, data.dtype, external=place)
    sign(out)
    assert "scene-0007.h5: /CAM_FRONT/intrinsics keeps its data in another file" in messages(out)


def test_a_missing_camera_is_named(out):
    with h5py.File(out / "scene-0007.h5", "r+") as file:
        del file["CAM_BACK"]
    sign(out)
    assert any("cameras are CAM_FRONT, by its settings CAM_BACK, CAM_FRONT" in line for line in messages(out))


def test_one_changed_byte_is_noticed(out):
    path = out / "scene-0007.h5"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    (found,) = messages(out)
    assert "has another checksum than the manifest says; remove it" in found


@pytest.mark.parametrize("size", [0, 100, -1])
def test_a_truncated_shard_is_named_in_one_line(out, size):
    path = out / "scene-0007.h5"
    path.write_bytes(path.read_bytes()[:size])
    (found,) = messages(out)
    assert re.search(r": has \d+ bytes, by the manifest \d+; remove it and run `ogmkit extract` again", found)
    sign(out)
    (found,) = messages(out)
    assert "not an HDF5 file, or cut short; if it is a shard, remove it and run `ogmkit extract`" in found


def test_what_does_not_match_is_never_opened(out, monkeypatch):
    """HDF5 may loop without end on damaged files."""
    path = out / "scene-0007.h5"
    data = bytearray(path.read_bytes())
    data[2000:2064] = bytes(64)
    path.write_bytes(data)
    monkeypatch.setattr(h5py, "File", None)
    (found,) = messages(out)
    assert "has another checksum" in found


@pytest.mark.parametrize("kind", ["a named pipe", "a device", "a folder"])
def test_what_is_no_file_is_listed_beside_the_others(out, kind):
    path = out / "scene-0007.h5"
    path.unlink()
    make = {
        "a named pipe": os.mkfifo,
        "a folder": Path.mkdir,
        "a device": lambda p: p.symlink_to("/dev/zero"),
    }
    make[kind](path)
    (found,) = messages(out)
    assert found.startswith(f"scene-0007.h5: can't be read ({kind}, not a")
    assert "remove" not in found


def test_damage_inside_is_named(out, settings):
    """Compressed data overwritten in place: the file opens, its rasters don't."""
    path = out / "scene-0007.h5"
    with h5py.File(path) as file:
        chunk = file["CAM_FRONT/drivable"].id.get_chunk_info(2)
    data = bytearray(path.read_bytes())
    data[chunk.byte_offset : chunk.byte_offset + chunk.size] = b"\xff" * chunk.size
    path.write_bytes(data)
    sign(out)
    assert any("is damaged inside" in line for line in messages(out))


@pytest.mark.parametrize(
    ("attribute", "value", "message"),
    [
        ("format", "other", "is HDF5, but no ogmkit shard"),
        ("format_version", 99, "has shard format 99, not 1; remove it and run"),
        ("settings", "{}", "attribute `settings` is damaged"),
        ("scene", "scene-0008", "holds scene-0008; rename it back"),
        (
            "dataset_version",
            "v1.0-trainval",
            "contradicts the manifest: dataset_version is v1.0-trainval here but v1.0-mini",
        ),
    ],
)
def test_a_foreign_or_renamed_shard_is_named(out, attribute, value, message):
    with h5py.File(out / "scene-0007.h5", "r+") as file:
        file.attrs[attribute] = value
    sign(out)
    assert any(message in line for line in messages(out))


def test_missing_and_extra_files_are_named(out):
    (out / "scene-0007.h5").rename(out / "scene-0009.h5")
    (out / "notes.txt").write_text("")
    found = messages(out)
    assert "scene-0007.h5: is missing; run `ogmkit extract` again" in found
    assert "notes.txt: is not in the manifest; move it elsewhere" in found
    assert "scene-0009.h5: is not in the manifest; move it elsewhere" in found


def test_a_wrong_frame_count_in_the_manifest_is_named(out):
    content = json.loads((out / "manifest.json").read_text())
    del content["sha256"]  # or the change would be taken for damage
    content["shards"][0]["frames"] = 11
    (out / "manifest.json").write_text(json.dumps(content))
    assert any("has not the manifest's 11 frames" in line for line in messages(out))


def test_a_damaged_manifest_does_not_hide_the_shards(out):
    (out / "manifest.json").write_text("{")
    with h5py.File(out / "scene-0007.h5", "r+") as file:
        del file["CAM_FRONT/intrinsics"]
    found = messages(out)
    assert found[0].startswith("manifest.json: is damaged")
    assert "scene-0007.h5: /CAM_FRONT/intrinsics is missing" in found


@pytest.mark.parametrize("left", [".ogmkit-extract.lock", ".scene-0007.h5.4711.part"])
def test_what_a_killed_run_left_goes_with_the_run(out, left):
    (out / left).write_bytes(b"")
    assert messages(out) == [f"{left}: was left by a run that was killed; remove it"]
    (out / ".ogmkit-amend.json").write_text('{"command": "homography-fit"}')
    assert messages(out) == [
        ".ogmkit-amend.json: homography-fit is unfinished; run `ogmkit homography-fit` again"
    ]


def test_an_unfinished_run_is_named(out):
    (out / ".ogmkit-extract.json").write_text("{}")
    assert messages(out) == [".ogmkit-extract.json: the extraction is unfinished; run `ogmkit extract` again"]


@pytest.mark.parametrize("name", ["empty", "absent"])
def test_a_folder_without_shards_is_refused(tmp_path, name):
    (tmp_path / "empty").mkdir()
    with pytest.raises(ShardError, match=name):
        verify_folder(tmp_path / name)

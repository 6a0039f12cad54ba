import json
import shutil
from dataclasses import dataclass, field

import h5py
import numpy as np
import pytest
from filelock import FileLock

from ogmkit.base.execution import Execution
from ogmkit.errors import OutputError, SettingsError, ShardError
from ogmkit.pipeline.amend import amend
from ogmkit.shards import schema
from ogmkit.shards.layout import store_dataset
from ogmkit.shards.manifest import AMENDING, LOCK
from ogmkit.shards.reader import Shard
from ogmkit.shards.verify import verify_folder

FRAMES = 8


@dataclass(frozen=True)
class Constant:
    """Adds homographies that are all the same; may fail at one scene."""

    names: tuple = ("one",)
    settings: dict = field(default_factory=lambda: {"least": 4})
    fails_at: str = ""
    command: str = "homography-fit"
    kind = schema.HOMOGRAPHY

    def groups(self, shard, camera):
        values = {"method": "constant", "settings": self.settings, "checkpoint_sha256": ""}
        return dict.fromkeys(self.names, values)

    def write(self, shard, camera, names, file):
        frames = shard.frames(camera)
        rows = {
            "bev_from_image": [np.diag([1.0, -1, -1])] * frames,
            "valid": [True] * frames,
            "reason": [""] * frames,
            "num_points": [0] * frames,
            "rms_px": [self.settings["least"]] * frames,
            "rms_cells": [0] * frames,
        }
        if shard.scene == self.fails_at:
            raise RuntimeError("boom")
        with file.writing() as h5:
            for name in names:
                for column, values in rows.items():
                    group, symbols = h5[f"{camera}/homography/{name}"], shard.sizes(camera)
                    store_dataset(group, self.kind.field(column), values, symbols)

    def report(self, shard, cameras):
        return [
            (camera, name, float(shard.dataset(camera, f"homography/{name}/rms_px")[0]))
            for camera in cameras
            for name in self.names
        ]


@pytest.fixture
def out(tmp_path, undisturbed):
    return shutil.copytree(undisturbed, tmp_path / "out")


@pytest.fixture(scope="module")
def amended(tmp_path_factory, undisturbed):
    """A folder with the addition; tests only read it."""
    out = shutil.copytree(undisturbed, tmp_path_factory.mktemp("amended") / "out")
    amend(out, Constant())
    return out


def shard_paths(out):
    return sorted(out.glob("*.h5"))


def test_every_camera_of_every_shard_gets_the_group(out):
    progress = []
    results = amend(out, Constant(), execution=Execution(on_progress=lambda *counts: progress.append(counts)))
    assert progress == [(1, 2), (2, 2)]
    assert [result.scene for result in results] == [path.stem for path in shard_paths(out)]
    assert all(result.changed for result in results)
    assert results[0].report == [("CAM_BACK", "one", 4.0), ("CAM_FRONT", "one", 4.0)]
    assert verify_folder(out) == ()
    assert {path.name for path in out.iterdir()} == {*(p.name for p in shard_paths(out)), "manifest.json"}


def test_a_second_run_touches_nothing_and_reports_the_same(out):
    first = amend(out, Constant())
    before = {path: path.stat() for path in (out, *out.iterdir())}
    second = amend(out, Constant())
    assert not any(result.changed for result in second)
    assert [result.report for result in second] == [result.report for result in first]
    for path, stat in before.items():
        assert path == out or (path.stat().st_mtime_ns, path.stat().st_ino) == (stat.st_mtime_ns, stat.st_ino)


def test_cameras_and_groups_can_come_one_by_one(out):
    amend(out, Constant(("one",)), cameras=["CAM_BACK"])
    with Shard(shard_paths(out)[0]) as shard:
        assert [shard.added(camera, "homography") for camera in shard.cameras] == [("one",), ()]
    results = amend(out, Constant(("one", "two")))
    assert [name for _, name, _ in results[0].report] == ["one", "two"] * 2
    assert verify_folder(out) == ()


def test_a_camera_that_is_not_there_is_named(out, undisturbed, digests):
    with pytest.raises(SettingsError, match="unknown camera 'CAM_FRONTS'; did you mean CAM_FRONT"):
        amend(out, Constant(), cameras=["CAM_FRONTS"])
    assert digests(out) == digests(undisturbed)


def test_other_settings_are_refused_before_anything_is_changed(out, amended, digests):
    amend(out, Constant(), cameras=["CAM_FRONT"])
    before = digests(out)
    with pytest.raises(
        OutputError,
        match=r"CAM_FRONT/homography/one .*settings\.least is 8 here but 4 there; use --overwrite",
    ):
        amend(out, Constant(settings={"least": 8}))
    assert digests(out) == before
    results = amend(out, Constant(settings={"least": 8}), execution=Execution(overwrite=True))
    assert {value for result in results for _, _, value in result.report} == {8.0}
    assert verify_folder(out) == ()
    amend(out, Constant(), execution=Execution(overwrite=True))
    assert digests(out) == digests(amended)


def test_a_run_cut_short_is_told_and_repaired(out, amended, digests):
    first, second = shard_paths(out)
    with pytest.raises(ShardError, match="boom"):
        amend(out, Constant(fails_at=second.stem))
    assert digests(out)[first.name] == digests(amended)[first.name]
    (problem,) = verify_folder(out)
    assert problem.message == "homography-fit is unfinished; run `ogmkit homography-fit` again"
    assert [result.changed for result in amend(out, Constant())] == [False, True]
    assert digests(out) == digests(amended)


def test_an_overwriting_run_cut_short_is_repaired(out, amended, digests):
    amend(out, Constant(settings={"least": 8}))
    with pytest.raises(ShardError, match="boom"):
        amend(out, Constant(fails_at=shard_paths(out)[1].stem), execution=Execution(overwrite=True))
    amend(out, Constant(), execution=Execution(overwrite=True))
    assert digests(out) == digests(amended)


def test_cut_short_before_the_manifest_it_is_repaired(out, amended, digests, undisturbed):
    amend(out, Constant())
    shutil.copy(undisturbed / "manifest.json", out)
    (out / AMENDING).write_text(json.dumps({"command": "homography-fit"}))
    assert not any(result.changed for result in amend(out, Constant()))
    assert digests(out) == digests(amended)


def test_extract_goes_on_with_amended_shards(out, amended, run, digests):
    amend(out, Constant())
    assert run(out).kept == 2
    assert digests(out) == digests(amended)


def test_extract_does_not_trust_the_manifest_of_a_run_cut_short(out, run, digests):
    with pytest.raises(ShardError):
        amend(out, Constant(fails_at=shard_paths(out)[1].stem))
    assert run(out).kept == 2
    entries = {
        entry["file"]: entry["sha256"] for entry in json.loads((out / "manifest.json").read_text())["shards"]
    }
    assert entries == {path.name: digests(out)[path.name] for path in shard_paths(out)}
    amend(out, Constant())
    assert verify_folder(out) == ()


@pytest.mark.parametrize("other", ["render-footprints", None])
def test_what_another_run_left_unfinished_comes_first(out, other):
    if other is None:
        (out / ".ogmkit-extract.json").write_text("{}")
    else:
        (out / AMENDING).write_text(json.dumps({"command": other}))
    with pytest.raises(OutputError, match=f"is unfinished; run `ogmkit {other or 'extract'}` again first"):
        amend(out, Constant())


def test_a_damaged_mark_is_named(out):
    (out / AMENDING).write_text("{}")
    with pytest.raises(ShardError, match="is damaged"):
        amend(out, Constant())
    assert any(problem.file == AMENDING for problem in verify_folder(out))


def test_one_run_at_a_time(out):
    with FileLock(out / LOCK), pytest.raises(OutputError, match="another ogmkit command is writing here"):
        amend(out, Constant())


def lose(path):
    path.unlink()


def shorten(path):
    path.write_bytes(path.read_bytes()[:-1])


def flip(path):
    data = bytearray(path.read_bytes())
    data[-3] ^= 1
    path.write_bytes(data)


def swap(path):
    with h5py.File(path, "w") as h5:
        h5["foreign"] = 1


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lose, "is absent; run `ogmkit extract` again"),
        (shorten, r"has \d+ bytes, by the manifest \d+; remove it"),
        (flip, "has another checksum than the manifest says"),
        (swap, r"has \d+ bytes, by the manifest \d+; remove it"),
    ],
)
def test_a_shard_that_was_changed_is_refused(out, undisturbed, digests, spoil, message):
    _, last = shard_paths(out)
    spoil(last)
    before = {name: digest for name, digest in digests(out).items() if name == last.name}
    with pytest.raises(ShardError, match=rf"{last.name}: {message}"):
        amend(out, Constant())
    assert {name: digest for name, digest in digests(out).items() if name == last.name} == before
    if spoil is not flip:  # which shows only when the shard is read
        assert digests(out).keys() <= digests(undisturbed).keys()


def test_a_shard_of_other_settings_than_the_manifest_is_refused(out):
    content = json.loads((out / "manifest.json").read_text())
    del content["sha256"]  # or the change would be taken for damage
    content["settings"]["min_visibility"] = 2
    (out / "manifest.json").write_text(json.dumps(content))
    with pytest.raises(ShardError, match="contradicts the manifest: min_visibility is 0 here but 2 there"):
        amend(out, Constant())


def test_a_manifest_without_shards_is_refused(out):
    content = json.loads((out / "manifest.json").read_text())
    del content["sha256"]  # or the change would be taken for damage
    (out / "manifest.json").write_text(json.dumps(content | {"shards": []}))
    with pytest.raises(ShardError, match="the manifest names no shard; run `ogmkit extract` again"):
        amend(out, Constant())


def test_a_folder_without_shards_is_refused_and_left_alone(tmp_path):
    with pytest.raises(ShardError, match=r"manifest\.json: can't be read"):
        amend(tmp_path, Constant())
    assert list(tmp_path.iterdir()) == []

import json
import shutil
import sys
from collections import deque
from dataclasses import replace

import h5py
import pytest

from ogmkit.base.execution import Execution
from ogmkit.errors import DataFileError, OutputError, SettingsError
from ogmkit.grid import GridSpec
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.pipeline.render_footprints import render_footprints
from ogmkit.pipeline.selection import read_scene
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.verify import verify_folder

FRAMES = 8


@pytest.fixture
def out(tmp_path, undisturbed):
    """A finished folder to change."""
    return shutil.copytree(undisturbed, tmp_path / "out")


@pytest.fixture
def coarse(small_settings):
    """Other settings."""
    return replace(
        small_settings, targets=replace(small_settings.targets, grid=GridSpec(1.0, 30, 20, 30, 10))
    )


@pytest.fixture
def damaged(tmp_path, tiny_dataroot, dataset):
    """A copy of the dataset whose first scene lacks an image."""
    root = shutil.copytree(tiny_dataroot, tmp_path / "damaged")
    frame = dataset.scene(dataset.scene_names()[0], ["CAM_BACK"]).cameras["CAM_BACK"][3]
    (root / frame.image_path).unlink()
    with Dataset(root) as damaged:
        yield damaged


def test_a_finished_folder_holds_shards_and_manifest_only(undisturbed, dataset):
    expected = {f"{scene}.h5" for scene in dataset.scene_names()} | {"manifest.json"}
    assert {path.name for path in undisturbed.iterdir()} == expected
    assert verify_folder(undisturbed) == ()


def test_the_manifest_lists_frames_sizes_and_splits(undisturbed, dataset, small_settings):
    manifest = read_manifest(undisturbed)
    assert (manifest.dataset_version, manifest.settings.targets) == ("v1.0-mini", small_settings.targets)
    assert manifest.dataroot == str(dataset.root.resolve())
    splits = dataset.splits()
    for entry, scene in zip(manifest.shards, dataset.scene_names(), strict=True):
        assert (entry.scene, entry.file, entry.frames) == (scene, f"{scene}.h5", 2 * FRAMES)
        assert entry.bytes == (undisturbed / entry.file).stat().st_size
        assert entry.splits == tuple(sorted(name for name in splits if scene in splits[name]))
        assert entry.splits


def test_the_summary_adds_up(tmp_path, run, undisturbed):
    progress = []
    summary = run(tmp_path / "out", execution=Execution(on_progress=lambda *counts: progress.append(counts)))
    assert progress == [(1, 2), (2, 2)]
    assert (summary.scenes, summary.kept, summary.failures) == (2, 0, ())
    assert summary.frames == 4 * FRAMES
    assert summary.bytes == sum(path.stat().st_size for path in undisturbed.glob("*.h5"))
    rasters, valid = {"drivable": [], "vehicles": []}, 0
    for path in sorted(undisturbed.glob("*.h5")):
        with Shard(path) as shard:
            for camera in shard.cameras:
                valid += int(shard.dataset(camera, "trajectory/valid")[:].sum())
                for name, means in rasters.items():
                    means.append(shard.dataset(camera, name)[:].mean())
    assert summary.valid_trajectories == valid
    assert summary.drivable_share == pytest.approx(sum(rasters["drivable"]) / 4)
    assert summary.vehicle_share == pytest.approx(sum(rasters["vehicles"]) / 4)


def test_two_workers_give_the_same_bytes(tmp_path, run, undisturbed, digests):
    run(tmp_path / "out", execution=Execution(workers=2))
    assert digests(tmp_path / "out") == digests(undisturbed)


def test_a_profiler_that_holds_on_to_frames_changes_no_byte(tmp_path, run, undisturbed, digests):
    """Dask's does; what the frames hold, such as datasets, is closed late then."""
    held = deque(maxlen=99)
    sys.setprofile(lambda frame, event, _: held.append(frame) if event == "call" else None)
    try:
        run(tmp_path / "out")
        fit_shards(tmp_path / "out", ["surface"])
        render_footprints(tmp_path / "out")
    finally:
        sys.setprofile(None)
    whole = shutil.copytree(undisturbed, tmp_path / "whole")
    fit_shards(whole, ["surface"])
    render_footprints(whole)
    assert digests(tmp_path / "out") == digests(whole)


def test_a_second_run_changes_nothing(out, run, undisturbed, digests):
    before = {path.name: path.stat().st_mtime_ns for path in out.glob("*.h5")}
    summary = run(out)
    assert (summary.scenes, summary.kept, summary.frames) == (2, 2, 4 * FRAMES)
    assert digests(out) == digests(undisturbed)
    assert before == {path.name: path.stat().st_mtime_ns for path in out.glob("*.h5")}


def test_of_scenes_whose_shards_are_there_nothing_is_read_but_tokens(out, run, monkeypatch):
    read = []

    def noted(dataset, name, settings):
        read.append(name)
        return read_scene(dataset, name, settings)

    monkeypatch.setattr("ogmkit.pipeline.extract.read_scene", noted)
    assert run(out).kept == 2
    assert read == []
    (out / "scene-0002.h5").unlink()
    assert run(out, execution=Execution(workers=2)).kept == 1
    assert read == ["scene-0002"]


def test_a_shard_that_was_written_to_is_looked_at_closely(out, run, undisturbed, digests):
    """Its size and tokens are as they were."""
    path = out / "scene-0001.h5"
    with h5py.File(path, "r+") as h5:
        h5.move("CAM_FRONT/vehicles", "CAM_FRONT/vehicle_")
    assert path.stat().st_size == (undisturbed / path.name).stat().st_size
    assert run(out).kept == 1
    assert digests(out) == digests(undisturbed)


def test_scenes_can_come_one_by_one(tmp_path, run, undisturbed, digests, dataset):
    for scene in reversed(dataset.scene_names()):
        run(tmp_path / "out", scenes=[scene, scene])
    assert digests(tmp_path / "out") == digests(undisturbed)


def spoil_nothing(path):
    path.unlink()


def spoil_end(path):
    path.write_bytes(path.read_bytes()[:-1000])


def spoil_all(path):
    path.write_text("<html>")


@pytest.mark.parametrize("spoil", [spoil_nothing, spoil_end, spoil_all])
@pytest.mark.parametrize("finished", [True, False])
def test_what_is_missing_or_broken_is_made_again(out, run, undisturbed, digests, spoil, finished):
    first, second = sorted(out.glob("*.h5"))
    spoil(first)
    if not finished:
        manifest = json.loads((out / "manifest.json").read_text())
        marker = {"dataset_version": manifest["dataset_version"], **manifest["settings"]}
        (out / ".ogmkit-extract.json").write_text(json.dumps(marker))
        (out / "manifest.json").unlink()
        (out / ".scene-0001.h5.4711.part").write_text("half a shard")
        (out / "..ogmkit-extract.json.4711.part").write_text("half a marker")
    before = second.stat().st_mtime_ns
    assert run(out).kept == 1
    assert digests(out) == digests(undisturbed)
    assert second.stat().st_mtime_ns == before


def test_a_damaged_manifest_is_made_again(out, run, undisturbed, digests):
    (out / "manifest.json").write_text("{")
    assert run(out).kept == 2
    assert digests(out) == digests(undisturbed)


def test_a_shard_of_another_dataset_is_made_again(tmp_path, out, run, tiny_dataroot, edit_table):
    """The same scene name, other tokens: not what this dataset would give."""
    root = shutil.copytree(tiny_dataroot, tmp_path / "other")

    def rename(records):
        for record in records:
            for key in ("token", "prev", "next"):
                record[key] = f"{record[key]}x" if record[key] else ""

    edit_table(root, "sample_data", rename)
    with Dataset(root) as other:
        assert run(out, dataset=other).kept == 0


def test_other_settings_are_refused_by_name(out, run, coarse, undisturbed, digests):
    with pytest.raises(OutputError, match=r"grid\.rows is 30 here but 60 there.*--overwrite or another OUT"):
        run(out, coarse)
    assert digests(out) == digests(undisturbed)


def test_other_settings_are_refused_while_unfinished(tmp_path, run, coarse, undisturbed):
    out = tmp_path / "out"
    out.mkdir()
    manifest = json.loads((undisturbed / "manifest.json").read_text())
    marker = {"dataset_version": manifest["dataset_version"], **manifest["settings"]}
    (out / ".ogmkit-extract.json").write_text(json.dumps(marker))
    shard = next(undisturbed.glob("*.h5"))
    shutil.copy(shard, out)
    with pytest.raises(OutputError, match=r"grid\.m_per_cell is 1\.0 here but 0\.5 there"):
        run(out, coarse)
    (out / shard.name).unlink()
    assert run(out, coarse).kept == 0  # without any shard the earlier settings bind nobody


def test_overwrite_makes_all_anew(out, run, coarse):
    assert run(out, coarse, execution=Execution(overwrite=True)).kept == 0
    assert verify_folder(out) == ()
    assert read_manifest(out).settings.targets.grid.rows == 30


def test_overwrite_does_not_leave_a_mixture(out, run, coarse, dataset, undisturbed, digests):
    first, second = dataset.scene_names()
    with pytest.raises(OutputError, match=rf"{second}\.h5: .*choose its scene as well"):
        run(out, coarse, execution=Execution(overwrite=True), scenes=[first])
    assert digests(out) == digests(undisturbed)


def test_a_bad_scene_does_not_lose_the_others(tmp_path, run, damaged, dataset):
    bad, good = dataset.scene_names()
    summary = run(tmp_path / "out", dataset=damaged)
    assert [failure.scene for failure in summary.failures] == [bad]
    assert isinstance(summary.failures[0].error, DataFileError)
    assert (summary.scenes, summary.frames) == (1, 2 * FRAMES)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {f"{good}.h5", "manifest.json"}
    assert verify_folder(tmp_path / "out") == ()
    assert run(tmp_path / "out").kept == 1  # the dataset repaired


def test_strict_stops_at_the_first_bad_scene(tmp_path, run, damaged):
    with pytest.raises(DataFileError, match="--images none"):
        run(tmp_path / "out", dataset=damaged, strict=True)
    assert [path.name for path in (tmp_path / "out").iterdir()] == [".ogmkit-extract.json"]


def test_bad_tables_fail_their_scene_only(tmp_path, run, tiny_dataroot, edit_table, dataset):
    root = shutil.copytree(tiny_dataroot, tmp_path / "broken")
    token = dataset.scene(dataset.scene_names()[1], ["CAM_FRONT"]).cameras["CAM_FRONT"][0].sample_data_token

    def lose(records):
        return [record for record in records if record["token"] != token]

    edit_table(root, "sample_data", lose)
    with Dataset(root) as broken:
        summary = run(tmp_path / "out", dataset=broken)
    assert [failure.scene for failure in summary.failures] == [dataset.scene_names()[1]]
    assert summary.scenes == 1


def test_a_failing_scene_keeps_its_old_shard(out, run, damaged, digests, undisturbed):
    summary = run(out, dataset=damaged, execution=Execution(overwrite=True))
    assert len(summary.failures) == 1
    assert digests(out).keys() == digests(undisturbed).keys()
    assert verify_folder(out) == ()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"scenes": ["scene-9999"]}, "unknown scene 'scene-9999'"),
        ({"cameras": ("CAM_TOP",)}, "unknown camera 'CAM_TOP'"),
        ({"categories": ("vehicles.",)}, "unknown category 'vehicles.'"),
    ],
)
def test_unknown_names_are_refused_before_anything_is_made(tmp_path, run, small_settings, change, message):
    settings, options = small_settings, {}
    if "scenes" in change:
        options = change
    elif "cameras" in change:
        settings = replace(settings, **change)
    else:
        settings = replace(settings, targets=replace(settings.targets, **change))
    with pytest.raises(SettingsError, match=message):
        run(tmp_path / "out", settings, **options)
    assert not (tmp_path / "out").exists()

import dataclasses
import hashlib
import shutil

import h5py
import numpy as np
import pytest

from ogmkit.base.execution import Execution
from ogmkit.errors import OutputError, SettingsError, ShardError
from ogmkit.homography.leave_out import left_out_errors, summarise
from ogmkit.homography.methods import METHODS, fit
from ogmkit.homography.settings import FitSettings
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.extract import extract
from ogmkit.pipeline.geometry import frame_geometry
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.shards.manifest import read_manifest, write_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.verify import verify_folder
from ogmkit.target_settings import TargetSettings

ALL = tuple(METHODS)
FEW = ("surface", "dlt")


@pytest.fixture
def out(tmp_path, undisturbed):
    return shutil.copytree(undisturbed, tmp_path / "out")


@pytest.fixture(scope="module")
def fitted(tmp_path_factory, undisturbed):
    """A folder with all methods, and what the run said; tests only read it."""
    out = shutil.copytree(undisturbed, tmp_path_factory.mktemp("fitted") / "out")
    return out, fit_shards(out, ALL)


def test_the_folder_stays_sound(fitted):
    out, summary = fitted
    assert verify_folder(out) == ()
    assert (summary.shards, summary.kept) == (2, 0)
    assert [method.method for method in summary.methods] == list(ALL)


def assert_same(stored, found):
    """Equal but for rounding: the last digits depend on how many threads BLAS has, and a run has one."""
    np.testing.assert_allclose(stored, found, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("method", ALL)
@pytest.mark.parametrize("camera", ["CAM_FRONT", "CAM_BACK"])
def test_what_is_stored_is_what_the_method_answers(fitted, method, camera):
    out, _ = fitted
    settings, group = FitSettings(), f"homography/{method}"
    for path in sorted(out.glob("*.h5")):
        with Shard(path) as shard:
            stored = {name: shard.dataset(camera, f"{group}/{name}")[:] for name in shard.h5[camera][group]}
            reasons = shard.strings(camera, f"{group}/reason")
            offsets = shard.dataset(camera, "boxes/offsets")[:]
            assert ("plane" in stored) == (method in ("plane", "calibration", "ego-plane"))
            for frame in range(shard.frames(camera)):
                geometry = frame_geometry(shard, camera, frame)
                found = fit(method, geometry, shard.grid, settings)
                assert_same(stored["bev_from_image"][frame], found.bev_from_image)
                assert (stored["valid"][frame], reasons[frame]) == (found.valid, found.reason)
                assert stored["num_points"][frame] == found.points_used
                assert_same(stored["rms_px"][frame], found.rms_px)
                assert_same(stored["rms_cells"][frame], found.rms_cells)
                if found.plane is not None:
                    assert_same(stored["plane"][frame], found.plane)
                errors = left_out_errors(method, geometry, settings)
                rows = slice(offsets[frame], offsets[frame + 1])
                assert_same(stored["left_out_error_m"][rows], errors.error_m)
                np.testing.assert_array_equal(stored["left_out_refused"][rows], errors.refused)


def test_the_summary_is_that_of_all_frames(fitted):
    out, summary = fitted
    for method in summary.methods:
        fits, errors = [], []
        for path in sorted(out.glob("*.h5")):
            with Shard(path) as shard:
                for camera in shard.cameras:
                    frames = [frame_geometry(shard, camera, i) for i in range(shard.frames(camera))]
                    fits += [fit(method.method, frame, shard.grid, FitSettings()) for frame in frames]
                    errors += [left_out_errors(method.method, frame, FitSettings()) for frame in frames]
        assert (method.frames, method.valid) == (len(fits), sum(found.valid for found in fits))
        assert sum(count for _, count in method.reasons) == method.frames - method.valid
        residuals = [found.rms_px for found in fits if not np.isnan(found.rms_px)]
        assert_same(method.median_rms_px, np.median(residuals))
        for found, expected in zip(method.ranges, summarise(errors), strict=True):
            assert found.boxes == expected.boxes
            shown = (found.median_m, found.p90_m, found.refused_share)
            wanted = (expected.median_m, expected.p90_m, expected.refused_share)
            assert_same(shown, wanted)
    assert any(method.ranges[0].boxes for method in summary.methods)


def test_reasons_stand_most_frequent_first(fitted):
    _, summary = fitted
    (robust,) = (method for method in summary.methods if method.method == "robust")
    counts = [count for _, count in robust.reasons]
    assert counts == sorted(counts, reverse=True)
    assert all("fewer than 8" in reason or "horizon" in reason for reason, _ in robust.reasons)


def test_two_workers_give_the_same_bytes(out, fitted, digests):
    summary = fit_shards(out, ALL, execution=Execution(workers=2))
    assert digests(out) == digests(fitted[0])
    assert summary.methods[0].ranges == fitted[1].methods[0].ranges


def test_a_second_run_keeps_all_and_says_the_same(fitted, digests):
    out, first = fitted
    before = digests(out)
    second = fit_shards(out, ALL)
    assert second.kept == second.shards == 2
    assert digests(out) == before
    assert [m.median_rms_cells for m in second.methods] == [m.median_rms_cells for m in first.methods]


def test_other_settings_are_refused_by_name(out, digests):
    fit_shards(out, FEW)
    before = digests(out)
    with pytest.raises(
        OutputError, match=r"homography/dlt .*settings\.max_distance_m is 30\.0 here but 60\.0"
    ):
        fit_shards(out, FEW, FitSettings(max_distance_m=30.0))
    assert digests(out) == before
    fit_shards(out, FEW, FitSettings(max_distance_m=30.0), execution=Execution(overwrite=True))
    fit_shards(out, FEW, execution=Execution(overwrite=True))
    assert digests(out) == before


def test_settings_that_a_method_does_not_use_are_no_difference(out):
    fit_shards(out, ["surface", "calibration"])
    assert fit_shards(out, ["surface", "calibration"], FitSettings(min_points=12)).kept == 2


@pytest.mark.parametrize(
    ("methods", "message"), [(["dlt", "dlr"], "method 'dlr' is unknown"), ([], "name at least one")]
)
def test_unknown_methods_are_refused_before_anything_is_read(tmp_path, methods, message):
    with pytest.raises(SettingsError, match=message):
        fit_shards(tmp_path / "absent", methods)


def test_frames_without_boxes_are_no_error(tmp_path, tiny_dataroot, edit_table, mask_cache, small_settings):
    root = shutil.copytree(tiny_dataroot, tmp_path / "root")
    for table in ("sample_annotation", "instance"):
        edit_table(root, table, lambda records: [])
    with Dataset(root) as dataset:
        scenes, splits = dataset.scene_names(), dataset.splits()
        extract(dataset, tmp_path / "out", small_settings, scenes=scenes, splits=splits, cache_dir=mask_cache)
    summary = fit_shards(tmp_path / "out", ALL)
    assert verify_folder(tmp_path / "out") == ()
    valid = {method.method: method.valid for method in summary.methods}
    frames = summary.methods[0].frames
    fitted = dict.fromkeys(("dlt", "robust", "plane", "four-point"), 0)
    assert valid == dict.fromkeys(("surface", "calibration", "ego-plane"), frames) | fitted
    assert summary.methods[1].reasons == (("0 usable corners, fewer than 4", frames),)
    assert np.isnan(summary.methods[1].median_rms_px)
    assert [found.boxes for found in summary.methods[0].ranges] == [0, 0, 0]


def rewrite(out, edit):
    """Change a shard, and the manifest with it, as if it had been extracted so."""
    manifest = read_manifest(out)
    path = out / manifest.shards[0].file
    with h5py.File(path, "r+") as h5:
        edit(h5["CAM_FRONT"])
    changed = dataclasses.replace(
        manifest.shards[0],
        bytes=path.stat().st_size,
        sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
    )
    write_manifest(out, dataclasses.replace(manifest, shards=(changed, *manifest.shards[1:])))
    return path


def test_shards_without_boxes_are_named(out):
    path = rewrite(out, lambda front: front.pop("boxes"))
    with pytest.raises(ShardError, match=rf"{path.name}: /CAM_FRONT/boxes/offsets is missing; remove it"):
        fit_shards(out)


def test_calibration_that_is_none_is_named(out):
    def edit(front):
        front["intrinsics"][3] = np.nan

    path = rewrite(out, edit)
    with pytest.raises(ShardError, match=rf"{path.name}: /CAM_FRONT, frame 3: .*not finite"):
        fit_shards(out)


@pytest.mark.slow
def test_real_frames_give_the_designs_figures(real_dataroot, tmp_path, mask_cache):
    """design.md §2, scene-0103 and scene-0061: 20–40 m and 40–60 m hold over 100 boxes each."""
    with Dataset(real_dataroot) as dataset:
        settings = ExtractSettings(TargetSettings(images="none"))
        extract(
            dataset, tmp_path / "out", settings, scenes=dataset.scene_names(), splits={}, cache_dir=mask_cache
        )
    methods = {method.method: method for method in fit_shards(tmp_path / "out").methods}
    medians = {name: [r.median_m for r in method.ranges] for name, method in methods.items()}
    assert (np.array(medians["surface"]) <= [1.0, 1.7, 2.3]).all()
    assert (np.array([r.p90_m for r in methods["surface"].ranges]) <= [2.4, 3.6, 5.8]).all()
    assert all(r.refused_share == 0 for r in methods["surface"].ranges)
    np.testing.assert_allclose(medians["dlt"], [1.36, 1.82, 2.22], rtol=0.05)
    assert (np.array(medians["plane"]) <= np.array([1.04, 1.33, 2.67]) * 1.05).all()

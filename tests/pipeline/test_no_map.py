"""Without a usable map there is all but the drivable area, and what needs that says so."""

import re
import shutil
from dataclasses import replace

import numpy as np
import pytest

from ogmkit.errors import ShardError, TableError
from ogmkit.evaluation.evaluate import evaluate
from ogmkit.evaluation.planning.evaluate import evaluate_plans
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.footprints.settings import FootprintSettings
from ogmkit.homography.settings import FitSettings
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pictures.preview import preview
from ogmkit.pictures.settings import PreviewSettings
from ogmkit.pipeline.extract import extract
from ogmkit.pipeline.extract_summary import grouped
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.pipeline.render_footprints import render_footprints
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.verify import verify_folder

CAMERAS = ("CAM_FRONT", "CAM_BACK")


@pytest.fixture(scope="module")
def without(small_settings):
    return replace(small_settings, targets=replace(small_settings.targets, no_map=True))


def _no_folder(root, edit_table):
    shutil.rmtree(root / "maps")


def _no_table(root, edit_table):
    (root / "v1.0-mini/map.json").unlink()


def _garbage(root, edit_table):
    (root / "v1.0-mini/map.json").write_text("<html>")


def _no_logs(root, edit_table):
    edit_table(root, "map", lambda rows: [row | {"log_tokens": []} for row in rows])


def _vector_maps(root, edit_table):
    edit_table(root, "map", lambda rows: [row | {"filename": "maps/a.json"} for row in rows])


def _no_picture(root, edit_table):
    for path in (root / "maps").glob("*.png"):
        path.write_bytes(b"no picture")


UNUSABLE = {
    _no_folder: r"maps/.*\.png: map mask is absent, one of 2; download them, or .*--no-map",
    _no_table: r"map\.json: table is missing; .*, or extract with --no-map",
    _garbage: r"map\.json: an HTML or XML page.*, or extract with --no-map",
    _no_logs: r"scene\.json: record .* is listed by 0 records of map\.json.*--no-map",
    _vector_maps: r"maps/a\.json: is a vector map of .*; ogmkit needs the mask PNG, or --no-map",
    _no_picture: r"maps/.*\.png: map mask is not a whole PNG or JPEG .*, or extract with --no-map",
}


@pytest.mark.sampled(2)
@pytest.mark.parametrize("break_maps", UNUSABLE)
def test_a_map_that_can_t_be_used_stops_only_what_needs_it(
    tmp_path, tiny_dataroot, edit_table, run, without, break_maps
):
    root = shutil.copytree(tiny_dataroot, tmp_path / "root")
    break_maps(root, edit_table)
    with Dataset(root) as dataset:
        summary = run(tmp_path / "with", dataset=dataset)
        (group,) = grouped(summary.failures)
        assert len(group.scenes) == 2
        assert re.search(UNUSABLE[break_maps], group.reason), group.reason
        summary = run(tmp_path / "without", without, dataset=dataset)
    assert (summary.scenes, summary.failures) == (2, ())
    assert np.isnan(summary.drivable_share)
    assert verify_folder(tmp_path / "without") == ()


def test_the_dataset_opens_without_its_table_of_maps(tmp_path, tiny_dataroot):
    root = shutil.copytree(tiny_dataroot, tmp_path / "root")
    (root / "v1.0-mini/map.json").unlink()
    with Dataset(root) as dataset:
        assert len(dataset.overview()) == 2
        scene = dataset.scene("scene-0001", ["CAM_FRONT"], maps=False)
        assert {frame.map_path for frame in scene.cameras["CAM_FRONT"]} == {""}
        with pytest.raises(TableError, match=r"map\.json: table is missing.*--no-map"):
            dataset.scene("scene-0001", ["CAM_FRONT"])


@pytest.fixture(scope="module")
def pair(tmp_path_factory, tiny_dataroot, small_settings, without, mask_cache):
    """Shards with maps and without, each with homographies and all kinds of footprints."""
    folders = []
    for settings in (small_settings, without):
        out = tmp_path_factory.mktemp("pair") / "out"
        with Dataset(tiny_dataroot) as dataset:
            scenes = dataset.scene_names()[:1]
            extract(
                dataset,
                out,
                settings,
                scenes=scenes,
                splits={"val": scenes},
                cache_dir=mask_cache,
            )
        fit_shards(out, ["surface", "calibration"], FitSettings())
        for footprints in (
            FootprintSettings("calibration"),
            FootprintSettings("calibration", "project"),
            FootprintSettings("surface", "full-body"),
        ):
            render_footprints(out, footprints)
        folders.append(out)
    return folders


def test_all_else_is_the_same(pair):
    whole, bare = pair
    assert verify_folder(bare) == ()
    with Shard(whole / "scene-0001.h5") as one, Shard(bare / "scene-0001.h5") as other:
        names: list[str] = []
        one.h5.visit(names.append)
        lost = {name for name in names if name.endswith("/drivable")}
        assert {name for name in names if name not in other.h5} == lost
        assert len(lost) == 2 * 4  # of two cameras: the raster, and three sets of footprints
        for camera in CAMERAS:
            for name in (
                "footprints/calibration/vehicles",
                "footprints/calibration-project/vehicles",
                "footprints/full-body/vehicles",
                "homography/surface/bev_from_image",
                "homography/surface/left_out_error_m",
            ):
                found, wanted = (shard.dataset(camera, name)[:] for shard in (other, one))
                np.testing.assert_array_equal(found, wanted)
        assert other.dataset("CAM_FRONT", "footprints/full-body/vehicles")[:].any()


def test_pictures_are_drawn_all_the_same(pair, tmp_path):
    _, bare = pair
    views = ("targets", "footprints", "stretch", "masks")
    settings = PreviewSettings(views=views, frames=1, masks="calibration")
    drawn = preview(bare, tmp_path / "pictures", settings, cameras=["CAM_FRONT"])
    assert len(drawn) == len(views)


def test_grids_can_t_be_evaluated(pair):
    with pytest.raises(ShardError, match=r"out: has no drivable area \(--no-map\), which is needed here"):
        evaluate(pair[1], settings=EvaluateSettings(split="val"))


def test_of_plans_only_what_lies_off_the_drivable_area_is_unknown(plan_shards, tmp_path, mask_cache):
    manifest = read_manifest(plan_shards)
    with Dataset(tmp_path.joinpath(manifest.dataroot)) as dataset:
        scenes = dataset.scene_names()
        extract(
            dataset,
            tmp_path / "out",
            replace(manifest.settings, targets=replace(manifest.settings.targets, no_map=True)),
            scenes=scenes,
            splits=dataset.splits(),
            cache_dir=mask_cache,
        )
    found, expected = (evaluate_plans(shards).figures for shards in (tmp_path / "out", plan_shards))
    for one, other in zip(found, expected, strict=True):
        if one.metric == "off_drivable":
            assert np.isnan(one.value)
        else:
            np.testing.assert_equal(one.value, other.value)
    assert (
        "off drivable is not known: the shards were made with --no-map"
        in evaluate_plans(tmp_path / "out").notes
    )

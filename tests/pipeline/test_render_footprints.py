import json
import shutil

import h5py
import numpy as np
import pytest

from ogmkit.base.execution import Execution
from ogmkit.errors import OutputError, SettingsError, ShardError
from ogmkit.footprints.settings import FootprintSettings
from ogmkit.geometry.boxes import box_corners, ground_corners
from ogmkit.geometry.camera import project
from ogmkit.geometry.se3 import inverse
from ogmkit.homography.settings import FitSettings
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.extract import extract
from ogmkit.pipeline.footprint_masks import renderer
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.pipeline.render_footprints import render_footprints
from ogmkit.shards.reader import Shard
from ogmkit.shards.verify import verify_folder

CAMERAS = ("CAM_BACK", "CAM_FRONT")
SETS = {
    "surface": FootprintSettings(),
    "dlt": FootprintSettings("dlt"),
    "surface-project": FootprintSettings(method="project"),
    "calibration-project": FootprintSettings("calibration", "project"),
    "full-body": FootprintSettings(method="full-body"),
    "surface+dlt": FootprintSettings("surface+dlt"),
    "large": FootprintSettings(scale=0.5, name="large"),
}


@pytest.fixture(scope="module")
def fitted(tmp_path_factory, undisturbed):
    """A folder with homographies, those of `dlt` not in every frame; tests only read it."""
    out = shutil.copytree(undisturbed, tmp_path_factory.mktemp("fitted") / "out")
    fit_shards(out, ["surface", "dlt"], FitSettings(min_points=12))
    return out


@pytest.fixture
def out(tmp_path, fitted):
    return shutil.copytree(fitted, tmp_path / "out")


@pytest.fixture(scope="module")
def rendered(tmp_path_factory, fitted):
    """A folder with all sets; tests only read it."""
    out = shutil.copytree(fitted, tmp_path_factory.mktemp("rendered") / "out")
    return out, {name: render_footprints(out, settings) for name, settings in SETS.items()}


@pytest.fixture(params=["first", "second"])
def shard(request, rendered):
    path = sorted(rendered[0].glob("*.h5"))[request.param == "second"]
    with Shard(path) as shard:
        yield shard


def masks(shard, camera, name):
    return tuple(shard.dataset(camera, f"footprints/{name}/{mask}")[:] for mask in ("drivable", "vehicles"))


def warped_by_hand(mask_bev, bev_from_image, image_size, mask_size):
    """Mask pixel → image pixel → cell, in float64; and where rounding decides."""
    v, u = np.mgrid[: mask_size[0], : mask_size[1]] + 0.5
    u, v = u * image_size[1] / mask_size[1] - 0.5, v * image_size[0] / mask_size[0] - 0.5
    column, row, w = np.moveaxis(np.stack([u, v, np.ones_like(u)], axis=-1) @ bev_from_image.T, -1, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        place = np.stack([row / w, column / w])
    undecided = (np.abs(place - np.floor(place) - 0.5) < 1e-3).any(axis=0)
    inside = (w > 0) & (place > -0.5).all(axis=0)
    inside &= (place[0] < mask_bev.shape[0] - 0.5) & (place[1] < mask_bev.shape[1] - 0.5)
    row, column = np.where(inside, np.round(place), 0).astype(int)
    return np.where(inside, mask_bev[row, column], 0), undecided


def test_the_sets_stand_side_by_side_in_a_sound_folder(rendered, shard):
    out, summaries = rendered
    assert verify_folder(out) == ()
    for camera in CAMERAS:
        assert shard.added(camera, "footprints") == tuple(sorted(SETS))
    for name, summary in summaries.items():
        assert (summary.name, summary.shards, summary.kept, summary.frames) == (name, 2, 0, 32)


def test_attributes_tell_how_a_set_was_made(shard):
    attributes = dict(shard.h5["CAM_FRONT/footprints/dlt"].attrs)
    assert (attributes["homography"], attributes["method"], attributes["scale"]) == ("dlt", "warp", 2.0)
    fit = json.loads(attributes["settings"])["homography"]
    assert (fit["method"], fit["settings"]["min_points"]) == ("dlt", 12)
    attributes = dict(shard.h5["CAM_FRONT/footprints/full-body"].attrs)
    assert (attributes["method"], attributes["settings"]) == ("full-body", "{}")


def test_masks_are_stored_a_compressed_chunk_a_frame(shard):
    drivable = shard.dataset("CAM_FRONT", "footprints/large/drivable")
    assert (drivable.shape, drivable.dtype) == ((8, 180, 320), np.uint8)
    stored = shard.h5["CAM_FRONT/footprints/large/drivable"]
    assert (stored.chunks, stored.compression) == ((1, 180, 320), "gzip")


@pytest.mark.parametrize(("name", "source"), [("surface", "surface"), ("dlt", "dlt"), ("large", "surface")])
@pytest.mark.parametrize("camera", CAMERAS)
def test_warped_masks_are_the_bev_masks_through_the_stored_homography(shard, camera, name, source):
    matrices = shard.dataset(camera, f"homography/{source}/bev_from_image")[:]
    valid = shard.dataset(camera, f"homography/{source}/valid")[:]
    np.testing.assert_array_equal(shard.dataset(camera, f"footprints/{name}/valid")[:], valid)
    found = masks(shard, camera, name)
    for layer, warped in zip(("drivable", "vehicles"), found, strict=True):
        for frame in range(len(valid)):
            if not valid[frame]:
                assert not warped[frame].any()
                continue
            bev = shard.dataset(camera, layer)[frame]
            expected, undecided = warped_by_hand(bev, matrices[frame], (90, 160), warped.shape[1:])
            assert ((warped[frame] == expected) | undecided).all()
    assert found[0].any() == (camera == "CAM_FRONT" and valid.any())  # the grid lies ahead


@pytest.mark.parametrize("camera", CAMERAS)
def test_a_source_for_each_gives_each_ones_masks_where_both_are_valid(shard, camera):
    valid = shard.dataset(camera, "homography/dlt/valid")[:]  # those of `surface` are all valid
    np.testing.assert_array_equal(shard.dataset(camera, "footprints/surface+dlt/valid")[:], valid)
    drivable, vehicles = masks(shard, camera, "surface+dlt")
    np.testing.assert_array_equal(drivable[valid], masks(shard, camera, "surface")[0][valid])
    np.testing.assert_array_equal(vehicles[valid], masks(shard, camera, "dlt")[1][valid])
    assert not drivable[~valid].any()
    fits = json.loads(shard.h5[f"{camera}/footprints/surface+dlt"].attrs["settings"])
    assert [fit["method"] for fit in fits.values()] == ["surface", "dlt"]


def test_masks_of_another_fit_of_the_vehicles_are_other_masks(out):
    render_footprints(out, FootprintSettings("surface+dlt"))
    fit_shards(out, ["dlt"], FitSettings(min_points=4), execution=Execution(overwrite=True))
    problems = [str(problem) for problem in verify_folder(out)]
    assert any("surface+dlt (vehicles_homography.settings.min_points is 4" in one for one in problems)


def test_frames_without_a_valid_homography_are_marked_and_counted(rendered):
    out, summaries = rendered
    valid = []
    for path in out.glob("*.h5"):
        with Shard(path) as shard:
            valid += [shard.dataset(camera, "homography/dlt/valid")[:] for camera in CAMERAS]
    invalid = np.count_nonzero(~np.concatenate(valid))
    assert 0 < invalid < 32
    assert summaries["dlt"].invalid == invalid
    assert summaries["surface"].invalid == summaries["full-body"].invalid == 0


@pytest.mark.parametrize("camera", CAMERAS)
def test_exact_vehicles_are_those_of_the_boxes(shard, camera):
    """Corners of faces wholly in the image lie on the masks' outlines; bodies hold their footprints."""
    _, footprints = masks(shard, camera, "surface-project")
    _, bodies = masks(shard, camera, "full-body")
    assert not (footprints > bodies).any()
    for frame in range(shard.frames(camera)):
        boxes = shard.boxes(camera, frame)
        cars = boxes.selected(np.array([name.startswith("vehicle.") for name in boxes.category]))
        to_camera = inverse(
            shard.dataset(camera, "global_from_ego")[frame] @ shard.dataset(camera, "ego_from_camera")[frame]
        )
        poses, intrinsics = to_camera @ cars.global_from_box, shard.dataset(camera, "intrinsics")[frame]
        for mask, corners in (
            (footprints[frame], ground_corners(poses, cars.size_wlh)),
            (bodies[frame], box_corners(poses, cars.size_wlh)),
        ):
            pixels, depth_m = project(intrinsics, corners)
            pixels = (pixels + 0.5) / 2 - 0.5
            whole = (depth_m > 1).all(axis=1) & ((pixels > 1) & (pixels < (78, 43))).all(axis=(1, 2))
            for polygon in pixels[whole]:
                column, row = np.round(polygon.mean(axis=0)).astype(int)
                if np.ptp(polygon, axis=0).min() > 3:
                    assert mask[row, column]
            if whole.all():
                rows, columns = np.nonzero(mask)
                assert len(rows) == 0 or columns.min() >= pixels[..., 0].min() - 0.5
                assert len(rows) == 0 or rows.max() <= pixels[..., 1].max() + 0.5


def test_two_workers_give_the_same_bytes(tmp_path, fitted, digests):
    one, two = (shutil.copytree(fitted, tmp_path / name) for name in ("one", "two"))
    render_footprints(one)
    render_footprints(two, execution=Execution(workers=2))
    assert digests(one) == digests(two)


def test_a_second_run_changes_nothing(rendered, digests):
    out, _ = rendered
    before = digests(out)
    assert render_footprints(out, SETS["large"]).kept == 2
    assert digests(out) == before


def test_other_settings_are_refused_by_name(out, digests):
    render_footprints(out)
    before = digests(out)
    with pytest.raises(OutputError, match=r"/surface exists with .*scale is 4\.0 here but 2\.0 there"):
        render_footprints(out, FootprintSettings(scale=4))
    assert digests(out) == before
    render_footprints(out, FootprintSettings(scale=4, name="small"))
    render_footprints(out, FootprintSettings(scale=4), execution=Execution(overwrite=True))
    assert verify_folder(out) == ()
    with Shard(next(out.glob("*.h5"))) as shard:
        assert shard.dataset("CAM_FRONT", "footprints/surface/vehicles").shape == (8, 22, 40)


def test_masks_of_another_fit_are_other_masks(out):
    render_footprints(out, FootprintSettings("dlt"))
    fit_shards(out, ["dlt"], FitSettings(min_points=4), execution=Execution(overwrite=True))
    with pytest.raises(
        OutputError, match=r"settings\.homography\.settings\.min_points is 4 here but 12 there"
    ):
        render_footprints(out, FootprintSettings("dlt"))
    summary = render_footprints(out, FootprintSettings("dlt"), execution=Execution(overwrite=True))
    assert summary.kept == 0
    assert verify_folder(out) == ()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (FootprintSettings("surfac"), r"CAM_BACK: unknown homography 'surfac'; did you mean surface\?"),
        (FootprintSettings("network"), "there are: dlt, surface; `ogmkit homography-fit` adds some"),
        (FootprintSettings("surface+plane"), "CAM_BACK: unknown homography 'plane'"),
        (FootprintSettings("surface+dlt", "project"), r"'surface\+dlt' knows no ground"),
        (
            FootprintSettings("dlt", "project"),
            "'dlt' knows no ground .* or ego-plane",
        ),
        (FootprintSettings(scale=200), "leaves nothing of 90 × 160 pixels"),
        (FootprintSettings(name="../x"), "use letters, digits"),
    ],
)
def test_what_cannot_be_made_is_refused_before_anything_is_changed(out, digests, settings, message):
    before = digests(out)
    with pytest.raises(SettingsError, match=message):
        render_footprints(out, settings)
    assert digests(out) == before


def test_shards_without_homographies_can_only_be_projected(tmp_path, undisturbed):
    out = shutil.copytree(undisturbed, tmp_path / "out")
    with pytest.raises(SettingsError, match="unknown homography 'surface'; there are: none"):
        render_footprints(out)
    assert render_footprints(out, FootprintSettings(method="project")).invalid == 0
    assert verify_folder(out) == ()


def test_a_homography_that_is_not_finite_is_none(out):
    path = next(out.glob("*.h5"))
    with h5py.File(path, "r+") as h5:
        h5["CAM_FRONT/homography/surface/bev_from_image"][3, 0, 0] = np.nan
    with Shard(path) as shard:
        render = renderer(shard, "CAM_FRONT", FootprintSettings())
        assert render(3) is None
        assert render(2).drivable.any()


def test_images_of_several_sizes_are_named(out):
    path = next(out.glob("*.h5"))
    with h5py.File(path, "r+") as h5:
        h5["CAM_FRONT/image_size"][3] = (80, 160)
    with Shard(path) as shard, pytest.raises(ShardError, match=r"CAM_FRONT has images of 2 sizes, not one"):
        renderer(shard, "CAM_FRONT", FootprintSettings())


def test_frames_without_boxes_have_ground_all_the_same(
    tmp_path, tiny_dataroot, edit_table, mask_cache, small_settings
):
    root, out = shutil.copytree(tiny_dataroot, tmp_path / "root"), tmp_path / "out"
    for table in ("sample_annotation", "instance"):
        edit_table(root, table, lambda records: [])
    with Dataset(root) as dataset:
        scenes, splits = dataset.scene_names(), dataset.splits()
        extract(dataset, out, small_settings, scenes=scenes, splits=splits, cache_dir=mask_cache)
    fit_shards(out, ["surface", "dlt"])
    invalid = {name: render_footprints(out, SETS[name]).invalid for name in SETS}
    assert invalid == dict.fromkeys(SETS, 0) | {"dlt": 32, "surface+dlt": 32}
    assert verify_folder(out) == ()
    with Shard(next(out.glob("*.h5"))) as shard:
        drivable, vehicles = masks(shard, "CAM_FRONT", "surface-project")
    assert drivable.any()
    assert not vehicles.any()

import json
import re
import shutil
from pathlib import Path

import cv2
import h5py
import numpy as np
import pytest
import torch

from ogmkit.errors import (
    CheckpointError,
    DataFileError,
    OgmkitError,
    OutputError,
    SettingsError,
    ShardError,
    TableError,
)
from ogmkit.geometry.se3 import inverse, pose_matrix
from ogmkit.grid import GridSpec
from ogmkit.learn.predict.choice import Choice
from ogmkit.learn.predict.homographies import predict_homographies
from ogmkit.learn.predict.images import predict_images
from ogmkit.learn.predict.run import open_run
from ogmkit.learn.predict.shards import PredictionJob, predict_shards
from ogmkit.samples.index import index_frames
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards.manifest import file_sha256
from ogmkit.shards.reader import Shard

GRID = GridSpec(0.5, 80, 60, 80.0, 34.0)
CAMERAS = ("CAM_BACK", "CAM_FRONT")
SETTINGS = {
    "footprints": {},
    "ved": {"bev_cell_m": 1.0},
    "oft": {"bev_cell_m": 1.0},
    "bev-lidar": {"bev_cell_m": 1.0},
}
SCENES = ("scene-0001", "scene-0002")
POSE = pose_matrix((0.9, 0.1, 1.8), (0.7, 0.1, -0.1, 0.6))
LAST = 7
"""The last frame of a scene; its points become a sweep."""


@pytest.fixture(scope="module")
def runs(tmp_path_factory, make_run):
    """System → RUN of both cameras."""
    folder = tmp_path_factory.mktemp("runs")
    return {
        system: make_run(folder / system, system, GRID, CAMERAS, **more) for system, more in SETTINGS.items()
    }


@pytest.fixture(scope="module")
def homography_run(tmp_path_factory, make_run, learn_shards):
    """A run of `homography` that answers about what the cameras see, differently from image to image."""

    def change(net):
        rows, cameras = [], []
        for path in sorted(learn_shards.glob("*.h5")):
            with Shard(path) as shard:
                for place, camera in enumerate(CAMERAS):
                    rows.append(shard.dataset(camera, "homography/surface/bev_from_image")[:])
                    cameras += [place] * len(rows[-1])
        shrunk = np.diag([160 / 96, 90 / 64, 1])
        matrices = torch.from_numpy(np.concatenate(rows) @ shrunk)
        fitted = type(net.code).fit(matrices, torch.tensor(cameras), 2, net.settings.image_size, GRID)
        net.code.load_state_dict(fitted.state_dict())
        torch.nn.init.normal_(net.net.layers[-1].weight, std=10.0)

    return make_run(
        tmp_path_factory.mktemp("homography") / "run", "homography", GRID, CAMERAS, change, encoder="resnet18"
    )


@pytest.fixture(scope="module")
def recording(tmp_path_factory, learn_shards):
    """The first scene's front images, and one sweep, outside of shards, with what is known of them."""
    folder = tmp_path_factory.mktemp("recording")
    (folder / "images").mkdir()
    (folder / "sweeps").mkdir()
    known = {}
    with Shard(learn_shards / "scene-0001.h5") as shard:
        read = {
            name: shard.dataset("CAM_FRONT", name)[:]
            for name in (
                "level_from_global",
                "global_from_ego",
                "ego_from_camera",
                "intrinsics",
                "image_size",
            )
        }
        level_from_camera = read["level_from_global"] @ read["global_from_ego"] @ read["ego_from_camera"]
        for frame in range(shard.frames("CAM_FRONT")):
            name = f"{frame:03d}.jpg"
            (folder / "images" / name).write_bytes(shard.image("CAM_FRONT", frame).tobytes())
            known[name] = {
                "camera": "CAM_FRONT",
                "image_size": read["image_size"][frame].tolist(),
                "intrinsics": read["intrinsics"][frame].tolist(),
                "level_from_camera": level_from_camera[frame].tolist(),
            }
        start, stop = shard.dataset("CAM_FRONT", "lidar/offsets")[LAST : LAST + 2]
        points_level = shard.dataset("CAM_FRONT", "lidar/points")[start:stop]
    lidar_from_level = inverse(POSE)
    points = points_level[:, :3] @ lidar_from_level[:3, :3].T + lidar_from_level[:3, 3]
    sweep = np.column_stack([points, points_level[:, 3], np.zeros(len(points))]).astype("<f4")
    (folder / "sweeps" / "a.pcd.bin").write_bytes(sweep.tobytes())
    (folder / "calibration.json").write_text(json.dumps(known))
    (folder / "lidar.json").write_text(json.dumps({"level_from_lidar": POSE.tolist()}))
    return folder


def job(system, runs, out, **more):
    return PredictionJob(system, runs[system], out, batch_size=3, **more)


def read(path, camera="/"):
    with h5py.File(path) as h5:
        group = h5[camera]
        return {
            name: group[name].asstr()[:] if group[name].dtype.kind == "O" else group[name][:]
            for name in group
            if isinstance(group[name], h5py.Dataset)
        }


def from_shards(system, runs, shards, out, **more):
    """The front camera's predictions of the first scene."""
    choice = Choice(("scene-0001",), cameras=("CAM_FRONT",))
    predict_shards(job(system, runs, out), shards, choice=choice, **more)
    return read(out / "scene-0001.h5", "CAM_FRONT")


@pytest.mark.sampled(2)
@pytest.mark.parametrize("system", SETTINGS)
def test_files_hold_what_is_predicted(tmp_path, learn_shards, runs, system):
    told = []
    summary = predict_shards(
        job(system, runs, tmp_path / "out"), learn_shards, on_progress=lambda *counts: told.append(counts)
    )
    assert (summary.frames, summary.files, told[-1]) == (32, 2, (32, 32))
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"scene-0001.h5", "scene-0002.h5"}
    source = "surface" if system == "footprints" else None
    index = index_frames(learn_shards, SCENES, CAMERAS, needs=SampleSpec(), valid_only=False)
    found = open_run(runs[system]).frames(index, source, batch_size=8, workers=0)
    for expected in found:
        stored = read(tmp_path / "out" / f"{expected.scene}.h5", expected.camera)
        place = expected.frame
        assert stored["frame"][place] == place
        assert stored["bev"].dtype == np.float16
        np.testing.assert_allclose(stored["bev"][place], expected.bev, atol=1e-3)
        assert ("image" in stored) == ("homography_valid" in stored) == (system == "footprints")
        if system == "footprints":
            np.testing.assert_allclose(stored["image"][place], expected.image, atol=1e-3)
        with Shard(learn_shards / f"{expected.scene}.h5") as shard:
            for name in ("sample_token", "sample_data_token"):
                assert stored[name][place] == shard.strings(expected.camera, name)[place]


def test_a_homography_for_each_mask_warps_each_by_its_own(learn_shards, runs):
    run = open_run(runs["footprints"])
    index = index_frames(learn_shards, ["scene-0001"], CAMERAS, needs=SampleSpec(), limit=3)

    def grids(homography):
        return np.stack([one.bev for one in run.frames(index, homography, batch_size=2, workers=0)])

    pair, surface, calibration = map(grids, ("surface+calibration", "surface", "calibration"))
    np.testing.assert_array_equal(pair[:, 0], surface[:, 0])
    np.testing.assert_array_equal(pair[:, 1], calibration[:, 1])
    assert (surface != calibration).any()


def test_a_file_tells_of_its_origin(tmp_path, learn_shards, runs):
    from_shards("footprints", runs, learn_shards, tmp_path / "out", homography="calibration")
    with h5py.File(tmp_path / "out" / "scene-0001.h5") as h5:
        about = dict(h5.attrs)
        assert list(h5) == ["CAM_FRONT"]
    assert (about["system"], about["homography"], about["scene"]) == (
        "footprints",
        "calibration",
        "scene-0001",
    )
    assert about["checkpoint_sha256"] == file_sha256(runs["footprints"] / "best.ckpt")
    assert (about["grid_rows"], about["grid_columns"], about["grid_ego_column"]) == (80, 60, 34.0)


def test_frames_can_be_chosen(tmp_path, learn_shards, runs):
    for choice, expected in (
        (Choice(splits=("val",)), {"scene-0002"}),
        (Choice(("scene-0001",)), {"scene-0001"}),
        (Choice(limit=2), set(SCENES)),
    ):
        out = tmp_path / str(len(list(tmp_path.iterdir())))
        predict_shards(job("bev-lidar", runs, out), learn_shards, choice=choice)
        assert {path.stem for path in out.iterdir()} == expected
    with h5py.File(out / "scene-0002.h5") as h5:  # the seventeenth of 32 frames
        assert list(h5) == ["CAM_BACK"]
        assert h5["CAM_BACK/frame"][:].tolist() == [0]


def test_pictures_hold_probabilities(tmp_path, learn_shards, runs):
    choice = Choice(("scene-0002",), cameras=("CAM_BACK",), limit=1)
    summary = predict_shards(
        job("footprints", runs, tmp_path / "out", form="png"), learn_shards, choice=choice
    )
    names = {
        f"scene-0002_CAM_BACK_0000_{view}_{target}.png"
        for view in ("bev", "image")
        for target in ("drivable", "vehicles")
    }
    assert {path.name for path in (tmp_path / "out").iterdir()} == names
    assert summary.files == 4
    index = index_frames(learn_shards, SCENES[1:], CAMERAS[:1], needs=SampleSpec(), valid_only=False, limit=1)
    (expected,) = open_run(runs["footprints"]).frames(index, "surface", batch_size=8, workers=0)
    for channel, target in enumerate(("drivable", "vehicles")):
        path = tmp_path / "out" / f"scene-0002_CAM_BACK_0000_bev_{target}.png"
        pixels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert (pixels.dtype, pixels.shape) == (np.uint8, (80, 60))
        np.testing.assert_allclose(pixels / 255, expected.bev[channel], atol=0.51 / 255)


def test_frames_without_a_homography_are_marked(tmp_path, learn_shards, runs):
    shards = shutil.copytree(learn_shards, tmp_path / "shards")
    with h5py.File(shards / "scene-0001.h5", "r+") as h5:
        h5["CAM_FRONT/homography/surface/valid"][2] = False
        h5["CAM_FRONT/homography/surface/bev_from_image"][2] = np.nan
    stored = from_shards("footprints", runs, shards, tmp_path / "out")
    assert stored["homography_valid"].tolist() == [True, True] + [False] + [True] * 5
    assert not stored["bev"][2].any()
    assert stored["bev"][3].any()
    assert stored["image"][2].any()


def test_an_interrupted_file_stays_as_it_was(tmp_path, learn_shards, runs):
    out = tmp_path / "out"
    out.mkdir()
    (out / "scene-0001.h5").write_text("what was there")

    def interrupt(done, total):
        if done == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        predict_shards(job("bev-lidar", runs, out), learn_shards, on_progress=interrupt)
    assert [path.read_text() for path in out.iterdir()] == ["what was there"]
    predict_shards(job("bev-lidar", runs, out), learn_shards)
    assert len(read(out / "scene-0001.h5", "CAM_FRONT")["bev"]) == 8


@pytest.mark.parametrize(
    ("system", "more", "choice", "error", "message"),
    [
        ("oft", {"checkpoint": "ved"}, {}, CheckpointError, "is a run of ved, not of oft"),
        ("footprints", {"homography": "dlt"}, {}, ShardError, "homography-fit .* --method dlt"),
        ("ved", {}, {"scenes": ("scene-1",)}, SettingsError, "unknown scene 'scene-1'"),
        ("ved", {}, {"splits": ("test",)}, SettingsError, "unknown split 'test'"),
        (
            "ved",
            {},
            {"scenes": ("scene-0001",), "splits": ("val",)},
            SettingsError,
            "none of the chosen scenes",
        ),
        ("ved", {}, {"cameras": ("CAM_TOP",)}, SettingsError, "unknown camera 'CAM_TOP'"),
        ("ved", {"out": "shards/x"}, {}, OutputError, "holds nothing but shards"),
    ],
)
def test_wrong_input_is_named_before_anything_is_written(
    tmp_path, learn_shards, runs, system, more, choice, error, message
):
    out = learn_shards / "x" if "out" in more else tmp_path / "out"
    wanted = PredictionJob(system, runs[more.get("checkpoint", system)], out)
    with pytest.raises(error, match=message):
        predict_shards(wanted, learn_shards, homography=more.get("homography"), choice=Choice(**choice))
    assert not out.exists()


@pytest.mark.parametrize("system", ["footprints", "ved", "oft"])
def test_images_of_a_folder_are_predicted_as_those_of_shards(tmp_path, learn_shards, runs, recording, system):
    source = {"homography": "calibration"} if system == "footprints" else {}
    expected = from_shards(system, runs, learn_shards, tmp_path / "shards", **source)
    summary = predict_images(
        job(system, runs, tmp_path / "out"), recording / "images", recording / "calibration.json"
    )
    assert (summary.frames, summary.files) == (8, 1)
    found = read(tmp_path / "out" / "predictions.h5")
    assert found["file"].tolist() == [f"{frame:03d}.jpg" for frame in range(8)]
    np.testing.assert_allclose(found["bev"], expected["bev"], atol=2e-3)
    if system == "footprints":
        np.testing.assert_array_equal(found["image"], expected["image"])
        assert found["homography_valid"].all()


def test_a_sweep_is_predicted_as_the_shards_points(tmp_path, learn_shards, runs, recording):
    expected = from_shards("bev-lidar", runs, learn_shards, tmp_path / "shards")["bev"][LAST]
    predict_images(job("bev-lidar", runs, tmp_path / "out"), recording / "sweeps", recording / "lidar.json")
    found = read(tmp_path / "out" / "predictions.h5")
    assert found["file"].tolist() == ["a.pcd.bin"]
    # A point on the border of two cells may have moved to the other.
    assert (np.abs(found["bev"][0] - expected) < 2e-3).mean() > 0.99


def test_a_given_homography_leads_to_the_plane_whatever_its_scale_and_sign(
    tmp_path, learn_shards, runs, recording
):
    expected = from_shards("footprints", runs, learn_shards, tmp_path / "shards", homography="surface")
    known = json.loads((recording / "calibration.json").read_text())
    with Shard(learn_shards / "scene-0001.h5") as shard:
        matrices = shard.dataset("CAM_FRONT", "homography/surface/bev_from_image")[:]
    for values, matrix in zip(known.values(), matrices, strict=True):
        values["bev_from_image"] = (-3.7 * matrix).tolist()
    (tmp_path / "calibration.json").write_text(json.dumps(known))
    predict_images(
        job("footprints", runs, tmp_path / "out"), recording / "images", tmp_path / "calibration.json"
    )
    found = read(tmp_path / "out" / "predictions.h5")
    np.testing.assert_allclose(found["bev"], expected["bev"], atol=2e-3)
    np.testing.assert_allclose(found["bev_from_image"], matrices, rtol=1e-9)


def test_a_networks_homography_leads_to_the_plane(tmp_path, learn_shards, runs, recording, homography_run):
    shards = shutil.copytree(learn_shards, tmp_path / "shards")
    predict_homographies(shards, homography_run)
    expected = from_shards("footprints", runs, shards, tmp_path / "expected")  # `network` is preferred
    predict_images(
        job("footprints", runs, tmp_path / "out"),
        recording / "images",
        recording / "calibration.json",
        homography_checkpoint=homography_run,
    )
    found = read(tmp_path / "out" / "predictions.h5")
    with Shard(shards / "scene-0001.h5") as shard:
        matrices = shard.dataset("CAM_FRONT", "homography/network/bev_from_image")[:]
    assert np.isfinite(matrices).all()
    assert np.std(matrices, axis=0).max() > 0.01  # they differ, or places could be mixed up unseen
    np.testing.assert_allclose(found["bev_from_image"], matrices, rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(found["bev"], expected["bev"], atol=1e-2)


def test_png_images_and_one_calibration_for_all(tmp_path, runs, recording):
    known = json.loads((recording / "calibration.json").read_text())["003.jpg"]
    (tmp_path / "one.json").write_text(json.dumps(known))
    images = tmp_path / "images"
    images.mkdir()
    pixels = cv2.imread(str(recording / "images" / "003.jpg"))
    cv2.imwrite(str(images / "same.PNG"), pixels)
    predict_images(job("footprints", runs, tmp_path / "out", form="png"), images, tmp_path / "one.json")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        f"same_{view}_{target}.png" for view in ("bev", "image") for target in ("drivable", "vehicles")
    }
    predict_images(
        job("footprints", runs, tmp_path / "h5"), recording / "images", recording / "calibration.json"
    )
    expected = read(tmp_path / "h5" / "predictions.h5")["image"][3, 0]
    found = cv2.imread(str(tmp_path / "out" / "same_image_drivable.png"), cv2.IMREAD_UNCHANGED)
    np.testing.assert_allclose(found / 255, expected, atol=0.02)  # JPEGs are decoded at half their size


def spoil(key, value):
    def change(known):
        known[key] = value

    return change


ROTATION = np.eye(4).tolist()
MIRROR = np.diag([1.0, -1, 1, 1]).tolist()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda known: known.pop("image_size"), "image_size is missing"),
        (lambda known: known.pop("intrinsics"), "gives neither bev_from_image nor intrinsics"),
        (spoil("image_size", [90.0, 160]), r"image_size is not \[height, width\]"),
        (spoil("image_size", [90, 0]), r"image_size is not \[height, width\]"),
        (spoil("intrinsics", [[1, 0], [0, 1]]), "intrinsics is not 3 rows of 3 numbers"),
        (spoil("intrinsics", [["1", 0, 0], [0, 1, 0], [0, 0, 1]]), "intrinsics is not 3 rows of 3 numbers"),
        (spoil("intrinsics", [[-9, 0, 0], [0, 9, 0], [0, 0, 1]]), "focal length that is not positive"),
        (spoil("intrinsics", [[9, 0, 0], [0, 9, 0], [0, 0, 2]]), "intrinsics is not upper triangular"),
        (spoil("intrinsics", [[float("nan"), 0, 0], [0, 9, 0], [0, 0, 1]]), "number that is not finite"),
        (spoil("intrinsics", [[10**400, 0, 0], [0, 9, 0], [0, 0, 1]]), "number that is too large"),
        (spoil("level_from_camera", MIRROR), "level_from_camera holds no rotation"),
        (spoil("level_from_camera", (2 * np.eye(4)).tolist()), "level_from_camera does not end in"),
        (spoil("level_from_camera", ROTATION), "leads to no homography"),
        (spoil("bev_from_image", np.zeros((3, 3)).tolist()), "leads to no homography: .*singular"),
        (spoil("bev_from_image", [[1, 0, 0], [0, -1, 0], [0, 0, 1]]), "leads to no homography: .*below"),
        (spoil("camera", "CAM_TOP"), "unknown camera 'CAM_TOP'"),
        (spoil("camera", 3), "camera is not a text"),
        (lambda known: known.pop("camera"), "camera is missing; name one of CAM_BACK, CAM_FRONT"),
        (spoil("intrinsic", 3), "unknown key 'intrinsic'; did you mean intrinsics"),
    ],
)
def test_a_wrong_calibration_is_named_with_file_input_and_key(tmp_path, runs, recording, change, message):
    known = json.loads((recording / "calibration.json").read_text())
    change(known["004.jpg"])
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps(known))
    with pytest.raises(TableError, match=message) as error:
        predict_images(job("footprints", runs, tmp_path / "out"), recording / "images", path)
    assert str(error.value).startswith(f"{path}: 004.jpg: ")
    assert "\n" not in str(error.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ("[]", "holds no object"),
        ("{}", "holds no object"),
        ('{"000.jpg": {}, "001.jpg": []}', "holds neither one calibration nor one for each image"),
        ('{"000.jpg": {"image_size": [90, 160], "camera": "CAM_BACK"}}', "unknown image '001.jpg'"),
    ],
)
def test_a_file_that_is_no_calibration_is_named(tmp_path, runs, recording, text, message):
    path = tmp_path / "calibration.json"
    path.write_text(text)
    with pytest.raises(TableError, match=f"calibration.json: {message}"):
        predict_images(job("ved", runs, tmp_path / "out"), recording / "images", path)


def empty(images):
    for path in images.iterdir():
        path.unlink()


def cut(images):
    path = images / "005.jpg"
    path.write_bytes(path.read_bytes()[:-500])


def cut_png(images):
    path = images / "x.png"
    cv2.imwrite(str(path), np.zeros((90, 160, 3), np.uint8))
    path.write_bytes(path.read_bytes()[:-20])


def other_size(images):
    cv2.imwrite(str(images / "005.jpg"), np.zeros((80, 160, 3), np.uint8))


def twice(images):
    cv2.imwrite(str(images / "005.png"), np.zeros((90, 160, 3), np.uint8))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (empty, r"holds no \*.jpg"),
        (cut, "005.jpg: not a whole JPEG or PNG"),
        (cut_png, "x.png: not a whole JPEG or PNG"),
        (other_size, "005.jpg: has 160 × 80 pixels, by its calibration 160 × 90"),
        (twice, "005.png: differs from 005.jpg in its ending only"),
    ],
)
def test_wrong_images_are_named(tmp_path, runs, recording, change, message):
    images = shutil.copytree(recording / "images", tmp_path / "images")
    change(images)
    known = {"camera": "CAM_FRONT", "image_size": [90, 160]}
    (tmp_path / "calibration.json").write_text(json.dumps(known))
    with pytest.raises(DataFileError, match=message):
        predict_images(job("ved", runs, tmp_path / "out"), images, tmp_path / "calibration.json")
    assert not list(tmp_path.glob("out/*"))


def test_results_stay_out_of_the_input(runs, recording):
    images = recording / "images"
    with pytest.raises(OutputError, match="holds the input"):
        predict_images(job("ved", runs, images), images, recording / "calibration.json")


def test_two_runs_must_be_of_one_grid(tmp_path, runs, recording, make_run):
    coarser = make_run(tmp_path / "run", "homography", GridSpec(1.0, 40, 30, 40.0, 17.0), CAMERAS)
    wanted = job("footprints", runs, tmp_path / "out")
    images, file = recording / "images", recording / "calibration.json"
    with pytest.raises(SettingsError, match="was trained on another grid than"):
        predict_images(wanted, images, file, homography_checkpoint=coarser)
    other = make_run(tmp_path / "back", "homography", GRID, ("CAM_BACK",))
    with pytest.raises(SettingsError, match="unknown camera 'CAM_FRONT'"):
        predict_images(wanted, images, file, homography_checkpoint=other)
    with pytest.raises(OgmkitError, match="is a run of ved, not of homography"):
        predict_images(wanted, images, file, homography_checkpoint=runs["ved"])


def test_the_documented_calibrations_lead_to_the_plane(tmp_path, runs):
    text = (Path(__file__).parents[3] / "docs" / "predict.md").read_text(encoding="utf-8")
    text, _, _ = text.partition("\n## Plans\n")
    examples = re.findall(r"^```json\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert len(examples) == 2
    images = tmp_path / "images"
    images.mkdir()
    cv2.imwrite(str(images / "0001.jpg"), np.zeros((900, 1600, 3), np.uint8))
    for example in examples:
        (tmp_path / "calibration.json").write_text(example)
        predict_images(job("footprints", runs, tmp_path / "out"), images, tmp_path / "calibration.json")
        assert read(tmp_path / "out" / "predictions.h5")["homography_valid"].all()

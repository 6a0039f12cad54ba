import shutil

import cv2
import numpy as np
import pytest
import torch

from ogmkit.base.execution import Execution
from ogmkit.errors import CheckpointError, OutputError, SettingsError, ShardError
from ogmkit.footprints.settings import FootprintSettings
from ogmkit.grid import GridSpec
from ogmkit.learn.predict.homographies import predict_homographies
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.extract import extract
from ogmkit.pipeline.render_footprints import render_footprints
from ogmkit.shards.manifest import file_sha256
from ogmkit.shards.reader import Shard
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.verify import verify_folder
from ogmkit.target_settings import TargetSettings

GRID = GridSpec(0.5, 80, 60, 80.0, 34.0)
CAMERAS = ("CAM_BACK", "CAM_FRONT")
SIZE = (70, 128)
"""Of the network's images; the shards' are 90 × 160, so that both axes shrink, by different factors."""
PIXELS = np.array([[20, 65], [110, 60], [50, 45], [75, 43]], np.float32)
CELLS = {
    "CAM_FRONT": np.array([[28, 74], [39, 71], [24, 50], [47, 44]], np.float32),
    "CAM_BACK": np.array([[25, 70], [44, 72], [20, 40], [50, 45]], np.float32),
}


def known(camera):
    """The homography of resized pixels that takes PIXELS to CELLS."""
    return cv2.getPerspectiveTransform(PIXELS, CELLS[camera])


def answering(matrices):
    """Make a network answer, whatever it sees, the matrix of the image's camera."""

    def change(net):
        for place, camera in enumerate(net.cameras):
            matrix = torch.as_tensor(matrices[camera])
            net.code.mean[place] = matrix / matrix[2, 2].abs()
            net.code.scale[place] = 0.0

    return change


@pytest.fixture
def out(tmp_path, learn_shards):
    return shutil.copytree(learn_shards, tmp_path / "out")


@pytest.fixture(scope="module")
def run(tmp_path_factory, make_run):
    matrices = {camera: known(camera) for camera in CAMERAS}
    folder = tmp_path_factory.mktemp("runs") / "known"
    return make_run(folder, "homography", GRID, CAMERAS, answering(matrices), image_size=SIZE)


def columns(out, camera, name="network"):
    """Name of each dataset of the homographies → rows over all shards."""
    parts = []
    for path in sorted(out.glob("*.h5")):
        with Shard(path) as shard:
            group = shard.h5[f"{camera}/homography/{name}"]
            parts.append({key: group[key].asstr()[:] if key == "reason" else group[key][:] for key in group})
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}


@pytest.mark.parametrize("camera", CAMERAS)
def test_the_networks_homography_comes_out_for_the_original_pixels(out, run, camera):
    predict_homographies(out, run)
    stored = columns(out, camera)
    assert stored["valid"].all()
    assert len(stored["valid"]) == 16
    # A pixel's centre in the resized image, and the same place in the original one.
    pixels = (PIXELS + 0.5) * (160 / SIZE[1], 90 / SIZE[0]) - 0.5
    for matrix in stored["bev_from_image"]:
        mapped = np.column_stack([pixels, np.ones(4)]) @ matrix.T
        assert (mapped[:, 2] > 0).all()
        np.testing.assert_allclose(mapped[:, :2] / mapped[:, 2:], CELLS[camera], atol=1e-4)
        assert abs(matrix[2, 2]) == pytest.approx(1)


def test_the_folder_stays_sound_and_footprints_can_be_rendered_by_it(out, run):
    summary = predict_homographies(out, run)
    (method,) = summary.methods
    assert (method.method, method.valid, method.frames, summary.shards) == ("network", 32, 32, 2)
    assert verify_folder(out) == ()
    assert render_footprints(out, FootprintSettings("network", scale=1.0)).invalid == 0
    assert verify_folder(out) == ()


def test_the_shards_tell_of_the_checkpoint(out, run):
    predict_homographies(out, run, name="network-mine")
    with Shard(next(out.glob("*.h5"))) as shard:
        attributes = shard.h5["CAM_FRONT/homography/network-mine"].attrs
        assert attributes["method"] == "network"
        assert attributes["checkpoint_sha256"] == file_sha256(run / "best.ckpt")
        for told in ('"system": "homography"', '"target": "surface"', '"image_size": [70, 128]'):
            assert told in attributes["settings"]


def test_errors_at_boxes_are_measured_by_hand(out, make_run, tmp_path):
    """In a flat world a frame's calibration is the truth; the network is off by 3 and 4 cells of 0.5 m."""
    pixels = np.array([[20, 80], [140, 85], [60, 60], [100, 60]], np.float32)
    resized = ((pixels + 0.5) * (SIZE[1] / 160, SIZE[0] / 90) - 0.5).astype(np.float32)
    matrices = {}
    for camera in CAMERAS:
        truth = columns(out, camera, "calibration")["bev_from_image"][3]
        mapped = np.column_stack([pixels, np.ones(4)]) @ truth.T
        cells = mapped[:, :2] / mapped[:, 2:] + (3, -4)
        matrices[camera] = cv2.getPerspectiveTransform(resized, cells.astype(np.float32))
    run = make_run(tmp_path / "run", "homography", GRID, CAMERAS, answering(matrices), image_size=SIZE)
    predict_homographies(out, run)
    measured = 0
    for camera in CAMERAS:
        ours, theirs = columns(out, camera), columns(out, camera, "calibration")
        with Shard(min(out.glob("*.h5"))) as shard:
            boxes = slice(*shard.dataset(camera, "boxes/offsets")[3:5])
        evaluated = np.isfinite(theirs["left_out_error_m"][boxes])
        errors_m = ours["left_out_error_m"][boxes]
        np.testing.assert_allclose(errors_m[evaluated], 2.5, atol=0.02)
        assert np.isnan(errors_m[~evaluated]).all()
        assert not ours["left_out_refused"].any()
        if evaluated.any():
            assert ours["rms_cells"][3] == pytest.approx(5, abs=0.04)
        measured += evaluated.sum()
    assert measured > 0


def test_a_reversed_sign_is_put_right(out, make_run, tmp_path):
    matrices = {camera: -known(camera) for camera in CAMERAS}
    run = make_run(tmp_path / "run", "homography", GRID, CAMERAS, answering(matrices), image_size=SIZE)
    predict_homographies(out, run)
    assert columns(out, "CAM_FRONT")["valid"].all()
    assert verify_folder(out) == ()


def test_answers_that_are_no_homography_are_marked(out, make_run, tmp_path):
    singular = known("CAM_BACK")
    singular[0] = singular[1]
    mirrored = known("CAM_FRONT") @ np.diag([-1.0, 1, 1]) + [[0, 0, 60], [0, 0, 0], [0, 0, 0]]
    matrices = {"CAM_BACK": singular, "CAM_FRONT": mirrored}
    run = make_run(tmp_path / "run", "homography", GRID, CAMERAS, answering(matrices), image_size=SIZE)
    summary = predict_homographies(out, run)
    assert summary.methods[0].valid == 0
    for camera, reason in (("CAM_BACK", "singular"), ("CAM_FRONT", "from below")):
        stored = columns(out, camera)
        assert np.isnan(stored["bev_from_image"]).all()
        assert reason in stored["reason"][0]
        np.testing.assert_array_equal(
            stored["left_out_refused"], ~np.isnan(columns(out, camera, "calibration")["left_out_error_m"])
        )
    assert verify_folder(out) == ()


def test_the_same_checkpoint_stays_and_another_needs_overwrite(out, run, make_run, tmp_path, contents):
    predict_homographies(out, run)
    before = contents(out)
    assert predict_homographies(out, run).kept == 2
    assert contents(out) == before
    matrices = {"CAM_BACK": known("CAM_FRONT"), "CAM_FRONT": known("CAM_BACK")}
    other = make_run(tmp_path / "other", "homography", GRID, CAMERAS, answering(matrices), image_size=SIZE)
    with pytest.raises(OutputError, match=r"checkpoint_sha256 is .* use --overwrite"):
        predict_homographies(out, other)
    assert contents(out) == before
    predict_homographies(out, other, execution=Execution(overwrite=True))
    predict_homographies(out, run, execution=Execution(overwrite=True))
    assert contents(out) == before


@pytest.mark.parametrize("scheduler", ["", pytest.param("local", marks=pytest.mark.slow)])
def test_two_workers_give_the_same_bytes(out, learn_shards, run, tmp_path, contents, scheduler):
    if scheduler:
        pytest.importorskip(
            "distributed", reason="distributed is not installed: pip install 'ogmkit[cluster]'"
        )
    two = shutil.copytree(out, tmp_path / "two")
    predict_homographies(out, run)
    predict_homographies(two, run, execution=Execution(2, scheduler))
    assert contents(two) == contents(out)


def test_interrupted_it_goes_on_where_it_stopped(out, learn_shards, run, tmp_path, contents):
    whole = shutil.copytree(learn_shards, tmp_path / "whole")
    predict_homographies(whole, run)

    def interrupt(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        predict_homographies(out, run, execution=Execution(on_progress=interrupt))
    assert predict_homographies(out, run).kept == 1
    assert contents(out) == contents(whole)


def test_only_cameras_that_the_run_knows_are_predicted(out, make_run, tmp_path, contents):
    matrices = {"CAM_FRONT": known("CAM_FRONT")}
    run = make_run(tmp_path / "run", "homography", GRID, ("CAM_FRONT",), answering(matrices), image_size=SIZE)
    before = contents(out)
    with pytest.raises(SettingsError, match="unknown camera 'CAM_BACK'"):
        predict_homographies(out, run, cameras=("CAM_BACK",))
    assert contents(out) == before
    assert predict_homographies(out, run).methods[0].frames == 16
    with Shard(next(out.glob("*.h5"))) as shard:
        assert "network" in shard.added("CAM_FRONT", "homography")
        assert "network" not in shard.added("CAM_BACK", "homography")


@pytest.mark.parametrize("name", ["surface", "networks", "network/x", ""])
def test_other_sources_names_are_refused(out, run, name, contents):
    before = contents(out)
    with pytest.raises(SettingsError, match="name"):
        predict_homographies(out, run, name=name)
    assert contents(out) == before


def test_a_run_of_another_system_or_grid_is_refused(out, make_run, tmp_path, contents):
    before = contents(out)
    other = make_run(tmp_path / "other", "ved", GRID, CAMERAS, bev_cell_m=1.0)
    with pytest.raises(CheckpointError, match="is a run of ved, not of homography"):
        predict_homographies(out, other)
    coarser = make_run(tmp_path / "coarser", "homography", GridSpec(1.0, 40, 30, 40.0, 17.0), CAMERAS)
    with pytest.raises(SettingsError, match="another grid"):
        predict_homographies(out, coarser)
    assert contents(out) == before


def test_shards_without_images_are_refused_before_they_are_marked(tmp_path, tiny_dataroot, run, contents):
    out = tmp_path / "out"
    settings = ExtractSettings(TargetSettings(GRID, images="none"), CAMERAS)
    with Dataset(tiny_dataroot) as dataset:
        extract(
            dataset, out, settings, scenes=dataset.scene_names()[:1], splits={}, cache_dir=tmp_path / "cache"
        )
    before = contents(out)
    with pytest.raises(ShardError, match="has no images"):
        predict_homographies(out, run)
    assert contents(out) == before

"""What is wrong with a training is found before anything is built, and nothing is written."""

import json
import shutil
from dataclasses import replace

import pytest

from ogmkit.errors import CheckpointError, OutputError, SettingsError, ShardError, TrainingError
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.runs import open_folder
from ogmkit.learn.training.plan import plan_training
from ogmkit.nuscenes.splits import read_split_file
from ogmkit.shards.manifest import read_manifest, write_manifest

CAMERAS = ("CAM_BACK", "CAM_FRONT")
SPLITS = {"train": ("scene-0001",), "val": ("scene-0002",)}


def test_a_sound_training_has_its_settings_filled_in(learn_shards, tmp_path):
    plan = plan_training(CATALOGUE["footprints"].settings(), learn_shards, tmp_path / "run")
    assert (plan.settings.masks, plan.settings.cameras, plan.division.splits()) == (
        "surface",
        CAMERAS,
        SPLITS,
    )
    assert plan.grid.shape == (80, 60)
    assert list(tmp_path.iterdir()) == []


def test_a_training_chooses_by_logs_of_train_and_its_list_may_gain_scenes_to_report(
    learn_shards, copy_scenes, tmp_path
):
    logs = {"a": ("train", "1"), "b": ("train", "2"), "c": ("train", "3"), "v": ("val", "4")}
    shards, run = copy_scenes(learn_shards, tmp_path / "shards", logs), tmp_path / "run"
    settings = CATALOGUE["lstm-ed"].settings()
    plan = plan_training(settings, shards, run)
    assert [len(plan.division.train), len(plan.division.val), plan.division.test] == [2, 1, ("v",)]
    with open_folder(run, plan.settings, plan.division.splits(), overwrite=False):
        pass
    assert read_split_file(run / "splits.json") == plan.division.splits()
    again = plan_training(settings, shards, run, split_file=run / "splits.json")
    assert again.division.splits() == plan.division.splits()
    more = json.dumps(plan.division.splits() | {"test": ["v", "w"]})
    (run / "splits.json").write_text(more)
    plan_training(settings, shards, run)
    with pytest.raises(OutputError, match="a training with other settings exists: train_split"):
        plan_training(replace(settings, train_split="train"), shards, run)


def test_named_splits_are_taken_whole(learn_shards, copy_scenes, tmp_path):
    logs = {"a": ("train", "1"), "b": ("train", "2"), "c": ("train", "3"), "v": ("val", "4")}
    shards = copy_scenes(learn_shards, tmp_path / "shards", logs)
    settings = CATALOGUE["lstm-ed"].settings(train_split="train", val_split="val")
    division = plan_training(settings, shards, tmp_path / "run").division
    assert division.splits() == {"train": ("a", "b", "c"), "val": ("v",)}


@pytest.mark.parametrize(
    ("system", "values", "error", "message"),
    [
        ("footprints", {"val_split": "typo"}, TrainingError, "split 'typo' has no scene"),
        ("footprints", {"cameras": ("CAM_TOP",)}, SettingsError, "unknown camera 'CAM_TOP'"),
        ("footprints", {"masks": "dlt"}, ShardError, "render-footprints .* --homography dlt"),
        ("footprints", {"bev_loss": True, "target": "dlt"}, ShardError, "homography-fit .* --method .*dlt"),
        ("homography", {"target": "network"}, ShardError, "predict homography"),
        ("holistic", {}, ShardError, "predict homography"),
        ("holistic-cv", {"perception": "nowhere"}, CheckpointError, "nowhere: not a checkpoint"),
    ],
)
def test_what_shards_lack_is_told(learn_shards, tmp_path, system, values, error, message):
    with pytest.raises(error, match=message):
        plan_training(CATALOGUE[system].settings(**values), learn_shards, tmp_path / "run")
    assert list(tmp_path.iterdir()) == []


def test_a_frozen_perception_needs_no_masks(learn_shards, tmp_path):
    (tmp_path / "perception.ckpt").touch()
    settings = CATALOGUE["holistic-cv"].settings(
        masks="dlt", perception=str(tmp_path / "perception.ckpt"), freeze=("perception",)
    )
    assert plan_training(settings, learn_shards, tmp_path / "run").settings.freezes_perception
    with pytest.raises(ShardError, match="dlt"):
        plan_training(replace(settings, freeze=()), learn_shards, tmp_path / "run")


def test_a_folder_with_other_settings_is_refused_unless_it_is_to_be_overwritten(learn_shards, tmp_path):
    run = tmp_path / "run"
    first = CATALOGUE["lstm-ed"].settings(lr=1e-2)
    plan = plan_training(first, learn_shards, run)
    with open_folder(run, plan.settings, plan.division.splits(), overwrite=False):
        pass
    before = {path.name: path.read_bytes() for path in run.iterdir()}
    plan_training(replace(first, epochs=7), learn_shards, run)
    other = replace(first, lr=1e-3)
    with pytest.raises(OutputError, match=r"other settings.*lr is 0\.001 here but 0\.01 there"):
        plan_training(other, learn_shards, run)
    plan_training(other, learn_shards, run, overwrite=True)
    assert {path.name: path.read_bytes() for path in run.iterdir()} == before


def test_lidar_is_looked_for(learn_shards, tmp_path, make_without_lidar):
    with pytest.raises(ShardError, match="has no LiDAR points"):
        plan_training(CATALOGUE["bev-lidar"].settings(), make_without_lidar(learn_shards), tmp_path / "run")


@pytest.fixture
def make_without_lidar(tmp_path):
    """A copy of shards whose manifest says that there is no LiDAR."""

    def make(shards):
        folder = shutil.copytree(shards, tmp_path / "shards")
        manifest = read_manifest(folder)
        settings = manifest.settings
        without = replace(settings, targets=replace(settings.targets, lidar=False))
        write_manifest(folder, replace(manifest, settings=without))
        return folder

    return make

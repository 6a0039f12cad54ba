"""Starting from another run's weights, and leaving parts of a network as they are."""

import pytest
import torch

from ogmkit.base.news import Passed, listening
from ogmkit.errors import CheckpointError, SettingsError
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.checkpoints import read_checkpoint, write_checkpoint
from ogmkit.learn.runs import BEST
from ogmkit.learn.systems.registry import build_system
from ogmkit.learn.training.train import train
from ogmkit.shards.manifest import read_manifest

CAMERAS = ("CAM_BACK", "CAM_FRONT")
FEW = {
    "image_size": (64, 96),
    "encoder": "tu-test_resnet",
    "masks": "surface",
    "max_steps": 1,
    "batch_size": 2,
    "limit_frames": 4,
}


def settings_of(system, **values):
    entry = CATALOGUE[system]
    return entry.settings(**entry.read(FEW | values))


@pytest.fixture(scope="module")
def grid(learn_shards):
    return read_manifest(learn_shards).settings.targets.grid


@pytest.fixture(scope="module")
def first(make_run, grid, tmp_path_factory):
    """A run of footprints."""
    return make_run(tmp_path_factory.mktemp("first") / "run", "footprints", grid, CAMERAS)


def weights(run):
    return read_checkpoint(run / "last.ckpt")[1]["state_dict"]


def started(settings, shards, run):
    """The lines that a training tells, and its weights."""
    told = []
    with listening(lambda news: told.append(news.text) if isinstance(news, Passed) else None):
        train(settings, shards, run)
    return told, weights(run)


def test_a_run_starts_from_another_s_weights(learn_shards, first, tmp_path):
    """A learning rate of 0 leaves them as they were loaded."""
    told, found = started(
        settings_of("footprints", init=str(first), lr=0.0, batch_norm="kept"), learn_shards, tmp_path / "run"
    )
    there = read_checkpoint(first / "best.ckpt")[1]["state_dict"]
    assert there.keys() == found.keys()
    same = [torch.equal(value, there[name]) for name, value in found.items() if name != "thresholds"]
    assert all(same)
    assert told[0] == f"{len(there)} of {len(found)} tensors from {first} (footprints)"


def test_weights_of_half_precision_are_taken_and_trained_in_full(learn_shards, first, tmp_path):
    _, content = read_checkpoint(first / BEST)
    content["state_dict"] = {
        name: value.half() if value.is_floating_point() else value
        for name, value in content["state_dict"].items()
    }
    half = tmp_path / "half.ckpt"
    write_checkpoint(half, content)
    settings = settings_of("footprints", init=str(half), lr=0.0, batch_norm="kept")
    _, found = started(settings, learn_shards, tmp_path / "run")
    for name, value in content["state_dict"].items():
        assert found[name].dtype == (torch.float32 if value.is_floating_point() else value.dtype)
        assert name == "thresholds" or torch.equal(found[name], value.to(found[name].dtype))


def test_what_does_not_fit_starts_fresh_and_is_told(learn_shards, first, tmp_path):
    """From footprints to the homography network: the encoder is the same."""
    settings = settings_of("homography", init=str(first / "best.ckpt"), lr=0.0, batch_norm="kept")
    told, found = started(settings, learn_shards, tmp_path / "run")
    there = read_checkpoint(first / "best.ckpt")[1]["state_dict"]
    shared = [name for name in found if name in there]
    assert 80 < len(shared) < len(found)
    assert all(torch.equal(found[name], there[name]) for name in shared)
    assert told[0].startswith(
        f"{len(shared)} of {len(found)} tensors from {first / 'best.ckpt'} (footprints); "
    )
    assert "; not there: code (" in told[0]
    assert "; not used: " in told[0]


def test_a_planner_keeps_the_statistics_that_its_weights_were_learnt_with(plan_shards, make_run, tmp_path):
    """Another dataset's would let the same weights say other metres."""
    grid = read_manifest(plan_shards).settings.targets.grid
    run = make_run(tmp_path / "planner", "lstm-ed", grid, ["CAM_FRONT"])
    _, content = read_checkpoint(run / BEST)
    content["state_dict"]["planner.of_targets.spread"] = torch.tensor([123.0, 45.0])
    write_checkpoint(run / BEST, content)
    settings = CATALOGUE["lstm-ed"].settings
    options = {"max_steps": 1, "lr": 0.0}
    _, kept = started(settings(init=str(run), **options), plan_shards, tmp_path / "kept")
    assert kept["planner.of_targets.spread"].tolist() == [123.0, 45.0]
    # A linear mean that wasn't there is learnt, and with it what it leaves over.
    _, learnt = started(settings(init=str(run), mean="linear", **options), plan_shards, tmp_path / "learnt")
    assert learnt["planner.of_targets.spread"].max() < 45
    assert learnt["planner.linear_mean.weights"].abs().max() > 0


def test_a_run_of_which_nothing_fits_is_refused(learn_shards, make_run, grid, tmp_path):
    planner = make_run(tmp_path / "planner", "lstm-ed", grid, CAMERAS)
    with pytest.raises(CheckpointError, match=r"planner: no weight of lstm-ed fits this footprints"):
        train(settings_of("footprints", init=str(planner)), learn_shards, tmp_path / "run")
    with pytest.raises(CheckpointError, match=r"nowhere: not a checkpoint"):
        train(settings_of("footprints", init="nowhere"), learn_shards, tmp_path / "run")


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ([1.0, 2.0], r"best.ckpt: not a checkpoint of ogmkit"),
        (float("nan"), r"best.ckpt: \S+ holds numbers that are not finite"),
    ],
)
def test_weights_that_are_none_are_refused(plan_shards, make_run, tmp_path, value, message):
    grid = read_manifest(plan_shards).settings.targets.grid
    run = make_run(tmp_path / "planner", "lstm-ed", grid, ["CAM_FRONT"])
    _, content = read_checkpoint(run / BEST)
    name = next(name for name, weight in content["state_dict"].items() if weight.dim() == 2)
    weight = content["state_dict"][name]
    content["state_dict"][name] = value if isinstance(value, list) else torch.full_like(weight, value)
    write_checkpoint(run / BEST, content)
    with pytest.raises(CheckpointError, match=message):
        train(CATALOGUE["lstm-ed"].settings(init=str(run)), plan_shards, tmp_path / "run")


def test_frozen_parts_stay_and_others_learn(learn_shards, tmp_path):
    settings = settings_of("footprints", freeze=("encoder",), lr=0.1)
    torch.manual_seed(0)
    train(settings, learn_shards, tmp_path / "run")
    after = weights(tmp_path / "run")
    train(settings_of("footprints", freeze=("encoder",), lr=0.2), learn_shards, tmp_path / "other")
    other = weights(tmp_path / "other")  # the same start, another step
    alike = {name: torch.equal(value, other[name]) for name, value in after.items() if name != "thresholds"}
    assert all(same for name, same in alike.items() if ".encoder." in name)
    assert not all(same for name, same in alike.items() if ".encoder." not in name)


def test_kept_statistics_of_normalisation_stay(grid):
    system = build_system(settings_of("footprints", batch_norm="kept"), grid, CAMERAS)
    system.freeze_parts()
    before = {name: value.clone() for name, value in system.named_buffers()}
    system.train()
    system.net(torch.rand(2, 3, 64, 96))
    assert all(torch.equal(value, before[name]) for name, value in system.named_buffers())
    assert all(parameter.requires_grad for parameter in system.parameters())

    learning = build_system(settings_of("footprints"), grid, CAMERAS).train()
    before = {name: value.clone() for name, value in learning.named_buffers()}
    learning.net(torch.rand(2, 3, 64, 96))
    assert not all(torch.equal(value, before[name]) for name, value in learning.named_buffers())


def test_an_unknown_part_is_told_with_those_there_are(grid):
    system = build_system(settings_of("footprints", freeze=("encodr",)), grid, CAMERAS)
    with pytest.raises(SettingsError, match=r"freeze: unknown part 'encodr'.*encoder"):
        system.freeze_parts()

"""Planners as systems: what they see, where gradients go, what the perception keeps."""

import numpy as np
import pytest
import torch

from ogmkit.errors import CheckpointError, SettingsError
from ogmkit.grid import GridSpec
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.data.loader import EpochBatches, loader
from ogmkit.learn.data.sequences import SequenceDataset
from ogmkit.learn.predict.run import open_run
from ogmkit.learn.systems.planning import pooled
from ogmkit.learn.systems.registry import build_system
from ogmkit.learn.training.train import train
from ogmkit.metrics.linear import fit_linear_plan
from ogmkit.samples.index import index_sequences
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards.manifest import read_manifest

CAMERAS = ("CAM_FRONT",)
PLANNERS = [name for name, entry in CATALOGUE.items() if entry.plans]
SEEING = ("holistic", "holistic-cv")
TINY = {"image_size": (64, 96), "encoder": "tu-test_resnet", "masks": "surface", "warp": "surface"}


def settings_of(system, **values):
    """Settings of a system, among values for several."""
    entry = CATALOGUE[system]
    return entry.settings(**entry.read({"workers": 0, **TINY, **values}))


def system(shards, name, **more):
    grid = read_manifest(shards).settings.targets.grid
    torch.manual_seed(1)
    return build_system(settings_of(name, **more), grid, CAMERAS)


def batch_of(shards, net, size=4):
    index = index_sequences(shards, ("scene-0001",), CAMERAS, needs=net.spec)
    batches = EpochBatches(len(index), size, seed=0, shuffle=False)
    return next(iter(loader(SequenceDataset(index, net.spec), batches, workers=0)))


def loss_of(net, batch):
    return sum(net.losses(net.answer(batch), batch).values())


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    ("name", "more"),
    [
        *((name, {}) for name in PLANNERS),
        ("mid-to-end", {"no_past": True}),
        ("holistic", {"no_past": True}),
        *((name, {"no_destination": True}) for name in PLANNERS),
    ],
)
def test_each_planner_learns_with_all_its_weights(plan_shards, name, more):
    # timm's smallest encoder begins with weights of 0 behind others, which learn nothing then
    net = system(plan_shards, name, **more, encoder="resnet18")
    points = 6 if more.get("no_destination") else 5
    batch = batch_of(plan_shards, net)
    loss_of(net, batch).backward()
    assert [key for key, weight in net.named_parameters() if not weight.grad.any()] == []
    plan = net.eval().predict(batch).plan
    assert plan.mean.shape == (4, points, 2)
    net.update_score(net.answer(batch), batch)
    error_m = (plan.mean - batch["future"][:, :points]).norm(dim=-1)
    scores = net.scores()
    assert float(scores["ade"]) == pytest.approx(float(error_m.detach().mean()), rel=1e-5)
    assert float(scores["last_m"]) == pytest.approx(float(error_m[:, -1].detach().mean()), rel=1e-5)
    shown = net.pictures(batch)
    assert all(pixels.shape[::3] == (4, 3) for _, pixels in shown.panels)
    expected = [f"ADE {one:.2f} m" for one in error_m.detach().mean(1).tolist()]
    assert [*shown.scores] == expected


def test_the_mean_that_is_learnt_from_training_sequences_is_their_linear_plan(plan_shards):
    net = system(plan_shards, "lstm-ed", mean="linear")
    batch = batch_of(plan_shards, net)
    net.prepare([batch])
    torch.nn.init.zeros_(net.planner.head[-1].weight)
    torch.nn.init.zeros_(net.planner.head[-1].bias)

    positions, future = (batch[name].double().numpy() for name in ("positions", "future"))
    plan = fit_linear_plan(positions, future[:, 5], future[:, :5])
    found = net.eval().predict(batch).plan.mean.detach()
    np.testing.assert_allclose(found, plan(positions, future[:, 5]), atol=1e-4)
    assert np.ptp(found.numpy(), axis=0).max() > 0.01  # or one plan would do for all


@pytest.mark.parametrize("name", ["mid-to-end", "holistic-cv"])
def test_without_the_past_the_plan_does_not_depend_on_it(plan_shards, name):
    net = system(plan_shards, name, no_past=True).eval()
    batch = batch_of(plan_shards, net)
    moved = {**batch, "positions": batch["positions"] + 3}
    assert torch.equal(net.predict(batch).plan.mean, net.predict(moved).plan.mean)


@pytest.mark.parametrize("name", ["lstm-ed", "mid-to-end", "holistic"])
def test_the_targets_are_never_looked_at_but_the_destination(plan_shards, name):
    net = system(plan_shards, name).eval()
    batch = batch_of(plan_shards, net)
    other = batch["future"].clone()
    other[:, :5] += 7
    assert torch.equal(net.predict(batch).plan.mean, net.predict({**batch, "future": other}).plan.mean)
    other[:, 5] += 1
    assert not torch.equal(net.predict(batch).plan.mean, net.predict({**batch, "future": other}).plan.mean)


@pytest.mark.parametrize("name", ["lstm-ed", "mid-to-end"])
def test_without_the_destination_nothing_of_the_future_is_looked_at(plan_shards, name):
    net = system(plan_shards, name, no_destination=True).eval()
    batch = batch_of(plan_shards, net)
    assert torch.equal(
        net.predict(batch).plan.mean,
        net.predict({**batch, "future": torch.full_like(batch["future"], torch.nan)}).plan.mean,
    )


@pytest.mark.sampled(1)
@pytest.mark.parametrize("name", SEEING)
def test_the_motion_alone_teaches_the_perception(plan_shards, name):
    net = system(plan_shards, name, encoder="resnet18")
    batch = batch_of(plan_shards, net)
    net.losses(net.answer(batch), batch)["motion"].backward()
    reached = [weight.grad is not None and bool(weight.grad.any()) for weight in net.perception.parameters()]
    assert np.mean(reached) > 0.9


def test_gradients_through_the_warp_are_those_of_finite_differences(plan_shards):
    net = system(plan_shards, "holistic", hidden=16).double().eval()
    batch = {
        key: value.double() if value.is_floating_point() else value
        for key, value in batch_of(plan_shards, net, size=1).items()
    }

    def motion():
        return net.losses(net.answer(batch), batch)["motion"]

    motion().backward()
    for head in net.perception.heads:
        for weight, place in ((head.bias, (0,)), (head.weight, (0, 3, 0, 0))):
            found, step = float(weight.grad[place]), 1e-5
            with torch.no_grad():
                weight[place] += step
                above = float(motion())
                weight[place] -= 2 * step
                below = float(motion())
                weight[place] += step
            assert found == pytest.approx((above - below) / (2 * step), rel=1e-4, abs=1e-9)
            assert found != 0


def test_masks_are_pooled_to_means_of_their_parts():
    torch.manual_seed(0)
    masks = torch.rand(12, 2, 40, 30).round()
    found = pooled(masks, 310).reshape(2, 6, 2, 20, 15)
    by_hand = masks.reshape(2, 6, 2, 20, 2, 15, 2).mean((4, 6))
    torch.testing.assert_close(found, by_hand)
    assert torch.equal(pooled(masks, 10_000).flatten(), masks.flatten())  # never enlarged


@pytest.mark.parametrize(("cells", "as_read"), [(310, True), (700, False), (10_000, True)])
def test_true_masks_are_pooled_alike_as_they_are_read_and_in_the_network(plan_shards, cells, as_read):
    net = system(plan_shards, "mid-to-end", pool_cells=cells)
    batch, whole = batch_of(plan_shards, net), SampleSpec(bev_cell_m=0.5, bev=True)
    assert ("bev_parts" in batch) is as_read
    index = index_sequences(plan_shards, ("scene-0001",), CAMERAS, needs=net.spec)
    masks = torch.stack([SequenceDataset(index, whole)[i]["bev"] for i in range(4)])
    features = net.observed(batch)["features"]
    assert features.shape == (4, 6, net.feature_size())
    torch.testing.assert_close(features.flatten(0, 1), pooled(masks.flatten(0, 1), cells))


def test_masks_in_camera_view_and_on_the_plane_give_a_planner_as_many_numbers():
    on_the_plane, in_camera_view = (
        build_system(settings_of(name, image_size=(448, 800)), GridSpec(), CAMERAS) for name in SEEING
    )
    assert on_the_plane.feature_size() == in_camera_view.feature_size() == 2 * 5500


@pytest.mark.parametrize("name", ["lstm-ed", "holistic-cv"])
def test_plans_are_worked_out_in_32_bits_where_all_else_has_16(plan_shards, name):
    net = system(plan_shards, name).eval()
    batch = batch_of(plan_shards, net)
    net.prepare([batch])
    far = {**batch, "positions": 1000 * batch["positions"]}  # saturates what 16 bits would round to ±1
    with torch.no_grad(), torch.autocast("cpu", torch.bfloat16):
        assert torch.isfinite(loss_of(net, far))
        seen = net.observed(batch)
        found = net.answer(batch)["mean"]
    features = seen["features"].float() if seen else None
    expected = net.planner(features, batch["positions"], batch["future"][:, 5]).mean
    assert torch.equal(found, expected)


def test_a_frozen_perception_stays(plan_shards, tmp_path, make_run):
    grid = read_manifest(plan_shards).settings.targets.grid
    stage_1 = make_run(tmp_path / "footprints", "footprints", grid, CAMERAS)
    there = open_run(stage_1 / "best.ckpt").model.state_dict()
    few = {"epochs": 2, "batch_size": 2, "lr": 1e-3, "perception": str(stage_1)}
    for freeze in (("perception",), ()):
        run = tmp_path / f"freeze-{len(freeze)}"
        train(settings_of("holistic", **few, freeze=freeze), plan_shards, run)
        found = open_run(run / "last.ckpt").model.perception.state_dict()
        alike = [torch.equal(value, there[f"net.{key}"]) for key, value in found.items()]
        assert all(alike) is bool(freeze)


@pytest.mark.parametrize(
    ("more", "error", "message"),
    [
        ({"encoder": "resnet34"}, SettingsError, "--encoder tu-test_resnet"),
        ({"decoder_width": 48}, SettingsError, "has decoder_width 256, not 48; choose --decoder-width 256"),
        ({"perception": "nowhere"}, CheckpointError, "nowhere"),
        ({"grid": GridSpec(0.5, 90, 60, 90.0, 34.0)}, SettingsError, "grid.rows is 90 here"),
        ({"stage_1": "oft"}, CheckpointError, "run of oft"),
    ],
    ids=["encoder", "decoders", "absent", "grid", "system"],
)
def test_a_perception_that_does_not_fit_is_named(tmp_path, plan_shards, make_run, more, error, message):
    grid = more.pop("grid", read_manifest(plan_shards).settings.targets.grid)
    run = make_run(tmp_path / "stage-1", more.pop("stage_1", "footprints"), grid, CAMERAS)
    chosen = {"system": "holistic", "perception": str(run)} | more
    with pytest.raises(error, match=message):
        train(settings_of(**chosen), plan_shards, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_plans_are_predicted_in_order_and_alike_in_any_batch(plan_shards, tmp_path, make_run):
    grid = read_manifest(plan_shards).settings.targets.grid
    path = make_run(tmp_path / "run", "holistic", grid, CAMERAS, warp="surface")
    run = open_run(path)
    scenes = ("scene-0002", "scene-0001")
    index = index_sequences(plan_shards, scenes, CAMERAS, needs=run.model.spec, valid_only=False)
    assert run.name == "holistic"
    one, many = (list(run.plans(index, run.warps_by(None), batch_size=size, workers=0)) for size in (1, 5))
    places = [(plan.scene, plan.frame) for plan in many]
    assert places == [(scene, frame) for scene in ("scene-0002", "scene-0001") for frame in range(6, 10)]
    for ours, theirs in zip(one, many, strict=True):
        np.testing.assert_allclose(ours.plan.mean, theirs.plan.mean, atol=1e-4)
        np.testing.assert_allclose(ours.plan.sigma, theirs.plan.sigma, atol=1e-4)

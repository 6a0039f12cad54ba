import numpy as np
import pytest
import torch

from ogmkit.errors import SettingsError
from ogmkit.footprints.warp import warp_to_bev
from ogmkit.geometry.camera import image_from_ground
from ogmkit.grid import GridSpec
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.systems.registry import build_system

GRID = GridSpec(0.5, 20, 24, 20.0, 10.0)
CAMERAS = ("CAM_BACK", "CAM_FRONT")
SIZE = (64, 96)
STAGE_1 = [name for name, entry in CATALOGUE.items() if not entry.plans]


def system(name, **more):
    chosen = {
        "image_size": SIZE,
        "encoder": "tu-test_resnet",
        "masks": "surface",
        "channels": 16,
        "blocks": 1,
    }
    entry = CATALOGUE[name]
    return build_system(entry.settings(**(entry.read(chosen) | more)), GRID, CAMERAS)


def batch_of(net, frames=3):
    """Random frames that hold all that any system asks for."""
    torch.manual_seed(4)
    rows, columns = getattr(net, "own_grid", GRID).shape
    level_from_camera = torch.tensor(
        [[0.0, 0, 1, 1], [-1, 0, 0, 0], [0, -1, 0, 1.5], [0, 0, 0, 1]], dtype=torch.float64
    )
    intrinsics = torch.tensor([[60.0, 0, 47.5], [0, 60, 31.5], [0, 0, 1]], dtype=torch.float64)
    ground = image_from_ground(intrinsics.numpy(), level_from_camera.numpy())
    bev_from_image = GRID.bev_from_level @ np.linalg.inv(ground)
    homography = torch.from_numpy(bev_from_image / abs(bev_from_image[2, 2]))
    return {
        "image": torch.rand(frames, 3, *SIZE),
        "masks": torch.rand(frames, 2, *SIZE).round(),
        "bev": torch.rand(frames, 2, rows, columns).round(),
        "bev_known": torch.ones(frames, rows, columns),
        "lidar": torch.rand(frames, 3, rows, columns),
        "bev_from_image": homography.repeat(frames, 1, 1),
        "homography_valid": torch.ones(frames, dtype=torch.bool),
        "intrinsics": intrinsics.repeat(frames, 1, 1),
        "level_from_camera": level_from_camera.repeat(frames, 1, 1),
        "camera": torch.zeros(frames, dtype=torch.int64),
        "index": torch.arange(frames),
    }


@pytest.mark.parametrize("name", [name for name in STAGE_1 if name != "homography"])
def test_predictions_are_probabilities_on_the_shards_grid(name):
    net = system(name).eval()
    with torch.inference_mode():
        found = net.predict(batch_of(net))
    assert found.bev.shape == (3, 2, 20, 24)
    assert float(found.bev.min()) >= 0
    assert float(found.bev.max()) <= 1


def test_coarse_predictions_are_repeated():
    net = system("oft").eval()
    with torch.inference_mode():
        bev = net.predict(batch_of(net)).bev
    assert net.own_grid.shape == (10, 12)
    assert torch.equal(bev[..., ::2, ::2], bev[..., 1::2, 1::2])


class Drawing(torch.nn.Module):
    """A network whose answer is a rectangle, whatever it sees."""

    def forward(self, image):
        logits = torch.full((len(image), 2, *SIZE), -20.0)
        logits[..., 34:60, 30:70] = 20.0
        return logits


def test_footprints_go_to_the_plane_as_the_core_warps_them():
    net = system("footprints").eval()
    net.net = Drawing()
    batch = batch_of(net)
    found = net.predict(batch)
    image = (found.image[0, 1] > 0.5).numpy().astype("uint8")
    expected = warp_to_bev(image, batch["bev_from_image"][0].numpy(), GRID.shape)
    assert 0.1 < expected.mean() < 0.9
    assert (expected != (found.bev[0, 1] > 0.5).numpy()).mean() < 0.02
    assert net.predict({"image": batch["image"]}).bev is None


def test_the_models_of_ved_share_nothing():
    net = system("ved", bev_cell_m=1.0)
    batch = batch_of(net)
    net.losses(net.answer(batch), batch)["drivable"].backward()
    touched = {name.split(".")[1] for name, weight in net.named_parameters() if weight.grad.any()}
    assert touched == {"drivable"}


def test_trained_side_by_side_ved_is_as_trained_apart():
    both, alone = system("ved", bev_cell_m=1.0).eval(), system("ved", bev_cell_m=1.0).eval()
    alone.load_state_dict(both.state_dict())
    batch = batch_of(both)
    for net, names in ((both, ("drivable", "vehicles")), (alone, ("vehicles",))):
        optimizer = torch.optim.SGD(net.parameters(), 0.1, momentum=0.9)
        for _ in range(3):
            optimizer.zero_grad()
            terms = net.losses(net.answer(batch), batch)
            sum(terms[name] for name in names).backward()
            optimizer.step()
    for left, right in zip(
        both.nets["vehicles"].parameters(), alone.nets["vehicles"].parameters(), strict=True
    ):
        assert torch.equal(left, right)


def test_the_loss_in_bev_is_an_option_and_reaches_the_network():
    net = system("footprints", bev_loss=True)
    assert (net.spec.bev, net.spec.homography) == (True, "surface")
    assert not system("footprints").spec.bev
    batch = batch_of(net)
    terms = net.losses(net.answer(batch), batch)
    terms["bev"].backward()
    assert all(weight.grad is not None for weight in net.parameters())
    assert any(float(weight.grad.abs().sum()) for weight in net.parameters())


@pytest.mark.parametrize("name", STAGE_1)
def test_unknown_cells_and_scores(name):
    net = system(name)
    batch = batch_of(net)
    if name == "homography":
        net.code.load_state_dict(
            type(net.code)
            .fit(
                batch["bev_from_image"] * (1 + 1e-3 * torch.rand(3, 3, 3)),
                batch["camera"] + torch.tensor([0, 1, 0]),
                2,
                SIZE,
                net.grid,
            )
            .state_dict()
        )
    net.update_score(net.answer(batch), batch)
    scores = net.scores()
    assert net.score_name in scores
    assert all(bool(torch.isfinite(value)) for value in scores.values())


def test_cells_that_a_flip_brought_in_do_not_count():
    net = system("oft")
    batch = batch_of(net)
    half = batch["bev_known"].clone()
    half[:, :, 6:] = 0
    other = {**batch, "bev_known": half, "bev": batch["bev"].clone()}
    other["bev"][..., 6:] = 1 - other["bev"][..., 6:]
    answer = net.answer(batch)
    known = {**batch, "bev_known": half}
    assert torch.equal(net.losses(answer, known)["perception"], net.losses(answer, other)["perception"])
    net.update_score(answer, known)
    expected = net.scores()
    net.update_score(answer, other)
    assert net.scores() == expected


def test_cameras_are_found_by_name():
    net = system("homography")
    batch = {"camera": torch.tensor([0, 1, 0])}
    assert net.camera_indices(batch, ("CAM_FRONT", "CAM_BACK")).tolist() == [1, 0, 1]
    with pytest.raises(SettingsError, match="CAM_LEFT is unknown to this run"):
        net.camera_indices(batch, ("CAM_LEFT", "CAM_BACK"))


def test_a_grid_that_cells_do_not_divide_is_refused():
    with pytest.raises(SettingsError, match=r"0\.7"):
        system("oft", bev_cell_m=0.7)

import pickle

import pytest
import torch

from ogmkit.errors import CheckpointError, SettingsError
from ogmkit.grid import GridSpec
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.checkpoints import Card, load_system, read_checkpoint
from ogmkit.learn.predict.run import open_run, require_grid, require_system
from ogmkit.learn.runs import checkpoint_file
from ogmkit.learn.systems.registry import build_system

GRID = GridSpec(0.5, 40, 30, 40.0, 17.0)
CAMERAS = ("CAM_BACK", "CAM_FRONT")


def save(path, system="homography", **more):
    entry = CATALOGUE[system]
    settings = entry.settings(
        **entry.read({"image_size": (64, 96), "encoder": "resnet18", "masks": "surface"})
    )
    net = build_system(settings, GRID, CAMERAS)
    content = {"state_dict": net.state_dict(), "ogmkit": Card(settings, GRID, CAMERAS).to_dict()}
    torch.save(content | more, path)
    return net


class Bomb:
    """Unpickling this would create a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


def test_a_system_comes_back_with_its_weights(tmp_path):
    net = save(tmp_path / "a.ckpt")
    card, found = load_system(tmp_path / "a.ckpt")
    assert (card.grid, card.cameras, card.settings.system) == (GRID, CAMERAS, "homography")
    assert not found.training
    for name, value in net.state_dict().items():
        assert torch.equal(found.state_dict()[name].nan_to_num(), value.nan_to_num()), (
            name
        )  # factors are not fitted


def test_the_best_checkpoint_of_a_run_is_taken(tmp_path):
    save(tmp_path / "last.ckpt")
    assert checkpoint_file(tmp_path).name == "last.ckpt"
    save(tmp_path / "best.ckpt")
    assert checkpoint_file(tmp_path).name == "best.ckpt"
    assert open_run(tmp_path).checkpoint.name == "best.ckpt"


def test_a_pickle_is_refused_and_not_run(tmp_path):
    path, victim = tmp_path / "a.ckpt", tmp_path / "victim"
    path.write_bytes(pickle.dumps({"state_dict": {}, "ogmkit": Bomb(victim)}))
    with pytest.raises(CheckpointError, match="more than weights and plain values; nothing of it was run"):
        read_checkpoint(path)
    torch.save({"state_dict": {}, "ogmkit": Bomb(victim)}, path)
    with pytest.raises(CheckpointError, match="nothing of it was run"):
        read_checkpoint(path)
    assert not victim.exists()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"state_dict": {}}, "not a checkpoint of ogmkit"),
        ([1, 2], "not a checkpoint of ogmkit"),
        ({"state_dict": {}, "ogmkit": {"format_version": 1}}, "format 1, not 2; train again"),
        ({"state_dict": {}, "ogmkit": {"format_version": 99}}, "format 99, not 2"),
        ({"state_dict": {}, "ogmkit": {"format_version": 2}}, "says of itself is damaged"),
    ],
)
def test_foreign_checkpoints_are_named(tmp_path, content, message):
    torch.save(content, tmp_path / "a.ckpt")
    with pytest.raises(CheckpointError, match=message):
        read_checkpoint(tmp_path / "a.ckpt")


def test_damage_is_named(tmp_path):
    path = tmp_path / "a.ckpt"
    save(path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(CheckpointError, match="is damaged"):
        read_checkpoint(path)
    with pytest.raises(CheckpointError, match="can't be read"):
        read_checkpoint(tmp_path / "absent.ckpt")
    with pytest.raises(CheckpointError, match="not a checkpoint, and holds none"):
        checkpoint_file(tmp_path / "absent")


def test_weights_of_another_system_are_named(tmp_path):
    net = build_system(CATALOGUE["oft"].settings(image_size=(64, 96), channels=16, blocks=1), GRID, CAMERAS)
    save(tmp_path / "a.ckpt", state_dict=net.state_dict())
    with pytest.raises(CheckpointError, match="its weights are no homography"):
        load_system(tmp_path / "a.ckpt")


def test_another_system_or_grid_is_refused(tmp_path, learn_shards):
    save(tmp_path / "best.ckpt")
    run = open_run(tmp_path)
    require_system(run, "homography")
    with pytest.raises(CheckpointError, match="is a run of homography, not of oft"):
        require_system(run, "oft")
    with pytest.raises(SettingsError, match=r"grid\.rows is 40 here but 80 there"):
        require_grid(run, learn_shards)

import errno
import io
import os
import pickle
import random
from pathlib import Path

import pytest
import torch

from ogmkit.errors import CheckpointError, OutputError, SettingsError
from ogmkit.grid import GridSpec
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.checkpoints import Card, read_checkpoint, write_checkpoint
from ogmkit.learn.checksums import add_checksum
from ogmkit.learn.predict.run import open_run, require_grid, require_system
from ogmkit.learn.runs import checkpoint_file
from ogmkit.learn.systems.registry import build_system

GRID = GridSpec(0.5, 40, 30, 40.0, 17.0)
CAMERAS = ("CAM_BACK", "CAM_FRONT")


def save(path, system="homography", **more):
    entry = CATALOGUE[system]
    settings = entry.settings(
        **entry.read({"image_size": (64, 96), "encoder": "tu-test_resnet", "masks": "surface"})
    )
    net = build_system(settings, GRID, CAMERAS)
    content = {"state_dict": net.state_dict(), "ogmkit": Card(settings, GRID, CAMERAS).to_dict()}
    write_checkpoint(path, content | more)
    return net


def checksummed(path):
    """Give a file that torch wrote the checksum of a checkpoint."""
    with path.open("r+b") as file:
        add_checksum(file)


def test_equal_content_gives_equal_bytes_however_it_came_about(tmp_path):
    """Texts and tuples may be one object, or several that are equal."""
    one, pair = "step", (0.9, 0.999)
    state = torch.nn.BatchNorm1d(2).state_dict()
    for name, step, betas in (("a", one, pair), ("b", "".join(["st", "ep"]), (*pair[:1], 0.999))):
        more = {step: betas, "other": pair}
        write_checkpoint(tmp_path / name, {one: {one: 1}, "more": more, "state": state})
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    found = torch.load(tmp_path / "a", weights_only=True)
    assert found["more"] == {"step": pair, "other": pair}
    assert found["state"]._metadata == state._metadata


class Bomb:
    """Unpickling this would create a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


def test_a_system_comes_back_with_its_weights(tmp_path):
    net = save(tmp_path / "a.ckpt")
    run = open_run(tmp_path / "a.ckpt")
    card, found = run.card, run.model
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
    with pytest.raises(CheckpointError, match=r"carries no checksum: .*nothing of it was run"):
        read_checkpoint(path)
    torch.save({"state_dict": {}, "ogmkit": Bomb(victim)}, path)
    checksummed(path)
    with pytest.raises(CheckpointError, match="more than weights and plain values; nothing of it was run"):
        read_checkpoint(path)
    assert not victim.exists()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"state_dict": {}}, "not a checkpoint of ogmkit"),
        ([1, 2], "not a checkpoint of ogmkit"),
        ({"state_dict": {}, "ogmkit": {"format_version": 1}}, "format 1, not 4; train again"),
        ({"state_dict": {}, "ogmkit": {"format_version": 99}}, "format 99, not 4"),
        ({"state_dict": {}, "ogmkit": {"format_version": 4}}, "says of itself is damaged"),
    ],
)
def test_foreign_checkpoints_are_named(tmp_path, content, message):
    write_checkpoint(tmp_path / "a.ckpt", content)
    with pytest.raises(CheckpointError, match=message):
        read_checkpoint(tmp_path / "a.ckpt")


@pytest.mark.parametrize("wrong", [{"batches": float("inf")}, {"epoch": None}, {"step_s": "soon"}])
def test_numbers_that_are_none_are_named(tmp_path, wrong):
    save(tmp_path / "a.ckpt")
    _, content = read_checkpoint(tmp_path / "a.ckpt")
    write_checkpoint(tmp_path / "a.ckpt", content | {"ogmkit": content["ogmkit"] | wrong})
    with pytest.raises(CheckpointError, match="says of itself is damaged"):
        read_checkpoint(tmp_path / "a.ckpt")


def test_damage_is_named(tmp_path):
    path = tmp_path / "a.ckpt"
    save(path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(CheckpointError, match="carries no checksum: cut short"):
        read_checkpoint(path)
    path.write_bytes(b"")
    with pytest.raises(CheckpointError, match="carries no checksum: cut short"):
        read_checkpoint(path)
    with pytest.raises(CheckpointError, match="can't be read"):
        read_checkpoint(tmp_path / "absent.ckpt")
    with pytest.raises(CheckpointError, match="not a checkpoint, and holds none"):
        checkpoint_file(tmp_path / "absent")


def test_every_flipped_bit_is_found(tmp_path):
    path = tmp_path / "best.ckpt"
    save(path)
    sound = path.read_bytes()
    chosen, whole = random.Random(0), range(8 * len(sound))
    last = range(8 * (len(sound) - 110), 8 * len(sound))  # the archive's end and the checksum itself
    for bit in (*chosen.sample(whole, 20), *chosen.sample(last, 10)):
        damaged = bytearray(sound)
        damaged[bit // 8] ^= 1 << bit % 8
        path.write_bytes(damaged)
        with pytest.raises(CheckpointError, match="checksum"):
            open_run(path)
    path.write_bytes(sound)
    assert open_run(path).system == "homography"


def test_equal_content_gives_equal_bytes_whatever_the_file_is_called(tmp_path):
    for name in ("a.ckpt", "other.ckpt"):
        write_checkpoint(tmp_path / name, {"state_dict": {"a": torch.arange(7.0)}})
    assert (tmp_path / "a.ckpt").read_bytes() == (tmp_path / "other.ckpt").read_bytes()


def test_torch_reads_a_checkpoint_by_itself(tmp_path):
    write_checkpoint(tmp_path / "a.ckpt", {"state_dict": {"a": torch.arange(7.0)}})
    for mapped in (False, True):
        content = torch.load(tmp_path / "a.ckpt", weights_only=True, mmap=mapped)
        assert torch.equal(content["state_dict"]["a"], torch.arange(7.0))


class FullDisk(io.FileIO):
    """A file whose n-th write is refused, and no other."""

    def __init__(self, path, mode, refused):
        super().__init__(path, mode)
        self._left = refused

    def write(self, data):
        self._left -= 1
        if self._left == 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return super().write(data)


@pytest.mark.parametrize("refused", [1, 2, 5, 13])
def test_a_full_disk_is_named_and_the_old_checkpoint_stays(tmp_path, monkeypatch, refused):
    path = tmp_path / "a.ckpt"
    path.write_bytes(b"before")
    with monkeypatch.context() as patched:
        patched.setattr(Path, "open", lambda path, mode: FullDisk(path, mode, refused))
        with pytest.raises(OutputError, match=r"a\.ckpt: can't be written: No space left on device"):
            write_checkpoint(path, {"state_dict": {"a": torch.arange(70_000.0)}})
    assert {one.name: one.read_bytes() for one in tmp_path.iterdir()} == {"a.ckpt": b"before"}


def test_weights_of_another_system_are_named(tmp_path):
    net = build_system(CATALOGUE["oft"].settings(image_size=(64, 96), channels=16, blocks=1), GRID, CAMERAS)
    save(tmp_path / "a.ckpt", state_dict=net.state_dict())
    with pytest.raises(CheckpointError, match="its weights are no homography"):
        _ = open_run(tmp_path / "a.ckpt").model


def test_another_system_or_grid_is_refused(tmp_path, learn_shards):
    save(tmp_path / "best.ckpt")
    run = open_run(tmp_path)
    require_system(run, "homography")
    with pytest.raises(CheckpointError, match="is a run of homography, not of oft"):
        require_system(run, "oft")
    with pytest.raises(SettingsError, match=r"grid\.rows is 40 here but 80 there"):
        require_grid(run, learn_shards)

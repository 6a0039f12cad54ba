"""The examples run as a newcomer calls them, and do what they say."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.verify import verify_folder

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
DRIVES = ("drive-1", "drive-2")
PARTS = {"homography": "net.encoder.", "holistic": "planner."}
"""What trainings of the demo take from their starts where that isn't all; holistic has footprints, too."""
ROAD_M, EGO_M = (35.5, 44.5), 42.2
"""Radii of own_dataset.py's ring road, inner and outer edge, and of the ego on it."""


def run(name, *arguments):
    command = [sys.executable, EXAMPLES / name, *arguments]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    """What own_dataset.py writes."""
    out = tmp_path_factory.mktemp("examples") / "own"
    assert run("own_dataset.py", out) == ""
    return out


def test_a_dataset_of_ones_own_becomes_sound_shards(own):
    assert verify_folder(own / "shards") == ()
    manifest = read_manifest(own / "shards")
    assert {entry.scene: entry.splits for entry in manifest.shards} == {
        "drive-1": ("train",),
        "drive-2": ("val",),
    }
    for drive in DRIVES:
        with Shard(own / "shards" / f"{drive}.h5") as shard:
            # Twenty key frames less six before and six after.
            assert shard.dataset("CAM_FRONT", "trajectory/valid")[:].sum() == 8
            assert shard.dataset("CAM_FRONT", "homography/surface/valid")[:].all()


def test_its_rasters_show_the_ring_road_and_the_cars(own):
    with Shard(own / "shards" / "drive-2.h5") as shard:
        drivable = shard.dataset("CAM_FRONT", "drivable")[8]
        vehicles = shard.dataset("CAM_FRONT", "vehicles")[8]
    rows, columns = np.indices(drivable.shape)
    x_ahead_m, y_left_m = 0.25 * (160 - rows - 0.5), 0.25 * (60 - columns - 0.5)
    # The ring's centre is to the left of the ego, whatever its heading.
    distance_m = np.hypot(x_ahead_m, EGO_M - y_left_m)
    expected = (distance_m > ROAD_M[0]) & (distance_m < ROAD_M[1])
    assert (drivable == expected).mean() > 0.99
    assert 0.25**2 * vehicles.sum() == pytest.approx(2 * 1.9 * 4.6, rel=0.1)
    # The car ahead is 0.3 rad on.
    row, column = 160 - EGO_M * np.sin(0.3) / 0.25, 60 - EGO_M * (1 - np.cos(0.3)) / 0.25
    assert vehicles[round(row), round(column)]


def test_its_pictures_are_drawn(own):
    names = {f"{drive}_CAM_FRONT{ending}.png" for drive in DRIVES for ending in ("", "_footprints_surface")}
    assert {path.name for path in (own / "pictures").iterdir()} == names
    for name in names:
        assert cv2.imread(str(own / "pictures" / name)).std() > 10


needs_torch = pytest.mark.skipif(
    importlib.util.find_spec("torch") is None, reason="torch is not installed: pip install 'ogmkit[train]'"
)


@needs_torch
def test_the_demo_s_starts_are_small_and_hold_what_its_networks_need():
    yaml = pytest.importorskip("yaml", reason="yaml is not installed: pip install 'ogmkit[train]'")
    from ogmkit.learn.checkpoints import read_checkpoint
    from ogmkit.learn.systems.registry import build_system
    from ogmkit.workflow.reading import config_of

    path = EXAMPLES / "demo.yaml"
    trainings = config_of(yaml.safe_load(path.read_text(encoding="utf-8")), path).trainings
    files = set()
    for one in trainings:
        files.add(Path(one.settings.init))
        card, content = read_checkpoint(Path(one.settings.init))
        own = {
            name: value.shape
            for name, value in build_system(one.settings, card.grid, card.cameras).state_dict().items()
        }
        there = {name: value.shape for name, value in content["state_dict"].items()}
        part = PARTS.get(one.name, "")
        assert {name: shape for name, shape in own.items() if name.startswith(part)} == {
            name: shape for name, shape in there.items() if name.startswith(part)
        }
    assert files == set((path.parents[1] / "fixtures" / "demo-start").iterdir())
    assert sum(file.stat().st_size for file in files) < 3_000_000


@needs_torch
def test_a_network_of_all_cameras_learns_from_key_frames(surround_shards):
    lines = run("surround_network.py", surround_shards, 30).splitlines()
    losses = [float(re.fullmatch(r"step \d+: loss (\S+)", line)[1]) for line in lines]
    assert len(losses) == 3
    assert losses[-1] < 0.8 * losses[0]


@needs_torch
def test_a_network_of_ones_own_learns_from_them(own):
    lines = run("own_network.py", own / "shards", 3).splitlines()
    found = [re.fullmatch(r"epoch \d: loss (\S+), IoU (\S+) and (\S+)", line) for line in lines]
    losses, drivable, vehicles = np.array([match.groups() for match in found], dtype=float).T
    assert len(losses) == 3
    assert losses[-1] < losses[0]
    assert drivable[-1] > drivable[0]
    assert ((vehicles >= 0) & (vehicles <= 1)).all()

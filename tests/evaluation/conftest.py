"""Shards on an off-centre grid, and runs that need no torch: their predictions are what a test says."""

import json
import shutil
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from ogmkit.footprints.settings import FootprintSettings
from ogmkit.grid import GridSpec
from ogmkit.learn.data.index import index_frames
from ogmkit.learn.data.spec import SampleSpec
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.extract import extract
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.pipeline.render_footprints import render_footprints
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.settings import ExtractSettings
from ogmkit.targets import TargetSettings

GRID = GridSpec(0.5, 140, 60, 136.0, 34.0)
CAMERAS = ("CAM_FRONT", "CAM_BACK")


@pytest.fixture(scope="session")
def eval_shards(tmp_path_factory, tiny_dataroot):
    """Two scenes (train, val) of eight frames of two cameras; tests only read them."""
    folder = tmp_path_factory.mktemp("evaluation")
    out = folder / "shards"
    settings = ExtractSettings(TargetSettings(GRID), CAMERAS)
    with Dataset(tiny_dataroot) as dataset:
        scenes, splits = dataset.scene_names(), dataset.splits()
        extract(dataset, out, settings, scenes=scenes, splits=splits, cache_dir=folder / "cache")
    fit_shards(out, ("surface", "calibration"))
    render_footprints(out, FootprintSettings(scale=2.0))
    return out


@pytest.fixture
def own_shards(tmp_path, eval_shards):
    """A copy that a test may spoil."""
    return shutil.copytree(eval_shards, tmp_path / "shards")


@pytest.fixture
def both_splits(tmp_path, eval_shards):
    """A split file: both scenes are in `val`, none in `train`."""
    path = tmp_path / "splits.json"
    path.write_text(json.dumps({"val": [entry.scene for entry in read_manifest(eval_shards).shards]}))
    return path


@pytest.fixture
def true_frame():
    """Masks of a frame: `true_frame(shards, scene, camera, index)` → drivable, vehicles, in view."""

    def read(shards, scene, camera, index):
        with Shard(shards / f"{scene}.h5") as shard:
            names = ("drivable", "vehicles", "field_of_view")
            return tuple(shard.dataset(camera, name)[index] > 0 for name in names)

    return read


@pytest.fixture
def fake_runs(tmp_path, monkeypatch):
    """`fake_runs(name, system, predict, masks=None, …)` makes a RUN; returns its path.

    `predict(place)` gives BEV probabilities and, or None, those in camera view.
    """
    runs = {}

    def open_run(path):
        return runs[path]

    def predict_frames(run, shards, scenes, cameras, *, homography, batch_size, workers, limit):
        run.calls.append((homography, batch_size, workers))
        index = index_frames(shards, scenes, cameras, needs=SampleSpec(), limit=limit)
        for place in map(index.place, range(len(index))):
            bev, image = run.predict(place)
            scene, camera, frame = place
            yield SimpleNamespace(scene=scene, camera=camera, frame=frame, bev=bev, image=image)

    module = ModuleType("ogmkit.learn.inference")
    module.open_run, module.predict_frames = open_run, predict_frames
    monkeypatch.setitem(sys.modules, "ogmkit.learn.inference", module)

    def make(name, system="ved", predict=None, masks=None, grid=GRID, cameras=CAMERAS, has_bev=True):
        path = tmp_path / "runs" / name
        path.mkdir(parents=True)
        nothing = np.zeros((2, *grid.shape), np.float32)
        runs[path] = SimpleNamespace(
            checkpoint=path / "best.ckpt",
            system=system,
            masks=masks,
            grid=grid,
            cameras=cameras,
            model=SimpleNamespace(has_bev=has_bev),
            predict=predict or (lambda place: (nothing, None)),
            calls=[],
        )
        return path

    make.opened = runs
    return make

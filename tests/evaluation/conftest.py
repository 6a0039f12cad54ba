"""Shards on an off-centre grid, and runs that need no torch: their predictions are what a test says."""

import json
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from ogmkit.footprints.settings import FootprintSettings
from ogmkit.grid import GridSpec
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.extract import extract
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.pipeline.render_footprints import render_footprints
from ogmkit.shards.manifest import AMENDING, read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.settings import ExtractSettings
from ogmkit.target_settings import TargetSettings

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
    """A copy that a test may change; marked, so that sizes are not compared with the manifest's."""
    out = shutil.copytree(eval_shards, tmp_path / "shards")
    (out / AMENDING).write_text('{"command": "homography-fit"}')
    return out


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
def fake_runs(tmp_path):
    """`fake_runs(name, system, predict, masks=None, …)` makes an opened run.

    `predict(place)` gives BEV probabilities and, or None, those in camera view.
    """

    def make(name, system="ved", predict=None, masks=None, **options):
        grid = options.get("grid", GRID)
        path = tmp_path / "runs" / name
        path.mkdir(parents=True)
        nothing = np.zeros((2, *grid.shape), np.float32)
        calls = []

        def frames(index, homography, *, batch_size, workers):
            calls.append((homography, batch_size, workers))
            for place in map(index.place, range(len(index))):
                bev, image = predict(place) if predict else (nothing, None)
                scene, camera, frame = place
                yield SimpleNamespace(scene=scene, camera=camera, frame=frame, bev=bev, image=image)

        return SimpleNamespace(
            step_s=0.5,
            path=path,
            checkpoint=path / "best.ckpt",
            system=system,
            name=system,
            masks=masks,
            frames=frames,
            calls=calls,
            **{"output": "grids", "thresholds": None, "grid": GRID, "cameras": CAMERAS} | options,
        )

    return make

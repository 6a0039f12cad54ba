"""Each system can learn four frames by heart: the least that loss, target and network owe each other."""

import pytest
import torch

from ogmkit.footprints.settings import FootprintSettings
from ogmkit.grid import GridSpec
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.loader import EpochBatches, loader
from ogmkit.learn.predict.run import open_run
from ogmkit.learn.training.train import train
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.extract import extract
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.pipeline.render_footprints import render_footprints
from ogmkit.samples.index import index_frames
from ogmkit.shards.settings import ExtractSettings
from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings
from ogmkit.target_settings import TargetSettings

pytestmark = pytest.mark.slow

COMMON = {
    "cameras": ("CAM_FRONT",),
    "image_size": (96, 160),
    "encoder": "resnet18",
    "batch_size": 4,
    "limit_frames": 4,
    "optimizer": "adamw",
    "lr": 2e-3,
    "schedule": "cosine",
    "checkpoint_every": 10_000,
}


def settings_of(system, **values):
    """Settings of a system, among values for several."""
    entry = CATALOGUE[system]
    return entry.settings(**entry.read({"workers": 0, **COMMON, **values}))


@pytest.fixture(scope="module")
def shards(tmp_path_factory):
    """Two scenes, train and val, in traffic and on hills: frames show vehicles, and homographies differ."""
    folder = tmp_path_factory.mktemp("overfit")
    world, out = folder / "world", folder / "shards"
    cameras = COMMON["cameras"]
    traffic = SynthesisSettings(
        scenes=2, frames=8, seed=1, cameras=cameras, image_size=(180, 320), relief_m=2.0
    )
    synthesize(world, traffic)
    settings = ExtractSettings(TargetSettings(GridSpec(0.5, 80, 60, 80.0, 34.0), lidar=True), cameras)
    with Dataset(world) as dataset:
        scenes, splits = dataset.scene_names(), dataset.splits()
        extract(dataset, out, settings, scenes=scenes, splits=splits, cache_dir=folder / "cache")
    fit_shards(out, ("surface",))
    for method in ("warp", "full-body"):
        render_footprints(out, FootprintSettings(method=method, scale=1.0))
    return out


def learnt(tmp_path, shards, settings):
    """Scores of the last state on the frames that it was trained on."""
    run = tmp_path / "run"
    train(settings, shards, run)
    system = open_run(run / "last.ckpt").model
    index = index_frames(shards, ("scene-0001",), ("CAM_FRONT",), needs=system.spec, limit=4)
    frames = FrameDataset(index, system.spec)
    for batch in loader(frames, EpochBatches(4, 4, seed=0, shuffle=False), workers=0):
        with torch.inference_mode():
            system.update_score(system.answer(batch), batch)
            prediction = system.predict(batch)
    return {name: float(value) for name, value in system.scores().items()}, system, batch, prediction


@pytest.mark.parametrize(
    ("system", "more"),
    [
        # DeepLab's heads draw at a quarter of the image's size: vehicles far away need some pixels.
        ("footprints", {"epochs": 200, "image_size": (128, 224)}),
        ("footprints", {"epochs": 200, "image_size": (128, 224), "masks": "full-body"}),
        ("ved", {"epochs": 300, "bev_cell_m": 1.0}),
        # Cells out of sight are learnt, too: as many blocks as published, so that cells in sight reach them.
        ("oft", {"epochs": 600, "channels": 64, "blocks": 8}),
        ("bev-lidar", {"epochs": 200, "bev_cell_m": 0.5}),
    ],
    ids=lambda value: value if isinstance(value, str) else value.get("masks", ""),
)
def test_four_frames_are_learnt_by_heart(tmp_path, shards, system, more):
    settings = settings_of(system, **more)
    scores, net, batch, _ = learnt(tmp_path, shards, settings)
    assert bool(net.truth(batch)[0][:, 1].flatten(1).any(1).all())
    assert min(scores["iou_drivable"], scores["iou_vehicles"]) >= 0.9, scores


@pytest.mark.parametrize("head", ["entries", "four-point"])
def test_four_homographies_are_learnt_by_heart(tmp_path, shards, head):
    settings = settings_of("homography", epochs=200, head=head)
    scores, system, batch, prediction = learnt(tmp_path, shards, settings)
    ahead = torch.tensor([20.0, 0.0, 1.0], dtype=torch.float64)
    place = torch.from_numpy(system.grid.bev_from_level) @ ahead
    pixels = torch.linalg.solve(batch["bev_from_image"], place.expand(4, 3))
    found = (prediction.bev_from_image @ pixels[..., None])[..., 0]
    error_m = (found[:, :2] / found[:, 2:] - place[:2]).norm(dim=1) * system.grid.m_per_cell
    assert float(error_m.max()) < 0.5, error_m
    assert scores["error_m"] < 0.5

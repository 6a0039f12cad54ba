"""Shards of a dataset that a benchmark has made."""

from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.extract import extract
from ogmkit.shards.settings import ExtractSettings


def extracted(dataroot, out, settings=None):
    """Extract all scenes of a dataset to `out`, decoded maps beside it; returns the scenes' names."""
    settings = settings or ExtractSettings()
    with Dataset(dataroot) as dataset:
        scenes, cache = dataset.scene_names(), out.parent / "cache"
        extract(dataset, out, settings, scenes=scenes, splits=dataset.splits(), cache_dir=cache)
    return scenes

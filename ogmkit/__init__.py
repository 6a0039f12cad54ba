"""Exact bird's-eye-view ground truth from nuScenes-style datasets.

The names of `__all__` are the library's public face, described in docs/api.md; each is imported when it is
first used. Samples as tensors are in `ogmkit.torch`, the classes of errors in `ogmkit.errors`.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ogmkit.base.execution import Execution
    from ogmkit.errors import OgmkitError
    from ogmkit.footprints.settings import FootprintSettings
    from ogmkit.footprints.warp import warp_to_bev, warp_to_image
    from ogmkit.frames import Boxes, FrameRecord, LidarRecord, SceneRecord, neighbours
    from ogmkit.geometry.se3 import pose_matrix
    from ogmkit.grid import GridSpec
    from ogmkit.homography.points import homography_from_points
    from ogmkit.homography.settings import FitSettings
    from ogmkit.metrics.bootstrap import Estimate
    from ogmkit.metrics.scores import IouTally, displacement_errors
    from ogmkit.nuscenes.dataset import Dataset
    from ogmkit.pictures.preview import preview
    from ogmkit.pictures.settings import PreviewSettings
    from ogmkit.pipeline.extract import extract
    from ogmkit.pipeline.homography_fit import fit_shards
    from ogmkit.pipeline.render_footprints import render_footprints
    from ogmkit.pipeline.sources import RecordDataset
    from ogmkit.samples.index import FrameIndex, index_frames, index_sequences
    from ogmkit.samples.spec import SampleSpec
    from ogmkit.samples.splits import Division, divide_scenes, split_scenes
    from ogmkit.shards.folder import ShardFolder
    from ogmkit.shards.reader import Shard
    from ogmkit.shards.settings import ExtractSettings
    from ogmkit.shards.verify import verify_folder
    from ogmkit.target_settings import TargetSettings
    from ogmkit.targets import FrameTargets, frame_targets

__version__ = "0.2.0"

_HOMES = {
    "base.execution": ("Execution",),
    "errors": ("OgmkitError",),
    "footprints.settings": ("FootprintSettings",),
    "footprints.warp": ("warp_to_bev", "warp_to_image"),
    "frames": ("Boxes", "FrameRecord", "LidarRecord", "SceneRecord", "neighbours"),
    "geometry.se3": ("pose_matrix",),
    "grid": ("GridSpec",),
    "homography.points": ("homography_from_points",),
    "homography.settings": ("FitSettings",),
    "metrics.bootstrap": ("Estimate",),
    "metrics.scores": ("IouTally", "displacement_errors"),
    "nuscenes.dataset": ("Dataset",),
    "pictures.preview": ("preview",),
    "pictures.settings": ("PreviewSettings",),
    "pipeline.extract": ("extract",),
    "pipeline.homography_fit": ("fit_shards",),
    "pipeline.render_footprints": ("render_footprints",),
    "pipeline.sources": ("RecordDataset",),
    "samples.index": ("FrameIndex", "index_frames", "index_sequences"),
    "samples.spec": ("SampleSpec",),
    "samples.splits": ("Division", "divide_scenes", "split_scenes"),
    "shards.folder": ("ShardFolder",),
    "shards.reader": ("Shard",),
    "shards.settings": ("ExtractSettings",),
    "shards.verify": ("verify_folder",),
    "target_settings": ("TargetSettings",),
    "targets": ("FrameTargets", "frame_targets"),
}
"""Module → its public names: the imports above, for when the program runs (a test compares)."""

__all__ = [
    "Boxes",
    "Dataset",
    "Division",
    "Estimate",
    "Execution",
    "ExtractSettings",
    "FitSettings",
    "FootprintSettings",
    "FrameIndex",
    "FrameRecord",
    "FrameTargets",
    "GridSpec",
    "IouTally",
    "LidarRecord",
    "OgmkitError",
    "PreviewSettings",
    "RecordDataset",
    "SampleSpec",
    "SceneRecord",
    "Shard",
    "ShardFolder",
    "TargetSettings",
    "displacement_errors",
    "divide_scenes",
    "extract",
    "fit_shards",
    "frame_targets",
    "homography_from_points",
    "index_frames",
    "index_sequences",
    "neighbours",
    "pose_matrix",
    "preview",
    "render_footprints",
    "split_scenes",
    "verify_folder",
    "warp_to_bev",
    "warp_to_image",
]


def __getattr__(name: str) -> object:
    for module, names in _HOMES.items():
        if name in names:
            found: object = getattr(importlib.import_module(f"{__name__}.{module}"), name)
            globals()[name] = found
            return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

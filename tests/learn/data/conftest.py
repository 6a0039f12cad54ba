"""Shards of the tiny dataset on a small grid, the ego off its middle, with all that samples may hold."""

import shutil

import pytest

from ogmkit.footprints.settings import FootprintSettings
from ogmkit.grid import GridSpec
from ogmkit.homography.settings import FitSettings
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.extract import extract
from ogmkit.pipeline.homography_fit import fit_shards
from ogmkit.pipeline.render_footprints import render_footprints
from ogmkit.shards.settings import ExtractSettings
from ogmkit.targets import TargetSettings

GRID = GridSpec(0.5, 60, 40, 60.0, 15.0)
CAMERAS = ("CAM_BACK", "CAM_FRONT")


@pytest.fixture(scope="session")
def grid():
    return GRID


@pytest.fixture(scope="session")
def make_shards(tiny_dataroot, tmp_path_factory):
    """A folder of shards of the tiny dataset."""

    def make(**targets):
        out = tmp_path_factory.mktemp("shards") / "out"
        settings = ExtractSettings(TargetSettings(GRID, **targets), CAMERAS)
        with Dataset(tiny_dataroot) as dataset:
            scenes, splits = dataset.scene_names(), dataset.splits()
            cache = tmp_path_factory.mktemp("cache")
            extract(dataset, out, settings, scenes=scenes, splits=splits, cache_dir=cache)
        return out

    return make


@pytest.fixture(scope="session")
def shards(make_shards):
    """Two scenes of eight frames, two cameras, images of 90 × 160, masks of 45 × 80.

    Homographies by `calibration` are in all frames, those by `dlt` in some. Tests only read it.
    """
    out = make_shards(lidar=True)
    fit_shards(out, ["surface", "calibration"])
    fit_shards(out, ["dlt"], FitSettings(min_points=12))
    for settings in (
        FootprintSettings("calibration"),
        FootprintSettings("dlt"),
        FootprintSettings("calibration", scale=0.7, name="large"),
    ):
        render_footprints(out, settings)
    return out


@pytest.fixture
def copied(shards, tmp_path):
    """A copy of the shards, to be changed."""
    return shutil.copytree(shards, tmp_path / "out")

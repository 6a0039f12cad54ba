"""What extraction tests share: a small grid, one decoded-mask store, and a look into a folder."""

import hashlib

import pytest

from ogmkit.grid import GridSpec
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.extract import extract
from ogmkit.shards.settings import ExtractSettings
from ogmkit.target_settings import TargetSettings


@pytest.fixture(scope="session")
def small_settings():
    return ExtractSettings(TargetSettings(GridSpec(0.5, 60, 40, 60.0, 20.0)), ("CAM_FRONT", "CAM_BACK"))


@pytest.fixture(scope="session")
def mask_cache(tmp_path_factory):
    return tmp_path_factory.mktemp("mask-cache")


@pytest.fixture
def dataset(tiny_dataroot):
    with Dataset(tiny_dataroot) as dataset:
        yield dataset


@pytest.fixture
def run(dataset, small_settings, mask_cache):
    """`extract` with the small settings and all scenes, unless told otherwise."""

    def call(out, settings=small_settings, **options):
        options.setdefault("scenes", dataset.scene_names())
        options.setdefault("splits", dataset.splits())
        source = options.pop("dataset", dataset)
        return extract(source, out, settings, cache_dir=mask_cache, **options)

    return call


@pytest.fixture(scope="session")
def digests():
    """File name → SHA-256 of all files of a folder, hidden ones too."""

    def read(out):
        return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in out.iterdir()}

    return read


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory, tiny_dataroot, small_settings, mask_cache):
    """A folder that one run made; tests only read it."""
    out = tmp_path_factory.mktemp("undisturbed") / "out"
    with Dataset(tiny_dataroot) as dataset:
        scenes, splits = dataset.scene_names(), dataset.splits()
        extract(dataset, out, small_settings, scenes=scenes, splits=splits, cache_dir=mask_cache)
    return out

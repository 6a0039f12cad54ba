"""The shards that tests of samples share, by short names."""

import shutil

import pytest

from ogmkit.grid import GridSpec


@pytest.fixture(scope="session")
def grid():
    return GridSpec(0.5, 60, 40, 60.0, 15.0)


@pytest.fixture(scope="session")
def make_shards(make_sample_shards):
    return make_sample_shards


@pytest.fixture(scope="session")
def shards(sample_shards):
    return sample_shards


@pytest.fixture
def copied(shards, tmp_path):
    """A copy of the shards, to be changed."""
    return shutil.copytree(shards, tmp_path / "out")

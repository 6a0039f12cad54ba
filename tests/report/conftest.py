"""Shards with names that would break a careless page."""

import shutil
from dataclasses import replace

import h5py
import pytest

from ogmkit.shards.manifest import read_manifest, write_manifest

HOSTILE = """</script><img src=x onerror="document.title='broken'"> & 'more'"""
"""A scene's name, in a manifest and a shard."""


@pytest.fixture(scope="session")
def hostile_scene():
    return HOSTILE


@pytest.fixture(scope="session")
def hostile_shards(shared_folder, sample_shards):
    """The sample shards, the first scene with a hostile name and a reason with another; only read."""

    def fill(folder):
        out = shutil.copytree(sample_shards, folder / "out")
        manifest = read_manifest(out)
        path = out / manifest.shards[0].file
        with h5py.File(path, "r+") as h5:
            h5.attrs["scene"] = HOSTILE
            h5["CAM_FRONT/homography/dlt/reason"][0] = "<b onclick=x>too few</b>"
            h5["CAM_FRONT/homography/dlt/valid"][0] = False
        first = replace(manifest.shards[0], scene=HOSTILE, bytes=path.stat().st_size)
        write_manifest(out, replace(manifest, shards=(first, *manifest.shards[1:])))

    return shared_folder("hostile", fill) / "out"

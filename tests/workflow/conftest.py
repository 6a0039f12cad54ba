"""A small chain, run once; tests copy it before they change anything."""

import copy
from pathlib import Path

import pytest

from ogmkit.shards.manifest import read_manifest
from ogmkit.workflow.reading import config_of

VALUES = {
    "extract": {"grid": {"m_per_cell": 0.5, "rows": 80, "columns": 60, "ego_column": 34}},
    "homography_fit": {"methods": ["surface"]},
    "render_footprints": {"scale": 1, "sets": ["surface"]},
    "train": {
        "encoder": "tu-test_resnet",
        "image_size": [64, 96],
        "batch_size": 2,
        "epochs": 1,
        "max_steps": 1,
        "limit_frames": 2,
    },
    "homography": {"head": "four-point"},
    "footprints": {},
    "planners": ["lstm-ed", {"system": "mid-to-end", "pool_cells": 48}],
    "evaluate": {"samples": 1, "limit": 4},
}


@pytest.fixture(scope="session")
def world(plan_shards):
    """A dataset of two scenes, train and val."""
    return Path(read_manifest(plan_shards).dataroot)


@pytest.fixture(scope="session")
def chain_config(world):
    """A configuration: `chain_config(out, train={"lr": 0.1}, …)`; sections are merged into the small one's.

    Those that `without` names are left out.
    """

    def make(out, without=(), **changes):
        values = copy.deepcopy(VALUES) | {"data": str(world), "out": str(out)}
        for name in without:
            del values[name]
        for name, value in changes.items():
            merged = isinstance(value, dict) and isinstance(values.get(name), dict)
            values[name] = values[name] | value if merged else value
        return config_of(values, out.parent / "chain.yaml")

    return make


@pytest.fixture(autouse=True, scope="session")
def _cache(tmp_path_factory):
    """Decoded maps go to a folder of the tests' own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session")
def finished(shared_folder, chain_config):
    """The folder of a chain that is done; tests only read it."""
    pytest.importorskip("torch", reason="torch is not installed: pip install 'ogmkit[train]'")
    import torch

    from ogmkit.workflow.chain import run_chain

    torch.set_num_threads(1)
    return shared_folder("chain", lambda folder: run_chain(chain_config(folder / "out"))) / "out"

"""What a changed setting does to the trainings of a run."""

from pathlib import Path
from types import NoneType
from typing import Literal, get_args, get_origin, get_type_hints

import pytest

from ogmkit.learn.catalogue import CATALOGUE, all_settings, readers
from ogmkit.workflow.config import ELSEWHERE
from ogmkit.workflow.reading import config_of
from ogmkit.workflow.training import Train

EVERYTHING = {
    "data": "world",
    "out": "out",
    "extract": {"lidar": True},
    "homography": {},
    "footprints": {},
    "baselines": ["ved", "oft", "bev-lidar"],
    "planners": ["lstm-ed", "end-to-end", "mid-to-end", "holistic", "holistic-cv"],
}
CHANGED = {
    "cameras": ["CAM_FRONT"],
    "train_split": "other",
    "val_split": "other",
    "image_size": [64, 96],
    "encoder": "resnet34",
    "encoder_weights": "imagenet",
    "masks": "full-body",
    "target": "dlt",
    "warp": "dlt",
    "blocks": 3,
    "bev_cell_m": 2.0,
    "perception": None,
    "init": __file__,  # its checksum counts, nothing more
    "freeze": ["perception"],
    "precision": "bf16-mixed",
}
HOW = {"workers", "cache_samples", "checkpoint_every"}
"""Settings that don't decide what comes out."""


def fingerprints(**values):
    config = config_of({**EVERYTHING, **values}, Path("folder/chain.yaml"))
    return {one.name: dict(Train(config, one).settings) for one in config.trainings}


def other_value(name):
    """A value that is not a system's default."""
    if name in CHANGED:
        return CHANGED[name]
    cls = CATALOGUE[readers(name)[0]].settings
    hint, default = get_type_hints(cls)[name], getattr(cls(), name)
    kind = next((one for one in get_args(hint) if one is not NoneType), hint) if default is None else hint
    if get_origin(kind) is Literal:
        return next(one for one in get_args(kind) if one != default)
    return {bool: True, int: 77, float: 0.37}[kind]


@pytest.mark.parametrize("name", [name for name in all_settings() if name not in ELSEWHERE])
def test_a_shared_setting_changes_the_trainings_that_read_it_and_no_other(name):
    before, after = fingerprints(), fingerprints(train={name: other_value(name)})
    changed = {system for system in before if before[system] != after[system]}
    assert changed == (set() if name in HOW else set(readers(name)))


def test_every_system_is_in_this_test():
    assert set(fingerprints()) == set(CATALOGUE)

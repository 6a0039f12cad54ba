"""The official splits are the devkit's."""

import pytest
from nuscenes.utils.splits import create_splits_scenes

from ogmkit.nuscenes.splits import OFFICIAL


@pytest.mark.parametrize("split", ["train", "val", "mini_train", "mini_val"])
def test_official_split_is_the_devkits(split):
    assert sorted(OFFICIAL[split]) == sorted(create_splits_scenes()[split])

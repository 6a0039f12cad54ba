"""The sheet of all cameras: images round the raster, and what is refused."""

import numpy as np
import pytest

from ogmkit.errors import SettingsError
from ogmkit.pictures.canvas import PAGE
from ogmkit.pictures.cells import DRIVABLE_COLOUR, VEHICLE_COLOUR
from ogmkit.pictures.preview import preview
from ogmkit.pictures.settings import PreviewSettings
from ogmkit.pictures.surround import draw_surround
from ogmkit.shards.reader import Shard


def test_a_file_for_each_scene(surround_shards, tmp_path):
    settings = PreviewSettings(("surround", "targets"), frames=1)
    written = preview(surround_shards, tmp_path, settings, scenes=["scene-0002"])
    assert [path.name for path in written] == [
        "scene-0002_CAM_BACK.png",
        "scene-0002_CAM_FRONT.png",
        "scene-0002_SURROUND.png",
    ]


def test_images_stand_ahead_and_behind_of_the_raster(surround_shards):
    with Shard(surround_shards / "scene-0001.h5") as shard:
        sheet = draw_surround(shard, 1)
    # A tile stands 44 px below the heading's 144, 40 px from the left; images are 225 × 400.
    tile = sheet[188:, 40:]
    ahead, behind = tile[30:225, 470:850], tile[720:910, 470:850]
    raster = tile[237:700, 412:912].reshape(-1, 3)
    assert ahead.std() > 10
    assert behind.std() > 10
    assert np.abs(ahead[:190].astype(int) - behind).mean() > 5
    for colour in (DRIVABLE_COLOUR, VEHICLE_COLOUR):
        assert (raster == colour).all(axis=1).any()
    assert (tile[300:700, :400] == PAGE).all()  # no camera looks to the side


def test_without_the_labels_the_command_is_named(sample_shards, tmp_path):
    with pytest.raises(
        SettingsError, match="has no labels surround; extract with --definition paper,surround"
    ):
        preview(sample_shards, tmp_path, PreviewSettings(("surround",)))

"""The sheet of all cameras: images round the raster, and what is refused."""

import re

import numpy as np
import pytest

from ogmkit.drawing.palette import THEMES
from ogmkit.errors import SettingsError, ShardError
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


@pytest.mark.parametrize(("theme", "colours"), THEMES.items(), ids=THEMES)
def test_images_stand_ahead_and_behind_of_the_raster(surround_shards, theme, colours):
    with Shard(surround_shards / "scene-0001.h5") as shard:
        sheet = draw_surround(shard, PreviewSettings(frames=1, theme=theme))
    # A tile stands 36 px below the heading, 40 px from the left; images are 225 × 400, titles 36 px high.
    tile = sheet[180:, 40:]
    ahead, behind = tile[40:250, 470:850], tile[895:1105, 470:850]
    raster = tile[309:840, 412:912].reshape(-1, 3)
    assert ahead.std() > 10
    assert behind.std() > 10
    assert np.abs(ahead.astype(int) - behind).mean() > 5
    for colour in (colours.drivable, colours.vehicle):
        assert (raster == colour).all(axis=1).any()
    assert (tile[300:700, :400] == colours.page).all()  # no camera looks to the side
    titles = (tile[:30], tile[275:305], tile[853:885])
    assert all((part == colours.text).all(axis=-1).any() for part in titles)


def test_without_the_labels_the_command_is_named(sample_shards, tmp_path):
    with pytest.raises(
        SettingsError, match="has no labels surround; extract with --definition paper,surround"
    ):
        preview(sample_shards, tmp_path, PreviewSettings(("surround",)))


def test_a_damaged_part_is_one_line(surround_shards, monkeypatch):
    def broken(*arguments, **options):
        raise OSError("filter returned failure during read")

    monkeypatch.setattr("ogmkit.pictures.surround.read_view", broken)
    path = surround_shards / "scene-0001.h5"
    with Shard(path) as shard, pytest.raises(ShardError, match=re.escape(str(path))):
        draw_surround(shard, PreviewSettings(frames=1))

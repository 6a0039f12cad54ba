"""Scores over cells that no box hides, and over those that LiDAR reaches."""

import numpy as np

from ogmkit.evaluation.evaluate import evaluate
from ogmkit.evaluation.formats import report_of
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.shards.reader import Shard


def test_each_kind_of_cells_has_its_figures(seen_shards):
    found = evaluate(seen_shards, settings=EvaluateSettings(split="val"))
    figures = {
        one.cells: one.value
        for one in found.figures
        if (one.system, one.target, one.view, one.region, one.metric)
        == ("all-drivable", "drivable", "bev", "full", "foreground_iou")
    }
    assert list(figures) == ["all", "fov", "rays", "lidar"]
    counted = dict.fromkeys(figures, 0)
    drivable = dict.fromkeys(figures, 0)
    with Shard(seen_shards / "scene-0002.h5") as shard:
        for camera in shard.cameras:
            truth = shard.dataset(camera, "drivable")[:] > 0
            names = {"fov": "field_of_view", "rays": "seen/rays", "lidar": "seen/lidar"}
            masks = {kind: shard.dataset(camera, name)[:] > 0 for kind, name in names.items()}
            for kind, mask in {"all": np.ones_like(truth), **masks}.items():
                counted[kind] += np.count_nonzero(mask)
                drivable[kind] += np.count_nonzero(mask & truth)
    assert counted["all"] > counted["fov"] > counted["rays"] > counted["lidar"] > 0
    for kind, value in figures.items():
        np.testing.assert_allclose(value, drivable[kind] / counted[kind])


def test_tables_name_them(seen_shards, sample_shards):
    titles = [table.title for table in report_of(evaluate(seen_shards)).tables]
    assert sum("cells in view that no box hides" in title for title in titles) == 2
    assert sum("cells in view as far as LiDAR points" in title for title in titles) == 2
    assert not [one for one in evaluate(sample_shards).figures if one.cells not in ("all", "fov")]

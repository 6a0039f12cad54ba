"""Examples of predictions, by runs that are no networks."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ogmkit.report.predictions import NONE, PICTURES, predict_examples
from ogmkit.report.thumbnails import PLANE_BYTES
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard


def true_masks(folder, scene, camera, index):
    """(2, rows, columns) drivable area and vehicles, and the field of view."""
    with Shard(folder / f"{scene}.h5") as shard:
        names = ("drivable", "vehicles", "field_of_view")
        drivable, vehicles, seen = (shard.dataset(camera, name)[index] for name in names)
    return np.stack([drivable, vehicles]), seen > 0


class Shifted:
    """Predicts the truth, ten columns to the right."""

    path = checkpoint = Path("runs/shifted")
    system = name = "oft"
    output, masks, thresholds = "grids", None, None
    cameras = ("CAM_FRONT",)

    def __init__(self, folder):
        self.folder = folder
        self.grid = read_manifest(folder).settings.targets.grid

    def grids(self, place):
        return np.roll(true_masks(self.folder, *place)[0], 10, axis=2).astype(np.float32)

    def frames(self, index, homography, *, batch_size, workers):
        for number in range(len(index)):
            place = index.place(number)
            yield SimpleNamespace(
                scene=place[0], camera=place[1], frame=place[2], bev=self.grids(place), image=None
            )


@pytest.fixture(scope="module")
def run(sample_shards):
    return Shifted(sample_shards)


def test_ious_in_view_are_those_of_numpy(run, sample_shards):
    told = []
    found = predict_examples(sample_shards, [run], 3, on_progress=lambda *counts: told.append(counts))
    assert told == [(1, 3), (2, 3), (3, 3)]
    assert found.heading.startswith("3 frames of split val, threshold 0.5")
    assert len(found.by_frame) == 3
    for place, (one,) in found.by_frame.items():
        true, seen = true_masks(sample_shards, *place)
        predicted = run.grids(place) > 0.5
        assert place[1] == "CAM_FRONT"
        assert one.run == "oft"
        for share, mask, other in zip(one.iou, true > 0, predicted, strict=True):
            union = np.count_nonzero((mask | other) & seen)
            expected = np.count_nonzero(mask & other & seen) / union if union else np.nan
            assert share == pytest.approx(expected, nan_ok=True)
        assert len(one.pictures) == PICTURES
        assert all(len(picture) <= 4 * PLANE_BYTES / 3 + 4 for picture in one.pictures)
    assert found.characters == sum(
        len(picture) for (one,) in found.by_frame.values() for picture in one.pictures
    )


def test_without_runs_or_frames_there_is_nothing(run, sample_shards):
    assert predict_examples(sample_shards, [], 3) is NONE
    assert predict_examples(sample_shards, [run], 0) is NONE

"""Key frames five times as often: neighbours are found by time."""

import shutil

import numpy as np
import pytest

from ogmkit.errors import TrainingError
from ogmkit.geometry.se3 import transform_points
from ogmkit.grid import GridSpec
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.extract import extract
from ogmkit.samples.index import index_sequences
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards.crosschecks import cross_problems
from ogmkit.shards.reader import Shard
from ogmkit.shards.settings import ExtractSettings
from ogmkit.target_settings import TargetSettings

SCENE, CAMERA = "scene-0001", "CAM_FRONT"
GRID = GridSpec(0.5, 20, 16, 20.0, 6.0)


@pytest.fixture(scope="module")
def fast_root(tiny_dataroot, tmp_path_factory, edit_table):
    """The tiny dataset, its clock five times as slow: eight key frames a scene, about 0.1 s apart."""
    root = tmp_path_factory.mktemp("fast") / "root"
    shutil.copytree(tiny_dataroot, root)

    def slow_down(rows):
        start_us = 1_500_000_000_000_000
        for row in rows:
            row["timestamp"] = start_us + (row["timestamp"] - start_us) // 5

    for table in ("sample", "sample_data", "ego_pose"):
        edit_table(root, table, slow_down)
    return root


@pytest.fixture(scope="module")
def shards(fast_root, tmp_path_factory):
    """Write shards of a root with a step: `shards(step_s, root)`; returns the folder and the summary."""

    def write(step_s, root=fast_root):
        out = tmp_path_factory.mktemp("shards") / "out"
        settings = ExtractSettings(TargetSettings(GRID, step_s=step_s, images="none"), (CAMERA,))
        with Dataset(root) as dataset:
            return out, extract(dataset, out, settings, scenes=(SCENE,), splits={})

    return write


def test_at_ten_hertz_a_step_of_half_a_second_is_five_frames(shards):
    out, summary = shards(0.5)

    with Shard(out / f"{SCENE}.h5") as shard:
        future, past = (shard.dataset(CAMERA, f"trajectory/{name}")[:] for name in ("future", "past"))
        positions = shard.dataset(CAMERA, "global_from_ego")[:, :3, 3]
        level_from_global = shard.dataset(CAMERA, "level_from_global")[:]
        assert cross_problems(shard, CAMERA) == ()
    for frame in range(3):
        expected = transform_points(level_from_global[frame], positions[frame + 5 : frame + 6])[0, :2]
        np.testing.assert_allclose(future[frame, 0], expected, rtol=0, atol=1e-9)
    assert np.isnan(future[:, 1:]).all()  # a scene of 0.7 s
    assert np.isnan(past[:3]).all()
    assert np.isfinite(past[3:, 5]).all()
    typical, shortest, longest = summary.step_s
    assert shortest <= typical <= longest
    assert shortest >= 0.25
    assert longest <= 0.75
    with pytest.raises(TrainingError, match="0 have 5 images before it without a gap"):
        index_sequences(out, [SCENE], [CAMERA], needs=SampleSpec(), whole_trajectory=False)


def test_a_step_of_a_tenth_gives_what_half_a_second_gives_of_the_original(shards, tiny_dataroot):
    (fast, summary), (original, _) = shards(0.1), shards(0.5, tiny_dataroot)

    for name in ("past", "future"):
        found = []
        for out in (fast, original):
            with Shard(out / f"{SCENE}.h5") as shard:
                found.append(shard.dataset(CAMERA, f"trajectory/{name}")[:])
        np.testing.assert_array_equal(*found)
        assert np.isfinite(found[0]).any()
    with Shard(fast / f"{SCENE}.h5") as shard:
        times_s = np.diff(shard.dataset(CAMERA, "timestamp_us")[:]) / 1e6
        attributes = shard.attributes(CAMERA)
    expected = (np.median(times_s), times_s.min(), times_s.max())
    assert tuple(attributes[name] for name in ("step_s", "step_min_s", "step_max_s")) == expected
    assert summary.step_s == expected
    index = index_sequences(fast, [SCENE], [CAMERA], needs=SampleSpec(), whole_trajectory=False)
    assert index.rows.tolist() == [[0, 1, 2, 3, 4, 5], [1, 2, 3, 4, 5, 6], [2, 3, 4, 5, 6, 7]]
    assert index.step_s == 0.1

"""Planning scores by name, of plans whose scores are known."""

import json
import math
import re

import h5py
import numpy as np
import pytest

from ogmkit.errors import ShardError
from ogmkit.evaluation.planning.evaluate import evaluate_plans
from ogmkit.evaluation.planning.named_report import named_tables
from ogmkit.evaluation.planning.obstacles import CameraObstacles
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.metrics.plan import Plan
from ogmkit.shards.reader import Shard

FRAME = 7
"""Its sixth point is the 14th frame's, the last one."""


def scored(shards, runs=(), **options):
    return evaluate_plans(shards, runs, EvaluateSettings(samples=0, **options))


def named(found, system, definition, metric):
    """Horizon → value."""
    return {
        one.horizon_s: one.value
        for one in found.named
        if (one.system, one.definition, one.metric) == (system, definition, metric)
    }


def known(values):
    """Figures but for those that aren't defined."""
    return [value for value in values.values() if not math.isnan(value)]


def test_a_planner_off_by_5_m_has_no_figure_at_3_s(shards, fake_planners, driven):
    def plan(place):
        return Plan(driven(shards, place)[:5] + np.array([3.0, -4.0]), np.ones((5, 2)), np.zeros(5))

    found = scored(shards, [fake_planners("run", plan=plan)])

    for definition in ("uniad", "stp3", "vad"):
        values = named(found, "lstm-ed", definition, "l2")
        assert list(values) == [1.0, 2.0, 3.0]
        assert known(values) == pytest.approx([5.0, 5.0])
        assert math.isnan(named(found, "lstm-ed", definition, "collision")[3.0])
    assert found.untold == ("truth", "constant-velocity", "ego-status")


def test_a_planner_that_is_not_told_has_all_figures_among_its_like(shards, fake_planners, driven):
    def plan(place):
        return Plan(driven(shards, place) + np.array([3.0, -4.0]), np.ones((6, 2)), np.zeros(6))

    found = scored(shards, [fake_planners("run", "lstm-ed-nd", plan), fake_planners("other")])

    for definition in ("uniad", "stp3", "vad"):
        assert list(named(found, "lstm-ed-nd", definition, "l2").values()) == pytest.approx([5.0] * 3)
        assert known(named(found, "lstm-ed-nd", definition, "collision")) == [0.0] * 3
    assert len(known(named(found, "lstm-ed-nd", "exact", "edge_crossing"))) == 3
    assert found.untold == ("lstm-ed-nd", "truth", "constant-velocity", "ego-status")
    assert found.systems == ("lstm-ed-nd", "lstm-ed")

    untold = [table for table in named_tables(found) if "not told it" in table.title]
    assert [[row[0] for row in table.systems] for table in untold] == [["lstm-ed-nd"]] * 3
    assert "–" not in {cell for table in untold for row in table.systems for cell in row}
    told = [table for table in named_tables(found) if table not in untold]
    assert [[row[0] for row in table.systems] for table in told] == [["lstm-ed"]] * 3
    assert all(row[-1] == "–" for table in told for row in table.systems)


def test_a_planner_that_is_not_told_competes_with_its_like_alone(shards, fake_planners, driven):
    def plan(place):
        return Plan(driven(shards, place) + np.array([3.0, -4.0]), np.ones((6, 2)), np.zeros(6))

    found = scored(shards, [fake_planners("run", "lstm-ed-nd", plan), fake_planners("other")])
    notes = [note for note in found.notes if "beat" in note or "not told" in note]
    assert notes == [
        "lstm-ed does not beat constant-velocity, straight-line, cubic, linear by ADE up to 2.5 s: no result",
        "lstm-ed-nd: is not told the destination; compare it with rows that aren't either",
        "lstm-ed-nd does not beat constant-velocity, ego-status by mean L2 up to 3 s: no result",
    ]


def test_both_readings_of_driving_on(shards, driven):
    errors = []
    for scene in ("scene-0002", "scene-0003"):
        with h5py.File(shards / f"{scene}.h5") as h5:
            past = h5["CAM_FRONT/trajectory/past"][6:9]
        for frame, step in zip((6, 7, 8), -past[:, -1], strict=True):
            future = driven(shards, (scene, "CAM_FRONT", frame))
            errors.append(np.linalg.norm(step * np.arange(1, 7)[:, None] - future, axis=1))
    errors = np.mean(errors, axis=0)
    found = scored(shards)

    at, mean = (named(found, "constant-velocity", name, "l2") for name in ("uniad", "vad"))
    assert list(at.values()) == pytest.approx(errors[[1, 3, 5]])
    assert list(mean.values()) == pytest.approx([errors[:n].mean() for n in (2, 4, 6)])
    assert mean == named(found, "constant-velocity", "stp3", "l2")
    assert set(named(found, "truth", "uniad", "l2").values()) == {0.0}


def test_ego_status_is_least_squares_from_the_past_alone(shards):
    with h5py.File(shards / "scene-0001.h5", "r+") as h5:
        future = h5["CAM_FRONT/trajectory/future"]
        future[...] += np.random.default_rng(0).normal(0, 0.1, future.shape)

    def read(scene):
        with h5py.File(shards / f"{scene}.h5") as h5:
            past, future = (h5[f"CAM_FRONT/trajectory/{name}"][6:9] for name in ("past", "future"))
        return past.reshape(3, -1), future.reshape(3, -1)

    past, future = read("scene-0001")
    weights = np.linalg.pinv(past - past.mean(0), rcond=1e-6) @ (future - future.mean(0))
    errors = []
    for scene in ("scene-0002", "scene-0003"):
        new, truth = read(scene)
        planned = future.mean(0) + (new - past.mean(0)) @ weights
        errors.append(np.linalg.norm((planned - truth).reshape(3, 6, 2), axis=-1))
    expected = np.concatenate(errors).mean(axis=0)[[1, 3, 5]]

    assert list(named(scored(shards), "ego-status", "uniad", "l2").values()) == pytest.approx(expected)


class TestObstacles:
    """One box where the ego is at the sixth point of one of six sequences."""

    @pytest.fixture
    def in_the_way(self, shards, put_boxes):
        """`in_the_way(category)` puts a box where the ego stands in scene-0002's last frame but one."""

        def put(category, frame=FRAME + 6, at=FRAME + 6):
            path = shards / "scene-0002.h5"
            with h5py.File(path) as h5:
                pose = h5["CAM_FRONT/global_from_ego"][at]
            heading = np.arctan2(pose[1, 0], pose[0, 0])
            put_boxes(path, frame, {category: (*(pose[:2, 3] + 1.4 * pose[:2, 0]), heading)})
            with h5py.File(path, "r+") as h5:
                h5["CAM_FRONT/boxes/num_lidar_pts"][:] = 9
            return shards

        return put

    def test_the_truths_contact_counts_but_by_rules_that_drop_it(self, in_the_way):
        found = scored(in_the_way("vehicle.car"))

        # Of six sequences three see frame 13: at points 7, 6 and 5, so that two have it up to 3 s.
        assert named(found, "truth", "exact", "collision") == pytest.approx({1.0: 0, 2.0: 0, 3.0: 2 / 6})
        for definition in ("uniad", "stp3", "vad"):
            assert set(named(found, "truth", definition, "collision").values()) == {0.0}

    def test_who_counts_is_the_definitions(self, in_the_way):
        found = scored(in_the_way("human.pedestrian.adult"))
        assert named(found, "truth", "exact", "collision")[3.0] == pytest.approx(2 / 6)

        found = scored(in_the_way("movable_object.barrier"))
        assert named(found, "truth", "exact", "collision")[3.0] == 0

    def test_a_plan_collides_by_each_definition(self, in_the_way, fake_planners, driven):
        """The ego stands still in a box that comes where it is, 2 s later; the truth has driven on."""
        shards = in_the_way("vehicle.car", frame=FRAME + 4, at=FRAME)
        run = fake_planners("run")  # stands still
        found = scored(shards, [run])

        # At the fourth point of the sequence of frame 7; in those of frames 6 and 8 the ego stands 3.3 m
        # before or after the box, further than half of both lengths.
        exact = named(found, "lstm-ed", "exact", "collision")
        assert (exact[1.0], exact[2.0]) == pytest.approx((0, 1 / 6))
        assert named(found, "lstm-ed", "uniad", "collision")[2.0] == pytest.approx(1 / 6)
        # Its ego lies too far back, and hits from frame 8 what stands behind: twice in four points each.
        assert named(found, "lstm-ed", "stp3", "collision")[2.0] == pytest.approx(2 / 6 / 4)
        assert named(found, "lstm-ed", "vad", "collision")[2.0] == 0  # who wasn't there yet is no obstacle

    def test_a_box_without_a_pose_is_named(self, in_the_way):
        shards = in_the_way("human.pedestrian.adult")
        with h5py.File(shards / "scene-0002.h5", "r+") as h5:
            h5["CAM_FRONT/boxes/global_from_box"][:, 0, 3] = np.nan

        text = f"scene-0002.h5: CAM_FRONT: frame {FRAME + 6} has a box whose pose or size is not finite; "
        with pytest.raises(ShardError, match=re.escape(text)):
            scored(shards)


def test_what_was_driven_has_its_own_headings(shards):
    with Shard(shards / "scene-0002.h5") as shard:
        found = CameraObstacles(shard, "CAM_FRONT").headings(FRAME)

    np.testing.assert_allclose(found, 0.04 * np.arange(1, 7))


def test_the_edge_is_crossed_by_the_box_before_the_point(shards, fake_planners):
    """Left of y = 7 m nothing is drivable: straight to the left the front is over it from y = 4 m on."""
    mean = np.stack([np.zeros(5), [1.0, 2.0, 3.0, 4.0, 5.0]], axis=-1)
    run = fake_planners("run", plan=lambda place: Plan(mean, np.ones((5, 2)), np.zeros(5)))
    found = scored(shards, [run])

    assert set(named(found, "truth", "exact", "edge_crossing").values()) == {0.0}
    assert known(named(found, "lstm-ed", "exact", "edge_crossing")) == [0.0, 1.0]


def test_without_maps_nothing_is_known_of_the_edge(shards):
    for path in shards.glob("*.h5"):
        with h5py.File(path, "r+") as h5:
            del h5["CAM_FRONT/drivable"]
            h5.attrs["settings"] = json.dumps(json.loads(h5.attrs["settings"]) | {"no_map": True})
    found = scored(shards)

    assert known(named(found, "truth", "exact", "edge_crossing")) == []
    assert known(named(found, "truth", "exact", "collision")) == [0.0] * 3


def test_what_a_frame_that_is_left_out_hides_counts_nowhere(shards):
    """Frame 12 lies 6, 5 and 4 steps after the sequences that end at 6, 7 and 8."""
    path = shards / "scene-0002.h5"
    with h5py.File(path, "r+") as h5:
        front = h5["CAM_FRONT"]
        time_us = front["timestamp_us"][12]
        for name in ("global_from_ego", "level_from_global", "timestamp_us", "sample_token", "drivable"):
            values = front[name][:]
            del front[name]
            front[name] = np.delete(values, 12, axis=0)
        for name in ("past", "future", "valid"):
            values = front[f"trajectory/{name}"][:]
            del front[f"trajectory/{name}"]
            front[f"trajectory/{name}"] = np.delete(values, 12, axis=0)
        values = front["homography/surface/valid"][:]
        del front["homography/surface/valid"], front["boxes/offsets"]
        front["homography/surface/valid"] = np.delete(values, 12)
        front["boxes/offsets"] = np.zeros(15, np.int64)
        front["left_out/timestamp_us"] = [time_us]
        front["left_out/sample_data_token"] = ["lost"]
    found = scored(shards)

    assert named(found, "truth", "exact", "collision") == {1.0: 0.0, 2.0: 0.0, 3.0: 0.0}
    assert named(found, "truth", "uniad", "l2")[3.0] == 0.0

import json
from dataclasses import FrozenInstanceError
from pathlib import Path

import numpy as np
import pytest

from ogmkit.frames import Boxes, FrameRecord
from ogmkit.geometry.se3 import pose_matrix
from ogmkit.trajectories import trajectory

_NO_BOXES = Boxes((), (), (), np.empty((0, 4, 4)), np.empty((0, 3)), np.empty(0, np.uint8), np.empty(0, int))
_REGULAR_US = 1_000_000_000 + 500_000 * np.arange(-6, 7)
_NORTH = [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]


def _frame(rotation, positions, timestamps_us):
    """A frame at the seventh of thirteen positions; a negative time means that there is no frame."""
    positions, timestamps_us = np.array(positions, dtype=float), np.array(timestamps_us)
    return FrameRecord(
        dataroot=Path(),
        scene_name="scene",
        location="boston-seaport",
        map_path="maps/m.png",
        camera="CAM_FRONT",
        sample_token="s",
        sample_data_token="d",
        timestamp_us=int(timestamps_us[6]),
        image_path="i.jpg",
        image_size=(9, 16),
        intrinsics=np.eye(3),
        ego_from_camera=np.eye(4),
        global_from_ego=pose_matrix(positions[6], rotation),
        boxes=_NO_BOXES,
        neighbour_timestamps_us=timestamps_us,
        neighbour_positions_global=np.where((timestamps_us >= 0)[:, None], positions, np.nan),
        lidar=None,
    )


def _driving_north(timestamps_us=_REGULAR_US):
    """5 m a step north, 1 m a step east, from (100, 200) at the frame itself."""
    steps = np.arange(-6, 7)
    return _frame(_NORTH, np.stack([100 + steps, 200 + 5 * steps, 0 * steps], axis=1), timestamps_us)


def test_steps_are_oldest_first_forward_is_x_and_right_is_negative_y():
    path = trajectory(_driving_north())
    np.testing.assert_allclose(path.past, [[5 * k, -k] for k in range(-6, 0)], atol=1e-12)
    np.testing.assert_allclose(path.future, [[5 * k, -k] for k in range(1, 7)], atol=1e-12)
    assert path.past_valid.all()
    assert path.future_valid.all()
    assert path.valid is True


def test_a_scene_s_start_leaves_the_past_invalid_and_nan():
    times = _REGULAR_US.copy()
    times[:4] = -1
    path = trajectory(_driving_north(times))
    np.testing.assert_array_equal(path.past_valid, [False] * 4 + [True] * 2)
    np.testing.assert_array_equal(np.isnan(path.past), ~np.stack([path.past_valid] * 2, axis=1))
    assert path.future_valid.all()
    assert path.valid is False


def test_a_gap_ends_the_path_outwards_on_its_side_only():
    times = _REGULAR_US.copy()
    times[7:9] -= 100_000
    times[9:] += 200_000  # 0.8 s after the one before, each within half a step of its time
    path = trajectory(_driving_north(times))
    np.testing.assert_array_equal(path.future_valid, [True, True, False, False, False, False])
    assert np.isnan(path.future[2:]).all()
    assert path.past_valid.all()
    assert not path.valid
    assert trajectory(_driving_north(times), max_gap_s=0.8).valid


def test_a_gap_before_the_frame_cuts_all_of_the_past():
    times = _REGULAR_US.copy()
    times[:6] -= 240_000
    path = trajectory(_driving_north(times), max_gap_s=0.7)
    assert not path.past_valid.any()
    assert path.future_valid.all()


def test_a_neighbour_far_from_its_time_is_missing_however_long_gaps_may_be():
    times = _REGULAR_US.copy()
    times[8:] += 250_001
    path = trajectory(_driving_north(times), max_gap_s=5)
    np.testing.assert_array_equal(path.future_valid, [True] + [False] * 5)


def test_neighbours_found_for_another_step_are_missing():
    path = trajectory(_driving_north(_REGULAR_US), max_gap_s=5, step_s=0.2)
    assert not path.past_valid.any()
    assert not path.future_valid.any()
    fifths_us = 1_000_000_000 + 200_000 * np.arange(-6, 7)
    assert trajectory(_driving_north(fifths_us), max_gap_s=0.3, step_s=0.2).valid
    assert not trajectory(_driving_north(fifths_us)).valid


def test_the_longest_gap_allowed_is_allowed():
    times = _REGULAR_US.copy()
    times[7:] += 250_000
    assert trajectory(_driving_north(times)).valid
    times[7:] += 1
    assert not trajectory(_driving_north(times)).future_valid.any()


def test_a_frame_alone_has_no_trajectory():
    times = np.full(13, -1)
    times[6] = 5
    path = trajectory(_driving_north(times))
    assert not path.past_valid.any()
    assert not path.future_valid.any()
    assert np.isnan(path.past).all()
    assert np.isnan(path.future).all()


def test_pitch_does_not_shorten_the_path():
    x, y, z, w = 0.0, np.sin(0.05), 0.0, np.cos(0.05)
    steps = np.arange(-6, 7)
    positions = np.stack([5.0 * steps, 0 * steps, 0 * steps], axis=1)
    np.testing.assert_allclose(
        trajectory(_frame([w, x, y, z], positions, _REGULAR_US)).future[:, 0], 5 * steps[7:]
    )


@pytest.fixture
def scene_0103(real_dataroot):
    """Times and ego poses of the front camera's key frames, in order, from the tables by plain json."""
    tables = {
        name: json.loads((real_dataroot / "v1.0-mini" / f"{name}.json").read_text(encoding="utf-8"))
        for name in ("scene", "sample", "sample_data", "ego_pose")
    }
    (scene,) = (scene for scene in tables["scene"] if scene["name"] == "scene-0103")
    samples = {sample["token"]: sample for sample in tables["sample"]}
    data = {
        record["sample_token"]: record
        for record in tables["sample_data"]
        if record["is_key_frame"] and "/CAM_FRONT/" in record["filename"]
    }
    poses = {pose["token"]: pose for pose in tables["ego_pose"]}
    token, frames = scene["first_sample_token"], []
    while token:
        frames.append((data[token]["timestamp"], poses[data[token]["ego_pose_token"]]))
        token = samples[token]["next"]
    return frames


def test_a_real_scene_agrees_with_complex_numbers(scene_0103):
    """An independent derivation: positions as complex numbers, turned back by the heading's angle."""
    assert len(scene_0103) == 40
    absent = (-1, {"translation": [np.nan] * 3})
    padded = [absent] * 6 + scene_0103 + [absent] * 6
    valid = 0
    for i, (_, pose) in enumerate(scene_0103):
        times, neighbours = zip(*padded[i : i + 13], strict=True)
        path = trajectory(_frame(pose["rotation"], [n["translation"] for n in neighbours], times))
        w, x, y, z = pose["rotation"]
        forward = complex(w * w + x * x - y * y - z * z, 2 * (x * y + w * z))
        for step, point in [
            *zip(range(-6, 0), path.past, strict=True),
            *zip(range(1, 7), path.future, strict=True),
        ]:
            east, north, _ = neighbours[6 + step]["translation"]
            offset = complex(east, north) - complex(*pose["translation"][:2])
            expected = offset * forward.conjugate() / abs(forward)
            np.testing.assert_allclose(point, [expected.real, expected.imag], atol=1e-6, rtol=0)
        valid += path.valid
    assert valid == 40 - 12


def test_a_trajectory_stays_as_it_is_and_equals_itself_alone():
    path, same = trajectory(_driving_north()), trajectory(_driving_north())
    with pytest.raises(FrozenInstanceError):
        path.valid = False
    assert len({path, same}) == 2  # == of arrays is no truth value


@pytest.mark.parametrize("late_us", [100_000, 100_001])
def test_half_a_step_off_is_near_enough_at_another_step_too(late_us):
    times = 1_000_000_000 + 200_000 * np.arange(-6, 7)
    times[:6] -= late_us
    path = trajectory(_driving_north(times), max_gap_s=9, step_s=0.2)
    assert path.past_valid.tolist() == [late_us == 100_000] * 6
    assert path.valid is (late_us == 100_000)

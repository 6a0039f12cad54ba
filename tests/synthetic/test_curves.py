from itertools import pairwise

import numpy as np
import pytest
from shapely import LineString, Point

from ogmkit.synthetic.arclines import arcline_path
from ogmkit.synthetic.curves import Path, even_path, turn


def circle(radius_m, angle_rad=1.5):
    angles = np.linspace(0, angle_rad, 2000)
    return even_path(radius_m * np.stack([np.sin(angles), 1 - np.cos(angles)], axis=-1))


def test_circle_is_measured_by_its_arc():
    path = circle(20.0)
    assert path.length == pytest.approx(30.0, rel=1e-4)
    assert path.curvatures[5:-5] == pytest.approx(1 / 20, rel=0.02)
    assert path.heading(10.0) == pytest.approx(0.5, abs=1e-3)


def test_positive_offset_lies_left_so_a_left_bend_gets_tighter():
    assert circle(20.0).offset(5.0).length == pytest.approx(1.5 * 15, rel=5e-3)
    assert circle(20.0).offset(-5.0).length == pytest.approx(1.5 * 25, rel=5e-3)


def test_path_goes_on_straight_beyond_both_ends():
    path = Path(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]))
    assert path.at(np.array([-1.5, 0.5, 3.0])).tolist() == [[-1.5, 0.0], [0.5, 0.0], [3.0, 0.0]]


def test_simplified_path_stays_within_its_tolerance():
    path = circle(30.0)
    simple = path.simplified(0.05)
    assert len(simple.points) < len(path.points) / 4
    line = LineString(simple.points)
    assert max(line.distance(Point(point)) for point in path.points) <= 0.05 + 1e-9


def test_turn_leaves_and_arrives_along_its_headings():
    path = turn(np.array([0.0, 0.0]), 0.0, np.array([10.0, 10.0]), np.pi / 2)
    assert path.headings[[0, -1]] == pytest.approx([0.0, np.pi / 2], abs=0.03)
    assert 1 / np.abs(path.curvatures).max() == pytest.approx(10.0, rel=0.1)


def arc_points(record, count=50):
    """Points of one arc or straight, from the expansion's own numbers."""
    x, y, heading = record["start_pose"]
    sign = 1 if record["shape"] == "LSL" else -1
    curved, straight, _ = record["segment_length"]
    s = np.linspace(0, curved + straight, count)
    if straight:
        return np.array([x, y]) + s[:, None] * np.array([np.cos(heading), np.sin(heading)])
    turned = sign * s / record["radius"]
    radius = sign * record["radius"]
    return np.stack(
        [
            x + radius * (np.sin(heading + turned) - np.sin(heading)),
            y - radius * (np.cos(heading + turned) - np.cos(heading)),
        ],
        axis=-1,
    )


def test_arcs_follow_every_lane_and_join(town):
    for lane in town.network.lanes:
        records = arcline_path(lane.path)
        for one, other in pairwise(records):
            assert one["end_pose"][:2] == other["start_pose"][:2]
        for record in records:
            assert arc_points(record)[-1] == pytest.approx(record["end_pose"][:2], abs=2e-3)
        line = LineString(np.concatenate([arc_points(record) for record in records]))
        assert max(line.distance(Point(point)) for point in lane.path.points) < 0.2

"""Exact contacts against another way to find them, and known times of contact."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.grid import GridSpec
from ogmkit.metrics.open_loop.catalogue import DEFINITIONS, EXACT
from ogmkit.metrics.open_loop.contact import contacts, edge_crossings
from ogmkit.metrics.open_loop.horizons import at_horizons
from ogmkit.metrics.open_loop.scores import Surrounding, point_values
from ogmkit.synthetic.catalogue import EGO_SIZE_WLH
from ogmkit.synthetic.fleet import draw_drivers
from ogmkit.synthetic.layout import LOCATIONS, build_layout
from ogmkit.synthetic.obstacles import draw_obstacles
from ogmkit.synthetic.passing import plan_passing

BOX = EXACT.ego
FRONT_M = BOX.centre_ahead_m + BOX.length_m / 2
REAR_M = BOX.centre_ahead_m - BOX.length_m / 2
NUMBERS = st.floats(-12, 12)


def rectangle(x, y, heading, length, width, ahead=0.0):
    """(4, 2) corners."""
    turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    half = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) / 2
    return np.array([x, y]) + (half * (length, width) + (ahead, 0.0)) @ turn


def depth_m(one, other):
    """How deep two convex quadrilaterals overlap, by the separating-axis theorem; negative if apart."""
    depth = np.inf
    for quad in (one, other):
        sides = np.roll(quad, -1, axis=0) - quad
        for normal in np.column_stack([-sides[:, 1], sides[:, 0]]):
            first, second = (shape @ normal / np.linalg.norm(normal) for shape in (one, other))
            depth = min(depth, first.max() - second.min(), second.max() - first.min())
    return depth


def straight(speed_m_s, count=6):
    """(6, 2) points half a second apart."""
    return np.column_stack([speed_m_s * 0.5 * np.arange(1, count + 1), np.zeros(count)])


@given(NUMBERS, NUMBERS, st.floats(-4, 4), st.floats(-1.5, 1.5), st.floats(2, 25))
def test_contact_is_overlap_of_turned_rectangles(x, y, heading, direction, speed_m_s):
    points = straight(speed_m_s) @ [
        [np.cos(direction), np.sin(direction)],
        [-np.sin(direction), np.cos(direction)],
    ]
    other = rectangle(x, y, heading, 4.6, 1.9)
    found = contacts(points[None], [other[None]] * 6, BOX)[0]
    for step, point in enumerate(points):
        own = rectangle(*point, direction, BOX.length_m, BOX.width_m, BOX.centre_ahead_m)
        depth = depth_m(own, other)
        if abs(depth) > 1e-6:
            assert found[step] == (depth > 0)


@pytest.mark.parametrize("gap_m", [0.5, 3.0, 7.7, 14.0])
@pytest.mark.parametrize("speed_m_s", [2.0, 8.0, 15.0])
def test_contact_with_what_stands_ahead_begins_and_ends_when_it_must(gap_m, speed_m_s):
    """A car of 4 m stands with its rear `gap_m` ahead of the ego's front."""
    car = rectangle(FRONT_M + gap_m + 2.0, 0.5, 0.0, 4.0, 1.8)
    found = contacts(straight(speed_m_s)[None], [car[None]] * 6, BOX)[0]

    begins_s = gap_m / speed_m_s
    ends_s = (FRONT_M + gap_m + 4.0 - REAR_M) / speed_m_s
    times_s = 0.5 * np.arange(1, 7)
    np.testing.assert_array_equal(found, (times_s >= begins_s) & (times_s <= ends_s))


def test_a_box_that_turns_touches_what_one_that_does_not_misses():
    """At the end of a quarter turn to the left, a car stands ahead of the ego: 3 m further along y."""
    angle = np.pi / 2 * np.arange(1, 7) / 6
    plan = 12.0 * np.column_stack([np.sin(angle), 1 - np.cos(angle)])
    car = rectangle(12.0, 12.0 + 3.0, 0.0, 1.0, 1.0)[None]
    faces = [np.zeros((0, 4, 2))] * 5 + [car]
    around = Surrounding(straight(0.0), faces, None, GridSpec())
    found = {
        name: point_values(one, plan[None], around)["collision"][0, 5] for name, one in DEFINITIONS.items()
    }
    assert found == {"uniad": 0, "stp3": 0, "vad": 0, "exact": 1}


def test_moving_obstacles_count_at_their_own_time():
    """One crosses from the right, 4 m/s, and is on the ego's way when the ego is there: at 1.5 s."""
    faces = [rectangle(15.0, 6.0 - 4.0 * t, np.pi / 2, 2.0, 1.0)[None] for t in 0.5 * np.arange(1, 7)]
    found = contacts(straight(9.0)[None], faces, BOX)[0]
    waiting = contacts(straight(2.0)[None], faces, BOX)[0]

    assert found.tolist() == [0, 0, 1, 0, 0, 0]
    assert not waiting.any()
    assert at_horizons(found, "up-to").tolist() == [0, 1, 1]


def test_nothing_is_known_without_a_point_or_obstacles():
    points = straight(1.0)[None].copy()
    points[0, 5] = np.nan
    found = contacts(points, [None, *[np.zeros((0, 4, 2))] * 5], BOX)[0]

    np.testing.assert_array_equal(found, [np.nan, 0, 0, 0, 0, np.nan])


class TestEdge:
    GRID = GridSpec(m_per_cell=0.25, rows=160, columns=80, ego_row=140, ego_column=50)

    def drivable(self, left_m):
        """All ground to the right of y = left_m."""
        cells = np.zeros(self.GRID.shape, np.uint8)
        rows, columns = np.indices(self.GRID.shape)
        y = self.GRID.positions_m(np.stack([columns, rows], axis=-1))[..., 1]
        cells[y < left_m] = 1
        return cells

    @pytest.mark.parametrize(("left_m", "crossed"), [(1.5, False), (1.25, False), (0.75, True), (-3.0, True)])
    def test_the_left_side_is_half_a_width_off_the_points(self, left_m, crossed):
        found = edge_crossings(straight(4.0)[None], self.drivable(left_m), self.GRID, BOX)

        assert found.tolist() == [[float(crossed)] * 6]

    def test_the_front_reaches_it_before_the_point(self):
        plan = np.stack([np.zeros(6), np.arange(1.0, 7.0)], axis=-1)[None]  # to the left
        found = edge_crossings(plan, self.drivable(7.5), self.GRID, BOX)[0]

        assert found.tolist() == [float(y + FRONT_M > 7.5) for y in range(1, 7)]

    def test_outside_the_grid_nothing_is_known_and_parts_outside_do_not_count(self):
        points = np.array([[[0.0, 0.0], [-4.6, 0.0], [-60.0, 0.0]]])  # the grid ends 5 m behind the ego
        drivable = self.drivable(5.0)

        found = edge_crossings(points, drivable, self.GRID, EXACT.ego)
        np.testing.assert_array_equal(found, [[0.0, 0.0, np.nan]])


@pytest.fixture(scope="module")
def incident():
    """The ego of a synthetic scene with incidents, what stands in its way, and how it passes that."""
    random, network = np.random.default_rng(8), build_layout(3, LOCATIONS[0]).network
    ego, _ = draw_drivers(random, network, 35.0, incidents=True)[:2]
    obstacles = draw_obstacles(random, network, ego.route, ego.start_m)
    return ego, obstacles, plan_passing(ego.route.path, obstacles, EGO_SIZE_WLH[0], ego.cruise_m_s)


def test_contacts_of_incidents_are_found_all_and_no_others(incident):
    """Plans that drive on along the lane, or swerve as the ego does, past what stands in its way.

    Known is when the boxes overlap, by the separating-axis theorem on the way's own headings. The rule is
    told these, or follows the path.
    """
    ego, obstacles, passing = incident
    others = np.stack([rectangle(*item.place.pose(0.0), *item.look.size_wlh[1::-1]) for item in obstacles])
    known, told, followed = [], [], []
    for path in (ego.route.path, ego.route.path.offset(passing.left_m)):
        for start_m in np.arange(5.0, path.distances[-1] - 40.0, 3.0):
            poses = np.array([_pose(path, start_m + ego.cruise_m_s * 0.5 * step) for step in range(7)])
            known.append([_deepest(pose, others) for pose in poses[1:]])
            cos, sin = np.cos(poses[0, 2]), np.sin(poses[0, 2])
            turn = np.array([[cos, -sin], [sin, cos]])
            plan, faces = ((xy - poses[0, :2]) @ turn for xy in (poses[1:, :2], others))
            followed.append(contacts(plan[None], [faces] * 6, BOX)[0])
            told.append(contacts(plan[None], [faces] * 6, BOX, poses[None, 1:, 2] - poses[0, 2])[0])
    known = np.array(known) > 0
    assert 20 < np.count_nonzero(known) < known.size / 2
    for found in (np.array(told) == 1, np.array(followed) == 1):
        assert np.count_nonzero(known & found) / np.count_nonzero(known) == 1.0  # recall
        assert np.count_nonzero(known & found) / np.count_nonzero(found) == 1.0  # precision


def _pose(path, at_m):
    """x, y and heading of a way."""
    here, ahead = np.array(
        [np.interp([at_m - 0.25, at_m + 0.25], path.distances, path.points[:, axis]) for axis in (0, 1)]
    ).T
    return (*(here + ahead) / 2, np.arctan2(*(ahead - here)[::-1]))


def _deepest(pose, others):
    own = rectangle(*pose, BOX.length_m, BOX.width_m, BOX.centre_ahead_m)
    near = others[np.linalg.norm(others.mean(axis=1) - pose[:2], axis=-1) < 12.0]
    return max((depth_m(own, other) for other in near), default=-1.0)

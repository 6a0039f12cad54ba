import numpy as np
import pytest
import shapely
from shapely import Polygon

from ogmkit.synthetic.catalogue import EGO_SIZE_WLH, Look
from ogmkit.synthetic.curves import Path
from ogmkit.synthetic.drivers import Braking, Driver
from ogmkit.synthetic.driving import Simulation
from ogmkit.synthetic.fleet import draw_drivers
from ogmkit.synthetic.motion import Standing
from ogmkit.synthetic.obstacles import Obstacle, draw_obstacles
from ogmkit.synthetic.passing import plan_passing
from ogmkit.synthetic.routes import Route
from ogmkit.synthetic.traffic import build_traffic

DURATION_S = 12.0
STRAIGHT = Path(np.column_stack([np.arange(0.0, 100.1, 0.5), np.zeros(201)]))
CAR = Look("vehicle.car", (2.0, 4.0, 1.6), (0.0, 0.0, 0.0))


def rectangle(pose, width, length, shift=0.0):
    x, y, heading = pose
    ahead = np.array([np.cos(heading), np.sin(heading)])
    left = np.array([-ahead[1], ahead[0]])
    corners = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    return Polygon(
        [np.array([x, y]) + (shift + a * length / 2) * ahead + b * width / 2 * left for a, b in corners]
    )


def obstacle(x=50.0, y=-1.0, heading=0.0, left_m=9.0, right_m=9.0):
    return Obstacle(CAR, Standing(x, y, heading), left_m, right_m)


@pytest.fixture(scope="module")
def busy(town):
    return build_traffic(np.random.default_rng(6), town.network, town.car_parks, DURATION_S, incidents=True)


@pytest.fixture(scope="module")
def drive(town):
    """The ego, what stands in its way, and how it passes that."""
    random = np.random.default_rng(8)
    ego, leader = draw_drivers(random, town.network, 35.0, incidents=True)[:2]
    obstacles = draw_obstacles(random, town.network, ego.route, ego.start_m)
    passing = plan_passing(ego.route.path, obstacles, EGO_SIZE_WLH[0], ego.cruise_m_s)
    return ego, leader, obstacles, passing


def places(route, obstacles):
    """Distances of obstacles along a route."""
    away = [np.linalg.norm(route.path.points - item.place.pose(0.0)[:2], axis=1) for item in obstacles]
    return np.array([route.path.distances[np.argmin(gaps)] for gaps in away])


def test_swerve_is_as_wide_as_the_obstacle_demands_and_leads_back():
    passing = plan_passing(STRAIGHT, [obstacle()], 1.8, 10.0)
    # The obstacle's near face is the path itself: half a width and the gap of 0.55 m away from it.
    assert np.allclose(passing.left_m[(STRAIGHT.distances > 47) & (STRAIGHT.distances < 53)], 1.45)
    assert np.all(passing.left_m[(STRAIGHT.distances < 30) | (STRAIGHT.distances > 66.5)] == 0.0)
    assert 4.0 < passing.limits_m_s.min() < 6.0
    assert np.all(np.isinf(passing.limits_m_s[STRAIGHT.distances < 30]))


@pytest.mark.parametrize("heading", [0.0, np.pi])
def test_obstacle_on_the_left_is_passed_on_the_right_whichever_way_it_heads(heading):
    passing = plan_passing(STRAIGHT, [obstacle(y=1.2, heading=heading)], 1.8, 10.0)
    assert passing.left_m.min() == pytest.approx(-1.25)
    assert passing.left_m.max() == 0.0


def test_little_room_narrows_the_gap_and_less_makes_the_way_impassable():
    # From its side 1 m left of its middle to 0.1 m before the edge: 2.2 m for 1.8 m and a gap of 0.4 m.
    assert plan_passing(STRAIGHT, [obstacle(left_m=3.3)], 1.8, 10.0).left_m.max() == pytest.approx(1.3)
    assert plan_passing(STRAIGHT, [obstacle(left_m=3.0)], 1.8, 10.0) is None
    turned = obstacle(left_m=3.0, heading=np.pi)
    assert plan_passing(STRAIGHT, [turned], 1.8, 10.0).left_m.max() == pytest.approx(1.45)


def test_what_stands_beside_the_way_or_across_it_far_off_is_ignored():
    passing = plan_passing(STRAIGHT, [obstacle(y=-3.0), obstacle(y=20.0)], 1.8, 10.0)
    assert np.all(passing.left_m == 0.0)
    assert np.all(np.isinf(passing.limits_m_s))


def test_obstacles_come_often_and_the_ego_swerves_beside_them_only(drive):
    ego, _, obstacles, passing = drive
    along = places(ego.route, obstacles)
    assert len(obstacles) > 3
    assert np.diff(along).min() > 25.0
    away = np.abs(ego.route.path.distances[:, None] - along)
    assert np.all(np.abs(passing.left_m[away.argmin(axis=0)]) > 0.75)
    assert np.count_nonzero(np.abs(passing.left_m[away.argmin(axis=0)]) > 1.0) >= len(obstacles) / 2
    assert away.min(axis=1)[np.abs(passing.left_m) > 1.0].max() < 18.0
    assert np.abs(passing.left_m).max() <= 2.2 + 0.1  # 0.1: obstacles stand a little aslant
    assert np.all(passing.left_m[away.min(axis=1) > 30.0] == 0.0)


def test_obstacles_stand_on_the_road_in_the_way_and_clear_of_the_swerving_ego(town, drive):
    ego, _, obstacles, passing = drive
    path = ego.route.path.offset(passing.left_m)
    swept = shapely.LineString(path.points).buffer(EGO_SIZE_WLH[0] / 2)
    usual = shapely.LineString(ego.route.path.points).buffer(EGO_SIZE_WLH[0] / 2)
    for item in obstacles:
        body = rectangle(item.place.pose(0.0), *item.look.size_wlh[:2])
        assert town.layers.drivable.buffer(0.05).contains(body)
        assert body.intersects(usual)
        assert body.distance(swept) > 0.25


def test_nobody_overlaps_anybody_and_the_ego_stays_on_the_road(town, busy):
    for time_s in np.arange(0.0, DURATION_S, 0.5):
        ego = rectangle(busy.ego.pose(time_s), *EGO_SIZE_WLH[:2], shift=3.4 - EGO_SIZE_WLH[1] / 2)
        assert town.layers.drivable.contains(ego)
        bodies, owners = [ego], [-2]
        for number, actor in enumerate(busy.actors):
            bodies.append(rectangle(actor.motion.pose(time_s), *actor.look.size_wlh[:2]))
            owners.append(actor.driver if actor.driver >= 0 else 1000 + number)
        for one, other in shapely.STRtree(bodies).query(bodies, predicate="intersects").T:
            if owners[one] != owners[other]:
                assert bodies[one].intersection(bodies[other]).area < 0.02


def test_drivers_accelerate_no_harder_than_cars_can(busy):
    times = np.arange(0.0, DURATION_S, 0.1)  # in which cars go further than a path's points are apart
    for motion in [busy.ego, *(actor.motion for actor in busy.actors if actor.driver == 1)]:
        poses = np.array([motion.pose(time_s) for time_s in times])
        acceleration = np.diff(poses[:, :2], 2, axis=0) / 0.1**2
        left = np.stack([-np.sin(poses[1:-1, 2]), np.cos(poses[1:-1, 2])], axis=-1)
        assert np.linalg.norm(acceleration, axis=1).max() < 7
        assert np.abs(np.sum(acceleration * left, axis=1)).max() < 4.5


def test_somebody_drives_just_ahead_of_the_ego(busy):
    (leader,) = [actor for actor in busy.actors if actor.driver == 1]
    times = np.arange(0.0, DURATION_S, 0.5)
    away = [np.subtract(leader.motion.pose(time_s)[:2], busy.ego.pose(time_s)[:2]) for time_s in times]
    gaps = np.linalg.norm(away, axis=1) - 3.4 - leader.look.size_wlh[1] / 2
    assert np.mean((gaps > 2) & (gaps < 30)) > 0.9
    ahead = [
        np.cos(busy.ego.pose(time_s)[2] - np.arctan2(*gap[::-1]))
        for time_s, gap in zip(times, away, strict=True)
    ]
    assert np.mean(np.array(ahead) > 0.7) > 0.9


def test_leader_brakes_every_now_and_then_on_the_egos_way(drive):
    ego, leader, _, _ = drive
    assert leader.route is ego.route
    starts = [braking.start_s for braking in leader.brakings]
    assert len(starts) >= 3
    assert 4 <= np.diff(starts).min() <= np.diff(starts).max() <= 7
    assert {braking.speed_m_s == 0.0 for braking in leader.brakings} == {True, False}


def test_braking_goes_down_to_its_speed_while_it_lasts(town):
    network = town.network
    lane = max(range(len(network.lanes)), key=lambda lane: network.lanes[lane].path.length)
    route = Route.along(network, (lane, network.following[lane][0]))
    driver = Driver(route, 30.0, 9.0, 4.0, ((CAR, 2.0),), brakings=(Braking(2.0, 5.0, 3.0),))
    _, speeds = Simulation(network, [driver], []).run(np.arange(0.0, 8.0, 0.1))
    assert speeds[0][20] > 6
    assert speeds[0][49] == pytest.approx(3.0, abs=0.2)
    assert speeds[0][79] > 5
    assert np.diff(speeds[0]).min() > -0.56


def test_same_seed_gives_the_same_incidents_and_none_by_default(town):
    def poses(seed, **given):
        drawn = build_traffic(np.random.default_rng(seed), town.network, town.car_parks, 2.0, **given)
        return np.array([actor.motion.pose(1.0) for actor in drawn.actors])

    first = poses(3, incidents=True)
    assert np.array_equal(first, poses(3, incidents=True))
    assert not np.array_equal(first[:20], poses(3)[:20])

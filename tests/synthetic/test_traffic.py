import numpy as np
import pytest
import shapely
from shapely import Polygon

from ogmkit.synthetic.catalogue import EGO_SIZE_WLH, Look, draw_look
from ogmkit.synthetic.curves import Path
from ogmkit.synthetic.drivers import Blockade, Driver
from ogmkit.synthetic.driving import Simulation
from ogmkit.synthetic.motion import Crossing, Driving, Standing, Strolling
from ogmkit.synthetic.overlap import overlaps
from ogmkit.synthetic.routes import Route

TIMES_S = np.arange(0.0, 8.01, 0.5)


def rectangle(pose, width, length, shift=0.0):
    x, y, heading = pose
    ahead = np.array([np.cos(heading), np.sin(heading)])
    left = np.array([-ahead[1], ahead[0]])
    corners = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    return Polygon(
        [np.array([x, y]) + (shift + a * length / 2) * ahead + b * width / 2 * left for a, b in corners]
    )


def ego_body(pose):
    return rectangle(pose, EGO_SIZE_WLH[0], EGO_SIZE_WLH[1], shift=3.4 - EGO_SIZE_WLH[1] / 2)


def test_nobody_overlaps_anybody(traffic):
    for time_s in TIMES_S:
        bodies = [ego_body(traffic.ego.pose(time_s))]
        owners = [-2]
        for number, actor in enumerate(traffic.actors):
            bodies.append(rectangle(actor.motion.pose(time_s), *actor.look.size_wlh[:2]))
            owners.append(actor.driver if actor.driver >= 0 else 1000 + number)
        tree = shapely.STRtree(bodies)
        for one, other in tree.query(bodies, predicate="intersects").T:
            if owners[one] != owners[other]:
                assert bodies[one].intersection(bodies[other]).area < 0.02


def test_ego_stays_on_the_road(town, traffic):
    for time_s in np.arange(0.0, 8.01, 0.1):
        assert town.layers.drivable.contains(ego_body(traffic.ego.pose(time_s)))


def test_moving_vehicles_head_where_they_go_and_stay_on_the_road(town, traffic):
    road = town.layers.drivable.buffer(0.3)
    moved = 0
    for actor in traffic.actors:
        for time_s in TIMES_S[:-1]:
            if actor.driver >= 0 and actor.motion.speed(time_s) > 2:
                start, end = (np.array(actor.motion.pose(time_s + shift)) for shift in (-0.05, 0.05))
                going = np.arctan2(*(end - start)[1::-1])
                heading = actor.motion.pose(time_s)[2]
                assert abs(np.angle(np.exp(1j * (going - heading)))) < 0.15
                assert road.contains(rectangle(actor.motion.pose(time_s), *actor.look.size_wlh[:2]))
                moved += 1
    assert moved > 50


def test_motion_is_smooth_and_gentle(traffic):
    times = np.arange(0.0, 8.0, 0.05)
    places = np.array([traffic.ego.pose(time_s)[:2] for time_s in times])
    velocity = np.diff(places, axis=0) / 0.05
    assert np.linalg.norm(velocity, axis=1).max() < 13
    assert np.linalg.norm(np.diff(velocity, axis=0) / 0.05, axis=1).max() < 8


def test_a_scene_has_every_kind_of_thing(traffic):
    categories = {actor.look.category for actor in traffic.actors}
    for category in (
        "vehicle.car",
        "vehicle.truck",
        "vehicle.bus.bendy",
        "vehicle.bus.rigid",
        "vehicle.trailer",
        "vehicle.construction",
        "vehicle.motorcycle",
        "vehicle.bicycle",
        "vehicle.emergency.police",
        "vehicle.emergency.ambulance",
        "human.pedestrian.adult",
        "movable_object.trafficcone",
        "movable_object.barrier",
    ):
        assert category in categories
    assert any(isinstance(actor.motion, Standing) for actor in traffic.actors)
    assert any(isinstance(actor.motion, Strolling) for actor in traffic.actors)


def car(network, lane, start_m, **given):
    look = Look("vehicle.car", (1.9, 4.6, 1.6), (0.0, 0.0, 0.0))
    lanes = (lane, network.following[lane][0])
    lanes += network.following[lanes[-1]][:1]
    given = {"cruise_m_s": 10.0, "length_m": 4.6, "parts": ((look, 2.3),), **given}
    return Driver(Route.along(network, lanes), start_m, **given)


def longest_lane(network):
    return max(range(len(network.lanes)), key=lambda lane: network.lanes[lane].path.length)


def test_follower_brakes_behind_one_who_halts_and_then_goes_on(town):
    network = town.network
    lane = longest_lane(network)
    ahead = car(network, lane, 40.0, pause_m=70.0, pause_s=5.0)
    fronts, speeds = Simulation(network, [car(network, lane, 10.0), ahead], []).run(np.arange(0, 30, 0.1))
    gaps = fronts[1] - 4.6 - fronts[0]
    assert gaps.min() > 1.0
    assert speeds[0].min() < 0.5
    assert speeds[0][-1] > 2.0


def test_driver_waits_at_the_stop_line_while_a_crossing_is_closed(town):
    network = town.network
    lane = longest_lane(network)
    length_m = network.lanes[lane].path.length
    forward = network.lanes[lane].side == network.traffic_side
    closed = Blockade(network.lanes[lane].road, forward, 0.0, 15.0)
    times = np.arange(0, 25, 0.1)
    fronts, speeds = Simulation(network, [car(network, lane, length_m - 60)], [closed]).run(times)
    assert fronts[0][times < 15].max() < length_m - 5.5
    assert speeds[0][149] < 0.5
    assert fronts[0][-1] > length_m


def test_crossing_ways_through_a_junction_are_driven_one_after_the_other(town):
    network = town.network
    turns = [index for index, lane in enumerate(network.lanes) if lane.road < 0 and lane.junction == 4]
    one, other = next(
        (a, b)
        for a in turns
        for b in turns
        if network.preceding[a] != network.preceding[b]
        and np.linalg.norm(
            network.lanes[a].path.points[:, None] - network.lanes[b].path.points[None], axis=-1
        ).min()
        < 1
        and network.following[a] != network.following[b]
    )
    drivers = []
    for way in (one, other):
        before = network.preceding[way][0]
        look = Look("vehicle.car", (1.9, 4.6, 1.6), (0.0, 0.0, 0.0))
        route = Route.along(network, (before, way, network.following[way][0]))
        drivers.append(Driver(route, float(route.starts_m[1]) - 40, 9.0, 4.6, ((look, 2.3),)))
    fronts, _ = Simulation(network, drivers, []).run(np.arange(0, 20, 0.1))
    inside = [
        (front > driver.route.starts_m[1]) & (front - 4.6 < driver.route.starts_m[2])
        for front, driver in zip(fronts, drivers, strict=True)
    ]
    assert inside[0].any()
    assert inside[1].any()
    assert not (inside[0] & inside[1]).any()


def test_overlaps_agree_with_shapely():
    random = np.random.default_rng(1)
    poses = np.column_stack([random.uniform(0, 20, (60, 2)), random.uniform(-4, 4, 60)])
    sizes = random.uniform(0.5, 5, (60, 2))
    shapes = [rectangle(pose, *size) for pose, size in zip(poses, sizes, strict=True)]
    expected = [[a is not b and a.intersects(b) for b in shapes] for a in shapes]
    assert np.array_equal(overlaps(poses, sizes), expected)


def test_body_is_the_chord_between_its_axles():
    angles = np.linspace(0, 2, 4000)
    path = Path(10 * np.stack([np.cos(angles), np.sin(angles)], axis=-1))
    motion = Driving(path, np.array([0.0, 1.0]), np.array([8.0, 8.0]), np.zeros(2), 3.0, 2.0, 1.0)
    x, y, heading = motion.pose(0.5)
    assert np.hypot(x, y) == pytest.approx(10 * np.cos(0.1), abs=1e-4)
    assert heading == pytest.approx(0.6 + np.pi / 2, abs=1e-4)


def test_strolling_turns_round_at_the_ends():
    stroll = Strolling(Path(np.array([[0.0, 0.0], [10.0, 0.0]])), 8.0, 1.0)
    assert stroll.pose(1.0) == pytest.approx((9.0, 0.0, 0.0))
    assert stroll.pose(4.0) == pytest.approx((8.0, 0.0, np.pi))


def test_crossing_waits_walks_and_stays():
    crossing = Crossing(Path(np.array([[0.0, 0.0], [0.0, 6.0]])), begin_s=2.0, speed_m_s=1.5)
    assert [crossing.pose(time_s)[1] for time_s in (0.0, 4.0, 9.0)] == pytest.approx([0.0, 3.0, 6.0])
    assert [crossing.speed(time_s) for time_s in (0.0, 4.0, 9.0)] == [0.0, 1.5, 0.0]


def test_looks_vary_round_their_usual_size():
    random = np.random.default_rng(0)
    looks = [draw_look(random, "vehicle.car") for _ in range(20)]
    lengths = [look.size_wlh[1] for look in looks]
    assert 4.2 < min(lengths) < max(lengths) < 5.0
    assert len({look.colour_bgr for look in looks}) > 10

import numpy as np
import pytest
import shapely
from shapely import LineString, Point, Polygon

from ogmkit.synthetic.layout import LOCATIONS, build_layout
from ogmkit.synthetic.mask import rasterise


@pytest.mark.sampled(6)
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("location", LOCATIONS, ids=lambda location: location.name)
def test_every_town_is_sound(seed, location):
    town = build_layout(seed, location)
    drivable = town.layers.drivable
    assert drivable.is_valid
    assert town.layers.walkway.is_valid
    assert len(drivable.geoms) == 1, "all roads and car parks hang together"
    holes = drivable.geoms[0].interiors
    islands = 4 + len(town.car_parks)
    assert len(holes) == 4 + islands, "four blocks, four medians, an island in each car park"
    width, height = location.size_m
    assert Polygon.from_bounds(5, 5, width - 5, height - 5).contains(drivable)
    assert town.layers.walkway.intersection(drivable).area < 1.0


def test_same_seed_gives_the_same_town_and_another_a_different_one():
    again, other = build_layout(3, LOCATIONS[0]), build_layout(4, LOCATIONS[0])
    town = build_layout(3, LOCATIONS[0])
    assert town.layers.drivable.equals_exact(again.layers.drivable, 0)
    assert not town.layers.drivable.equals_exact(other.layers.drivable, 1.0)


def test_lanes_run_on_the_side_that_traffic_keeps(town):
    for lane in town.network.lanes:
        if lane.road >= 0:
            centre = LineString(town.network.roads[lane.road].centre.points)
            middle = lane.path.at(lane.path.length / 2)
            nearest = np.array(centre.interpolate(centre.project(Point(middle))).coords[0])
            heading = lane.path.heading(lane.path.length / 2)
            centre_is_left = np.cross([np.cos(heading), np.sin(heading), 0], [*(nearest - middle), 0])[2] > 0
            assert centre_is_left != town.location.keeps_left


def test_lanes_and_turns_lie_in_the_drivable_area_and_join_smoothly(town):
    lanes = town.network.lanes
    road = town.layers.drivable.buffer(0.1)
    for index, lane in enumerate(lanes):
        assert road.contains(LineString(lane.path.points))
        assert town.network.following[index], "no lane ends nowhere"
        for follower in town.network.following[index]:
            assert np.allclose(lane.path.points[-1], lanes[follower].path.points[0])
            change = lanes[follower].path.headings[0] - lane.path.headings[-1]
            assert abs(np.angle(np.exp(1j * change))) < 0.06


def test_every_lane_is_led_to_and_leads_on(town):
    assert all(town.network.following)
    assert all(town.network.preceding)


def test_road_widths_vary(town):
    widths = np.concatenate([road.left_m + road.right_m for road in town.network.roads])
    assert widths.max() - widths.min() > 5.0


def test_mask_equals_centre_inside_everywhere_near_edges(town):
    drivable = town.layers.drivable
    mask = rasterise(drivable, town.location.size_m)
    assert mask.shape == (town.location.size_m[1] * 10, town.location.size_m[0] * 10)
    edges = shapely.get_coordinates(shapely.segmentize(drivable.boundary, 0.5))
    random = np.random.default_rng(0)
    around = edges + random.uniform(-0.3, 0.3, edges.shape)
    columns = np.round(around[:, 0] * 10).astype(int)
    rows = np.round(mask.shape[0] - around[:, 1] * 10).astype(int)
    inside = shapely.contains_xy(drivable, columns / 10, (mask.shape[0] - rows) / 10)
    assert 0.2 < inside.mean() < 0.8
    assert np.array_equal(mask[rows, columns] == 255, inside)


def test_asymmetric_triangle_is_rasterised_by_hand():
    # Pixel (row, column) has its centre at x = column / 10, y = (5 - row) / 10.
    triangle = Polygon([(0.05, 0.05), (0.35, 0.05), (0.05, 0.45)])
    expected = [
        [0, 0, 0, 0, 0],
        [0, 0, 0, 0, 0],
        [0, 1, 0, 0, 0],
        [0, 1, 1, 0, 0],
        [0, 1, 1, 1, 0],
    ]
    mask = rasterise(shapely.MultiPolygon([triangle]), (0.5, 0.5))
    assert (mask // 255).tolist() == expected

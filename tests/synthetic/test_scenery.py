import numpy as np
import pytest
import shapely
from shapely.geometry import MultiLineString, MultiPolygon, Polygon

from ogmkit.errors import SettingsError
from ogmkit.geometry.boxes import box_corners
from ogmkit.geometry.se3 import inverse, transform_points
from ogmkit.synthetic.ground import GroundLayers, markings
from ogmkit.synthetic.parts import split_into_parts
from ogmkit.synthetic.scenery import TREE, Palette, Scenery, Solids, concatenate


def layers(**given):
    nothing = dict.fromkeys(("drivable", "walkway", "crossings", "islands"), MultiPolygon())
    no_lines = dict.fromkeys(("lane_dividers", "road_edges", "parking_lines"), MultiLineString())
    return GroundLayers(**{**nothing, **no_lines, **given})


def solids(category, *, annotated=True):
    pose = np.eye(4)[None].copy()
    pose[0, :3, 3] = (10, 20, 3)
    return Solids(
        pose, np.array([[4.0, 4.0, 6.0]]), (category,), np.full((1, 3), 90.0), np.array([annotated])
    )


def test_solids_of_disagreeing_lengths_are_refused():
    with pytest.raises(SettingsError, match="1 categories"):
        Solids(
            np.zeros((2, 4, 4)), np.ones((1, 3)), ("vehicle.car",), np.zeros((1, 3)), np.ones(1, dtype=bool)
        )


def test_concatenation_keeps_the_order_and_accepts_nothing():
    joined = concatenate([solids("vehicle.car"), solids(TREE, annotated=False)])
    assert joined.category == ("vehicle.car", TREE)
    assert joined.annotated.tolist() == [True, False]
    assert len(concatenate([])) == 0


@pytest.mark.parametrize("extent", [(0, 0, 0, 10), (10, 0, 0, 10), (0, 0, 100_000, 10)])
def test_empty_or_endless_extent_is_refused(extent):
    with pytest.raises(SettingsError, match="extent"):
        Scenery(layers(), None, Palette.from_seed(0), extent)


def test_palette_depends_on_its_seed_alone():
    assert Palette.from_seed(3) == Palette.from_seed(3)
    assert len({Palette.from_seed(seed) for seed in range(8)}) == 8


@pytest.mark.parametrize("seed", range(6))
def test_sun_stands_above_the_horizon(seed):
    sun = np.array(Palette.from_seed(seed).sun_direction)
    assert sun[2] > 0.4
    assert np.linalg.norm(sun) == pytest.approx(1)


def test_vehicle_is_one_part_and_a_tree_stays_within_its_box():
    parts = split_into_parts(concatenate([solids("vehicle.car"), solids(TREE)]))
    assert parts.solid_index[0] == 0
    np.testing.assert_array_equal(parts.solid_index[1:], 1)
    tree = box_corners(parts.global_from_part, parts.size_wlh)[1:]
    inside = transform_points(inverse(solids(TREE).global_from_box), tree)
    assert (np.abs(inside) <= np.array([2, 2, 3]) + 1e-9).all()
    assert inside[..., 2].min() == pytest.approx(-3)
    assert inside[..., 2].max() == pytest.approx(3)


def test_zebra_stripes_run_along_the_road_and_cover_half_of_the_crossing():
    """A crossing of 8 m across a road along x: stripes of 3 m length along x, one a metre."""
    crossing = Polygon([(0, 0), (3, 0), (3, 8), (0, 8)])
    stripes = markings(layers(crossings=crossing))
    assert len(stripes) == 8
    for stripe in stripes:
        west, south, east, north = stripe.bounds
        assert (east - west, north - south) == pytest.approx((3, 0.5))
    assert shapely.union_all(stripes).area == pytest.approx(crossing.area / 2)


def test_lane_dividers_are_dashed_and_parking_lines_solid():
    line = MultiLineString([[(0, 0), (75, 0)]])
    dashes, (solid,) = markings(layers(lane_dividers=line)), markings(layers(parking_lines=line))
    assert len(dashes) == 10
    assert sum(dash.area for dash in dashes) == pytest.approx(10 * 3 * 0.15)
    assert solid.area == pytest.approx(75 * 0.15)


def test_ground_raster_is_not_flipped():
    """Asphalt only in the south-western corner of a long extent."""
    drivable = Polygon([(100, 200), (110, 200), (110, 204), (100, 204)])
    world = Scenery(layers(drivable=drivable), None, Palette.from_seed(0), (100, 200, 140, 220))
    points = np.array([[105.0, 202], [135, 202], [105, 218], [135, 218]])
    x, y = points[:, 0].reshape(2, 2), points[:, 1].reshape(2, 2)
    colours = world.texture.sample(x, y, 1.6).astype(int)
    saturation = np.ptp(colours, axis=-1).ravel()
    assert saturation[0] < 15
    assert (saturation[1:] > 30).all()
    brightness = world.texture.brightness(points)
    assert brightness.shape == (4,)


def test_slopes_away_from_the_sun_are_darker():
    palette = Palette.from_seed(1)
    towards = np.array(palette.sun_direction[:2]) / np.hypot(*palette.sun_direction[:2])
    extent = (0, 0, 30, 30)
    bright, dark = (
        Scenery(layers(), lambda points, sign=sign: sign * 0.3 * (points @ towards), palette, extent).texture
        for sign in (-1, 1)
    )
    assert bright.levels[0].mean() > 1.1 * dark.levels[0].mean()

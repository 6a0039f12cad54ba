"""The fill by winding numbers against `fill_polygons`, which shapely checks."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.raster.fill import fill_polygons
from ogmkit.raster.winding import fill_wound

_SHAPE = (40, 30)


@st.composite
def _polygons(draw):
    """Some rings that don't cross themselves, each with or without a hole; many lie outside the raster."""
    polygons = []
    for _ in range(draw(st.integers(0, 5))):
        radii = np.array(draw(st.lists(st.floats(0.01, 60), min_size=3, max_size=9)))
        centre = np.array(draw(st.tuples(st.floats(-60, 90), st.floats(-60, 90))))
        angles = draw(st.floats(0, 7)) + np.arange(len(radii)) * 2 * np.pi / len(radii)
        spokes = np.stack([np.cos(angles), np.sin(angles)], 1)
        outer = centre + radii[:, None] * spokes
        hole = centre + draw(st.floats(0.1, 0.9)) * radii[:, None] * spokes
        polygons.append([outer] + [hole] * draw(st.booleans()))
    return polygons


def _wound(rasters, turned=False):
    """Fill the polygons of each raster; `turned` lets all rings run the other way."""
    rings = [ring for polygons in rasters for rings in polygons for ring in rings]
    # Angles that grow run clockwise on the screen, so the right of an outer ring runs down: its left runs up.
    sides = [
        -1 if place == 0 else 1 for polygons in rasters for rings in polygons for place in range(len(rings))
    ]
    planes = [plane for plane, polygons in enumerate(rasters) for rings in polygons for _ in rings]
    if turned:
        rings, sides = [ring[::-1] for ring in rings], [-side for side in sides]
    return fill_wound(
        np.concatenate([np.zeros((0, 2)), *rings]),
        np.array([len(ring) for ring in rings], dtype=np.int64),
        np.array(sides, dtype=np.int64),
        np.array(planes, dtype=np.int64),
        (len(rasters), *_SHAPE),
    )


@given(st.lists(_polygons(), min_size=1, max_size=3), st.booleans())
def test_polygons_unite_as_by_parity_of_each(rasters, turned):
    found = _wound(rasters, turned)
    for mask, polygons in zip(found, rasters, strict=True):
        owners = [number for number, rings in enumerate(polygons) for _ in rings]
        rings = [ring for rings in polygons for ring in rings]
        np.testing.assert_array_equal(mask, fill_polygons(rings, _SHAPE, polygon_of_ring=owners))


def test_one_polygon_fills_the_hole_of_another():
    def square(low, high):
        return np.array([[low, low], [high, low], [high, high], [low, high]], dtype=float)

    (mask,) = _wound([[[square(1, 8), square(2, 7)], [square(3, 5)]]])
    assert ["".join(".#"[cell] for cell in row[:9]) for row in mask[:9]] == [
        ".........",
        ".#######.",
        ".#.....#.",
        ".#.##..#.",
        ".#.##..#.",
        ".#.....#.",
        ".#.....#.",
        ".#######.",
        ".........",
    ]

"""The plane from above: rasters and metres lie on one another, and nothing is mirrored."""

import dataclasses

import numpy as np
import pytest

from ogmkit.drawing.bev_panel import FOOTER, Plan, draw_paths, draw_plane, plan_for
from ogmkit.drawing.cells import target_colours
from ogmkit.drawing.palette import theme
from ogmkit.grid import GridSpec
from ogmkit.pictures.views import read_view
from ogmkit.shards.reader import Shard

SIZE = 540, 960


@pytest.fixture
def view(make_shards):
    with Shard(make_shards() / "scene-0001.h5") as shard:
        return read_view(shard, "CAM_FRONT", 1)


def colour_at(canvas, plan, x_m, y_m):
    column, row = np.rint(plan.pixels(np.array([[x_m, y_m]]))[0]).astype(int)
    return canvas.pixels[row, column].tolist()


def expected(drivable, vehicle, seen):
    cells = (np.full((1, 1), value, np.uint8) for value in (drivable, vehicle, seen))
    return target_colours(*cells)[0, 0].tolist()


def drawn(view, plan):
    canvas = draw_plane(target_colours(view.drivable, view.vehicles, view.field_of_view), plan)
    draw_paths(canvas, view.past, view.future, plan)
    return canvas


def test_each_kind_of_cell_has_its_colour_at_its_place(view, grid):
    plan = plan_for(grid, [view.past], SIZE)
    canvas = drawn(view, plan)

    # Rows 20–29 and columns 4–7 of 0.5 m, the ego at (80, 24): x 25…30 m, y 8…10 m.
    assert colour_at(canvas, plan, 27.0, 9.0) == expected(0, 1, 1)
    assert colour_at(canvas, plan, 27.0, 8.2) == expected(0, 1, 1)
    assert colour_at(canvas, plan, 27.0, 7.8) == expected(0, 0, 1)
    assert colour_at(canvas, plan, 30.3, 9.0) == expected(0, 0, 1)
    assert colour_at(canvas, plan, 27.0, -9.0 + 1.5) == expected(0, 0, 1)
    # Columns 10–29 drive: y from −3 to 7 m; below row 60 (x < 10 m) the camera sees nothing.
    assert colour_at(canvas, plan, 27.0, 6.0) == expected(1, 0, 1)
    assert colour_at(canvas, plan, 27.0, -2.5) == expected(1, 0, 1)
    assert colour_at(canvas, plan, 27.0, -3.5) == expected(0, 0, 1)
    assert colour_at(canvas, plan, 5.0, 6.0) == expected(1, 0, 0)


def test_past_and_future_points_have_their_dots(view, grid):
    plan = plan_for(grid, [view.past], SIZE)
    canvas = drawn(view, plan)

    assert view.future[5].tolist() == [12.0, pytest.approx(3.6)]
    beside_m = 4 / plan.px_per_m  # on the ring, off the line
    for x_m, y_m in view.future[1:]:
        assert colour_at(canvas, plan, x_m, y_m - beside_m) == list(theme().future)
    for x_m, y_m in view.past[:4]:
        assert colour_at(canvas, plan, x_m, y_m - beside_m) == list(theme().first)
    assert colour_at(canvas, plan, 12.0, -3.6) != list(theme().future)
    assert colour_at(canvas, plan, 0.0, 0.0) == list(theme().text)


def test_lines_leave_vehicles_as_they_are_and_points_are_rings(view, grid):
    future = np.array([[5.0, 0.0], [12.0, 0.0], [30.0, 0.0], [31.0, 0.0], [32.0, 0.0], [33.0, 0.0]])
    vehicles = np.zeros_like(view.vehicles)
    vehicles[30:60, 22:26] = 1  # 10 to 25 m ahead, 1 m to either side
    busy = dataclasses.replace(view, vehicles=vehicles, future=future)
    plan = plan_for(grid, [view.past], SIZE)
    canvas = drawn(busy, plan)

    for x_m in (15.0, 20.0, 24.0):  # between the points at 12 and 30 m
        for y_m in (-0.5, 0.0, 0.5):
            assert colour_at(canvas, plan, x_m, y_m) == list(theme().vehicle)
    assert colour_at(canvas, plan, 28.0, 0.0) == list(theme().future)
    assert colour_at(canvas, plan, 12.0, 0.0) == list(theme().vehicle)
    assert colour_at(canvas, plan, 12.0, 4 / plan.px_per_m) == list(theme().future)


def test_missing_points_draw_nothing(view, grid):
    nothing = np.full((6, 2), np.nan)
    lonely = dataclasses.replace(view, past=nothing, future=nothing)
    canvas = drawn(lonely, plan_for(grid, [lonely.past], SIZE))

    for colour in (theme().first, theme().future):
        assert not (canvas.pixels == colour).all(axis=2).any()


def test_the_strip_behind_holds_the_longest_past_up_to_a_limit(view, grid):
    def behind_m(distance_m):
        past = view.past.copy()
        past[0, 0] = -distance_m
        return plan_for(grid, [view.past, past], SIZE).behind_m

    assert behind_m(1.0) == 8.0
    assert behind_m(20.0) == 22.0
    assert behind_m(60.0) == 62.0
    assert behind_m(1e6) == 62.0
    assert plan_for(grid, [], SIZE).behind_m == 4.0


@pytest.mark.parametrize(
    "grid",
    [GridSpec(), GridSpec(0.25, 40, 900, 20, 17.5), GridSpec(1.0, 7, 3, 7, 1), GridSpec(0.1, 1, 1, 1, 0)],
)
def test_a_plan_fits_whatever_the_grid(view, grid):
    plan = plan_for(grid, [view.past], SIZE)
    height, width = plan.size

    assert 1 <= height <= SIZE[0] + 1
    assert 1 <= width <= SIZE[1] + 1
    assert draw_plane(np.zeros((*grid.shape, 3), np.uint8), plan).shape == plan.size


def test_metres_and_cells_agree_at_the_corners():
    grid = GridSpec(0.5, 80, 40, 80, 24)
    plan = Plan(grid, px_per_m=10.0, behind_m=5.0)

    assert plan.size == (450 + FOOTER, 200)
    # Five pixels a cell: the centre of cell (column 0, row 0) is pixel (2, 2).
    np.testing.assert_allclose(
        plan.pixels(grid.positions_m(np.array([[0, 0], [39, 79]]))), [[2, 2], [197, 397]]
    )


def test_the_scale_bar_is_as_long_as_it_says(view, grid):
    plan = plan_for(grid, [view.past], SIZE)
    canvas = drawn(view, plan)
    bar = canvas.pixels[plan.size[0] - FOOTER // 2]
    ink = (bar == theme().text).all(axis=1) | (bar == theme().muted).all(axis=1)
    columns = np.flatnonzero(ink[: round(6 * plan.px_per_m)])

    # 20 m wide: 5 m is the longest round length under 45 % of it.
    assert columns.max() - columns.min() + 1 == pytest.approx(5 * plan.px_per_m, abs=1)


def test_no_path_reaches_the_scale_bar(view, grid):
    past = np.stack([np.linspace(-1000.0, -1.0, 6), np.linspace(16.0, 0.0, 6)], axis=1)
    plan = plan_for(grid, [past], SIZE)
    far, near = (drawn(dataclasses.replace(view, past=one), plan).pixels for one in (past, view.past))

    assert (far[:-FOOTER] != near[:-FOOTER]).any()
    np.testing.assert_array_equal(far[-FOOTER:], near[-FOOTER:])

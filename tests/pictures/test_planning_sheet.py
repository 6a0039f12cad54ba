"""Pictures of plans: where points, ellipses and destination lie."""

import dataclasses

import cv2
import numpy as np
import pytest

from ogmkit.drawing import legend, plan_marks
from ogmkit.drawing.bev_panel import FOOTER
from ogmkit.drawing.bev_panel import Plan as BevPlan
from ogmkit.drawing.canvas import Canvas
from ogmkit.drawing.palette import theme
from ogmkit.evaluation.planning.result import PlanEvaluation, PlanSample
from ogmkit.grid import GridSpec
from ogmkit.metrics.plan import Plan
from ogmkit.pictures.planning_sheet import draw_plan, draw_plans
from ogmkit.pictures.views import read_view
from ogmkit.shards.reader import Shard

HEIGHT, WIDTH = 800, 600
PX_PER_M = (HEIGHT - FOOTER) / 24
"""Plans 5 m aside need 9 m aside on a panel of 4 by 3: 6 m behind and 18 m ahead."""


@pytest.fixture
def view(make_shards):
    with Shard(make_shards() / "scene-0002.h5") as shard:
        return read_view(shard, "CAM_FRONT", 1)


@pytest.fixture
def far_plan():
    """Points apart from the true ones, on the right."""
    mean = np.stack([np.arange(2.0, 12.0, 2.0), np.full(5, -5.0)], axis=1)
    return Plan(mean, np.tile([0.8, 0.2], (5, 1)), np.zeros(5))


def colour_at(canvas, x, y):
    """Of a place in the level frame, on the panel of a frame that reaches 18 m ahead."""
    column, row = (9 - y) * PX_PER_M, (18 - x) * PX_PER_M
    return tuple(canvas.pixels[round(row), round(column)].tolist())


def test_everything_lies_where_it_is(view, grid, far_plan):
    canvas = draw_plan(view, grid, far_plan)

    assert canvas.shape == pytest.approx((HEIGHT, 17 * PX_PER_M), abs=2)  # the grid ends 8 m to the right
    for point in far_plan.mean:
        assert colour_at(canvas, *point) == theme().second
    for x, y in view.future[:5]:
        assert colour_at(canvas, x, y - 4 / PX_PER_M) == theme().future
    assert colour_at(canvas, *view.future[5]) == theme().future
    assert colour_at(canvas, -3.0, -4 / PX_PER_M) == theme().first
    # The fixture: drivable in columns 10 … 29 (y from −3 to 7 m), in view over 10 m ahead.
    assert colour_at(canvas, 13.0, 1.0) == theme().drivable
    assert colour_at(canvas, 13.0, -4.0) == theme().ground


def test_a_destination_that_is_not_told_is_not_marked(view, grid, far_plan):
    mean = np.concatenate([far_plan.mean, [[12.0, -5.0]]])
    canvas = draw_plan(view, grid, Plan(mean, np.ones((6, 2)), np.zeros(6)))

    assert colour_at(canvas, 12.0, -5.0) == theme().second
    x, y = view.future[5]
    assert colour_at(canvas, x, y) != theme().future  # a ring, through which the cells are seen
    assert colour_at(canvas, x, y - 4 / PX_PER_M) == theme().future


def test_ellipses_reach_as_far_as_their_share(view, grid, far_plan):
    with_ellipses = draw_plan(view, grid, far_plan)
    nan = np.full((5, 2), np.nan)
    without = draw_plan(view, grid, Plan(far_plan.mean, nan, nan[:, 0]))

    def touched(dx, dy):
        place = 10.0 + dx, -5.0 + dy
        return colour_at(with_ellipses, *place) != colour_at(without, *place)

    # √(−2 ln 0.1) = 2.15 standard deviations of 0.8 m ahead and 0.2 m aside.
    assert touched(2.146 * 0.8, 0.0)
    assert touched(0.0, 2.146 * 0.2)
    for inside_or_beyond in ((1.5, 0.0), (1.9, 0.0), (0.0, 0.6), (0.0, 0.33)):
        assert not touched(*inside_or_beyond)  # an outline alone: what it holds stays visible


def test_vehicles_are_those_of_the_frame(view, grid, far_plan):
    vehicles = np.zeros_like(view.vehicles)
    vehicles[50:54, 30:34] = 1  # x from 13 to 15 m, y from −5 to −3 m
    canvas = draw_plan(dataclasses.replace(view, vehicles=vehicles), grid, far_plan)

    assert colour_at(canvas, 14.0, -4.0) == theme().vehicle
    assert colour_at(canvas, 14.0, -5.5) == theme().ground


@pytest.mark.parametrize("end", [(39.0, 0.0), (5.0, 10.0), (5.0, -7.0), (900.0, 3.0), (-20.0, 0.0)], ids=str)
def test_the_panel_holds_what_the_grid_holds(view, grid, end):
    mean = np.linspace(0, 1, 6)[1:, None] * end
    canvas = draw_plan(view, grid, Plan(mean, np.ones((5, 2)), np.zeros(5)))

    assert canvas.shape[0] <= HEIGHT + 1
    assert canvas.shape[1] <= WIDTH + 1
    inside = -6 < end[0] < grid.x_range_m[1] and grid.y_range_m[0] < end[1] < grid.y_range_m[1]
    planned = (canvas.pixels == theme().second).all(axis=-1).astype(np.uint8)
    _, _, stats, _ = cv2.connectedComponentsWithStats(planned)
    sides = stats[1:, cv2.CC_STAT_WIDTH : cv2.CC_STAT_HEIGHT + 1].max(axis=1)
    dots = np.count_nonzero((stats[1:, cv2.CC_STAT_AREA] >= 55) & (sides <= 12))  # letters are thinner
    assert dots == 5 if inside else dots < 5


def test_a_grid_that_the_ego_is_not_on(view, far_plan):
    grid = GridSpec(m_per_cell=0.5, rows=80, columns=40, ego_row=-60, ego_column=90)

    assert min(draw_plan(view, grid, far_plan).shape) > 0


def test_one_sheet_a_planner(make_shards, tmp_path, far_plan):
    shards = make_shards()
    place = "scene-0002", "CAM_FRONT", 1
    evaluation = PlanEvaluation(
        split="val",
        scenes=1,
        sequences=2,
        cameras=("CAM_FRONT",),
        systems=("holistic", "runs/a"),
        fixed=(),
        figures=(),
        notes=(),
        samples=tuple(PlanSample(name, place, far_plan) for name in ("holistic", "runs/a", "runs/a")),
    )
    written = draw_plans(shards, evaluation, tmp_path)

    assert written == (tmp_path / "holistic-plans.png", tmp_path / "runs%2Fa-plans.png")
    one, two = (cv2.imread(str(path)) for path in written)
    assert one.shape[1] == two.shape[1]
    assert two.shape[0] > one.shape[0] > HEIGHT
    assert (one == np.array(theme().future)[::-1]).all(axis=-1).sum() > 100


def test_swatches_have_the_legends_size():
    _, entries = plan_marks.plan_group(told=True, ellipses=True)
    shapes = {swatch.shape for swatch, _ in entries()}
    assert shapes == {swatch.shape for swatch, _ in legend.EGO[1]()}


def test_the_legend_names_what_the_plans_have():
    labels = [
        [label for _, label in plan_marks.plan_group(told=told, ellipses=ellipses)[1]()]
        for told, ellipses in ((False, False), (True, False), (False, True))
    ]

    ellipse = "90 % of its distribution"
    assert labels == [["planned"], ["destination", "planned"], ["planned", ellipse]]


def test_points_have_their_times_on_the_side_away_from_the_truth(view, grid, far_plan):
    canvas = draw_plan(view, grid, far_plan)
    for x, y in far_plan.mean:  # to the right of the true path
        row, column = round((18 - x) * PX_PER_M), round((9 - y) * PX_PER_M)
        right, left = (
            canvas.pixels[row, column + 10 : column + 50],
            canvas.pixels[row, column - 50 : column - 10],
        )
        plate = (right == theme().page).all(axis=-1) | (right == theme().second).all(axis=-1)
        assert plate.sum() >= 12
        assert not (left == theme().page).all(axis=-1).any()


def test_crowded_points_leave_some_times_out():
    canvas, plane = Canvas(400, 300), BevPlan(GridSpec(0.5, 60, 60, 60, 30), 10.0, 4.0)
    mean = np.stack([np.linspace(5.0, 6.0, 5), np.full(5, 2.0)], axis=1)
    before = canvas.pixels.copy()
    plan_marks.draw_plan_marks(canvas, plane, mean, np.zeros((6, 2)), labels=list("12345"))

    x = round(plane.pixels(mean[:1])[0, 0])
    changed = (canvas.pixels[:, x - 45 : x - 12] != before[:, x - 45 : x - 12]).any(axis=(1, 2))
    assert np.count_nonzero(np.diff(changed.astype(int)) == 1) == 1  # 10 px hold one label of 18

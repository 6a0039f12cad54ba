"""Tiles of the views that show masks: what stands where, and what is said of it."""

import dataclasses

import numpy as np
import pytest

from ogmkit.drawing.bev_panel import plan_for
from ogmkit.drawing.canvas import fit
from ogmkit.drawing.palette import theme
from ogmkit.drawing.sheet import CAPTION, GAP
from ogmkit.grid import GridSpec
from ogmkit.pictures.masks import open_sets
from ogmkit.pictures.subjects import PLANE_SIZE, SUBJECTS, photo_size
from ogmkit.pictures.views import read_view
from ogmkit.shards.reader import Shard

TOP = 2 * CAPTION
"""Above a tile's panels stand its own line and the first titles."""


@pytest.fixture
def path(make_shards):
    return make_shards(images="none") / "scene-0001.h5"


def draw(path, grid, subject, names, index=1):
    with Shard(path) as shard:
        view = read_view(shard, "CAM_FRONT", index)
        further = dict.fromkeys(("layers/lane", "classes/car", "instances/id"), view.vehicles)
        view = dataclasses.replace(view, further=further)
        plan = plan_for(grid, (), PLANE_SIZE)
        tile = SUBJECTS[subject].tile(view, plan, open_sets(shard, "CAM_FRONT", names) if names else ())
    return tile, plan


def plane(tile, plan, place):
    """One of the planes at a tile's right end: place −1 is the last."""
    width = plan.size[1]
    right = tile.shape[1] + (place + 1) * (width + GAP)
    return tile[TOP : TOP + plan.size[0], right - width : right]


def photo(tile, plan, place):
    """One of the pictures below each other at a tile's left end."""
    height, width = fit((90, 160), photo_size(plan))
    top = TOP + place * (height + GAP + CAPTION)
    return tile[top : top + height, :width]


def has(pixels, colour):
    return bool((pixels == colour).all(axis=2).any())


def body_mask():
    """A car at 8…10 m whose body reaches from the ground (row 62) to above the horizon (row 44.5)."""
    mask = np.zeros((90, 160), np.uint8)
    mask[35:63, 70:90] = 1
    return mask


def test_footprints_are_drawn_over_the_image_and_compared_from_above(path, grid, add_masks):
    mask = np.zeros((90, 160), np.uint8)
    mask[:, 100:120] = 1
    mask[:48] = 0  # 1.5 + 150 / 3.5 = 44 m: nearer than the grid's end
    add_masks(path, vehicles=mask)
    tile, plan = draw(path, grid, "footprints", ("surface",))

    masked = photo(tile, plan, 1).astype(int)
    assert tile.shape[1] == masked.shape[1] + 2 * (GAP + plan.size[1])
    tinted = (masked[..., 0] - masked[..., 2] > 100).nonzero()
    scale = masked.shape[0] / 90
    found = tinted[0].min(), tinted[1].min(), tinted[1].max()
    assert found == pytest.approx((48 * scale, 100 * scale, 120 * scale - 1), abs=1)
    assert not (photo(tile, plan, 0) == theme().vehicle).all(axis=2).any()
    true, compared = plane(tile, plan, -2), plane(tile, plan, -1)
    assert has(true, theme().vehicle)
    assert not has(true, theme().second)
    assert has(compared, theme().first)
    assert has(compared, theme().second)


def test_drivable_area_that_agrees_has_its_own_colour_all_over(path, grid, add_masks):
    with Shard(path) as shard:
        drivable = shard.dataset("CAM_FRONT", "drivable")[1]
    v, u = np.mgrid[0:90, 0:160].astype(float)
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(v > 44.5, 150 / (v - 44.5), np.nan)
    column, row = 24 + (u - 79.5) / 100 * depth / 0.5, 80 - (1.5 + depth) / 0.5
    inside = (column >= 0) & (column < 40) & (row >= 0) & (row < 80)
    mask = np.zeros((90, 160), np.uint8)
    mask[inside] = drivable[row[inside].astype(int), column[inside].astype(int)]
    add_masks(path, drivable=mask)
    tile, plan = draw(path, grid, "footprints", ("surface",))

    near = plane(tile, plan, -1)[round((40 - 16) * plan.px_per_m) : round((40 - 11) * plan.px_per_m)]
    width = near.shape[1]
    middle = near[:, round(width * 0.3) : round(width * 0.7)]
    assert (middle == theme().drivable).all()


def test_a_whole_body_is_stretched_away_from_the_camera_and_its_footprint_is_not(path, grid, add_masks):
    footprint = body_mask()
    footprint[:59] = 0  # 1.5 + 150 / 14.5 = 11.8 m
    add_masks(path, "full-body", homography="", vehicles=body_mask())
    add_masks(path, vehicles=footprint)
    tile, plan = draw(path, grid, "stretch", ("full-body", "surface"))
    truth = plane(tile, plan, -3)
    assert has(truth, theme().vehicle)
    assert not has(truth, theme().second)

    stretched, kept = (
        (plane(tile, plan, place) == theme().second).all(axis=2).nonzero()[0] for place in (-2, -1)
    )
    assert stretched.min() < 5  # to the far end of the grid
    assert kept.min() > (40 - 12.5) * plan.px_per_m


def test_the_camera_view_and_the_plane_have_the_same_colours(path, grid, add_masks):
    mask = np.zeros((90, 160), np.uint8)
    mask[60:] = 1
    vehicles = np.zeros_like(mask)
    vehicles[:20] = vehicles[80:] = 1
    add_masks(path, drivable=mask, vehicles=vehicles)
    tile, plan = draw(path, grid, "masks", ("surface",))

    masks = photo(tile, plan, 1)
    scale = masks.shape[0] / 90
    shown = [tuple(masks[round(scale * (row + 0.5)), 200].tolist()) for row in (5, 30, 70, 85)]
    assert shown == [theme().vehicle, theme().ground, theme().drivable, theme().vehicle]


@pytest.mark.parametrize("subject", ["footprints", "stretch", "masks"])
def test_a_frame_without_homography_is_named_in_its_caption(path, grid, add_masks, subject):
    for name in ("full-body", "surface"):
        add_masks(path, name, invalid=(1,))
    names = SUBJECTS[subject].sets("surface")
    silent, plan = draw(path, grid, subject, names, index=0)
    told, _ = draw(path, grid, subject, names, index=1)

    assert has(told[:CAPTION], theme().alarm)
    assert not has(silent[:CAPTION], theme().alarm)
    assert told.shape == silent.shape
    if subject != "masks":
        assert not has(plane(told, plan, -1), theme().ground)
        assert has(plane(silent, plan, -1), theme().ground)


@pytest.mark.parametrize("shape", [(80, 40), (80, 160), (40, 400), (400, 40)])
def test_planes_get_a_third_of_the_width_or_more(shape):
    plan = plan_for(GridSpec(0.5, *shape, shape[0], shape[1] / 2), (), PLANE_SIZE)
    width = fit((900, 1600), photo_size(plan))[1]

    assert plan.size[1] / (width + GAP + plan.size[1]) >= 1 / 3 - 0.001


@pytest.mark.parametrize("subject", SUBJECTS)
def test_every_panel_has_a_title(path, grid, add_masks, subject):
    for name in ("full-body", "surface"):
        add_masks(path, name)
    tile, plan = draw(path, grid, subject, SUBJECTS[subject].sets("surface"))
    height, width = fit((90, 160), photo_size(plan))
    planes = round((tile.shape[1] - width) / (plan.size[1] + GAP))
    lefts = [width + GAP + place * (plan.size[1] + GAP) for place in range(planes)]

    second = TOP + height + GAP
    titles = [tile[CAPTION:TOP, left : left + 60] for left in (0, *lefts)] + [
        tile[second : second + CAPTION, :60]
    ]
    assert planes >= 1
    assert all(has(title, theme().text) for title in titles)

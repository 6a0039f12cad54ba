"""Tiles of the views that show masks: what stands where, and what is said of it."""

import numpy as np
import pytest

from ogmkit.pictures import cells
from ogmkit.pictures.bev_panel import plan_for
from ogmkit.pictures.canvas import YELLOW, fit
from ogmkit.pictures.masks import open_sets
from ogmkit.pictures.subjects import CAMERA_SIZE, PLANE_SIZE, SUBJECTS
from ogmkit.pictures.views import read_view
from ogmkit.shards.reader import Shard

CAPTION = 44
CAMERA_WIDTH = fit((90, 160), CAMERA_SIZE)[1]


@pytest.fixture
def path(make_shards):
    return make_shards(images="none") / "scene-0001.h5"


def draw(path, grid, subject, names, index=1):
    with Shard(path) as shard:
        view = read_view(shard, "CAM_FRONT", index)
        plan = plan_for(grid, (), PLANE_SIZE)
        tile = SUBJECTS[subject].tile(view, plan, open_sets(shard, "CAM_FRONT", names))
    return tile, plan


def plane(tile, plan, place):
    """One of the planes at a tile's right end: place −1 is the last."""
    width = plan.size[1]
    right = tile.shape[1] + (place + 1) * (width + 12)
    return tile[CAPTION : CAPTION + plan.size[0], right - width : right]


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

    assert tile.shape[1] == CAMERA_WIDTH + 2 * (12 + plan.size[1])
    photo = tile[CAPTION : CAPTION + CAMERA_SIZE[0], :CAMERA_WIDTH].astype(int)
    tinted = (photo[..., 0] - photo[..., 2] > 100).nonzero()
    # Five pixels of the panel for one of the image.
    assert (tinted[0].min(), tinted[1].min(), tinted[1].max()) == (48 * 5, 100 * 5, 120 * 5 - 1)
    true, compared = plane(tile, plan, -2), plane(tile, plan, -1)
    assert has(true, cells.VEHICLE_COLOUR)
    assert not has(true, cells.ONLY_OTHER_COLOUR)
    assert has(compared, cells.ONLY_TRUE_COLOUR)
    assert has(compared, cells.ONLY_OTHER_COLOUR)


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
    assert (middle == cells.DRIVABLE_COLOUR).all()


def test_a_whole_body_is_stretched_away_from_the_camera_and_its_footprint_is_not(path, grid, add_masks):
    footprint = body_mask()
    footprint[:59] = 0  # 1.5 + 150 / 14.5 = 11.8 m
    add_masks(path, "full-body", homography="", vehicles=body_mask())
    add_masks(path, vehicles=footprint)
    tile, plan = draw(path, grid, "stretch", ("full-body", "surface"))

    stretched, kept = (
        (plane(tile, plan, place) == cells.ONLY_OTHER_COLOUR).all(axis=2).nonzero()[0] for place in (-2, -1)
    )
    assert stretched.min() < 5  # to the far end of the grid
    assert kept.min() > (40 - 12.5) * plan.px_per_m


def test_the_camera_view_and_the_plane_have_the_same_colours(path, grid, add_masks):
    mask = np.zeros((90, 160), np.uint8)
    mask[60:] = 1
    vehicles = np.zeros_like(mask)
    vehicles[:20] = vehicles[80:] = 1
    add_masks(path, drivable=mask, vehicles=vehicles)
    tile, _ = draw(path, grid, "masks", ("surface",))

    masks = tile[CAPTION : CAPTION + 450, CAMERA_WIDTH + 12 : 2 * CAMERA_WIDTH + 12]
    shown = [tuple(masks[5 * row + 2, 400].tolist()) for row in (5, 30, 70, 85)]
    assert shown == [cells.VEHICLE_COLOUR, cells.GROUND_COLOUR, cells.DRIVABLE_COLOUR, cells.VEHICLE_COLOUR]


@pytest.mark.parametrize("subject", ["footprints", "stretch", "masks"])
def test_a_frame_without_homography_is_named_in_its_caption(path, grid, add_masks, subject):
    for name in ("full-body", "surface"):
        add_masks(path, name, invalid=(1,))
    names = SUBJECTS[subject].sets("surface")
    silent, plan = draw(path, grid, subject, names, index=0)
    told, _ = draw(path, grid, subject, names, index=1)

    assert has(told[:CAPTION], YELLOW)
    assert not has(silent[:CAPTION], YELLOW)
    assert told.shape == silent.shape
    if subject != "masks":
        assert not has(plane(told, plan, -1), cells.GROUND_COLOUR)
        assert has(plane(silent, plan, -1), cells.GROUND_COLOUR)

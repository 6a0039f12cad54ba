"""Makes the pictures of docs/concepts/ from a synthetic world of hills: `make pictures`.

    python docs/concept_pictures.py [SHARDS]

SHARDS has what `make_shards` makes; without it, that is made first.
"""

import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import cv2
import numpy as np
from make_pictures import DOCS, QUALITY, ogmkit
from PIL import Image

from ogmkit import GridSpec, Shard, ShardFolder, warp_to_bev
from ogmkit.drawing import legend
from ogmkit.drawing.bev_panel import draw_plane, plan_for
from ogmkit.drawing.canvas import Canvas, fit
from ogmkit.drawing.cells import agreement_colours, stripes, target_colours
from ogmkit.drawing.palette import Colour, theme
from ogmkit.drawing.sheet import Column, Panel, draw_tile
from ogmkit.geometry.camera import image_from_resized
from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.ground import fit_ground
from ogmkit.homography.projective import apply
from ogmkit.metrics.controls import constant_velocity
from ogmkit.metrics.scores import displacement_errors
from ogmkit.pictures.camera_panel import draw_camera, draw_masks, draw_photo
from ogmkit.pictures.masks import open_sets
from ogmkit.pictures.subjects import scores_text
from ogmkit.pictures.views import View, read_view
from ogmkit.pipeline.geometry import frame_geometry
from ogmkit.raster.fill import fill_polygons
from ogmkit.typing import FloatArray, UInt8Array

CAMERA = "CAM_FRONT"
SLOPE, STREET = "scene-0001", "scene-0003"
FRAME = 12
PHOTO = 330, 640
PLANE = 480, 300
TEXT = 20
MARGIN = 24
WORLD = ("--num-scenes", 4, "--relief", 3, "--camera", CAMERA, "--seed", 5)


def main(shards: Path) -> None:
    """Draw every picture."""
    folder = ShardFolder(shards)
    for name, (scene, draw) in PICTURES.items():
        with folder.shard(scene) as shard:
            save(draw(shard), name)


def make_shards(work: Path) -> Path:
    """A world of hills, and all that the pictures show."""
    world, shards = work / "world", work / "shards"
    ogmkit("synthesize", world, *WORLD)
    ogmkit("extract", world, shards, "--scenes", f"{SLOPE},{STREET}", "--seen", "rays,lidar")
    ogmkit("homography-fit", shards, "--method", "surface,calibration")
    for method in ("warp", "project", "full-body"):
        ogmkit("render-footprints", shards, "--method", method)
    return shards


def save(pixels: UInt8Array, name: str) -> None:
    """Write a picture with a margin, without loss."""
    height, width = pixels.shape[:2]
    canvas = Canvas(height + 2 * MARGIN, width + 2 * MARGIN)
    canvas.paste(pixels, MARGIN, MARGIN)
    Image.fromarray(canvas.pixels).save(DOCS / "concepts" / f"{name}.webp", quality=QUALITY, method=6)


def level_frame(shard: Shard) -> UInt8Array:
    """A body on a slope with both frames' axes; the image with both horizons."""
    tilts = [abs(pitch_rad(frame_geometry(shard, CAMERA, index))) for index in range(shard.frames(CAMERA))]
    index = int(np.argmax(tilts))
    geometry, view = frame_geometry(shard, CAMERA, index), read_view(shard, CAMERA, index)
    photo = draw_photo(view, PHOTO)
    angles = np.radians(np.linspace(-50, 50, 41))
    level = np.stack([np.cos(angles), np.sin(angles), np.zeros(41)], axis=-1)
    for directions, colour in (
        (level, theme().vehicle),
        (level @ geometry.level_from_ego[:3, :3].T, theme().second),
    ):
        far = geometry.level_from_camera[:3, 3] + 1e6 * directions
        on_photo(photo, geometry, far, colour)
    degrees = np.degrees(pitch_rad(geometry))
    side = Panel(side_view(photo.shape[0]).pixels, "from the side", "slope drawn steeper than it is")
    return stacked(
        [side, Panel(photo.pixels, "in the image", f"ego pitched by {abs(degrees):.1f}°")],
        [("level frame, its horizon", theme().vehicle), ("ego frame, its horizon", theme().second)],
    )


def pitch_rad(geometry: FrameGeometry) -> float:
    """How far the ego's x axis points up."""
    return float(np.arcsin(geometry.level_from_ego[2, 0]))


def side_view(height: int) -> Canvas:
    """A vehicle on a slope, the axes of both frames at its origin."""
    width, slope = 500, np.radians(12)
    canvas = Canvas(height, width, theme().empty)
    turn = np.array([[np.cos(slope), -np.sin(slope)], [-np.sin(slope), -np.cos(slope)]])  # x ahead, z up

    def placed(points: Sequence[Sequence[float]], turned: FloatArray) -> FloatArray:
        return np.array([170.0, 235.0]) + 44 * np.array(points, dtype=float) @ turned.T

    canvas.polygon(placed([(-9, 0), (9, 0), (9, -9), (-9, -9)], turn), theme().drivable)
    body = [(-0.9, 0.35), (3.7, 0.35), (3.7, 0.9), (2.6, 1.0), (1.9, 1.6), (-0.3, 1.6), (-0.9, 1.0)]
    canvas.polygon(placed(body, turn), theme().line)
    canvas.dots(placed([(0, 0.35), (2.8, 0.35)], turn), theme().muted, 15)
    flat = np.array([[1.0, 0], [0, -1.0]])
    for name, turned, colour in (("ego", turn, theme().second), ("level", flat, theme().vehicle)):
        for tip, axis in (((5.4, 0.0), "x"), ((0.0, 3.6), "z")):
            arrow(canvas, placed([(0, 0), tip], turned), colour)
            x, y = placed([tip], turned)[0]
            right = axis == "x" or name == "level"
            canvas.text(
                f"{axis} {name}",
                int(x) + (10 if right else -10),
                int(y) - 6,
                TEXT,
                colour,
                "left" if right else "right",
            )
    return canvas


def grid(shard: Shard) -> UInt8Array:
    """The paper's grid, and the cells of one vehicle on a coarser one."""
    view = read_view(shard, CAMERA, FRAME)
    plan = plan_for(shard.grid, [], (560, 330))
    plane = draw_plane(target_colours(view.drivable, view.vehicles, np.ones_like(view.vehicles)), plan)
    coarse = GridSpec(0.5, 14, 16, 14.0, 8.0)
    turned = np.array([[np.cos(0.45), -np.sin(0.45)], [np.sin(0.45), np.cos(0.45)]])
    corners = np.array([[2.3, 0.95], [2.3, -0.95], [-2.3, -0.95], [-2.3, 0.95]]) @ turned.T + [3.4, 0.3]
    outline = coarse.cells(corners)
    inside = fill_polygons([outline], coarse.shape)
    drawn = np.zeros(coarse.shape, np.uint8)
    cv2.fillPoly(drawn, [np.rint(outline).astype(np.int32)], 1)
    side = 36
    zoom = Canvas(side * coarse.rows, side * coarse.columns, theme().ground)
    for row, column in np.ndindex(coarse.shape):
        left, top = side * column, side * row
        if inside[row, column]:
            zoom.fill(left, top, side, side, theme().drivable)
        elif drawn[row, column]:
            zoom.fill(left + side // 4, top + side // 4, side // 2, side // 2, theme().second)
        zoom.fill(left, top, side, 1, theme().line)
        zoom.fill(left, top, 1, side, theme().line)
        zoom.dots(np.array([[left, top]]) + side / 2, theme().text, 2.0)
    closed = (np.concatenate([outline, outline[:1]]) + 0.5) * side
    zoom.cased_polyline(closed, theme().vehicle, 3)
    return stacked(
        [
            Panel(plane.pixels, "1000 by 550 cells"),
            Panel(zoom.pixels, "one vehicle, cells of 0.5 m", "a cell counts by its centre"),
        ],
        [
            ("ground face of the box", theme().vehicle),
            ("its cells", theme().drivable),
            ("filled by cv2.fillPoly, too", theme().second),
        ],
    )


def field_of_view(shard: Shard) -> UInt8Array:
    """The image, and the plane with three kinds of cells."""
    view, plan = read_view(shard, CAMERA, FRAME), plan_for(shard.grid, [], PLANE)
    photos = [
        Panel(draw(view, (300, 380)).pixels, title)
        for draw, title in ((draw_photo, "image"), (draw_camera, "boxes"))
    ]
    columns: list[Column] = [photos]
    for name in ("field_of_view", "seen/rays", "seen/lidar"):
        cells = shard.dataset(CAMERA, name)[FRAME]
        edged = cells if name != "seen/lidar" else np.ones_like(cells)  # of 0.2° each: all edges
        colours = target_colours(view.drivable, view.vehicles, edged)
        colours[(cells == 0) & stripes(cells.shape, 1)] = theme().ground
        columns.append(Panel(draw_plane(colours, plan).pixels, name, f"{cells.mean():.0%}"))
    return with_legend(draw_tile(columns), legend.PLANE)


def surface_homography(shard: Shard) -> UInt8Array:
    """Lines across the road by two homographies, the ground's height, and where true corners land."""
    geometry, view = frame_geometry(shard, CAMERA, FRAME), read_view(shard, CAMERA, FRAME)
    shown = {"surface": theme().vehicle, "calibration": theme().second}
    image_from_bev = {
        name: np.linalg.inv(shard.dataset(CAMERA, f"homography/{name}/bev_from_image")[FRAME])
        for name in shown
    }
    photo, scale = draw_photo(view, PHOTO), fit(view.image_size, PHOTO)[0] / view.image_size[0]
    for ahead_m in (10.0, 20.0, 30.0, 40.0, 50.0):
        line = np.stack([np.full(31, ahead_m), np.linspace(-9, 9, 31)], axis=-1)
        heights, _ = fit_ground(geometry).height_m(line)
        on_photo(photo, geometry, np.column_stack([line, heights]), theme().first, 4)
        for name, colour in shown.items():
            pixels, _ = apply(image_from_bev[name], shard.grid.cells(line))
            photo.polyline((pixels + 0.5) * scale - 0.5, colour)
    plan = plan_for(shard.grid, [], (photo.shape[0] + 250, 330))
    plane = draw_plane(target_colours(view.drivable, np.zeros_like(view.vehicles), view.field_of_view), plan)
    vehicles = [
        box
        for box in np.flatnonzero(geometry.wholly_visible)
        if geometry.category[box].startswith("vehicle.")
    ]
    for box in vehicles:
        ring = np.array([0, 1, 2, 3, 0])
        plane.cased_polyline(plan.pixels(geometry.ground_corners_level[box, ring, :2]), theme().first)
        for name, colour in shown.items():
            cells, _ = apply(np.linalg.inv(image_from_bev[name]), geometry.ground_corners_px[box, ring])
            plane.cased_polyline(plan.pixels(shard.grid.positions_m(cells)), colour)
    profile = height_profile(geometry, photo.shape[1])
    return stacked(
        [
            [
                Panel(photo.pixels, "image", "lines across the road, every 10 m"),
                Panel(profile.pixels, "the ground's height along x", "10 times as steep"),
            ],
            Panel(plane.pixels, "from above"),
        ],
        [
            ("the ground, boxes on it", theme().first),
            ("by surface", theme().vehicle),
            ("by calibration, z = 0", theme().second),
        ],
    )


def height_profile(geometry: FrameGeometry, width: int) -> Canvas:
    """Height of the ground by the Gaussian process, two deviations on either side, and the boxes' bottoms."""
    canvas, ground = Canvas(178, width, theme().empty), fit_ground(geometry)
    ahead = np.linspace(0, 70, 141)
    mean, variance = ground.height_m(np.stack([ahead, np.zeros_like(ahead)], axis=-1))
    per_m, middle = (width - 50) / 70, 90

    def placed(heights: FloatArray, at: FloatArray) -> FloatArray:
        return np.stack([30 + per_m * at, middle - 10 * per_m * heights], axis=-1)

    spread = 2 * np.sqrt(variance)
    band = np.concatenate([placed(mean + spread, ahead), placed(mean - spread, ahead)[::-1]])
    canvas.polygon(band, theme().line)
    canvas.polyline(placed(0 * ahead, ahead), theme().second)
    canvas.polyline(placed(mean, ahead), theme().first, 3)
    bottoms = geometry.bottoms_level
    near = (bottoms[:, 0] > 0) & (bottoms[:, 0] < 70) & (abs(bottoms[:, 1]) < 12)
    canvas.dots(placed(bottoms[near, 2], bottoms[near, 0]), theme().text, 4)
    for metres in range(0, 71, 10):
        canvas.text(f"{metres} m", round(30 + per_m * metres), 172, 16, theme().muted, "centre")
    return canvas


def mask_sets(shard: Shard) -> UInt8Array:
    """Masks of three sets over the image."""
    view, panels = read_view(shard, CAMERA, FRAME), []
    for name in ("surface", "surface-project", "full-body"):
        masks = open_sets(shard, CAMERA, [name])[0].read(FRAME)
        photo = draw_masks(view, (300, 420), drivable=masks.drivable, vehicles=masks.vehicles)
        panels.append(Panel(photo.pixels, name))
    return with_legend(draw_tile(panels), legend.IMAGE)


def ceilings(shard: Shard) -> UInt8Array:
    """The truth; true masks from the image through three ways back to the plane, against it."""
    view, plan = read_view(shard, CAMERA, FRAME), plan_for(shard.grid, [], PLANE)
    truth = draw_plane(target_colours(view.drivable, view.vehicles, view.field_of_view), plan)
    columns: list[Column] = [Panel(truth.pixels, "truth")]
    for name, source in (
        ("surface-project", "surface"),
        ("surface-project", "calibration"),
        ("full-body", "surface"),
    ):
        above = through(shard, view, name, source)
        plane = draw_plane(agreement_colours((view.drivable, view.vehicles), above, view.field_of_view), plan)
        what = "whole bodies" if name == "full-body" else "footprints"
        drivable, vehicles = scores_text(view, above).removeprefix("drivable ").split(", vehicles ")
        columns.append(Panel(plane.pixels, f"{what}, {source}", ""))
        columns[-1] = [columns[-1], Panel(Canvas(1, 1).pixels, f"IoU {drivable} and {vehicles}")]
    return with_legend(draw_tile(columns), legend.VEHICLES, legend.DRIVABLE)


def through(shard: Shard, view: View, name: str, source: str) -> tuple[UInt8Array, UInt8Array]:
    """True masks of a set, laid on the grid by a homography."""
    bev_from_image = shard.dataset(CAMERA, f"homography/{source}/bev_from_image")[view.index]
    masks = open_sets(shard, CAMERA, [name])[0].read(view.index)
    bev_from_mask = bev_from_image @ image_from_resized(view.image_size, masks.drivable.shape)
    drivable, vehicles = (
        warp_to_bev(mask, bev_from_mask, shard.grid.shape) for mask in (masks.drivable, masks.vehicles)
    )
    return drivable, vehicles


def displacement(shard: Shard) -> UInt8Array:
    """A plan beside what was driven, and both readings of how far it is off."""
    views = [read_view(shard, CAMERA, index) for index in range(shard.frames(CAMERA))]
    whole = [view for view in views if not np.isnan([view.past, view.future]).any()]
    plans = [constant_velocity(view.past[None], view.future[None, 5])[0] for view in whole]
    off = [np.linalg.norm(plan[4] - view.future[4]) for plan, view in zip(plans, whole, strict=True)]
    chosen = int(np.argmax(off))
    plan, truth = plans[chosen][:5], whole[chosen].future[:5]
    errors = displacement_errors(plan[None], truth[None], ["one"]).value
    apart = np.linalg.norm(plan - truth, axis=-1)
    return stacked(
        [
            Panel(plan_panel(plan, truth).pixels, "from above"),
            Panel(bars(apart, errors).pixels, "metres off"),
        ],
        [
            ("driven", theme().future),
            ("planned: constant velocity", theme().second),
            ("off at the point", theme().vehicle),
            ("mean up to the point", theme().first),
        ],
    )


def plan_panel(plan: FloatArray, truth: FloatArray) -> Canvas:
    """Both paths, x to the right, and what lies between their points."""
    canvas = Canvas(360, 620, theme().empty)
    both = np.concatenate([plan, truth, np.zeros((1, 2))])
    low, high = both.min(axis=0), both.max(axis=0)
    per_m = min(500 / (high[0] - low[0]), 230 / (high[1] - low[1]))

    def placed(points: FloatArray) -> FloatArray:
        return np.stack(
            [60 + per_m * (points[:, 0] - low[0]), 290 - per_m * (points[:, 1] - low[1])], axis=-1
        )

    for points, colour in ((truth, theme().future), (plan, theme().second)):
        canvas.polyline(placed(np.concatenate([np.zeros((1, 2)), points])), colour, 2)
    for one, other in zip(placed(plan), placed(truth), strict=True):
        canvas.polyline(np.stack([one, other]), theme().vehicle, 3)
    for points, colour in ((truth, theme().future), (plan, theme().second)):
        canvas.dots(placed(points), colour, 6)
    canvas.dots(placed(np.zeros((1, 2))), theme().text, 7)
    for step, (x, y) in enumerate(placed(truth), start=1):
        canvas.text(f"{step / 2:g} s", round(x) - 6, round(y) - 16, 18, theme().muted, "centre")
    return canvas


def bars(apart: FloatArray, errors: FloatArray) -> Canvas:
    """How far off at each point, and the mean up to it at the three horizons."""
    canvas = Canvas(360, 560, theme().empty)
    per_m = 270 / max(apart)
    for step, metres in enumerate(apart):
        left, height = 40 + 102 * step, round(per_m * metres)
        canvas.fill(left, 315 - height, 34, height, theme().vehicle)
        canvas.text(f"{metres:.2f}", left + 17, 308 - height, 18, theme().text, "centre")
        canvas.text(f"{(step + 1) / 2:g} s", left + 34, 343, 18, theme().muted, "centre")
        mean = apart[: step + 1].mean()
        if step % 2 == 0:
            assert np.allclose(errors[step // 2], (metres, mean))  # what is drawn is what is scored
        height = round(per_m * mean)
        canvas.fill(left + 36, 315 - height, 34, height, theme().first)
        canvas.text(f"{mean:.2f}", left + 53, 308 - height, 18, theme().text, "centre")
    canvas.fill(20, 315, 520, 2, theme().muted)
    return canvas


def on_photo(
    photo: Canvas, geometry: FrameGeometry, points_level: FloatArray, colour: Colour, thickness: int = 2
) -> None:
    """Join (K, 3) points of the level frame, as the camera sees them."""
    pixels, depth = geometry.project_level(points_level)
    scale = photo.shape[0] / geometry.image_size[0]
    photo.cased_polyline(((pixels + 0.5) * scale - 0.5)[depth > 0], colour, thickness)


def arrow(canvas: Canvas, points: FloatArray, colour: Colour) -> None:
    """A line from the first of two points to the second, with a tip."""
    (x, y), (tip_x, tip_y) = points
    along = np.array([tip_x - x, tip_y - y]) / np.hypot(tip_x - x, tip_y - y)
    across = np.array([-along[1], along[0]])
    canvas.cased_polyline(points, colour, 3)
    canvas.polygon(
        points[1] + np.array([6 * along, -9 * along + 6 * across, -9 * along - 6 * across]), colour
    )


def stacked(columns: Sequence[Column], entries: Sequence[tuple[str, Colour]]) -> UInt8Array:
    """Panels side by side over a legend of lines' colours."""
    swatches = [(Canvas(20, 20, colour).pixels, label) for label, colour in entries]
    return with_legend(draw_tile(columns), ("", lambda: swatches))


def with_legend(tile: UInt8Array, *groups: legend.Group) -> UInt8Array:
    """A tile over a legend."""
    below = legend.draw_legend(groups, tile.shape[1])
    canvas = Canvas(tile.shape[0] + 20 + below.shape[0], max(tile.shape[1], below.shape[1]))
    canvas.paste(tile, 0, 0)
    canvas.paste(below, 0, tile.shape[0] + 20)
    return canvas.pixels


PICTURES: Mapping[str, tuple[str, Callable[[Shard], UInt8Array]]] = MappingProxyType(
    {
        "level-frame": (SLOPE, level_frame),
        "grid": (STREET, grid),
        "field-of-view": (STREET, field_of_view),
        "surface-homography": (STREET, surface_homography),
        "mask-sets": (STREET, mask_sets),
        "ceilings": (STREET, ceilings),
        "displacement": (SLOPE, displacement),
    }
)
"""Scene and drawing, by the names of files and of the pages that show them."""

if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as folder:
            main(make_shards(Path(folder)))

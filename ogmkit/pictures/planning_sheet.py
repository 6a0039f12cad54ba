"""Plans over the truth: one PNG for each planner, with the image beside the plane from above."""

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path
from urllib.parse import quote

import numpy as np

from ogmkit.evaluation.planning.result import PlanEvaluation, PlanSample
from ogmkit.grid import GridSpec
from ogmkit.metrics.gaussian import ellipse
from ogmkit.metrics.plan import Plan
from ogmkit.pictures import bev_panel, legend
from ogmkit.pictures.camera_panel import draw_photo
from ogmkit.pictures.canvas import PURPLE, YELLOW, Canvas, Colour
from ogmkit.pictures.cells import target_colours
from ogmkit.pictures.png import write_png
from ogmkit.pictures.sheet import Heading, Panel, draw_sheet, draw_tile
from ogmkit.pictures.views import View, read_view
from ogmkit.shards.faults import damaged
from ogmkit.shards.listed import listed_shard
from ogmkit.shards.manifest import Manifest, read_manifest
from ogmkit.typing import FloatArray, UInt8Array

PLAN_COLOUR: Colour = PURPLE
DESTINATION_COLOUR: Colour = YELLOW
SHARES = (0.9, 0.5)
"""Of a distribution: what its ellipses hold, the larger one first."""

_PHOTO_SIZE = 640, 960
_PLANE_SIZE = 640, 480
_LEAST_AHEAD_M, _BEYOND_M, _BEHIND_M = 16.0, 4.0, 6.0
_OPACITY = 0.3
_SWATCH = 20
_DIAMOND = np.array([[0.0, -9.0], [9.0, 0.0], [0.0, 9.0], [-9.0, 0.0]])


def draw_plans(shards: Path, evaluation: PlanEvaluation, pictures: Path) -> tuple[Path, ...]:
    """Draw the samples that an evaluation kept.

    Args:
        shards: the folder that was evaluated on.
        evaluation: with samples.
        pictures: where the PNGs go, a folder; those of an earlier run are replaced.

    Returns:
        The files written, `<system>-plans.png` each.

    Raises:
        ShardError, DataFileError: what is drawn can't be read.
        OutputError: a file can't be written.
    """
    manifest, written = read_manifest(shards), []
    note = f"split {evaluation.split} · each plan beside its image, over cells and vehicles of that moment"
    for name in evaluation.systems:
        tiles = [
            _draw_sample(shards, manifest, sample) for sample in evaluation.samples if sample.system == name
        ]
        path = pictures / f"{quote(name, safe=' +,=@')}-plans.png"  # a name may hold a part of a path
        write_png(path, draw_sheet(Heading(name, "", note), tiles, 2, (legend.PLANE, legend.EGO, _PLAN)))
        written.append(path)
    return tuple(written)


def _draw_sample(shards: Path, manifest: Manifest, sample: PlanSample) -> UInt8Array:
    """One sequence: its last image, and the plan from above."""
    scene, camera, index = sample.place
    (entry,) = (one for one in manifest.shards if one.scene == scene)
    dataroot = Path(manifest.dataroot) if manifest.settings.targets.images == "reference" else None
    try:
        with listed_shard(shards, entry) as shard:
            view, grid = read_view(shard, camera, index, dataroot=dataroot), shard.grid
    except OSError as error:
        raise damaged(shards / entry.file, error) from error
    errors = np.linalg.norm(view.future[: len(sample.plan.mean)] - sample.plan.mean, axis=1)
    photo = draw_photo(view, _PHOTO_SIZE).pixels
    plane = draw_plan(view, grid, sample.plan).pixels
    off = f"ADE {errors.mean():.2f} m, at the end {errors[-1]:.2f} m"
    return draw_tile([Panel(photo, f"{scene} · frame {index}", camera), Panel(plane, "", "")], off)


def draw_plan(view: View, grid: GridSpec, plan: Plan) -> Canvas:
    """Draw past, future, destination (where it is told) and plan on the part of the plane they take up.

    Args:
        view: of the sequence's last image.
        grid: of its rasters.
        plan: its plan, with distributions or without.
    """
    view, plane = _cropped(view, grid, _reach_m(np.concatenate([view.future, plan.mean])))
    colours = target_colours(view.drivable, view.vehicles, view.field_of_view)
    canvas = bev_panel.draw_plane(colours, plane)
    _draw_ellipses(canvas, [plane.pixels(outline) for outline in _ellipses(plan)])
    bev_panel.draw_paths(canvas, view, plane)
    canvas.polyline(plane.pixels(np.concatenate([np.zeros((1, 2)), plan.mean])), PLAN_COLOUR, 1)
    canvas.dots(plane.pixels(plan.mean), PLAN_COLOUR, bev_panel.DOT_RADIUS)
    if plan.told:
        canvas.polygon(plane.pixels(view.future[-1:]) + _DIAMOND, DESTINATION_COLOUR)
    return canvas


def _ellipses(plan: Plan) -> Iterator[FloatArray]:
    """(K, 2) outlines in metres, large ones first; none of points without distribution."""
    for share in SHARES:
        for mean, sigma, rho in zip(plan.mean, plan.sigma, plan.rho.tolist(), strict=True):
            if np.isfinite(sigma).all():
                yield ellipse(mean, sigma, rho, share)


def _draw_ellipses(canvas: Canvas, outlines: Sequence[FloatArray]) -> None:
    """Draw (K, 2) outlines, thin and filled lightly."""
    for outline in outlines:
        canvas.polygon(outline, PLAN_COLOUR, _OPACITY)
        canvas.polyline(np.concatenate([outline, outline[:1]]), PLAN_COLOUR, 1)


def _reach_m(points: FloatArray) -> float:
    """How far ahead a panel must show to hold (K, 2) points, by its shape also those at the sides."""
    ahead_m, aside_m = float(points[:, 0].max()), float(np.abs(points[:, 1]).max())
    height, width = _PLANE_SIZE
    wide_m = (aside_m + _BEYOND_M) * 2 * height / width - _BEHIND_M
    return max(_LEAST_AHEAD_M, ahead_m + _BEYOND_M, wide_m)


def _cropped(view: View, grid: GridSpec, reach_m: float) -> tuple[View, bev_panel.Plan]:
    """The frame on the part of its grid that a panel shows: so far ahead, and as wide as the panel allows."""
    height, width = _PLANE_SIZE
    side_m = (reach_m + _BEHIND_M) * width / height / 2
    corners = np.rint(grid.cells(np.array([[reach_m, side_m], [-_BEHIND_M, -side_m]])) + 0.5).astype(int)
    size = np.array([grid.columns, grid.rows])
    left, top = first = np.clip(corners[0], 0, size - 1)
    right, bottom = np.clip(corners[1], first + 1, size)
    names = ("drivable", "vehicles", "field_of_view")
    parts = {name: getattr(view, name)[top:bottom, left:right] for name in names}
    rows, columns = int(bottom - top), int(right - left)
    own = GridSpec(grid.m_per_cell, rows, columns, grid.ego_row - top, grid.ego_column - left)
    behind_m = max(own.x_range_m[0] + _BEHIND_M, 0.0)
    height_m, width_m = own.rows * own.m_per_cell + behind_m, own.columns * own.m_per_cell
    plane = bev_panel.Plan(own, min(height / height_m, width / width_m), behind_m)
    return dataclasses.replace(view, **parts), plane


def _plan_entries() -> Iterator[legend.Entry]:
    middle = np.full((1, 2), (_SWATCH - 1) / 2)
    swatch = Canvas(_SWATCH, _SWATCH)
    swatch.polygon(_DIAMOND + middle, DESTINATION_COLOUR)
    yield swatch.pixels, "destination"
    swatch = Canvas(_SWATCH, _SWATCH)
    swatch.polyline(np.array([[0, middle[0, 1]], [_SWATCH - 1, middle[0, 1]]]), PLAN_COLOUR, 1)
    swatch.dots(middle, PLAN_COLOUR, bev_panel.DOT_RADIUS)
    yield swatch.pixels, "planned"
    swatch = Canvas(_SWATCH, _SWATCH)
    sigma = np.full((1, 2), 0.21 * _SWATCH)  # 90 % lie within 2.15 of them
    _draw_ellipses(swatch, [*_ellipses(Plan(middle, sigma, np.zeros(1)))])
    yield swatch.pixels, "50 % and 90 % of its distribution"


_PLAN: legend.Group = ("Plan", _plan_entries)

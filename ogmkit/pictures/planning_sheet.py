"""Plans over the truth: one PNG for each planner, with the image beside the plane from above."""

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path
from urllib.parse import quote

import numpy as np

from ogmkit.base.steps import STEP_S
from ogmkit.drawing import bev_panel, legend
from ogmkit.drawing.canvas import Canvas
from ogmkit.drawing.cells import refined, target_colours
from ogmkit.drawing.palette import theme
from ogmkit.drawing.plan_marks import draw_plan_marks, plan_group
from ogmkit.drawing.png import write_png
from ogmkit.drawing.sheet import Caption, Heading, Panel, draw_sheet, draw_tile
from ogmkit.evaluation.planning.result import PlanEvaluation, PlanSample
from ogmkit.grid import GridSpec
from ogmkit.metrics.gaussian import ellipse
from ogmkit.metrics.plan import Plan
from ogmkit.pictures.camera_panel import draw_photo
from ogmkit.pictures.views import View, read_view
from ogmkit.shards.faults import damaged
from ogmkit.shards.listed import listed_shard
from ogmkit.shards.manifest import Manifest, read_manifest
from ogmkit.typing import FloatArray, UInt8Array

SHARE = 0.9
"""Of a distribution: what its ellipse holds."""

_PHOTO_SIZE = 480, 800
_PLANE_SIZE = 800, 600
_LEAST_AHEAD_M, _BEYOND_M, _BEHIND_M = 16.0, 4.0, 6.0
_LINE, _COLUMNS = 36, (0.08, 0.42, 0.75, 1.0)


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
        samples = [sample for sample in evaluation.samples if sample.system == name]
        tiles = [_draw_sample(shards, manifest, sample) for sample in samples]
        path = pictures / f"{quote(name, safe=' +,=@')}-plans.png"  # a name may hold a part of a path
        write_png(
            path, draw_sheet(Heading(name, "", note), tiles, 2, _groups([sample.plan for sample in samples]))
        )
        written.append(path)
    return tuple(written)


def _groups(plans: Sequence[Plan]) -> tuple[legend.Group, ...]:
    """The legend's: of what the plans have."""
    told, ellipses = any(plan.told for plan in plans), any(np.isfinite(plan.sigma).any() for plan in plans)
    return legend.PLANE, legend.EGO, plan_group(told=told, ellipses=ellipses)


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
    step_s = manifest.settings.targets.step_s
    photo, plane = draw_photo(view, _PHOTO_SIZE), draw_plan(view, grid, sample.plan, step_s)
    steps = _draw_steps(view, sample.plan, step_s, photo.shape[1])
    photos = [Panel(photo.pixels, "image"), Panel(steps, "plan, step by step")]
    height_m = (plane.shape[0] - bev_panel.FOOTER) / _area(view, grid, sample.plan)[1].px_per_m
    scale = f"{height_m:.0f} m high; scales differ"
    return draw_tile(
        [photos, Panel(plane.pixels, "from above", scale)], Caption(f"{scene} · frame {index}", camera)
    )


def draw_plan(view: View, grid: GridSpec, plan: Plan, step_s: float = STEP_S) -> Canvas:
    """Draw past, future, destination (where it is told) and plan on the part of the plane they take up.

    Args:
        view: of the sequence's last image.
        grid: of its rasters.
        plan: its plan, with distributions or without.
        step_s: time between its points.
    """
    shown, plane = _area(view, grid, plan)
    masks = map(refined, (shown.drivable, shown.vehicles, shown.field_of_view))
    canvas = bev_panel.draw_plane(target_colours(*masks), plane)
    bev_panel.draw_paths(canvas, view.past, view.future, plane)
    labels, outlines = _times(len(plan.mean), step_s), [*_ellipses(plan)]
    draw_plan_marks(canvas, plane, plan.mean, view.future, labels=labels, outlines=outlines)
    return canvas


def _area(view: View, grid: GridSpec, plan: Plan) -> tuple[View, bev_panel.Plan]:
    """The frame on the part of the plane that its paths take up."""
    return _cropped(view, grid, _reach_m(np.concatenate([view.future, plan.mean])))


def _draw_steps(view: View, plan: Plan, step_s: float, width: int) -> UInt8Array:
    """A table: each point's time, where it is planned and where the ego was, and how far these are apart."""
    truth = view.future[: len(plan.mean)]
    errors_m = np.linalg.norm(truth - plan.mean, axis=1)
    header = ("time", "planned: ahead, left", "true: ahead, left", "apart")
    rows = [
        (time, _metres(planned), _metres(true), f"{error:.2f} m")
        for time, planned, true, error in zip(
            _times(len(truth), step_s), plan.mean, truth, errors_m.tolist(), strict=True
        )
    ]
    rows.append(("mean", "", "", f"{errors_m.mean():.2f} m"))
    canvas = Canvas(_LINE * (len(rows) + 1), width)
    for line, row in enumerate((header, *rows)):
        for share, text in zip(_COLUMNS, row, strict=True):
            colour = theme().text if line else theme().muted
            canvas.text(text, round(share * width), _LINE * line + 24, legend.TEXT_SIZE, colour, "right")
    return canvas.pixels


def _times(points: int, step_s: float) -> list[str]:
    """Of a plan's points."""
    return [f"{step * step_s:g} s" for step in range(1, points + 1)]


def _metres(point: FloatArray) -> str:
    ahead, left = (f"{metres:z.2f}" for metres in point.tolist())
    return f"{ahead}, {left} m"


def _ellipses(plan: Plan) -> Iterator[FloatArray]:
    """(K, 2) outlines in metres; none of points without distribution."""
    for mean, sigma, rho in zip(plan.mean, plan.sigma, plan.rho.tolist(), strict=True):
        if np.isfinite(sigma).all():
            yield ellipse(mean, sigma, rho, SHARE)


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
    px_per_m = min((height - bev_panel.FOOTER) / height_m, width / width_m)
    plane = bev_panel.Plan(own, px_per_m, behind_m)
    return dataclasses.replace(view, **parts), plane

"""`ogmkit extract`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ogmkit.shards.settings import ExtractSettings
from ogmkit.target_settings import TargetSettings

from .command import Command
from .grid_options import grid_options
from .logs import complain, note
from .options import (
    cache_dir_option,
    dataroot_argument,
    scenes_option,
    scheduler_option,
    split_file_option,
    splits_option,
    version_option,
    workers_option,
)
from .paths import NEW_SHARDS
from .progress import progress
from .record_options import record_options
from .text import one_line

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ogmkit.grid import GridSpec
    from ogmkit.pipeline.extract_summary import ExtractSummary, FailureGroup
    from ogmkit.pipeline.plan import ScenePlan

_NAMED = 3
"""Scenes by name, of those that failed for one reason."""


@click.command(
    cls=Command,
    examples=(
        "ogmkit extract dataroot shards --workers 8 --layers lane --classes car,truck,bus --instances",
        "ogmkit extract dataroot labels --definition lss,cvt --scenes 'scene-00*'",
    ),
)
@dataroot_argument
@click.argument("out", type=NEW_SHARDS)
@version_option
@scenes_option
@splits_option
@split_file_option
@grid_options
@record_options(TargetSettings, "targets")
@record_options(ExtractSettings, "settings")
@workers_option
@scheduler_option
@cache_dir_option
@click.option("--overwrite", is_flag=True, help="Rebuild existing shards; other settings are allowed.")
@click.option("--strict", is_flag=True, help="Stop at the first scene that fails.")
@click.option("--dry-run", is_flag=True, help="Show what would be done; write nothing.")
def command(
    dataroot: Path,
    out: Path,
    version: str | None,
    scenes: tuple[str, ...],
    splits: tuple[str, ...],
    split_file: Path | None,
    grid: GridSpec,
    targets: TargetSettings,
    settings: ExtractSettings,
    workers: int,
    scheduler: str,
    cache_dir: Path | None,
    overwrite: bool,
    strict: bool,
    dry_run: bool,
) -> None:
    """Turn a dataset into training targets, one HDF5 shard a scene.

    Each scene of DATAROOT becomes OUT/<scene>.h5 with rasters, boxes, trajectories, calibration and images;
    OUT/manifest.json lists them. --layers, --classes, --instances and --future add rasters on the same grid.
    --definition stores labels as other repositories draw them, to the cell. To
    resume after an interruption, run the same command again. OUT may be s3://BUCKET/FOLDER.
    Scenes that fail are named at the end, with exit code 1; scenes that are left out are named too, with exit
    code 0 unless none is left.
    """
    from ogmkit.base.execution import Execution
    from ogmkit.nuscenes.dataset import Dataset
    from ogmkit.pipeline.extract import extract
    from ogmkit.pipeline.extract_summary import grouped
    from ogmkit.pipeline.plan import plan
    from ogmkit.pipeline.selection import select_scenes

    settings = replace(settings, targets=replace(targets, grid=grid))
    with Dataset(dataroot, version) as dataset:
        chosen = select_scenes(dataset, scenes, splits, split_file)
        if dry_run:
            _show(_plan_lines(plan(dataset, out, settings, scenes=chosen, overwrite=overwrite)))
            return
        with progress(len(chosen), "scenes", "extract") as advance:
            summary = extract(
                dataset,
                out,
                settings,
                scenes=chosen,
                splits=dataset.splits(split_file),
                execution=Execution(workers, scheduler, overwrite=overwrite, on_progress=advance),
                strict=strict,
                cache_dir=cache_dir,
            )
    _show(_summary_lines(summary, settings))
    for line in _group_lines("left out", grouped(summary.left_out, remedies=False)):
        note(f"ogmkit: {line}")
    for line in _group_lines("failed", grouped(summary.failures)):
        complain(line)
    if summary.left_out and not summary.scenes:
        complain(f"{out}: no scene is left")
    if summary.failures or not summary.scenes:
        raise click.exceptions.Exit(1)


def _show(rows: Iterator[tuple[str, str]]) -> None:
    pairs = list(rows)
    width = max(len(name) for name, _ in pairs)
    for name, value in pairs:
        click.echo(f"{name:<{width}}  {value}")


def _plan_lines(scenes: Sequence[ScenePlan]) -> Iterator[tuple[str, str]]:
    for scene in scenes:
        yield (
            one_line(scene.scene),
            f"{scene.action:<8}{scene.frames:>6} frames"
            if scene.error is None
            else one_line(f"{scene.action}: {scene.error}"),
        )
    writing = [scene for scene in scenes if scene.action in ("write", "replace")]
    frames = sum(scene.frames for scene in writing)
    yield "in all", f"{len(writing)} of {len(scenes)} scenes to write, {frames} frames"


def _group_lines(state: str, groups: Sequence[FailureGroup]) -> Iterator[str]:
    """A line a kind of reason."""
    from ogmkit.base.names import listed

    for group in groups:
        others = " (this is the first; the others are alike)" if group.others else ""
        yield one_line(f"{listed(group.scenes, _NAMED)} {state}: {group.reason}{others}")


def _paper_lines(summary: ExtractSummary, settings: ExtractSettings) -> Iterator[tuple[str, str]]:
    """Of the paper's labels."""
    from ogmkit.pipeline.extract_summary import oddities

    yield "valid trajectories", f"{summary.valid_trajectories}"
    if not settings.targets.no_map:
        yield "drivable cells", f"{summary.drivable_share:.2%}"
    yield "vehicle cells", f"{summary.vehicle_share:.2%}"
    for line in oddities(summary):
        yield "note", one_line(line)
    typical, shortest, longest = summary.step_s
    yield "step", f"{typical:.3f} s ({shortest:.3f} to {longest:.3f} s)" if summary.frames else "none"


def _summary_lines(summary: ExtractSummary, settings: ExtractSettings) -> Iterator[tuple[str, str]]:
    minutes, seconds = divmod(summary.seconds, 60)
    yield "scenes", f"{summary.scenes} ({summary.kept} were there)"
    if settings.only_complete or summary.left_out:
        yield "scenes left out", f"{len(summary.left_out)}"
    yield "frames", f"{summary.frames}"
    if settings.skip_bad_frames or summary.frames_left_out:
        yield "frames left out", f"{summary.frames_left_out}"
    if settings.labels:
        yield "labels", ", ".join(settings.definitions)
    if settings.paper:
        yield from _paper_lines(summary, settings)
    yield "time", f"{minutes:.0f} min {seconds:.1f} s"
    yield "size", f"{summary.bytes / 1e6:.1f} MB"
    yield "failed", f"{len(summary.failures)}"

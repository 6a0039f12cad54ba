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
from .logs import complain
from .options import (
    cache_dir_option,
    dataroot_argument,
    scenes_option,
    split_file_option,
    splits_option,
    version_option,
    workers_option,
)
from .paths import ANY
from .progress import progress
from .record_options import record_options, setting_options
from .text import one_line

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ogmkit.grid import GridSpec
    from ogmkit.pipeline.extract import ExtractSummary
    from ogmkit.pipeline.plan import ScenePlan
    from ogmkit.shards.settings import Compression

_NAMED = 3
"""Scenes by name, of those that failed for one reason."""


@click.command(
    cls=Command,
    examples=(
        "ogmkit extract dataroot shards --workers 8",
        "ogmkit extract dataroot shards --scenes 'scene-00*' --camera CAM_FRONT,CAM_BACK --lidar",
    ),
)
@dataroot_argument
@click.argument("out", type=ANY)
@version_option
@scenes_option
@splits_option
@split_file_option
@grid_options
@record_options(TargetSettings, "targets")
@setting_options(ExtractSettings)
@workers_option
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
    cameras: tuple[str, ...],
    compression: Compression,
    workers: int,
    cache_dir: Path | None,
    overwrite: bool,
    strict: bool,
    dry_run: bool,
) -> None:
    """Turn a dataset into training targets, one HDF5 shard a scene.

    Each scene of DATAROOT becomes OUT/<scene>.h5 with rasters, boxes, trajectories, calibration and images;
    OUT/manifest.json lists them. To resume after an interruption, run the same command again.
    Scenes that fail are named at the end, with exit code 1.
    """
    from ogmkit.nuscenes.dataset import Dataset
    from ogmkit.pipeline.execution import Execution
    from ogmkit.pipeline.extract import extract
    from ogmkit.pipeline.plan import plan
    from ogmkit.pipeline.selection import select_scenes

    settings = ExtractSettings(replace(targets, grid=grid), cameras, compression)
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
                execution=Execution(workers, overwrite=overwrite, on_progress=advance),
                strict=strict,
                cache_dir=cache_dir,
            )
    _show(_summary_lines(summary))
    for line in _failure_lines(summary):
        complain(line)
    if summary.failures:
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
            else one_line(str(scene.error)),
        )
    writing = [scene for scene in scenes if scene.action in ("write", "replace")]
    frames = sum(scene.frames for scene in writing)
    yield "in all", f"{len(writing)} of {len(scenes)} scenes to write, {frames} frames"


def _failure_lines(summary: ExtractSummary) -> Iterator[str]:
    """A line a reason: where a map is missing, that of hundreds of scenes is the same."""
    from ogmkit.base.names import listed

    scenes_of: dict[str, list[str]] = {}
    for failure in summary.failures:
        scenes_of.setdefault(str(failure.error), []).append(failure.scene)
    for error, scenes in scenes_of.items():
        yield one_line(f"{listed(scenes, _NAMED)} failed: {error}")


def _summary_lines(summary: ExtractSummary) -> Iterator[tuple[str, str]]:
    minutes, seconds = divmod(summary.seconds, 60)
    yield "scenes", f"{summary.scenes} ({summary.kept} were there)"
    yield "frames", f"{summary.frames}"
    yield "valid trajectories", f"{summary.valid_trajectories}"
    yield "drivable cells", f"{summary.drivable_share:.2%}"
    yield "vehicle cells", f"{summary.vehicle_share:.2%}"
    typical, shortest, longest = summary.step_s
    yield "step", f"{typical:.3f} s ({shortest:.3f} to {longest:.3f} s)" if summary.frames else "none"
    yield "time", f"{minutes:.0f} min {seconds:.1f} s"
    yield "size", f"{summary.bytes / 1e6:.1f} MB"
    yield "failed", f"{len(summary.failures)}"

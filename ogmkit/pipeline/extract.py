"""Extraction: every chosen scene of a dataset becomes one shard of a folder."""

import logging
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from ogmkit.base.execution import DEFAULT_EXECUTION, Execution, run_over
from ogmkit.base.names import with_number
from ogmkit.base.news import Found, tell
from ogmkit.errors import OgmkitError
from ogmkit.frames import SceneRecord
from ogmkit.pipeline import output
from ogmkit.pipeline.extract_summary import ExtractSummary, SceneFailure
from ogmkit.pipeline.frame_files import Refusal, prepare
from ogmkit.pipeline.maps import MapsAhead
from ogmkit.pipeline.output import Contents, Request
from ogmkit.pipeline.scene_shard import Look, Outcome, Task, kept, make_shard
from ogmkit.pipeline.selection import read_scene, require_known_names
from ogmkit.pipeline.sources import SceneSource
from ogmkit.shards.manifest import LOCK, Manifest, ShardEntry, write_manifest
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.summary import Expected, ShardSummary, spread, summarise

_LOG = logging.getLogger(__name__)


def extract(
    dataset: SceneSource,
    out: Path,
    settings: ExtractSettings,
    *,
    scenes: Sequence[str],
    splits: Mapping[str, Sequence[str]],
    execution: Execution = DEFAULT_EXECUTION,
    strict: bool = False,
    cache_dir: Path | None = None,
) -> ExtractSummary:
    """Write a shard for each scene, then the manifest.

    Existing shards that are complete and have the same settings stay. A scene that fails doesn't stop the
    others. Where the settings say so, scenes or frames whose files are absent or bad are left out; once the
    files are there, the same call rebuilds those shards. Killed at any moment, the folder holds whole
    shards only, and the same call again finishes the work.

    Args:
        dataset: a `Dataset`, or a `RecordDataset` of scenes made in Python.
        out: folder of the shards; absent, empty, or an earlier run's.
        settings: what to extract.
        scenes: names of the scenes.
        splits: split name → scene names, for the manifest.
        execution: where the work is done, progress, and whether to rebuild what exists.
        strict: raise the first scene's failure instead of continuing.
        cache_dir: folder of decoded map masks; the platform's cache folder by default.

    Raises:
        SettingsError: the dataset lacks a scene, camera or category.
        OutputError: the folder is foreign, holds other settings, or can't be written.
        OgmkitError: a worker process died, the scheduler is gone, or, when strict, what a scene failed with.
    """
    started = time.monotonic()
    request = Request(out, settings, dataset.version, tuple(dict.fromkeys(scenes)), execution.overwrite)
    require_known_names(dataset, settings, request.scenes)
    output.check_place(out, dataset.root)
    output.check_contents(request)  # before anything is made, and again once the folder is ours
    execution.require_reachable()
    outcomes: list[Outcome] = []
    with output.locked(out):
        contents = output.check_contents(request)
        output.begin(request)
        ahead = MapsAhead(cache_dir) if execution.beside and not settings.targets.no_map else None
        what = ", ".join((*settings.cameras, *(f"labels by {one.name}" for one in settings.labels)))
        tell(Found(f"{with_number(len(request.scenes), 'scene')} with {what}; {execution.place}"))
        shared = (dataset.root, out / LOCK)

        def take(outcome: Outcome) -> None:
            outcomes.append(outcome)
            _LOG.debug("%s: %s", outcome.scene, outcome.state)
            execution.report(len(outcomes), len(request.scenes))

        todo = request.scenes
        if looks := _looks(dataset, request, contents):
            with closing(run_over(kept, looks, execution, shared=shared)) as found:
                for outcome in found:
                    if outcome is not None:
                        take(outcome)
            there = {outcome.scene for outcome in outcomes}
            todo = tuple(name for name in todo if name not in there)
        if todo:
            tasks = _tasks(dataset, replace(request, scenes=todo), contents.checksums, cache_dir, ahead)
            with closing(run_over(make_shard, tasks, execution, shared=shared)) as done:
                for outcome in done:
                    if strict and outcome.state == "failed" and isinstance(outcome.result, OgmkitError):
                        raise outcome.result
                    take(outcome)
        _finish(dataset, request, contents.others, outcomes, splits)
    return _summary(request, outcomes, time.monotonic() - started)


def _looks(dataset: SceneSource, request: Request, contents: Contents) -> list[Look]:
    """What to look at before anything is read of a scene but its tokens: shards that may be as wanted."""
    settings, targets = request.settings, request.settings.targets
    there = [name for name in request.scenes if request.path(name).exists()]
    if request.overwrite or settings.labels or not there:
        return []
    expected = dataset.frame_tokens(settings.cameras, lidar=targets.lidar_source, maps=not targets.no_map)
    one = replace(request, scenes=())  # a worker needs no names of others
    return [
        Look(Expected(name, expected[name]), one, contents.checksums.get(file), file in contents.untouched)
        for name in there
        if name in expected
        for file in (request.path(name).name,)
    ]


def _tasks(
    dataset: SceneSource,
    request: Request,
    checksums: Mapping[str, tuple[int, str]],
    cache_dir: Path | None,
    ahead: MapsAhead | None,
) -> Iterator[Task]:
    """Read one scene's records after the other, as workers become free."""
    one = replace(request, scenes=())
    for name in request.scenes:
        scene: SceneRecord | OgmkitError
        try:
            scene = read_scene(dataset, name, request.settings)
            if ahead is not None and ahead.lacks(scene) and _is_new(scene, request):
                ahead.decode(scene)
        except OgmkitError as error:
            scene = error
        yield Task(name, scene, one, cache_dir, checksums.get(request.path(name).name))


def _is_new(scene: SceneRecord, request: Request) -> bool:
    """Whether a shard will be made that isn't there, as far as it shows without opening files."""
    if request.path(scene.name).exists() and not request.overwrite:
        return False
    return not isinstance(prepare(scene, request.settings, read=False), Refusal)


def _finish(
    dataset: SceneSource,
    request: Request,
    others: Sequence[Path],
    outcomes: Sequence[Outcome],
    splits: Mapping[str, Sequence[str]],
) -> None:
    """Write the manifest of all shards there are; without any, the folder stays marked as unfinished."""
    shards = [outcome.result for outcome in outcomes if isinstance(outcome.result, ShardSummary)]
    failed = [outcome.scene for outcome in outcomes if outcome.state == "failed"]
    earlier = [request.path(scene) for scene in failed if output.has_shard(request, scene)]
    shards += [summarise(path) for path in (*others, *earlier)]
    if not shards:
        return
    within = {split: frozenset(scenes) for split, scenes in splits.items()}
    entries = tuple(
        ShardEntry(
            scene=shard.scene,
            file=request.path(shard.scene).name,
            location=shard.location,
            frames=shard.frames,
            bytes=shard.bytes,
            sha256=shard.sha256,
            splits=tuple(sorted(split for split, scenes in within.items() if shard.scene in scenes)),
        )
        for shard in sorted(shards, key=lambda shard: shard.scene)
    )
    root = str(dataset.root.resolve())
    write_manifest(request.out, Manifest(request.dataset_version, root, request.settings, entries))
    output.finish(request.out)


def _summary(request: Request, outcomes: Sequence[Outcome], seconds: float) -> ExtractSummary:
    shards = [outcome.result for outcome in outcomes if isinstance(outcome.result, ShardSummary)]
    frames = sum(shard.frames for shard in shards)
    return ExtractSummary(
        scenes=len(shards),
        kept=sum(outcome.state == "kept" for outcome in outcomes),
        frames=frames,
        frames_left_out=sum(shard.left_out for shard in shards),
        valid_trajectories=sum(shard.valid_trajectories for shard in shards),
        drivable_share=sum(shard.frames * shard.drivable_share for shard in shards) / max(1, frames),
        blind=tuple(sorted(set.intersection(*(set(shard.blind) for shard in shards)) if shards else ())),
        vehicle_share=sum(shard.frames * shard.vehicle_share for shard in shards) / max(1, frames),
        step_s=spread([shard.step_s for shard in shards if not math.isnan(shard.step_s[0])]),
        seconds=seconds,
        bytes=sum(shard.bytes for shard in shards),
        failures=_without_shard(request, outcomes, "failed"),
        left_out=_without_shard(request, outcomes, "left out"),
    )


def _without_shard(request: Request, outcomes: Sequence[Outcome], state: str) -> tuple[SceneFailure, ...]:
    """Scenes in the order asked for."""
    found = {
        outcome.scene: SceneFailure(outcome.scene, outcome.result, outcome.absent)
        for outcome in outcomes
        if outcome.state == state and isinstance(outcome.result, OgmkitError)
    }
    return tuple(found[name] for name in request.scenes if name in found)

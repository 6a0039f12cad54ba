"""Extraction: every chosen scene of a dataset becomes one shard of a folder."""

import logging
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from ogmkit.base.names import with_number
from ogmkit.base.news import Found, tell
from ogmkit.errors import OgmkitError, OutputError
from ogmkit.frames import SceneRecord
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.pipeline import output
from ogmkit.pipeline.execution import DEFAULT_EXECUTION, Execution, run_over
from ogmkit.pipeline.maps import MapsAhead
from ogmkit.pipeline.output import Request
from ogmkit.pipeline.selection import require_known_names
from ogmkit.pipeline.sources import SceneSource
from ogmkit.shards.manifest import Manifest, ShardEntry, write_manifest
from ogmkit.shards.settings import ExtractSettings
from ogmkit.shards.summary import ShardSummary, is_current, spread, summarise
from ogmkit.shards.writer import write_shard

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class SceneFailure:
    """A scene that gave no shard, and why."""

    scene: str
    error: OgmkitError


@dataclass(frozen=True)
class ExtractSummary:
    """What a run did.

    Attributes:
        scenes: chosen scenes that have a whole shard now.
        kept: those of them that had one before.
        frames: their frames over all cameras.
        valid_trajectories: frames with a valid trajectory.
        drivable_share: share of drivable cells, over all frames.
        vehicle_share: share of vehicle cells, over all frames.
        step_s: median, shortest and longest time from a frame to the one a step on; NaN without any.
        seconds: wall time.
        bytes: size of the shards.
        failures: scenes that gave no shard.
    """

    scenes: int
    kept: int
    frames: int
    valid_trajectories: int
    drivable_share: float
    vehicle_share: float
    step_s: tuple[float, float, float]
    seconds: float
    bytes: int
    failures: tuple[SceneFailure, ...]


@dataclass(frozen=True)
class _Task:
    name: str
    scene: SceneRecord | OgmkitError
    request: Request
    cache_dir: Path | None
    checksum: tuple[int, str] | None


@dataclass(frozen=True)
class _Outcome:
    scene: str
    result: ShardSummary | OgmkitError
    kept: bool = False

    @property
    def state(self) -> str:
        """What became of the scene, in a word."""
        if isinstance(self.result, OgmkitError):
            return "failed"
        return "kept" if self.kept else "written"


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
    others. Killed at any moment, the folder holds whole shards only, and the same call again finishes the
    work.

    Args:
        dataset: a `Dataset`, or a `RecordDataset` of scenes made in Python.
        out: folder of the shards; absent, empty, or an earlier run's.
        settings: what to extract.
        scenes: names of the scenes.
        splits: split name → scene names, for the manifest.
        execution: worker processes, progress, and whether to rebuild what exists.
        strict: raise the first scene's failure instead of continuing.
        cache_dir: folder of decoded map masks; the platform's cache folder by default.

    Raises:
        SettingsError: the dataset lacks a scene, camera or category.
        OutputError: the folder is foreign, holds other settings, or can't be written.
        OgmkitError: a worker process died, or, when strict, what a scene failed with.
    """
    started = time.monotonic()
    request = Request(out, settings, dataset.version, tuple(dict.fromkeys(scenes)), execution.overwrite)
    require_known_names(dataset, settings, request.scenes)
    output.check_place(out, dataset.root)
    output.check_contents(request)  # before anything is made, and again once the folder is ours
    outcomes: list[_Outcome] = []
    with output.locked(out):
        contents = output.check_contents(request)
        output.begin(request)
        ahead = MapsAhead(cache_dir) if execution.executor is None and execution.workers > 1 else None
        tasks = _tasks(dataset, request, contents.checksums, cache_dir, ahead)
        cameras = ", ".join(settings.cameras)
        tell(Found(f"{with_number(len(request.scenes), 'scene')} with {cameras}; {execution.place}"))
        with closing(run_over(_run, tasks, execution)) as done:
            for outcome in done:
                if strict and isinstance(outcome.result, OgmkitError):
                    raise outcome.result
                outcomes.append(outcome)
                _LOG.debug("%s: %s", outcome.scene, outcome.state)
                execution.report(len(outcomes), len(request.scenes))
        _finish(dataset, request, contents.others, outcomes, splits)
    return _summary(request, outcomes, time.monotonic() - started)


def _tasks(
    dataset: SceneSource,
    request: Request,
    checksums: Mapping[str, tuple[int, str]],
    cache_dir: Path | None,
    ahead: MapsAhead | None,
) -> Iterator[_Task]:
    """Read one scene's records after the other, as workers become free."""
    settings = request.settings
    for name in request.scenes:
        scene: SceneRecord | OgmkitError
        try:
            scene = dataset.scene(
                name, settings.cameras, lidar=settings.targets.lidar, step_s=settings.targets.step_s
            )
            if ahead is not None and (request.overwrite or not request.path(name).exists()):
                ahead.decode(scene)
        except OgmkitError as error:
            scene = error
        yield _Task(name, scene, request, cache_dir, checksums.get(request.path(name).name))


def _run(task: _Task) -> _Outcome:
    """Make one shard, or find that it is there; runs in a worker."""
    if isinstance(task.scene, OgmkitError):
        return _Outcome(task.name, task.scene)
    request, path = task.request, task.request.path(task.name)
    if not request.overwrite and is_current(path, task.scene, request.settings, request.dataset_version):
        return _Outcome(task.name, _known(path, task.checksum), kept=True)
    try:
        write_shard(
            path,
            task.scene,
            request.settings.targets,
            MaskStore(task.cache_dir),
            dataset_version=request.dataset_version,
            compression=request.settings.compression,
        )
    except OutputError:
        raise  # a full disk would fail every scene: it ends the run
    except OgmkitError as error:
        return _Outcome(task.name, error)
    return _Outcome(task.name, summarise(path))


def _known(path: Path, checksum: tuple[int, str] | None) -> ShardSummary:
    """The figures of a shard that was there; its checksum by the manifest, if the size agrees."""
    unchanged = checksum is not None and checksum[0] == path.stat().st_size
    return summarise(path, sha256=checksum[1] if checksum is not None and unchanged else None)


def _finish(
    dataset: SceneSource,
    request: Request,
    others: Sequence[Path],
    outcomes: Sequence[_Outcome],
    splits: Mapping[str, Sequence[str]],
) -> None:
    """Write the manifest of all shards there are; without any, the folder stays marked as unfinished."""
    shards = [outcome.result for outcome in outcomes if isinstance(outcome.result, ShardSummary)]
    failed = [outcome.scene for outcome in outcomes if isinstance(outcome.result, OgmkitError)]
    earlier = [request.path(scene) for scene in failed if output.has_shard(request, scene)]
    shards += [summarise(path) for path in (*others, *earlier)]
    if not shards:
        return
    entries = tuple(
        ShardEntry(
            scene=shard.scene,
            file=request.path(shard.scene).name,
            location=shard.location,
            frames=shard.frames,
            bytes=shard.bytes,
            sha256=shard.sha256,
            splits=tuple(sorted(split for split, scenes in splits.items() if shard.scene in scenes)),
        )
        for shard in sorted(shards, key=lambda shard: shard.scene)
    )
    root = str(dataset.root.resolve())
    write_manifest(request.out, Manifest(request.dataset_version, root, request.settings, entries))
    output.finish(request.out)


def _summary(request: Request, outcomes: Sequence[_Outcome], seconds: float) -> ExtractSummary:
    shards = [outcome.result for outcome in outcomes if isinstance(outcome.result, ShardSummary)]
    failures = {
        outcome.scene: outcome.result for outcome in outcomes if isinstance(outcome.result, OgmkitError)
    }
    frames = sum(shard.frames for shard in shards)
    return ExtractSummary(
        scenes=len(shards),
        kept=sum(outcome.kept for outcome in outcomes),
        frames=frames,
        valid_trajectories=sum(shard.valid_trajectories for shard in shards),
        drivable_share=sum(shard.frames * shard.drivable_share for shard in shards) / max(1, frames),
        vehicle_share=sum(shard.frames * shard.vehicle_share for shard in shards) / max(1, frames),
        step_s=spread([shard.step_s for shard in shards if not math.isnan(shard.step_s[0])]),
        seconds=seconds,
        bytes=sum(shard.bytes for shard in shards),
        failures=tuple(SceneFailure(name, failures[name]) for name in request.scenes if name in failures),
    )

"""A dataset's labels in the folder layout that cross_view_transformers trains on, made from its tables."""

import json
import time
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from operator import attrgetter
from pathlib import Path

from ogmkit.base import locks
from ogmkit.base.atomic import output_errors, replacing
from ogmkit.base.execution import DEFAULT_EXECUTION, Execution, run_over
from ogmkit.base.names import with_number
from ogmkit.base.news import Found, tell
from ogmkit.errors import SettingsError
from ogmkit.frames import SceneRecord
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.pipeline.exports import record
from ogmkit.pipeline.exports.cvt_sample import CAMERAS, CVT, entry_of, files_of
from ogmkit.pipeline.exports.record import ExportedFile, ExportSummary
from ogmkit.pipeline.output import check_place
from ogmkit.shards.manifest import file_sha256

TABLE = "samples"


@dataclass(frozen=True)
class _Task:
    """One scene's work.

    Attributes:
        out: the folder of the labels.
        scene: its frames and key frames.
        splits: that it belongs to.
        known: its list in an export that was finished; None where none was.
    """

    out: Path
    scene: SceneRecord
    splits: tuple[str, ...]
    known: ExportedFile | None

    @property
    def path(self) -> Path:
        """Of the scene's list, which is written last."""
        return self.out / f"{self.scene.name}.json"


def export_cvt(
    dataset: Dataset,
    out: Path,
    scenes: Sequence[str],
    *,
    splits: Mapping[str, Sequence[str]] | None = None,
    lidar: str = "LIDAR_TOP",
    execution: Execution = DEFAULT_EXECUTION,
) -> ExportSummary:
    """Write `<scene>.json`, a list of samples, and `<scene>/` with their labels; `export.json` has checksums.

    No camera or LiDAR file is read. Killed at any moment, the same call again finishes the work.

    Args:
        dataset: the dataset, with map expansion.
        out: the folder; outside the dataset's.
        scenes: names.
        splits: split → scenes, for the record.
        lidar: channel of the LiDAR whose poses labels hang on.
        execution: worker processes and progress.

    Raises:
        SettingsError: a scene or the LiDAR is unknown, or there is none of the repository's cameras.
        TableError: a record that is used breaks a rule, or a sample lacks a camera's frame.
        DataFileError: a location's map expansion is absent or damaged.
        OutputError: OUT holds something else, another command writes there, or the disk refuses.
        OgmkitError: a worker process died.
    """
    started = time.monotonic()
    check_place(out, dataset.root)
    cameras = tuple(name for name in CAMERAS if name in dataset.channels())
    if not cameras:
        raise SettingsError(f"{dataset.root}: has none of {', '.join(CAMERAS)}")
    configuration = {
        "layout": "cvt",
        "dataset_version": dataset.version,
        "cameras": list(cameras),
        "definition": f"{CVT.name} {CVT.version}",
    }
    files: list[ExportedFile] = []
    kept = 0
    with locks.locked(out, record.LOCK):
        known = record.begin(out, configuration)
        read, own = partial(_scene, dataset, cameras, lidar), partial(_splits_of, splits or {})
        tasks = (_Task(out, read(name), own(name), known.get(f"{name}.json")) for name in scenes)
        tell(Found(f"{with_number(len(scenes), 'scene')}; {execution.place}"))
        with closing(run_over(_run, tasks, execution)) as results:
            for made, there in results:
                files.append(made)
                kept += there
                execution.report(len(files), len(scenes))
        every = {**known, **{one.file: one for one in files}}
        record.finish(out, configuration, sorted(every.values(), key=attrgetter("file")))
    return ExportSummary(tuple(files), kept, time.monotonic() - started)


def _scene(dataset: Dataset, cameras: Sequence[str], lidar: str, name: str) -> SceneRecord:
    scene = dataset.scene(name, cameras, maps=False)
    return replace(scene, key_frames=dataset.key_frames(name, lidar=lidar))


def _splits_of(splits: Mapping[str, Sequence[str]], scene: str) -> tuple[str, ...]:
    return tuple(split for split, names in splits.items() if scene in names)


def _run(task: _Task) -> tuple[ExportedFile, bool]:
    """Write a scene's labels, or find that they are there: its list, and whether it was; runs in a worker."""
    path, scene = task.path, task.scene
    there = record.is_whole(path, task.known)
    if not there:
        _write(task)
    rows, size = len(scene.key_frames), path.stat().st_size
    return ExportedFile(path.name, TABLE, scene.name, task.splits, rows, size, file_sha256(path)), there


def _write(task: _Task) -> None:
    folder, entries = task.out / task.scene.name, []
    with output_errors(folder):
        folder.mkdir(exist_ok=True)
    frames = {
        camera: {one.sample_token: one for one in found} for camera, found in task.scene.cameras.items()
    }
    for key_frame in task.scene.key_frames:
        for name, data in files_of(key_frame).items():
            with replacing(folder / name) as part:
                part.write_bytes(data)
        here = {camera: found.get(key_frame.sample_token) for camera, found in frames.items()}
        entries.append(entry_of(task.scene.name, key_frame, here))
    with replacing(task.path) as part:
        part.write_text(json.dumps(entries), encoding="utf-8")

"""Probabilities of every frame of a folder of shards, written to files."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

import numpy as np

from ogmkit.base.atomic import require_outside
from ogmkit.base.news import Found, tell
from ogmkit.learn.choices import common_cameras, preferred
from ogmkit.learn.devices import device_name
from ogmkit.learn.predict.choice import Choice
from ogmkit.learn.predict.files import (
    Format,
    Group,
    Row,
    Value,
    attributes,
    open_folder,
    reported,
    write_h5,
    write_pngs,
)
from ogmkit.learn.predict.frames import predict_frames
from ogmkit.learn.predict.run import Run, open_run, require_grid, require_system
from ogmkit.samples.index import FrameIndex, index_frames
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards import schema
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.typing import BoolArray

FOOTPRINTS, LIDAR = "footprints", "bev-lidar"
"""Systems that need something of their own."""


@dataclass(frozen=True)
class PredictionJob:
    """What is asked for, whatever it is predicted from.

    Attributes:
        system: that the run is expected to be of.
        checkpoint: a RUN, or one of its checkpoints.
        out: folder for the files, made where it isn't there; files of the same names are replaced.
        form: of the files.
        batch_size: frames at a time.
        workers: processes that read; 0 reads in the calling one.
    """

    system: str
    checkpoint: Path
    out: Path
    form: Format = "hdf5"
    batch_size: int = 8
    workers: int = 0


@dataclass(frozen=True)
class PredictionSummary:
    """What a run did.

    Attributes:
        system: that predicted.
        homography: what masks were warped by; None where no homography took part.
        frames: how many were predicted.
        files: how many were written.
        seconds: wall time.
    """

    system: str
    homography: str | None
    frames: int
    files: int
    seconds: float


def predict_shards(
    job: PredictionJob,
    shards: Path,
    *,
    homography: str | None = None,
    choice: Choice | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> PredictionSummary:
    """Predict frames of shards, and write a file a scene or a picture a mask.

    Args:
        job: by which run, how, and where to.
        shards: a folder that an extraction finished.
        homography: source that `footprints` are warped by; None is the network's if there, else `surface`.
        choice: which frames; all by default.
        on_progress: called with (frames done, frames in all).

    Raises:
        CheckpointError: there is no checkpoint, or it is damaged or of another system.
        SettingsError: the grids differ, or a scene, split or camera is unknown.
        ShardError: the folder is not a finished extraction, or lacks what the run predicts from.
        DataFileError: an image is absent or damaged.
        OutputError: the files can't be written, or would lie among the shards.
    """
    started = time.monotonic()
    choice = choice or Choice()
    require_outside(job.out, shards)
    run = open_run(job.checkpoint)
    require_system(run, job.system)
    require_grid(run, shards)
    manifest = read_manifest(shards)
    scenes = choice.scenes_of(shards, manifest)
    cameras = common_cameras(run.path, run.cameras, shards, manifest, choice.cameras)
    source = None
    if job.system == FOOTPRINTS:
        source = homography or preferred(shards, manifest, cameras[0], schema.HOMOGRAPHY.name)
    spec = run.model.prediction_spec(source)
    index = index_frames(shards, scenes, cameras, needs=spec, valid_only=False, limit=choice.limit)
    tell(Found(f"{index.counted('frame')}; {run.path} on {device_name()}"))
    rows = reported(_rows(run, index, spec, job), len(index), on_progress)
    open_folder(job.out)
    if job.form == "png":
        files = sum(len(write_pngs(job.out, row)) for row in rows)
    else:
        files = _write_scenes(job.out, run, source, index, rows)
    return PredictionSummary(job.system, source, len(index), files, time.monotonic() - started)


def _rows(run: Run, index: FrameIndex, spec: SampleSpec, job: PredictionJob) -> Iterator[Row]:
    """The rows of all frames of the index, in its order."""
    frames = predict_frames(run, index, spec, batch_size=job.batch_size, workers=job.workers)
    source = spec.homography
    paths = dict(zip(index.scenes, index.paths, strict=True))
    for (scene, camera), group in groupby(frames, key=lambda frame: (frame.scene, frame.camera)):
        with Shard(paths[scene]) as shard:
            tokens = {name: shard.strings(camera, name) for name in ("sample_token", "sample_data_token")}
            valid: BoolArray | None = None
            if source is not None:
                valid = shard.dataset(camera, f"{schema.HOMOGRAPHY.name}/{source}/valid")[:]
        for found in group:
            values: dict[str, Value] = {name: column[found.frame] for name, column in tokens.items()}
            values["frame"] = found.frame
            for name, value in (("bev", found.bev), ("image", found.image)):
                if value is not None:
                    values[name] = value
            if valid is not None:
                values["homography_valid"] = bool(valid[found.frame])
            yield Row(f"{scene}_{camera}_{found.frame:04d}", values)


def _write_scenes(out: Path, run: Run, source: str | None, index: FrameIndex, rows: Iterator[Row]) -> int:
    """Write a file a scene that has frames; returns how many."""
    files = 0
    about = attributes(run, source)
    for number, scene in enumerate(index.scenes):
        inside = index.camera[index.shard == number]
        counts = np.bincount(inside, minlength=len(index.cameras)).tolist()
        groups = [
            Group(camera, count, rows) for camera, count in zip(index.cameras, counts, strict=True) if count
        ]
        if groups:
            write_h5(out / f"{scene}.h5", {**about, "scene": scene}, groups)
            files += 1
    return files

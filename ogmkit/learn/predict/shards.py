"""Probabilities of every frame of a folder of shards, written to files."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from ogmkit.base.atomic import require_outside
from ogmkit.base.execution import Execution, run_over
from ogmkit.base.news import Found, tell
from ogmkit.learn.choices import common_cameras, preferred
from ogmkit.learn.predict.choice import Choice
from ogmkit.learn.predict.files import Format, attributes, open_folder, reported
from ogmkit.learn.predict.frames import FramePrediction, predict_frames
from ogmkit.learn.predict.run import open_run, require_grid, require_system
from ogmkit.learn.predict.scenes import Predictor, Scene, write_scene
from ogmkit.learn.predict.workers import place_name
from ogmkit.samples.index import index_frames
from ogmkit.shards import schema
from ogmkit.shards.manifest import read_manifest

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
        workers: processes that read for the one network; 0 reads in the calling one.
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
    scheduler: str = "",
    on_progress: Callable[[int, int], None] | None = None,
) -> PredictionSummary:
    """Predict frames of shards, and write a file a scene or a picture a mask.

    Args:
        job: by which run, how, and where to.
        shards: a folder that an extraction finished.
        homography: source that `footprints` are warped by; None is the network's if there, else `surface`.
        choice: which frames; all by default.
        scheduler: as of `Execution`; each of its workers loads the network and predicts one scene at a time.
            `local` starts `job.workers` of them. Empty predicts in this process.
        on_progress: called with (frames done, frames in all).

    Raises:
        CheckpointError: there is no checkpoint, or it is damaged or of another system.
        SettingsError: the grids differ, a scene, split or camera is unknown, or the scheduler can't be one.
        ShardError: the folder is not a finished extraction, or lacks what the run predicts from.
        DataFileError: an image is absent or damaged.
        OutputError: the files can't be written, or would lie among the shards.
        MissingPackageError, OgmkitError: of a scheduler, as `Execution` and `run_over`.
    """
    started = time.monotonic()
    execution = Execution(job.workers if scheduler else 0, scheduler, on_progress=on_progress)
    choice = choice or Choice()
    require_outside(job.out, shards)
    run = open_run(job.checkpoint)
    require_system(run, job.system)
    require_grid(run, shards)
    manifest = read_manifest(shards)
    names = choice.scenes_of(shards, manifest)
    cameras = common_cameras(run.path, run.cameras, shards, manifest, choice.cameras)
    source = None
    if job.system == FOOTPRINTS:
        source = homography or preferred(shards, manifest, cameras[0], schema.HOMOGRAPHY.name)
    spec = run.model.prediction_spec(source)
    index = index_frames(shards, names, cameras, needs=spec, valid_only=False, limit=choice.limit)
    execution.require_reachable()
    tell(Found(f"{index.counted('frame')}; {run.path} {place_name(execution)}"))
    open_folder(job.out)
    about = attributes(run, source)
    scenes = (Scene(part, spec, job.out, job.form, about) for part in index.by_scene())
    if scheduler:
        run.release()  # each worker has its own
        predictor = Predictor(run.checkpoint, str(about["checkpoint_sha256"]), job.batch_size)
        shared = (run.checkpoint, shards, job.out, *filter(None, [index.image_root]))
        files = _by_workers(predictor, scenes, len(index), execution, shared)
    else:
        frames = predict_frames(
            run, index, spec, batch_size=job.batch_size, workers=job.workers, by_scene=True
        )
        files = _here(reported(frames, len(index), on_progress), scenes)
    return PredictionSummary(job.system, source, len(index), files, time.monotonic() - started)


def _here(frames: Iterator[FramePrediction], scenes: Iterable[Scene]) -> int:
    """Write all scenes from one stream, so that the processes that read stay busy from scene to scene."""
    return sum(write_scene(scene, islice(frames, len(scene.index))).files for scene in scenes)


def _by_workers(
    predictor: Predictor, scenes: Iterable[Scene], total: int, execution: Execution, shared: Sequence[Path]
) -> int:
    frames = files = 0
    with closing(run_over(predictor, scenes, execution, shared=shared)) as results:
        for written in results:
            frames += written.frames
            files += written.files
            execution.report(frames, total)
    return files

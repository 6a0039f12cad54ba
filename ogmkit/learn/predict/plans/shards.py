"""Plans of every sequence of a folder of shards."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from ogmkit.base.news import Found, tell
from ogmkit.errors import SettingsError
from ogmkit.learn.choices import common_cameras
from ogmkit.learn.devices import device_name
from ogmkit.learn.predict.choice import Choice
from ogmkit.learn.predict.files import reported
from ogmkit.learn.predict.plans.inference import predict_plans
from ogmkit.learn.predict.plans.objects import PlanJob, PlanObject, PlanStream, plan_object
from ogmkit.learn.predict.run import Run, open_run, require_grid, require_planner
from ogmkit.samples.index import FrameIndex, index_sequences
from ogmkit.samples.poses import require_finite_poses
from ogmkit.samples.requirements import require_same_step
from ogmkit.samples.spec import SampleSpec
from ogmkit.shards import schema
from ogmkit.shards.manifest import read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.typing import FloatArray


@dataclass(frozen=True, eq=False)
class _Frames:
    """What is told of a camera's N frames in a scene.

    Attributes:
        tokens: N, of the key frames.
        times_us: N, of the images.
        destinations: (N, 2) float64 metres, level frame of each.
        homography_valid: N, whether there is one; None where masks are not warped.
    """

    tokens: tuple[str, ...]
    times_us: list[int]
    destinations: FloatArray
    homography_valid: list[bool] | None


def plans_of_shards(
    job: PlanJob,
    shards: Path,
    *,
    homography: str | None = None,
    choice: Choice | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> PlanStream:
    """Plan from every sequence of six images that has a valid trajectory.

    All that can be checked beforehand is; what is raised later comes out of the stream.

    Args:
        job: by which run, and what to draw.
        shards: a folder that an extraction finished.
        homography: source that masks are warped by (`holistic`); None is the one that the run was trained
            with.
        choice: which sequences, by their last frames; all by default.
        on_progress: called with (plans done, plans in all).

    Returns:
        Objects in the order of scenes, cameras and time. Beside what `plan_object` says: `scene`, `camera`,
        `frame`, `sample_token` and `timestamp_us` of the last image; and where masks are warped, six
        `homography_valid`, of each image: without one its masks are warped to nothing.

    Raises:
        CheckpointError: the checkpoint is missing, damaged or not a planner's, or a plan is not finite.
        SettingsError: grids or steps differ, a scene, split or camera is unknown, or a homography is given to
            a run that warps nothing.
        ShardError: the folder is not a finished extraction, lacks what the run plans from, or has poses that
            are not finite.
        TrainingError: no sequence is left.
        DataFileError: an image is absent or damaged.
    """
    choice = choice or Choice()
    run = open_run(job.checkpoint)
    require_planner(run)
    require_grid(run, shards)
    manifest = read_manifest(shards)
    scenes = choice.scenes_of(shards, manifest)
    cameras = common_cameras(run.path, run.cameras, shards, manifest, choice.cameras)
    spec = run.model.prediction_spec(homography)
    if homography is not None and spec.homography is None:
        raise SettingsError(f"{run.path}: {run.name} warps nothing; leave out --homography {homography}")
    index = index_sequences(shards, scenes, cameras, needs=spec, valid_only=False, limit=choice.limit)
    require_same_step(run.path, run.step_s, index.step_s)
    require_finite_poses(index)
    tell(Found(f"{index.counted('sequence')}; {run.path} on {device_name()}"))
    objects = _objects(job, run, index, spec)
    return PlanStream(run.name, spec.homography, len(index), reported(objects, len(index), on_progress))


def _objects(job: PlanJob, run: Run, index: FrameIndex, spec: SampleSpec) -> Iterator[PlanObject]:
    """Objects of all sequences of the index, in its order."""
    plans = predict_plans(run, index, spec, batch_size=job.batch_size, workers=job.workers)
    generator = job.generator()
    paths = dict(zip(index.scenes, index.paths, strict=True))
    pairs = zip(plans, index.rows.tolist(), strict=True)
    for (scene, camera), group in groupby(pairs, key=lambda pair: (pair[0].scene, pair[0].camera)):
        known = _read(paths[scene], camera, spec.homography)
        for found, rows in group:
            frame = found.frame
            about: dict[str, object] = {
                "scene": scene,
                "camera": camera,
                "frame": frame,
                "sample_token": known.tokens[frame],
                "timestamp_us": known.times_us[frame],
            }
            if known.homography_valid is not None:
                about["homography_valid"] = [known.homography_valid[row] for row in rows]
            destination = known.destinations[frame] if found.plan.told else None
            yield about | plan_object(found.plan, destination, index.step_s, job.samples, generator)


def _read(path: Path, camera: str, homography: str | None) -> _Frames:
    with Shard(path) as shard:
        valid = None
        if homography is not None:
            valid = shard.dataset(camera, f"{schema.HOMOGRAPHY.name}/{homography}/valid")[:].tolist()
        return _Frames(
            tokens=shard.strings(camera, "sample_token"),
            times_us=shard.dataset(camera, "timestamp_us")[:].tolist(),
            destinations=shard.dataset(camera, "trajectory/future")[:, -1],
            homography_valid=valid,
        )

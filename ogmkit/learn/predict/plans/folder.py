"""A plan from a user's own six images."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from torch import Tensor

from ogmkit.base.names import unknown
from ogmkit.errors import CheckpointError, DataFileError, SettingsError, TableError
from ogmkit.homography.result import Homography
from ogmkit.learn.data.tensors import per_frame_tensors, positions_tensor, trajectory_tensors
from ogmkit.learn.planner_settings import PlannerTraining
from ogmkit.learn.predict.image_folder import IMAGES, image_arrays, inputs_in
from ogmkit.learn.predict.image_homographies import given_homographies, homography_run, predicted_homographies
from ogmkit.learn.predict.image_inputs import GIVEN, ImageInputs, with_camera
from ogmkit.learn.predict.plans.file import PlanFile, read_plan_file
from ogmkit.learn.predict.plans.inference import predict_plan_batch, require_finite_plan
from ogmkit.learn.predict.plans.objects import PlanJob, PlanStream, plan_object
from ogmkit.learn.predict.run import Run, open_run, require_planner
from ogmkit.samples.arrays import SampleArrays
from ogmkit.samples.index import SEQUENCE
from ogmkit.samples.spec import SampleSpec


def plan_of_images(
    job: PlanJob, folder: Path, plan_file: Path, *, homography_checkpoint: Path | None = None
) -> PlanStream:
    """Plan from six images of a folder: t = −5 … 0, oldest first by their names.

    Args:
        job: by which run, and what to draw.
        folder: of six *.jpg and *.png; for `lstm-ed`, which sees none, they may be absent.
        plan_file: JSON, see `docs/predict.md`: calibration, past positions and destination.
        homography_checkpoint: a run of `homography` that says how `holistic` gets to the plane; without it
            the file's `bev_from_image` does, else its camera and the plane z = 0.

    Returns:
        One object. Beside what `plan_object` says: `files`, the images' names; and where masks are warped,
        six `homography_valid`, of each image.

    Raises:
        CheckpointError: there is no checkpoint, it is damaged, of no planner, or of one that needs true
            masks; or its plan isn't numbers.
        SettingsError: the two runs' grids differ, the homography's run doesn't know the camera, or is given
            to a run that warps nothing.
        TableError: the file is absent or wrong.
        DataFileError: there are not six images, or one is damaged or of another size than the file's.
    """
    run = open_run(job.checkpoint)
    spec = _spec(run)
    if homography_checkpoint is not None and spec.homography is None:
        raise SettingsError(f"{run.path}: {run.name} warps nothing; leave out --homography-checkpoint")
    network = None if homography_checkpoint is None else homography_run(homography_checkpoint, run)
    known = read_plan_file(plan_file, _needs(run, spec))
    _require_known_camera(known, run)
    paths = () if spec.image_size is None else _six_images(folder, run.step_s)
    homographies: tuple[Homography, ...] = ()
    source = None
    if spec.homography is not None:
        source = GIVEN if network is None else str(network.path)
        homographies = _homographies(paths, known, run, network)
    plan = predict_plan_batch(run.model, _batch(paths, known, spec, homographies), run.cameras)[0]
    require_finite_plan(run, plan, str(folder))
    about: dict[str, object] = {"files": [path.name for path in paths]}
    if homographies:
        about["homography_valid"] = [bool(one.valid) for one in homographies]
    destination = known.destination if plan.told else None
    found = plan_object(plan, destination, run.step_s, job.samples, job.generator())
    return PlanStream(run.name, source, 1, iter([about | found]))


def _spec(run: Run) -> SampleSpec:
    """What the run plans from, where images can give it."""
    require_planner(run)
    spec = run.model.prediction_spec(None)
    if spec.sees_bev:
        raise CheckpointError(
            f"{run.path}: {run.name} plans from true masks, which images don't give; plan from shards"
        )
    return spec


def _needs(run: Run, spec: SampleSpec) -> tuple[str, ...]:
    size = () if spec.image_size is None else ("image_size",)
    settings = run.card.settings
    if not isinstance(settings, PlannerTraining):
        return size
    told = {"positions": settings.sees_past, "destination": not settings.no_destination}
    return (*size, *(key for key, needed in told.items() if needed))


def _require_known_camera(known: PlanFile, run: Run) -> None:
    camera = known.calibrations[-1].camera
    if camera is not None and camera not in run.cameras:
        raise TableError(f"{known.path}: {unknown('camera', camera, run.cameras)}")


def _six_images(folder: Path, step_s: float) -> tuple[Path, ...]:
    paths = inputs_in(folder, IMAGES)
    if len(paths) != SEQUENCE:
        raise DataFileError(
            f"{folder}: holds {len(paths)} images; a plan takes {SEQUENCE}, {step_s:g} s apart, oldest "
            "first by their names"
        )
    return tuple(sorted(paths, key=_counted))


def _counted(path: Path) -> list[tuple[str, int]]:
    """A key by which 9.jpg comes before 10.jpg."""
    return [(text, int(number or -1)) for text, number in re.findall(r"(\D*)(\d*)", path.name)]


def _homographies(
    paths: tuple[Path, ...], known: PlanFile, run: Run, network: Run | None
) -> tuple[Homography, ...]:
    """How each image gets to the plane below the ego at its own time."""
    if network is None:
        return given_homographies(known.calibrations, known.places, run.grid)
    calibrations = tuple(with_camera(one, str(known.path), network) for one in known.calibrations)
    return predicted_homographies(ImageInputs(paths, calibrations, SEQUENCE), network)


def _batch(
    paths: tuple[Path, ...], known: PlanFile, spec: SampleSpec, homographies: tuple[Homography, ...]
) -> dict[str, Tensor]:
    """A batch of one sequence; of the future it knows the destination only."""
    arrays = SampleArrays(np.zeros((SEQUENCE, 2), np.int64))
    if spec.image_size is not None:
        arrays = image_arrays(paths, known.calibrations, spec.image_size, homographies)
    missing = np.full((SEQUENCE, 2), np.nan)
    arrays = replace(
        arrays,
        past=missing,
        future=np.concatenate([missing[1:], known.destination[None]]),
        trajectory_valid=np.array(False),
        positions=known.positions,
    )
    sample = per_frame_tensors(arrays, None, 1) | trajectory_tensors(arrays) | positions_tensor(arrays)
    return {name: value[None] for name, value in sample.items()}

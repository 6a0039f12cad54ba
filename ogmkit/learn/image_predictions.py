"""Probabilities of a user's own images, or LiDAR sweeps, with a calibration file in place of shards."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ogmkit.errors import OutputError, SettingsError, TableError
from ogmkit.geometry.camera import image_from_resized
from ogmkit.grid import GridSpec
from ogmkit.homography import calibration, given
from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.result import Homography, finished
from ogmkit.homography.settings import FitSettings
from ogmkit.learn.calibration_file import Calibration, CalibrationFile, read_calibration_file
from ogmkit.learn.data.loader import EpochBatches, loader
from ogmkit.learn.image_folder import IMAGES, SWEEPS, ImageFolder, inputs_in, stem
from ogmkit.learn.inference import Run, open_run, predict_batch, require_same_grid, require_system
from ogmkit.learn.network_homography import SYSTEM as HOMOGRAPHY
from ogmkit.learn.prediction_files import Group, Row, attributes, open_folder, reported, write_h5, write_pngs
from ogmkit.learn.predictions import FOOTPRINTS, LIDAR, PredictionJob, PredictionSummary
from ogmkit.learn.systems.base import Batch, Prediction
from ogmkit.nuscenes.names import unknown

FILE = "predictions.h5"

_GIVEN = "calibration file"
_CAMERA = ("intrinsics", "level_from_camera")
_NEEDS = {
    FOOTPRINTS: ("image_size",),
    "ved": ("image_size",),
    "oft": ("image_size", *_CAMERA),
    LIDAR: ("level_from_lidar",),
}
_NOTHING = np.empty((0, 2))


@dataclass(frozen=True, eq=False)
class _Inputs:
    """What is predicted from.

    Attributes:
        paths: N files.
        calibrations: N, of each.
        batch_size: inputs at a time.
        workers: processes that read.
    """

    paths: tuple[Path, ...]
    calibrations: tuple[Calibration, ...]
    batch_size: int
    workers: int

    def predictions(
        self, run: Run, homographies: Sequence[Homography] = ()
    ) -> Iterator[tuple[int, Prediction, int]]:
        """Place of a batch's first input, the batch's prediction and its length, over all inputs."""
        spec = run.model.prediction_spec(_GIVEN if homographies else None)
        folder = ImageFolder(self.paths, self.calibrations, run.cameras, run.grid, spec, homographies)
        batches = EpochBatches(len(folder), self.batch_size, seed=0, shuffle=False)
        batch: Batch
        for batch in loader(folder, batches, workers=self.workers):
            yield int(batch["index"][0]), predict_batch(run.model, batch, run.cameras), len(batch["index"])


def predict_images(
    job: PredictionJob,
    folder: Path,
    calibration_file: Path,
    *,
    homography_checkpoint: Path | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> PredictionSummary:
    """Predict all images of a folder (for `bev-lidar`, sweeps), and write a file, or a picture a mask.

    Args:
        job: by which run, how, and where to.
        folder: of *.jpg and *.png; of *.pcd.bin for `bev-lidar`.
        calibration_file: JSON, see `docs/predict.md`.
        homography_checkpoint: a run of `homography` that says how `footprints` get to the plane; without it
            the calibration file's `bev_from_image` does, else its camera and the plane z = 0.
        on_progress: called with (inputs done, inputs in all).

    Raises:
        CheckpointError: there is no checkpoint, or it is damaged or of another system.
        SettingsError: the two runs' grids differ, or the homography's run doesn't know a camera.
        TableError: the calibration file is absent or wrong.
        DataFileError: an input is absent, damaged, or of another size than its calibration's.
        OutputError: the files can't be written, or would lie among the inputs.
    """
    started = time.monotonic()
    if job.out.resolve() == folder.resolve():
        raise OutputError(f"{job.out}: holds the input; choose another folder")
    run = open_run(job.checkpoint)
    require_system(run, job.system)
    network = None if homography_checkpoint is None else _homography_run(homography_checkpoint, run)
    paths = inputs_in(folder, SWEEPS if job.system == LIDAR else IMAGES)
    file = read_calibration_file(calibration_file)
    calibrations = tuple(_calibration(file, path.name, run) for path in paths)
    inputs = _Inputs(paths, calibrations, job.batch_size, job.workers)
    homographies: tuple[Homography, ...] = ()
    source = None
    if job.system == FOOTPRINTS:
        source = _GIVEN if network is None else str(network.path)
        homographies = _given(inputs, file, run.grid) if network is None else _predicted(inputs, network)
    open_folder(job.out)
    rows = reported(_rows(inputs, run, homographies), len(paths), on_progress)
    if job.form == "png":
        files = sum(len(write_pngs(job.out, row)) for row in rows)
    else:
        write_h5(job.out / FILE, attributes(run, source), [Group("", len(paths), rows)])
        files = 1
    return PredictionSummary(job.system, source, len(paths), files, time.monotonic() - started)


def _homography_run(checkpoint: Path, run: Run) -> Run:
    network = open_run(checkpoint)
    require_system(network, HOMOGRAPHY)
    require_same_grid(network, run.grid, run.path)
    return network


def _calibration(file: CalibrationFile, name: str, run: Run) -> Calibration:
    """An input's calibration, with a camera that the run knows."""
    found = file.calibration(name, _NEEDS[run.system])
    if run.system == LIDAR:  # its points are in the level frame: whatever camera, the answer is the same
        return replace(found, camera=run.cameras[0])
    camera = found.camera or (run.cameras[0] if len(run.cameras) == 1 else None)
    if camera is None:
        raise TableError(f"{file.place(name)}: camera is missing; name one of {', '.join(run.cameras)}")
    if camera not in run.cameras:
        raise TableError(f"{file.place(name)}: {unknown('camera', camera, run.cameras)}")
    return replace(found, camera=camera)


def _given(inputs: _Inputs, file: CalibrationFile, grid: GridSpec) -> tuple[Homography, ...]:
    """Homographies as the calibration file says, or by its camera over the plane z = 0.

    Raises:
        TableError: neither is there, or a homography is none.
    """
    homographies = []
    for path, known in zip(inputs.paths, inputs.calibrations, strict=True):
        place = file.place(path.name)
        if known.bev_from_image is None and (known.intrinsics is None or known.level_from_camera is None):
            raise TableError(
                f"{place}: gives neither bev_from_image nor intrinsics and level_from_camera; "
                "add them, or use --homography-checkpoint"
            )
        homography = _by_calibration(known, grid)
        if not homography.valid:
            raise TableError(f"{place}: leads to no homography: {homography.reason}; correct it")
        homographies.append(homography)
    return tuple(homographies)


def _by_calibration(known: Calibration, grid: GridSpec) -> Homography:
    """The file's own homography, else the camera's over the plane z = 0."""
    if known.bev_from_image is not None:
        found = given.estimate(known.bev_from_image, known.image_size, grid)
    else:
        found = calibration.estimate(_camera(known), np.array([-1]), FitSettings())
    return finished(found, grid, _NOTHING, _NOTHING)


def _camera(known: Calibration) -> FrameGeometry:
    """The calibrated camera, without boxes."""
    nothing = np.empty(0)
    return FrameGeometry(
        intrinsics=np.eye(3) if known.intrinsics is None else known.intrinsics,
        level_from_camera=np.eye(4) if known.level_from_camera is None else known.level_from_camera,
        image_size=known.image_size,
        level_from_box=np.empty((0, 4, 4)),
        size_wlh=np.empty((0, 3)),
        category=(),
        visibility=nothing.astype(np.uint8),
    )


def _predicted(inputs: _Inputs, network: Run) -> tuple[Homography, ...]:
    """Homographies as a network reads them off the images.

    Raises:
        SettingsError: it was not trained on one of the cameras.
    """
    for known in inputs.calibrations:
        if known.camera not in network.cameras:
            raise SettingsError(f"{network.path}: {unknown('camera', str(known.camera), network.cameras)}")
    homographies = []
    for first, prediction, count in inputs.predictions(network):
        if prediction.bev_from_image is None:
            continue  # a homography network's is always there
        matrices = prediction.bev_from_image.cpu().numpy()
        for known, matrix in zip(inputs.calibrations[first : first + count], matrices, strict=True):
            resized_from_image = image_from_resized(network.card.settings.image_size, known.image_size)
            found = given.estimate(matrix @ resized_from_image, known.image_size, network.grid)
            homographies.append(finished(found, network.grid, _NOTHING, _NOTHING))
    return tuple(homographies)


def _rows(inputs: _Inputs, run: Run, homographies: Sequence[Homography]) -> Iterator[Row]:
    for first, prediction, count in inputs.predictions(run, homographies):
        maps = {"bev": prediction.bev, "image": prediction.image}
        arrays = {name: value.float().cpu().numpy() for name, value in maps.items() if value is not None}
        for number in range(count):
            path = inputs.paths[first + number]
            values = {"file": path.name, **{name: array[number] for name, array in arrays.items()}}
            if homographies:
                found = homographies[first + number]
                values |= {"homography_valid": found.valid, "bev_from_image": found.bev_from_image}
            yield Row(stem(path), values)

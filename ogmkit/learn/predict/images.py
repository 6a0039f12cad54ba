"""Probabilities of a user's own images, or LiDAR sweeps, with a calibration file in place of shards."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from ogmkit.base.names import with_number
from ogmkit.base.news import Found, tell
from ogmkit.errors import OutputError
from ogmkit.homography.result import Homography
from ogmkit.learn.devices import device_name
from ogmkit.learn.predict.calibration_file import Calibration, CalibrationFile, read_calibration_file
from ogmkit.learn.predict.files import Group, Row, attributes, open_folder, reported, write_h5, write_pngs
from ogmkit.learn.predict.image_folder import IMAGES, SWEEPS, inputs_in, stem
from ogmkit.learn.predict.image_homographies import given_homographies, homography_run, predicted_homographies
from ogmkit.learn.predict.image_inputs import GIVEN, ImageInputs, with_camera
from ogmkit.learn.predict.run import Run, open_run, require_system
from ogmkit.learn.predict.shards import FOOTPRINTS, LIDAR, PredictionJob, PredictionSummary

FILE = "predictions.h5"

_CAMERA = ("intrinsics", "level_from_camera")
_NEEDS = {
    FOOTPRINTS: ("image_size",),
    "ved": ("image_size",),
    "oft": ("image_size", *_CAMERA),
    LIDAR: ("level_from_lidar",),
}


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
    network = None if homography_checkpoint is None else homography_run(homography_checkpoint, run)
    paths = inputs_in(folder, SWEEPS if job.system == LIDAR else IMAGES)
    file = read_calibration_file(calibration_file)
    calibrations = tuple(_calibration(file, path.name, run) for path in paths)
    inputs = ImageInputs(paths, calibrations, job.batch_size, job.workers)
    homographies: tuple[Homography, ...] = ()
    source = None
    if job.system == FOOTPRINTS:
        source = GIVEN if network is None else str(network.path)
        if network is None:
            places = tuple(file.place(path.name) for path in paths)
            homographies = given_homographies(calibrations, places, run.grid)
        else:
            homographies = predicted_homographies(inputs, network)
    open_folder(job.out)
    tell(Found(f"{with_number(len(paths), 'input')}; {run.path} on {device_name()}"))
    rows = reported(_rows(inputs, run, homographies), len(paths), on_progress)
    if job.form == "png":
        files = sum(len(write_pngs(job.out, row)) for row in rows)
    else:
        write_h5(job.out / FILE, attributes(run, source), [Group("", len(paths), rows)])
        files = 1
    return PredictionSummary(job.system, source, len(paths), files, time.monotonic() - started)


def _calibration(file: CalibrationFile, name: str, run: Run) -> Calibration:
    """An input's calibration, with a camera that the run knows."""
    found = file.calibration(name, _NEEDS[run.system])
    if run.system == LIDAR:  # its points are in the level frame: whatever camera, the answer is the same
        return replace(found, camera=run.cameras[0])
    return with_camera(found, file.place(name), run)


def _rows(inputs: ImageInputs, run: Run, homographies: Sequence[Homography]) -> Iterator[Row]:
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

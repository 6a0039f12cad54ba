"""Ways to the plane for a user's own images: a calibration file's, or a network's."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ogmkit.base.names import unknown
from ogmkit.errors import SettingsError, TableError
from ogmkit.geometry.camera import image_from_resized
from ogmkit.grid import GridSpec
from ogmkit.homography import calibration, given
from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.result import Homography, finished
from ogmkit.homography.settings import FitSettings
from ogmkit.learn.predict.calibration_file import Calibration
from ogmkit.learn.predict.homographies import SYSTEM
from ogmkit.learn.predict.image_inputs import ImageInputs
from ogmkit.learn.predict.run import Run, open_run, require_same_grid, require_system

_NOTHING = np.empty((0, 2))


def homography_run(checkpoint: Path, run: Run) -> Run:
    """Open a run of `homography` that leads to another run's grid.

    Raises:
        CheckpointError: there is none, or it is damaged or of another system.
        SettingsError: its grid is another.
    """
    network = open_run(checkpoint)
    require_system(network, SYSTEM)
    require_same_grid(network, run.grid, run.path)
    return network


def given_homographies(
    calibrations: Sequence[Calibration], places: Sequence[str], grid: GridSpec
) -> tuple[Homography, ...]:
    """Homographies as calibrations say, or by their cameras over the plane z = 0.

    Args:
        calibrations: of N inputs.
        places: N, what messages call them.
        grid: the cells.

    Raises:
        TableError: neither is there, or a homography is none.
    """
    homographies = []
    for known, place in zip(calibrations, places, strict=True):
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


def predicted_homographies(inputs: ImageInputs, network: Run) -> tuple[Homography, ...]:
    """Homographies as a network reads them off the images; where it finds none, an invalid one.

    Raises:
        SettingsError: it was not trained on one of the cameras.
        DataFileError: an image is absent, damaged, or of another size than its calibration's.
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
            resized_from_image = image_from_resized(network.image_size, known.image_size)
            found = given.estimate(matrix @ resized_from_image, known.image_size, network.grid)
            homographies.append(finished(found, network.grid, _NOTHING, _NOTHING))
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
        level_from_ego=np.eye(4),
        image_size=known.image_size,
        level_from_box=np.empty((0, 4, 4)),
        size_wlh=np.empty((0, 3)),
        category=(),
        visibility=nothing.astype(np.uint8),
        num_lidar_pts=nothing.astype(np.int64),
    )

"""A user's own images, or LiDAR sweeps, with their calibrations, as networks take them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ogmkit.base.names import unknown
from ogmkit.errors import TableError
from ogmkit.homography.result import Homography
from ogmkit.learn.data.loader import EpochBatches, loader
from ogmkit.learn.predict.calibration_file import Calibration
from ogmkit.learn.predict.frames import predict_batch
from ogmkit.learn.predict.image_folder import ImageFolder
from ogmkit.learn.predict.run import Run
from ogmkit.learn.systems.base import Batch, Prediction

GIVEN = "calibration file"
"""What homographies that are not the shards' are called where a specification names their source."""


@dataclass(frozen=True, eq=False)
class ImageInputs:
    """What is predicted from.

    Attributes:
        paths: N files.
        calibrations: N, of each; their cameras are filled in.
        batch_size: inputs at a time.
        workers: processes that read.
    """

    paths: tuple[Path, ...]
    calibrations: tuple[Calibration, ...]
    batch_size: int
    workers: int = 0

    def predictions(
        self, run: Run, homographies: Sequence[Homography] = ()
    ) -> Iterator[tuple[int, Prediction, int]]:
        """Place of a batch's first input, the batch's prediction and its length, over all inputs."""
        spec = run.model.prediction_spec(GIVEN if homographies else None)
        folder = ImageFolder(self.paths, self.calibrations, run.cameras, run.grid, spec, homographies)
        batches = EpochBatches(len(folder), self.batch_size, seed=0, shuffle=False)
        batch: Batch
        for batch in loader(folder, batches, workers=self.workers):
            yield int(batch["index"][0]), predict_batch(run.model, batch, run.cameras), len(batch["index"])


def with_camera(known: Calibration, place: str, run: Run) -> Calibration:
    """A calibration with a camera that a run knows: the only one, where the file names none.

    Args:
        known: the calibration.
        place: what messages call it.
        run: that predicts.

    Raises:
        TableError: the camera is missing, and the run knows several; or it is unknown.
    """
    camera = known.camera or (run.cameras[0] if len(run.cameras) == 1 else None)
    if camera is None:
        raise TableError(f"{place}: camera is missing; name one of {', '.join(run.cameras)}")
    if camera not in run.cameras:
        raise TableError(f"{place}: {unknown('camera', camera, run.cameras)}")
    return replace(known, camera=camera)

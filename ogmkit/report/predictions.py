"""What runs predict of some frames, beside the truth: scores, and pictures of where they differ."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ogmkit.drawing.cells import overlap
from ogmkit.drawing.palette import THEMES
from ogmkit.evaluation.entrants import Entrant, entrants_of, no_grids
from ogmkit.evaluation.frames import Frame, FrameReader, Place
from ogmkit.evaluation.progress import Progress, Tick, ticker
from ogmkit.evaluation.runs import OpenRun
from ogmkit.evaluation.scope import Scope, paths, scope_of
from ogmkit.evaluation.settings import EvaluateSettings
from ogmkit.metrics.iou import masks_of, thresholded
from ogmkit.pictures.evaluation_sheet import differences
from ogmkit.pictures.views import read_view
from ogmkit.report.thumbnails import in_themes, small_plan
from ogmkit.samples.spec import TARGETS
from ogmkit.shards.manifest import read_manifest
from ogmkit.typing import UInt8Array

PICTURES = len(TARGETS) * len(THEMES)
"""Of each prediction."""


@dataclass(frozen=True)
class Predicted:
    """What a run says of a frame.

    Attributes:
        run: its name, as in the tables.
        iou: of drivable area and of vehicles, in view; NaN where neither has anything.
        pictures: the drivable area's difference in each theme, then the vehicles', in base64.
    """

    run: str
    iou: tuple[float, float]
    pictures: tuple[str, ...]


@dataclass(frozen=True)
class Predictions:
    """What runs predict.

    Attributes:
        heading: which frames, and how masks were laid on the grid; empty without runs.
        by_frame: frame → predictions, run by run.
    """

    heading: str
    by_frame: Mapping[Place, tuple[Predicted, ...]]

    @property
    def characters(self) -> int:
        """What the pictures take in the page."""
        return sum(
            len(picture) for found in self.by_frame.values() for one in found for picture in one.pictures
        )


NONE = Predictions("", {})


def predict_examples(
    shards: Path, runs: Sequence[OpenRun], most: int, *, on_progress: Progress | None = None
) -> Predictions:
    """Predict evenly spread frames of the split that `evaluate` reports.

    Args:
        shards: the folder.
        runs: that predict grids.
        most: frames.
        on_progress: called with (frames done, frames in all), each counted once a run.

    Raises:
        OgmkitError: as `ogmkit.evaluation.evaluate.evaluate`.
    """
    if not runs or not most:
        return NONE
    settings = EvaluateSettings(limit=most)
    known = read_manifest(shards).settings.cameras
    cameras = tuple(camera for camera in known if all(camera in run.cameras for run in runs))
    scope = scope_of(
        shards, split=None, split_file=None, cameras=cameras, homography=None, sources=None, limit=most
    )
    entrants = entrants_of(runs, scope, ())
    tick = ticker(on_progress, len(entrants) * len(scope.index))
    found: dict[Place, list[Predicted]] = {}
    for entrant in entrants:
        for place, one in _predicted(entrant, scope, settings, tick):
            found.setdefault(place, []).append(one)
    warped = f", masks warped by homography {scope.homography}" if scope.homography else ""
    heading = f"{len(found)} frames of split {scope.split}, threshold {settings.threshold:g}{warped}"
    return Predictions(heading, {place: tuple(ones) for place, ones in found.items()})


def _predicted(
    entrant: Entrant, scope: Scope, settings: EvaluateSettings, tick: Tick
) -> Iterator[tuple[Place, Predicted]]:
    grids = entrant.run.frames(scope.index, scope.homography, batch_size=settings.batch_size, workers=0)
    with FrameReader(paths(scope.index)) as reader:
        for one in grids:
            if one.bev is None:
                raise no_grids(entrant.run.path, entrant.name, scope.shards)
            place = one.scene, one.camera, one.frame
            masks = masks_of(thresholded(one.bev, settings.threshold))
            yield place, _compared(entrant.name, reader.frame(place), masks)
            tick()


def _compared(run: str, frame: Frame, found: tuple[UInt8Array, UInt8Array]) -> Predicted:
    """Scores and pictures of one prediction."""
    view, grid = read_view(frame.shard, frame.camera, frame.index), frame.shard.grid
    plan = small_plan(view, grid)
    pictures = in_themes(lambda: [*differences(view, plan, found).values()])
    true = view.drivable, view.vehicles
    drivable, vehicles = (
        overlap(one, other, view.field_of_view) for one, other in zip(true, found, strict=True)
    )
    return Predicted(run, (drivable, vehicles), tuple(pictures))

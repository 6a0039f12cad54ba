"""What an extraction did, and what it could not do, by kind of reason."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ogmkit.errors import OgmkitError
from ogmkit.pipeline.frame_files import Absence, joined


@dataclass(frozen=True)
class SceneFailure:
    """A scene that gave no shard, and why.

    Attributes:
        scene: the scene's name.
        error: the first reason.
        absent: the files that it lacks, where that is the reason.
    """

    scene: str
    error: OgmkitError
    absent: tuple[Absence, ...] = ()


@dataclass(frozen=True)
class FailureGroup:
    """Scenes that gave no shard for the same kind of reason.

    Attributes:
        scenes: their names.
        reason: one line, with the first file or record.
        others: whether the reasons of further scenes name other files or records.
    """

    scenes: tuple[str, ...]
    reason: str
    others: bool


@dataclass(frozen=True)
class ExtractSummary:
    """What a run did.

    Attributes:
        scenes: chosen scenes that have a whole shard now.
        kept: those of them that had one before.
        frames: their frames over all cameras.
        frames_left_out: frames that they lack, over all cameras, since a file was absent or bad.
        valid_trajectories: frames with a valid trajectory.
        drivable_share: share of drivable cells, over all frames; NaN without maps.
        vehicle_share: share of vehicle cells, over all frames.
        blind: cameras that see no cell of the grid in any frame.
        step_s: median, shortest and longest time from a frame to the one a step on; NaN without any.
        seconds: wall time.
        bytes: size of the shards.
        failures: scenes that gave no shard.
        left_out: scenes without a shard that the settings say to leave out.
    """

    scenes: int
    kept: int
    frames: int
    frames_left_out: int
    valid_trajectories: int
    drivable_share: float
    vehicle_share: float
    blind: tuple[str, ...]
    step_s: tuple[float, float, float]
    seconds: float
    bytes: int
    failures: tuple[SceneFailure, ...]
    left_out: tuple[SceneFailure, ...]


def oddities(summary: ExtractSummary) -> Iterator[str]:
    """Each figure that is 0 or 100 % throughout, and what may be behind it; a line each."""
    if not summary.frames:
        return
    cells = {0: "no cell", 1: "every cell"}
    if summary.drivable_share in cells:
        cell = cells[round(summary.drivable_share)]
        yield f"{cell} is drivable throughout; check the mask that map.json names, and that poses lie on it"
    if summary.vehicle_share in cells:
        cell = cells[round(summary.vehicle_share)]
        yield f"{cell} is under a vehicle throughout; check --categories, and sizes and positions of boxes"
    if not summary.valid_trajectories:
        yield "no frame has a valid trajectory; check --step and --max-gap against the step below"
    for camera in summary.blind:
        yield f"{camera} sees no cell of the grid; check its calibration, and the ego's place in the grid"


def grouped(failures: Sequence[SceneFailure], *, remedies: bool = True) -> tuple[FailureGroup, ...]:
    """One group for each kind of reason: of hundreds of scenes it is the same where a download is partial.

    Args:
        failures: the scenes.
        remedies: whether to say what is to be done about absent files.
    """
    others = [one for one in failures if not one.absent]
    return (*_by_absent_files(failures, remedies), *_by_kind(others))


def _by_absent_files(failures: Sequence[SceneFailure], remedies: bool) -> Iterator[FailureGroup]:
    for absence in joined(absence for failure in failures for absence in failure.absent):
        scenes = [
            failure.scene for failure in failures if any(one.what == absence.what for one in failure.absent)
        ]
        reason = f"{absence.problem}; {absence.remedy}" if remedies else absence.problem
        yield FailureGroup(tuple(scenes), reason, others=False)


def _by_kind(failures: Sequence[SceneFailure]) -> Iterator[FailureGroup]:
    groups: dict[str, list[SceneFailure]] = {}
    for failure in failures:
        groups.setdefault(failure.error.kind or str(failure.error), []).append(failure)
    for group in groups.values():
        reasons = [str(failure.error) for failure in group]
        yield FailureGroup(tuple(failure.scene for failure in group), reasons[0], len(set(reasons)) > 1)

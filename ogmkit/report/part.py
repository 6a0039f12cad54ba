"""What the report takes of one shard: its figures, and its pictures as text."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ogmkit.evaluation.frames import Place
from ogmkit.pictures.views import read_view
from ogmkit.pipeline.homography_summary import MethodResults, joined, read_results
from ogmkit.report import choice
from ogmkit.report.distributions import Distributions, FrameFigures, distributions, frame_figures, total
from ogmkit.report.homographies import measured
from ogmkit.report.predictions import Predicted
from ogmkit.report.thumbnails import frame_pictures
from ogmkit.shards import schema
from ogmkit.shards.faults import H5_ERRORS, damaged
from ogmkit.shards.invalid import InvalidFrames, invalid_frames
from ogmkit.shards.left_out import LeftOutCount, count_left_out
from ogmkit.shards.listed import listed_shard
from ogmkit.shards.manifest import ShardEntry
from ogmkit.shards.reader import Shard
from ogmkit.shards.summary import ShardSummary, summarise


@dataclass(frozen=True, eq=False)
class Task:
    """A shard to read.

    Attributes:
        folder: of the shards.
        entry: the manifest's.
        frames: most that are pictured.
        predicted: frames that are pictured besides, with what runs predict there.
        dataroot: where images are that the shards only refer to; None leaves them out.
    """

    folder: Path
    entry: ShardEntry
    frames: int
    predicted: Mapping[Place, tuple[Predicted, ...]]
    dataroot: Path | None


@dataclass(frozen=True)
class PicturedFrame:
    """A frame that is pictured; what isn't known is NaN.

    Attributes:
        camera: channel.
        index: place among the camera's frames.
        time_s: since the camera's first frame.
        drivable: share of drivable cells.
        vehicles: number of vehicles.
        speed_m_s: over the last step.
        lacks: what it lacks and why, in words.
        predicted: what runs say of it.
    """

    camera: str
    index: int
    time_s: float
    drivable: float
    vehicles: int
    speed_m_s: float
    lacks: tuple[str, ...]
    predicted: tuple[Predicted, ...]


@dataclass(frozen=True, eq=False)
class Part:
    """What one shard gives.

    Attributes:
        entry: the manifest's.
        summary: its figures.
        distributions: of all frames.
        invalid: frames that lack something.
        left_out: frames that are not there.
        homographies: source → its results, of measured boxes alone.
        frames: those that are pictured.
        pictures: of each of them, in base64.
    """

    entry: ShardEntry
    summary: ShardSummary
    distributions: Distributions
    invalid: tuple[InvalidFrames, ...]
    left_out: tuple[LeftOutCount, ...]
    homographies: Mapping[str, MethodResults]
    frames: tuple[PicturedFrame, ...]
    pictures: tuple[tuple[str, ...], ...]


def read_part(task: Task) -> Part:
    """Read one shard, a frame at a time.

    Raises:
        ShardError: it is absent or damaged.
        DataFileError: an image is damaged.
    """
    with listed_shard(task.folder, task.entry) as shard:
        try:
            return _part(task, shard)
        except H5_ERRORS as error:
            raise damaged(shard.path, error) from error


def _part(task: Task, shard: Shard) -> Part:
    figures = {camera: frame_figures(shard, camera) for camera in shard.cameras}
    invalid = invalid_frames(shard)
    places = _places(task, shard, invalid)
    return Part(
        entry=task.entry,
        summary=summarise(shard.path, sha256=task.entry.sha256),
        distributions=total(distributions(shard, camera, one) for camera, one in figures.items()),
        invalid=invalid,
        left_out=count_left_out(shard),
        homographies=_homographies(shard),
        frames=tuple(_frame(task, shard, place, lacks, figures[place[0]]) for place, lacks in places.items()),
        pictures=tuple(_pictures(task, shard, place) for place in places),
    )


def _places(task: Task, shard: Shard, invalid: tuple[InvalidFrames, ...]) -> dict[choice.Place, list[str]]:
    """The frames that are pictured, in order, with what they lack."""
    lacks: dict[choice.Place, list[str]] = {}
    for one in invalid:
        for index in one.frames:
            lacks.setdefault((one.camera, index), []).append(f"{one.of}: {one.reason}")
    counts = {camera: shard.frames(camera) for camera in shard.cameras}
    chosen = choice.chosen_frames(counts, lacks, task.frames)
    predicted = {(camera, index) for scene, camera, index in task.predicted if scene == shard.scene}
    return {place: lacks.get(place, []) for place in sorted({*chosen, *predicted})}


def _frame(
    task: Task, shard: Shard, place: choice.Place, lacks: list[str], figures: FrameFigures
) -> PicturedFrame:
    camera, index = place
    times_us = shard.dataset(camera, "timestamp_us")
    return PicturedFrame(
        camera=camera,
        index=index,
        time_s=(int(times_us[index]) - int(times_us[0])) / 1e6,
        drivable=float(figures.drivable[index]),
        vehicles=int(figures.vehicles[index]),
        speed_m_s=float(figures.speed_m_s[index]),
        lacks=tuple(lacks),
        predicted=task.predicted.get((shard.scene, *place), ()),
    )


def _pictures(task: Task, shard: Shard, place: choice.Place) -> tuple[str, ...]:
    found = frame_pictures(read_view(shard, *place, dataroot=task.dataroot), shard.grid)
    predicted = task.predicted.get((shard.scene, *place), ())
    return (*found, *(picture for one in predicted for picture in one.pictures))


def _homographies(shard: Shard) -> dict[str, MethodResults]:
    """Source → results over the cameras that have it, measured with boxes left out."""
    found: dict[str, list[MethodResults]] = {}
    for camera in shard.cameras:
        for source in shard.added(camera, schema.HOMOGRAPHY.name):
            if f"{camera}/{schema.HOMOGRAPHY.name}/{source}/left_out_error_m" in shard.h5:
                found.setdefault(source, []).append(measured(read_results(shard, camera, source)))
    return {source: joined(parts) for source, parts in found.items()}

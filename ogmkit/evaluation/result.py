"""What an evaluation found."""

from dataclasses import dataclass

from ogmkit.evaluation.frames import Place
from ogmkit.grid import GridSpec
from ogmkit.typing import UInt8Array


@dataclass(frozen=True)
class Figure:
    """One IoU, a share between 0 and 1, with its interval; NaN where undefined or not measured.

    Attributes:
        system: the row of the table.
        target: `drivable` or `vehicles`.
        view: `camera` or `bev`.
        region: `full`, `close` or `far`.
        cells: `all`, or `fov` for those in the field of view.
        iou: `foreground`, or `mean` with the background's.
        value: over all frames.
        low: lower end of the 95 % interval.
        high: its upper end.
    """

    system: str
    target: str
    view: str
    region: str
    cells: str
    iou: str
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Separation:
    """How often a system's vehicle grid tells neighbouring vehicles apart (`ogmkit.metrics.separation`).

    Attributes:
        system: the row of the table.
        pairs: neighbouring true vehicles.
        found: pairs of which both are found.
        value: share of the found pairs that are separated; NaN where none is found.
        low: lower end of the 95 % interval.
        high: its upper end.
    """

    system: str
    pairs: int
    found: int
    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Sample:
    """One frame's prediction, kept to be drawn.

    Attributes:
        system: the row of the table.
        place: the frame.
        bev: (rows, columns) code.
        image: (h, w) code in camera view; None for a system without.
    """

    system: str
    place: Place
    bev: UInt8Array
    image: UInt8Array | None


@dataclass(frozen=True, eq=False)
class Evaluation:
    """All figures, and what they were found on.

    Attributes:
        split: the split's name.
        scenes: scenes with frames.
        frames: over all scenes and cameras.
        cameras: channels.
        grid: the shards'.
        homography: the source that masks in camera view were warped by; None where there is none.
        threshold: what probabilities must exceed.
        scale: image size / mask size of the ceilings.
        systems: names of the runs, in the order given.
        fixed: names of the rows that need no run.
        figures: system by system.
        separations: the same.
        notes: sentences to be read with the tables.
        samples: kept predictions, run by run.
    """

    split: str
    scenes: int
    frames: int
    cameras: tuple[str, ...]
    grid: GridSpec
    homography: str | None
    threshold: float
    scale: float
    systems: tuple[str, ...]
    fixed: tuple[str, ...]
    figures: tuple[Figure, ...]
    separations: tuple[Separation, ...]
    notes: tuple[str, ...]
    samples: tuple[Sample, ...]

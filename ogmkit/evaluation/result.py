"""What an evaluation found."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from ogmkit.evaluation.frames import Place
from ogmkit.grid import GridSpec
from ogmkit.target_settings import TargetSettings
from ogmkit.typing import IntArray, UInt8Array

PAPER = "paper"
"""The paper's definition of labels (design.md §3)."""


def definition_of(targets: TargetSettings) -> str:
    """The definition of a folder's labels: `paper`, and what differs from it: `paper, min_lidar_points 1`."""
    paper = TargetSettings()
    different = [
        f"{name} {'+'.join(value) if isinstance(value, tuple) else value}"
        for name in ("categories", "min_visibility", "min_lidar_points")
        if (value := getattr(targets, name)) != getattr(paper, name)
    ]
    return ", ".join((PAPER, *different))


def labels_told(definition: str) -> str:
    """What a heading says of labels: nothing of the paper's."""
    return "" if definition == PAPER else f"labels: {definition}; "


@dataclass(frozen=True)
class Figure:
    """One figure with its interval; NaN where undefined or not measured.

    Attributes:
        system: the row of the table.
        definition: of the labels that it was measured by.
        target: `drivable` or `vehicles`.
        view: `camera` or `bev`.
        region: `full`, `close` or `far`.
        cells: `all`, or `fov` for those in the field of view; of these, `rays` and `lidar`, where shards have
            them (`ogmkit.raster.seen`).
        metric: `foreground_iou`, or `mean_iou` with the background's; `tuned_iou`, the foreground's at the
            thresholds that a run has chosen on its validation; of neighbouring vehicles
            (`ogmkit.metrics.separation`) the number of `pairs`, of `pairs_found`, and the share of these that
            is told apart, `pairs_separated`.
        value: over all frames: a share between 0 and 1, or a number of pairs.
        low: lower end of the 95 % interval; NaN of numbers, and where there is one scene only.
        high: its upper end, likewise.
    """

    system: str
    definition: str = field(default=PAPER, kw_only=True)
    target: str
    view: str
    region: str
    cells: str
    metric: str
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
class SceneCounts:
    """What the figures of one row are made of, scene by scene, for comparing rows on the same scenes.

    `ogmkit.metrics.iou.iou` makes IoUs of sums of it, `ogmkit.metrics.bootstrap.estimate` their intervals.

    Attributes:
        bev: (scenes, target, region, cells, outcome) int64, as `ogmkit.metrics.iou.BevCounter` counts.
        image: (scenes, target, outcome) int64, in camera view; zeros where a row has nothing there.
        tuned_bev: as `bev`, at the run's own thresholds; zeros where it has none.
        pairs: (scenes, 3) int64: `pairs`, `pairs_found`, and those that are told apart.
    """

    bev: IntArray
    image: IntArray
    tuned_bev: IntArray
    pairs: IntArray


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
        notes: sentences to be read with the tables.
        samples: kept predictions, run by run.
        chosen_on_reported: names of the runs whose checkpoint was chosen on scenes that are reported.
        learnt_from_reported: names of the runs that learnt from such scenes.
        definition: of the labels.
        near_training: share of the reported scenes' key frames near one of those to learn from, or NaN.
        by_scene: row → its counts; scenes in the order that the split has them.
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
    notes: tuple[str, ...]
    samples: tuple[Sample, ...]
    chosen_on_reported: tuple[str, ...] = ()
    learnt_from_reported: tuple[str, ...] = ()
    definition: str = PAPER
    near_training: float = math.nan
    by_scene: Mapping[str, SceneCounts] = field(default_factory=dict)

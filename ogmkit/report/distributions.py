"""How what shards hold is distributed: counts in bins that add up over shards."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from ogmkit.pipeline.homography_summary import box_ranges_m
from ogmkit.raster.vehicles import observed
from ogmkit.shards.reader import Shard
from ogmkit.typing import BoolArray, FloatArray, IntArray

SHARE = np.linspace(0, 1, 21)
"""Edges of bins of drivable shares."""
RANGE_M = np.arange(0.0, 101.0, 10.0)
"""Edges of bins of distances from the ego; the last bin has all that is farther, too."""
CROWD = np.arange(-0.5, 41.0, 2.0)
"""Edges of bins of vehicles in a frame; the last bin has all above, too."""
SPEED_M_S = np.arange(0.0, 31.0, 1.0)
"""Edges of bins of speeds; the last bin has all above, too."""
AHEAD_M, ASIDE_M = np.arange(-4.0, 61.0, 2.0), np.arange(-20.0, 21.0, 2.0)
"""Edges of bins of future positions, x forward and y to the left; what lies outside isn't counted."""


@dataclass(frozen=True, eq=False)
class Distributions:
    """Counts, int64.

    Attributes:
        drivable: frames by the share of their cells that is drivable; zeros where maps are unknown.
        ranges: vehicles by the distance of their centre from the ego.
        crowd: frames by the number of their vehicles.
        speed: frames by the speed over the last step, as far as both ends of that are known.
        ways: (ahead, aside) future positions of all steps.
    """

    drivable: IntArray
    ranges: IntArray
    crowd: IntArray
    speed: IntArray
    ways: IntArray

    @classmethod
    def empty(cls) -> Self:
        """Of no frame."""
        drivable, ranges, crowd, speed = (
            np.zeros(len(edges) - 1, np.int64) for edges in (SHARE, RANGE_M, CROWD, SPEED_M_S)
        )
        return cls(drivable, ranges, crowd, speed, _ways(np.empty((0, 2))))

    def __add__(self, other: "Distributions") -> "Distributions":
        return Distributions(
            *(getattr(self, one.name) + getattr(other, one.name) for one in fields(Distributions))
        )


@dataclass(frozen=True, eq=False)
class FrameFigures:
    """Figures of a camera's N frames.

    Attributes:
        drivable: (N,) share of drivable cells; NaN where maps are unknown.
        vehicles: (N,) number of vehicles.
        speed_m_s: (N,) over the last step; NaN where it isn't known.
    """

    drivable: FloatArray
    vehicles: IntArray
    speed_m_s: FloatArray


def total(parts: Iterable[Distributions]) -> Distributions:
    """All of them."""
    return sum(parts, Distributions.empty())


def frame_figures(shard: Shard, camera: str) -> FrameFigures:
    """The figures of a camera's frames; a frame's raster is read at a time.

    Raises:
        ShardError: the shard is damaged.
    """
    count = shard.frames(camera)
    known = not shard.settings.targets.no_map
    shares = [
        float(shard.dataset(camera, "drivable")[one].mean()) if known else np.nan for one in range(count)
    ]
    offsets = shard.dataset(camera, "boxes/offsets")[:]
    wanted = np.concatenate([[0], np.cumsum(_vehicles(shard, camera))])
    last = shard.dataset(camera, "trajectory/past")[:, -1]
    return FrameFigures(
        np.array(shares),
        np.diff(wanted[offsets]),
        np.hypot(last[:, 0], last[:, 1]) / shard.settings.targets.step_s,
    )


def distributions(shard: Shard, camera: str, figures: FrameFigures) -> Distributions:
    """The distributions of a camera's frames.

    Args:
        shard: open.
        camera: channel.
        figures: what `frame_figures` found.

    Raises:
        ShardError: the shard is damaged.
    """
    future = shard.dataset(camera, "trajectory/future")[:].reshape(-1, 2)
    return Distributions(
        drivable=_counted(figures.drivable, SHARE),
        ranges=_counted(box_ranges_m(shard, camera)[_vehicles(shard, camera)], RANGE_M),
        crowd=_counted(figures.vehicles.astype(float), CROWD),
        speed=_counted(figures.speed_m_s, SPEED_M_S),
        ways=_ways(future[~np.isnan(future).any(axis=1)]),
    )


def _vehicles(shard: Shard, camera: str) -> BoolArray:
    """(M,) which boxes count as vehicles, by the shard's settings."""
    categories, *least = shard.settings.targets.labels
    names = shard.strings(camera, "boxes/category")
    seen = (shard.dataset(camera, f"boxes/{name}")[:] for name in ("visibility", "num_lidar_pts"))
    wanted = np.array([name.startswith(categories) for name in names], dtype=np.bool_)
    chosen: BoolArray = wanted & observed(*seen, *least)
    return chosen


def _counted(values: FloatArray, edges: FloatArray) -> IntArray:
    """Values in bins, what lies beyond the last in the last; NaN isn't counted."""
    known = np.minimum(values[~np.isnan(values)], (edges[-2] + edges[-1]) / 2)
    counts: IntArray = np.histogram(known, edges)[0].astype(np.int64)
    return counts


def _ways(points: FloatArray) -> IntArray:
    counts: IntArray = np.histogram2d(points[:, 0], points[:, 1], (AHEAD_M, ASIDE_M))[0].astype(np.int64)
    return counts

"""Homographies by several methods for every frame of a folder of shards."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ogmkit.base.execution import DEFAULT_EXECUTION, Execution
from ogmkit.errors import SettingsError
from ogmkit.homography.leave_out import LeftOutErrors, left_out_errors
from ogmkit.homography.methods import estimator, fit
from ogmkit.homography.result import Homography
from ogmkit.homography.settings import FitSettings
from ogmkit.homography.sources import CALIBRATION, EGO_PLANE, SURFACE
from ogmkit.pipeline.amend import amend
from ogmkit.pipeline.amendment import Groups
from ogmkit.pipeline.geometry import frame_geometry
from ogmkit.pipeline.homography_rows import store_homographies
from ogmkit.pipeline.homography_summary import MethodResults, MethodSummary, joined, read_results
from ogmkit.shards import schema
from ogmkit.shards.fields import AddedKind
from ogmkit.shards.reader import Shard
from ogmkit.shards.sink import ShardFile

DEFAULT_METHODS = ("surface", "dlt", "plane", "calibration")

_WITHOUT_SETTINGS = (SURFACE, CALIBRATION, EGO_PLANE)
"""Methods that answer the same whatever `FitSettings` says."""
_WITH_PLANE = ("plane", CALIBRATION, EGO_PLANE)


@dataclass(frozen=True)
class HomographySummary:
    """What a run found.

    Attributes:
        methods: in the order asked for.
        shards: how many there are.
        kept: those of them that had all the homographies before.
        seconds: wall time.
    """

    methods: tuple[MethodSummary, ...]
    shards: int
    kept: int
    seconds: float


@dataclass(frozen=True)
class HomographyFit:
    """The groups `homography/<method>` of each camera: an `Amendment`.

    Attributes:
        methods: names of `ogmkit.homography.methods.METHODS`.
        settings: which boxes count.
    """

    methods: tuple[str, ...]
    settings: FitSettings

    @property
    def command(self) -> str:
        """As the user calls it."""
        return "homography-fit"

    @property
    def kind(self) -> AddedKind:
        """Homographies."""
        return schema.HOMOGRAPHY

    def groups(self, shard: Shard, camera: str) -> Groups:
        """One for each method, the same for all shards and cameras."""
        del shard, camera
        return {method: self._values(method) for method in self.methods}

    def write(self, shard: Shard, camera: str, names: Sequence[str], file: ShardFile) -> None:
        """Fit every frame, and every frame without each of its boxes in turn."""
        fits: dict[str, list[Homography]] = {name: [] for name in names}
        left_out: dict[str, list[LeftOutErrors]] = {name: [] for name in names}
        grid = shard.grid
        for frame in range(shard.frames(camera)):
            geometry = frame_geometry(shard, camera, frame)
            for name in names:
                fits[name].append(fit(name, geometry, grid, self.settings))
                left_out[name].append(left_out_errors(name, geometry, self.settings))
        symbols = shard.sizes(camera)
        with file.writing() as h5:
            for name in names:
                group = h5[f"{camera}/{self.kind.name}/{name}"]
                with_plane = name in _WITH_PLANE
                store_homographies(group, fits[name], left_out[name], symbols, with_plane=with_plane)

    def report(self, shard: Shard, cameras: Sequence[str]) -> tuple[MethodResults, ...]:
        """The results of each method over the cameras."""
        return tuple(
            joined([read_results(shard, camera, method) for camera in cameras]) for method in self.methods
        )

    def _values(self, method: str) -> Mapping[str, Any]:
        settings = {} if method in _WITHOUT_SETTINGS else self.settings.to_dict()
        return {"method": method, "settings": settings, "checkpoint_sha256": ""}


def fit_shards(
    out: Path,
    methods: Sequence[str] = DEFAULT_METHODS,
    settings: FitSettings | None = None,
    *,
    cameras: Sequence[str] = (),
    execution: Execution = DEFAULT_EXECUTION,
) -> HomographySummary:
    """Fit homographies to every frame of a folder's shards and store them there.

    A method that has no answer for a frame is not an error: the frame is marked invalid, with the reason.
    Shards that have the homographies with the same settings stay. Killed at any moment, the same call again
    finishes the work.

    Args:
        out: a folder that an extraction finished.
        methods: names of `ogmkit.homography.methods.METHODS`.
        settings: which boxes count; the defaults by default.
        cameras: channels; none means all.
        execution: worker processes, progress, and whether to rebuild what exists.

    Raises:
        SettingsError: a method or camera is unknown, or no method is named.
        ShardError, OutputError, OgmkitError: as `ogmkit.pipeline.amend.amend`.
    """
    started = time.monotonic()
    chosen = tuple(dict.fromkeys(methods))
    if not chosen:
        raise SettingsError("methods: name at least one")
    for method in chosen:
        estimator(method)  # unknown ones are refused before anything is read
    job = HomographyFit(chosen, settings or FitSettings())
    shards = amend(
        out,
        job,
        cameras=cameras,
        execution=execution,
    )
    results = zip(*(shard.report for shard in shards), strict=True)
    summaries = tuple(
        MethodSummary(method, joined(parts)) for method, parts in zip(chosen, results, strict=True)
    )
    kept = sum(not shard.changed for shard in shards)
    return HomographySummary(summaries, len(shards), kept, time.monotonic() - started)

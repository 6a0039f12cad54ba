"""Homographies that a trained network reads off the images, for every frame of a folder of shards."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ogmkit.base.execution import DEFAULT_EXECUTION, Execution
from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.homography.corners import usable_corners
from ogmkit.homography.frame import FrameGeometry
from ogmkit.homography.given import estimate
from ogmkit.homography.leave_out import LeftOutErrors, box_errors
from ogmkit.homography.result import Homography, finished
from ogmkit.homography.settings import FitSettings
from ogmkit.homography.sources import NETWORK, is_network
from ogmkit.learn.choices import common_cameras
from ogmkit.learn.predict.frames import predict_frames
from ogmkit.learn.predict.run import require_grid, require_system
from ogmkit.learn.predict.workers import opened_once, place_name
from ogmkit.learn.runs import checkpoint_file
from ogmkit.pipeline.amend import amend
from ogmkit.pipeline.amendment import Groups
from ogmkit.pipeline.geometry import frame_geometry
from ogmkit.pipeline.homography_fit import HomographySummary
from ogmkit.pipeline.homography_rows import store_homographies
from ogmkit.pipeline.homography_summary import MethodResults, MethodSummary, joined, read_results
from ogmkit.samples.index import index_frames
from ogmkit.samples.requirements import require_extracted
from ogmkit.shards import schema
from ogmkit.shards.additions import require_name
from ogmkit.shards.fields import AddedKind
from ogmkit.shards.manifest import file_sha256, read_manifest
from ogmkit.shards.reader import Shard
from ogmkit.shards.sink import ShardFile
from ogmkit.typing import FloatArray

SYSTEM = "homography"

_TOLD = ("system", "head", "target", "image_size", "encoder")
"""Settings of the training that the shards tell of; the rest follows from the checkpoint's checksum."""


@dataclass(frozen=True)
class NetworkHomography:
    """The group `homography/<name>` of each camera: an `Amendment`.

    Attributes:
        name: of the group.
        checkpoint: the network's file.
        sha256: its checksum, hexadecimal.
        settings: what the shards tell of its training.
        batch_size: frames at a time.
    """

    name: str
    checkpoint: Path
    sha256: str
    settings: Mapping[str, Any]
    batch_size: int

    @property
    def command(self) -> str:
        """As the user calls it."""
        return "predict homography"

    @property
    def kind(self) -> AddedKind:
        """Homographies."""
        return schema.HOMOGRAPHY

    def groups(self, shard: Shard, camera: str) -> Groups:
        """The one group, the same for all shards and cameras."""
        del shard, camera
        values = {"method": NETWORK, "settings": self.settings, "checkpoint_sha256": self.sha256}
        return {self.name: values}

    def write(self, shard: Shard, camera: str, names: Sequence[str], file: ShardFile) -> None:
        """Predict every frame, and measure the prediction at its boxes."""
        (name,) = names
        found: list[Homography] = []
        left_out: list[LeftOutErrors] = []
        run = opened_once(self.checkpoint, self.sha256)
        spec = run.model.prediction_spec(None)
        index = index_frames(shard.path.parent, (shard.scene,), (camera,), needs=spec, valid_only=False)
        frames = predict_frames(run, index, spec, batch_size=self.batch_size)
        for frame in frames:
            if frame.bev_from_image is not None:  # a homography network's is there for every frame
                geometry = frame_geometry(shard, camera, frame.frame)
                homography, errors = measured(frame.bev_from_image, geometry, shard.grid)
                found.append(homography)
                left_out.append(errors)
        symbols = shard.sizes(camera)
        with file.writing() as h5:
            store_homographies(h5[f"{camera}/{self.kind.name}/{name}"], found, left_out, symbols)

    def report(self, shard: Shard, cameras: Sequence[str]) -> MethodResults:
        """The results over the cameras."""
        return joined([read_results(shard, camera, self.name) for camera in cameras])


def measured(
    bev_from_image: FloatArray, geometry: FrameGeometry, grid: GridSpec
) -> tuple[Homography, LeftOutErrors]:
    """A predicted homography as shards have it, and its errors at the boxes that all methods are measured at.

    The network knows none of the frame's boxes, so that none has to be left out.

    Args:
        bev_from_image: (3, 3) float64, of the frame's own pixels, of any scale.
        geometry: the frame's.
        grid: the shard's.
    """
    found = estimate(bev_from_image, geometry.image_size, grid)
    corners = usable_corners(geometry, FitSettings())
    homography = finished(found, grid, corners.pixels, corners.positions_m)
    return homography, box_errors(geometry, lambda _: found)


def predict_homographies(
    out: Path,
    checkpoint: Path,
    *,
    name: str = NETWORK,
    cameras: Sequence[str] = (),
    batch_size: int = 8,
    execution: Execution = DEFAULT_EXECUTION,
) -> HomographySummary:
    """Predict the homography of every frame of a folder's shards and store it there.

    A frame where the network's answer is not a homography is marked invalid, with the reason. Shards that
    have the group from the same checkpoint stay. Killed at any moment, the same call again finishes the work.

    Args:
        out: a folder that an extraction finished, with images.
        checkpoint: a RUN of `homography`, or one of its checkpoints.
        name: of the group: `network` or `network-…`.
        cameras: channels; none means all that the run knows.
        batch_size: frames at a time.
        execution: where the work is done, progress, and whether to predict again what exists, also by another
            checkpoint. Each worker has the network for itself.

    Raises:
        CheckpointError: there is no checkpoint, or it is damaged or of another system.
        SettingsError: the name is not allowed, the grids differ, or a camera is unknown.
        DataFileError: an image is absent or damaged.
        ShardError, OutputError, OgmkitError: as `ogmkit.pipeline.amend.amend`.
    """
    started = time.monotonic()
    require_name(name)
    if not is_network(name):
        raise SettingsError(f"name {name!r}: a network's homographies are called {NETWORK} or {NETWORK}-…")
    file = checkpoint_file(checkpoint)
    sha256 = file_sha256(file)
    run = opened_once(file, sha256)
    require_system(run, SYSTEM)
    require_grid(run, out)
    manifest = read_manifest(out)
    chosen = common_cameras(run.path, run.cameras, out, manifest, cameras)
    require_extracted(out, manifest, run.model.prediction_spec(None))
    settings = run.card.settings.to_dict()
    job = NetworkHomography(name, file, sha256, {key: settings[key] for key in _TOLD}, batch_size)
    where = f"{run.path} {place_name(execution)}"
    shards = amend(out, job, cameras=chosen, execution=execution, where=where)
    results = joined([shard.report for shard in shards])
    kept = sum(not shard.changed for shard in shards)
    summary = MethodSummary(name, results)
    return HomographySummary((summary,), len(shards), kept, time.monotonic() - started)

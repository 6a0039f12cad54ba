"""Footprints in camera view for every frame of a folder of shards."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ogmkit.base.execution import DEFAULT_EXECUTION, Execution
from ogmkit.footprints.settings import FootprintSettings
from ogmkit.pipeline.amend import amend
from ogmkit.pipeline.amendment import Groups
from ogmkit.pipeline.footprint_masks import mask_size, renderer, require_renderable
from ogmkit.shards import fields, schema
from ogmkit.shards.additions import require_name
from ogmkit.shards.crosschecks_added import fits_of
from ogmkit.shards.fields import AddedKind
from ogmkit.shards.layout import create_dataset, store_dataset
from ogmkit.shards.reader import Shard
from ogmkit.shards.sink import ShardFile


@dataclass(frozen=True)
class FootprintSummary:
    """What a run did.

    Attributes:
        name: of the set of footprints.
        shards: how many there are.
        kept: those of them that had the set before.
        frames: their frames, over the chosen cameras.
        invalid: frames without a valid homography: their masks are empty.
        seconds: wall time.
    """

    name: str
    shards: int
    kept: int
    frames: int
    invalid: int
    seconds: float


@dataclass(frozen=True)
class RenderFootprints:
    """The group `footprints/<set>` of each camera: an `Amendment`.

    Attributes:
        settings: what to make.
    """

    settings: FootprintSettings

    @property
    def command(self) -> str:
        """As the user calls it."""
        return "render-footprints"

    @property
    def kind(self) -> AddedKind:
        """Footprints."""
        return schema.FOOTPRINTS

    def groups(self, shard: Shard, camera: str) -> Groups:
        """The one set; it also tells how its homography came about, so that another fit makes another set."""
        settings = self.settings
        require_renderable(shard, camera, settings)
        warped = settings.method == "warp"
        values = {
            "homography": settings.homography,
            "method": settings.method,
            "scale": float(settings.scale),
            "settings": fits_of(shard, camera, settings.homography) if warped else {},
        }
        return {settings.set_name: values}

    def write(self, shard: Shard, camera: str, names: Sequence[str], file: ShardFile) -> None:
        """Make and store the masks, frame by frame."""
        (name,) = names
        frames = shard.frames(camera)
        height, width = mask_size(shard, camera, self.settings)
        symbols = {fields.FRAMES: frames, fields.HEIGHT: height, fields.WIDTH: width}
        compression, parts = shard.settings.compression, fields.parts_of(shard.settings.targets)
        with file.writing() as h5:
            group = h5[f"{camera}/{self.kind.name}/{name}"]
            masks = {
                field.name: create_dataset(group, field, symbols, compression)
                for field in self.kind.fields
                if field.storage == "rasters" and field.part in parts
            }
        valid = np.zeros(frames, dtype=np.bool_)
        render = renderer(shard, camera, self.settings)
        for frame in range(frames):
            made = render(frame)
            if made is None:
                continue
            valid[frame] = True
            with file.writing():
                for mask, rows in masks.items():
                    rows.store(frame, getattr(made, mask))
        with file.writing():
            store_dataset(group, self.kind.field("valid"), valid, symbols)

    def report(self, shard: Shard, cameras: Sequence[str]) -> tuple[int, int]:
        """Frames, and how many of them are valid, over the cameras."""
        place = f"{self.kind.name}/{self.settings.set_name}/valid"
        valid = np.concatenate([shard.dataset(camera, place)[:] for camera in cameras])
        return len(valid), int(np.count_nonzero(valid))


def render_footprints(
    out: Path,
    settings: FootprintSettings | None = None,
    *,
    cameras: Sequence[str] = (),
    execution: Execution = DEFAULT_EXECUTION,
) -> FootprintSummary:
    """Render a set of footprints for every frame of a folder's shards and store it there.

    A frame without a valid homography is marked; its masks stay empty. Shards that have the set with the same
    settings stay. Killed at any moment, the same call again finishes the work.

    Args:
        out: a folder that an extraction finished; for `warp`, with homographies.
        settings: what to make; the defaults by default.
        cameras: channels; none means all.
        execution: worker processes, progress, and whether to rebuild what exists.

    Raises:
        SettingsError: the homography or camera is unknown, or the name or scale is not allowed.
        ShardError, OutputError, OgmkitError: as `ogmkit.pipeline.amend.amend`.
    """
    started = time.monotonic()
    job = RenderFootprints(settings or FootprintSettings())
    require_name(job.settings.set_name)
    shards = amend(
        out,
        job,
        cameras=cameras,
        execution=execution,
    )
    frames = sum(shard.report[0] for shard in shards)
    valid = sum(shard.report[1] for shard in shards)
    return FootprintSummary(
        name=job.settings.set_name,
        shards=len(shards),
        kept=sum(not shard.changed for shard in shards),
        frames=frames,
        invalid=frames - valid,
        seconds=time.monotonic() - started,
    )

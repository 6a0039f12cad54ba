"""Whether masks of cells that are seen agree with the field of view and with what they are made of."""

from collections.abc import Callable, Iterator

import numpy as np

from ogmkit.raster.occlusion import reached_mask, unhidden_mask
from ogmkit.raster.seen import LIDAR, RAYS
from ogmkit.shards.crosschecks import RASTER_TOLERANCE, first_wrong
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema_seen import SEEN
from ogmkit.typing import UInt8Array


def seen_problems(shard: Shard, camera: str) -> Iterator[str]:
    """Describe what contradicts itself in one camera's masks; all else in its group is sound.

    They are made again from boxes and poses, and from LiDAR points where the shard keeps them.

    Yields:
        A line for each contradiction, naming the dataset and the first frame.
    """
    targets = shard.settings.targets
    makers: dict[str, Callable[[Shard, str, int, UInt8Array], UInt8Array] | None] = {
        RAYS: _rays,
        LIDAR: _lidar if targets.lidar else None,
    }
    for kind in targets.seen[1:]:
        make, frames = makers[kind], shard.frames(camera)
        within, same = np.ones((2, frames), dtype=np.bool_)
        for frame in range(frames):
            mask = shard.dataset(camera, f"{SEEN}/{kind}")[frame]
            view = shard.dataset(camera, "field_of_view")[frame]
            within[frame] = (mask <= view).all()
            if make is not None:
                same[frame] = np.mean(mask != make(shard, camera, frame, view)) <= RASTER_TOLERANCE
        name = f"/{camera}/{SEEN}/{kind}"
        yield from first_wrong(f"{name} goes beyond the field of view in", ~within)
        yield from first_wrong(f"{name} contradicts boxes, poses or points in", within & ~same)


def _rays(shard: Shard, camera: str, frame: int, view: UInt8Array) -> UInt8Array:
    names = ("level_from_global", "global_from_ego", "ego_from_camera")
    to_level, to_global, to_ego = (shard.dataset(camera, name)[frame] for name in names)
    eye_level = (to_level @ to_global @ to_ego)[:3, 3]
    return unhidden_mask(shard.grid, eye_level, to_level, shard.boxes(camera, frame), view)


def _lidar(shard: Shard, camera: str, frame: int, view: UInt8Array) -> UInt8Array:
    first, stop = shard.dataset(camera, "lidar/offsets")[frame : frame + 2].tolist()
    points = shard.dataset(camera, "lidar/points")[first:stop].astype(np.float64)
    centre = shard.dataset(camera, f"{SEEN}/lidar_centre_level")[frame]
    return reached_mask(shard.grid, centre, points) & view

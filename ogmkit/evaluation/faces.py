"""Ground faces of the vehicles in a shard's frame."""

from ogmkit.geometry.boxes import ground_corners
from ogmkit.raster.vehicles import select
from ogmkit.shards.reader import Shard
from ogmkit.typing import FloatArray


def vehicle_faces(shard: Shard, camera: str, index: int, seen_from: int | None = None) -> FloatArray:
    """Ground faces of the vehicles that a frame's raster shows.

    Args:
        shard: an open shard.
        camera: channel.
        index: the frame.
        seen_from: the frame in whose level frame corners are given; None for the same one.

    Returns:
        (M, 4, 2) corners x, y in metres.
    """
    targets = shard.settings.targets
    boxes = select(shard.boxes(camera, index), *targets.labels)
    own = index if seen_from is None else seen_from
    level_from_global = shard.dataset(camera, "level_from_global")[own]
    corners: FloatArray = ground_corners(level_from_global @ boxes.global_from_box, boxes.size_wlh)[..., :2]
    return corners

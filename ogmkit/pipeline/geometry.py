"""A shard's frames as the homography estimators know them."""

from ogmkit.errors import SettingsError, ShardError
from ogmkit.homography.frame import FrameGeometry
from ogmkit.shards.faults import REMEDY
from ogmkit.shards.reader import Shard


def frame_geometry(shard: Shard, camera: str, frame: int) -> FrameGeometry:
    """Camera and boxes of one frame.

    Args:
        shard: an open shard.
        camera: channel.
        frame: index, from 0.

    Raises:
        ShardError: the frame's numbers are no geometry, such as NaN in its calibration.
    """
    names = ("level_from_global", "global_from_ego", "ego_from_camera", "intrinsics", "image_size")
    to_level, to_global, to_ego, intrinsics, size = (shard.dataset(camera, name)[frame] for name in names)
    boxes = shard.boxes(camera, frame)
    try:
        return FrameGeometry(
            intrinsics=intrinsics,
            level_from_camera=to_level @ to_global @ to_ego,
            level_from_ego=to_level @ to_global,
            image_size=(int(size[0]), int(size[1])),
            level_from_box=to_level @ boxes.global_from_box,
            size_wlh=boxes.size_wlh,
            category=boxes.category,
            visibility=boxes.visibility,
            num_lidar_pts=boxes.num_lidar_pts,
        )
    except SettingsError as error:
        raise ShardError(f"{shard.path}: /{camera}, frame {frame}: {error}; {REMEDY}") from error

"""Frame records of one scene, made from the rows of its key frames."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ogmkit.frames import Boxes, FrameRecord, KeyFrame, LidarRecord, neighbours
from ogmkit.geometry.se3 import pose_matrix
from ogmkit.nuscenes.ahead import Columns, ReadAhead
from ogmkit.nuscenes.tables import Tables, stacked
from ogmkit.nuscenes.visibility import BY_TOKEN
from ogmkit.typing import FloatArray

_SCENES = """
SELECT token, min(rowid) FROM scene
WHERE token IS NOT NULL GROUP BY token ORDER BY min(coalesce(name, token)), token
"""
_IMAGES = """
SELECT k.scene, k.sample_token, k.token, k.timestamp, k.filename, k.width, k.height, k.translation,
       k.rotation, c.translation AS sensor_translation, c.rotation AS sensor_rotation, c.camera_intrinsic
FROM key_frame k JOIN calibrated_sensor c ON c.token = k.calibrated_sensor_token
WHERE k.scene IN (SELECT unnest($scenes::VARCHAR[])) AND k.channel = $channel
ORDER BY k.sample_timestamp
"""
# A sample's annotations in file order, as the devkit lists them.
_ANNOTATIONS = f"""
SELECT a.scene_row AS scene, a.token, a.sample_token, a.instance_token, c.name AS category, a.translation,
       a.rotation, a.size, coalesce(v.number, 0) AS visibility, coalesce(a.num_lidar_pts, -1) AS num_lidar_pts
FROM sample_annotation a
JOIN instance i ON i.token = a.instance_token
JOIN category c ON c.token = i.category_token
LEFT JOIN {BY_TOKEN} v ON v.token = a.visibility_token
WHERE a.scene_row IN (SELECT unnest($rows::BIGINT[]))
ORDER BY a.rowid
"""


@dataclass(frozen=True)
class SceneKey:
    """What a scene's frames have in common; `token` finds its rows, `map_path` may be empty."""

    dataroot: Path
    token: str
    name: str
    log: str
    location: str
    map_path: str


def read_scene_key(tables: Tables, dataroot: Path, token: str, name: str, *, maps: bool) -> SceneKey:
    """What the frames of a sound scene have in common; without maps, the table of maps is not asked."""
    of_map = "LEFT JOIN map m ON $maps AND list_contains(m.log_tokens, s.log_token)"
    ((log, location, map_path),) = tables.rows(
        "SELECT s.log_token, l.location, coalesce(m.filename, '') "
        f"FROM scene s JOIN log l ON l.token = s.log_token {of_map} WHERE s.token = $token",
        {"maps": maps, "token": token},
    )
    return SceneKey(dataroot, token, name, log, location, map_path)


class SceneRows:
    """Rows of scenes, read ahead in the order of the scenes' names.

    Args:
        tables: with the table `key_frame`.
    """

    def __init__(self, tables: Tables) -> None:
        self._tables = tables
        self._row_of: dict[str, int] = dict(tables.rows(_SCENES))
        self._annotations = ReadAhead(
            tables, tuple(self._row_of.values()), _ANNOTATIONS, lambda rows: {"rows": rows}
        )
        self._images: dict[str, ReadAhead] = {}

    def images(self, scene_token: str, channel: str) -> Columns:
        """The columns of a scene's key-frame data of one camera or LiDAR, in temporal order."""
        if channel not in self._images:
            self._images[channel] = ReadAhead(
                self._tables,
                tuple(self._row_of),
                _IMAGES,
                lambda scenes: {"scenes": scenes, "channel": channel},
            )
        return self._images[channel].rows(scene_token)

    def boxes(self, scene_token: str) -> dict[str, Boxes]:
        """Sample token → that key frame's boxes; samples without annotations are left out."""
        rows = self._annotations.rows(self._row_of[scene_token])
        boxes = Boxes(
            annotation_token=tuple(rows["token"]),
            instance_token=tuple(rows["instance_token"]),
            category=tuple(rows["category"]),
            global_from_box=pose_matrix(stacked(rows["translation"], (3,)), stacked(rows["rotation"], (4,))),
            size_wlh=stacked(rows["size"], (3,)),
            visibility=rows["visibility"].astype(np.uint8),
            num_lidar_pts=rows["num_lidar_pts"].astype(np.int64),
        )
        sample_tokens, inverse = np.unique(rows["sample_token"].astype(str), return_inverse=True)
        return {str(token): boxes.selected(inverse == i) for i, token in enumerate(sample_tokens)}


def no_boxes() -> Boxes:
    """What a key frame without annotations has."""
    return Boxes(
        annotation_token=(),
        instance_token=(),
        category=(),
        global_from_box=np.zeros((0, 4, 4)),
        size_wlh=np.zeros((0, 3)),
        visibility=np.zeros(0, dtype=np.uint8),
        num_lidar_pts=np.zeros(0, dtype=np.int64),
    )


def lidar_records(rows: Columns) -> dict[str, LidarRecord]:
    """Sample token → its LiDAR sweep."""
    global_from_ego, ego_from_lidar = _poses(rows)
    global_from_lidar = global_from_ego @ ego_from_lidar
    return {
        token: LidarRecord(path=path, timestamp_us=int(time), global_from_lidar=pose)
        for token, path, time, pose in zip(
            rows["sample_token"], rows["filename"], rows["timestamp"], global_from_lidar, strict=True
        )
    }


def frame_records(
    key: SceneKey,
    camera: str,
    rows: Columns,
    boxes: Mapping[str, Boxes],
    lidar: Mapping[str, LidarRecord],
    step_s: float,
) -> tuple[FrameRecord, ...]:
    """The frames of one camera.

    Args:
        key: the scene.
        camera: the channel.
        rows: what `SceneRows.images` gave for it.
        boxes: by sample token.
        lidar: by sample token; empty where none is wanted.
        step_s: time from one neighbour to the next.
    """
    global_from_ego, ego_from_camera = _poses(rows)
    intrinsics = stacked(rows["camera_intrinsic"], (3, 3))
    own_us = rows["timestamp"].astype(np.int64)
    times_us, positions = neighbours(own_us, global_from_ego[:, :3, 3], step_s)
    return tuple(
        FrameRecord(
            dataroot=key.dataroot,
            scene_name=key.name,
            location=key.location,
            map_path=key.map_path,
            camera=camera,
            sample_token=sample_token,
            sample_data_token=rows["token"][i],
            timestamp_us=int(own_us[i]),
            image_path=rows["filename"][i],
            image_size=(int(rows["height"][i]), int(rows["width"][i])),
            intrinsics=intrinsics[i],
            ego_from_camera=ego_from_camera[i],
            global_from_ego=global_from_ego[i],
            boxes=boxes.get(sample_token, no_boxes()),
            neighbour_timestamps_us=times_us[i],
            neighbour_positions_global=positions[i],
            lidar=lidar.get(sample_token),
        )
        for i, sample_token in enumerate(rows["sample_token"])
    )


def key_frames(
    key: SceneKey, sweeps: Columns, boxes: Mapping[str, Boxes], cameras: Mapping[str, FrameRecord]
) -> tuple[KeyFrame, ...]:
    """A scene's samples.

    Args:
        key: the scene.
        sweeps: what `SceneRows.images` gave for the LiDAR.
        boxes: by sample token.
        cameras: frames of the front camera by sample token; empty where none are wanted.
    """
    global_from_ego, ego_from_lidar = _poses(sweeps)
    return tuple(
        KeyFrame(
            dataroot=key.dataroot,
            location=key.location,
            sample_token=token,
            global_from_ego=global_from_ego[i],
            ego_from_lidar=ego_from_lidar[i],
            lidar_path=sweeps["filename"][i],
            boxes=boxes.get(token, no_boxes()),
            camera=cameras.get(token),
            map_path=key.map_path,
        )
        for i, token in enumerate(sweeps["sample_token"])
    )


def _poses(rows: Columns) -> tuple[FloatArray, FloatArray]:
    """`global_from_ego` and `ego_from_sensor`, each (N, 4, 4)."""
    global_from_ego = pose_matrix(stacked(rows["translation"], (3,)), stacked(rows["rotation"], (4,)))
    ego_from_sensor = pose_matrix(
        stacked(rows["sensor_translation"], (3,)), stacked(rows["sensor_rotation"], (4,))
    )
    return global_from_ego, ego_from_sensor

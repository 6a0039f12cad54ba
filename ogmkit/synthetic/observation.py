"""What is seen of each actor at each key frame, and the annotations that follow."""

from collections.abc import Sequence
from dataclasses import dataclass

from ogmkit.geometry.se3 import pose_matrix
from ogmkit.synthetic.catalogue import VISIBILITIES
from ogmkit.synthetic.clock import CAMERA_DELAYS_US
from ogmkit.synthetic.plan import ScenePlan
from ogmkit.synthetic.rig import CAMERA_MOUNTS, NATIVE_SIZE, scaled_intrinsics
from ogmkit.synthetic.scenery import Solids
from ogmkit.synthetic.stage import Box, Stage
from ogmkit.synthetic.tables import Row, Tables
from ogmkit.synthetic.visibility import visible_fraction
from ogmkit.typing import FloatArray, IntArray

_MOVING_M_S = 0.3


@dataclass(frozen=True, eq=False)
class Moment:
    """The world at one key frame.

    Attributes:
        timestamp_us: the sample's.
        boxes: actors nearby.
        solids: the same boxes first, then what is never annotated.
    """

    timestamp_us: int
    boxes: list[Box]
    solids: Solids


def observe(stage: Stage, timestamp_us: int) -> Moment:
    """The world at a time."""
    boxes = stage.boxes(timestamp_us)
    return Moment(timestamp_us, boxes, stage.solids(boxes, timestamp_us))


def camera_shares(stage: Stage, moment: Moment, channels: Sequence[str]) -> FloatArray:
    """Share of each solid, 0 to 1, that some cameras together see at a key frame; (M,).

    They are mounted as on every log without relief, and see images of the native size.

    Args:
        stage: the scene.
        moment: the key frame.
        channels: the cameras.
    """
    views = []
    for channel in channels:
        mount = CAMERA_MOUNTS[channel]
        pose = pose_matrix(*stage.ego_pose(moment.timestamp_us + CAMERA_DELAYS_US[channel]))
        camera = pose @ pose_matrix(mount.translation_m, mount.rotation_wxyz)
        views.append((scaled_intrinsics(channel, NATIVE_SIZE), camera, NATIVE_SIZE))
    return visible_fraction(moment.solids, views)


def add_annotations(
    tables: Tables,
    plan: ScenePlan,
    moments: Sequence[Moment],
    shares: Sequence[FloatArray],
    lidar_counts: Sequence[IntArray],
) -> int:
    """Instances and annotations of a scene; returns the number of annotations.

    An object is annotated from the first key frame to the last in which a camera or the LiDAR has seen it, as
    long as it is in range.

    Args:
        tables: where to.
        plan: the scene.
        moments: its key frames.
        shares: for each key frame, what the cameras see of each solid.
        lidar_counts: for each key frame, LiDAR points on each solid.
    """
    tracks: dict[int, list[tuple[int, int, bool]]] = {}
    for sample, moment in enumerate(moments):
        for position, box in enumerate(moment.boxes):
            if moment.solids.annotated[position]:
                seen = bool(shares[sample][position] > 0 or lidar_counts[sample][position] > 0)
                tracks.setdefault(box.actor, []).append((sample, position, seen))
    count = 0
    for actor, track in sorted(tracks.items()):
        seen_at = [number for number, (_, _, seen) in enumerate(track) if seen]
        if not seen_at:
            continue
        rows = [
            _annotation(
                tables,
                plan,
                actor,
                sample,
                moments[sample].boxes[position],
                shares[sample][position],
                int(lidar_counts[sample][position]),
            )
            for sample, position, _ in track[seen_at[0] : seen_at[-1] + 1]
        ]
        category = moments[track[0][0]].boxes[track[0][1]].look.category
        _add_instance(tables, plan, actor, category, rows)
        count += len(rows)
    return count


def _add_instance(tables: Tables, plan: ScenePlan, actor: int, category: str, rows: list[Row]) -> None:
    tables.add_chain("sample_annotation", rows)
    row: Row = {
        "category_token": tables.token("category", category),
        "nbr_annotations": len(rows),
        "first_annotation_token": rows[0]["token"],
        "last_annotation_token": rows[-1]["token"],
    }
    tables.add("instance", tables.token("instance", plan.index, actor), row)


def _annotation(
    tables: Tables,
    plan: ScenePlan,
    actor: int,
    sample: int,
    box: Box,
    share: float,
    num_lidar_pts: int,
) -> Row:
    return {
        "token": tables.token("sample_annotation", plan.index, actor, sample),
        "sample_token": tables.token("sample", plan.index, sample),
        "instance_token": tables.token("instance", plan.index, actor),
        "visibility_token": visibility_token(share),
        "attribute_tokens": [tables.token("attribute", name) for name in attributes(box)],
        "translation": box.translation,
        "size": list(box.look.size_wlh),
        "rotation": box.rotation,
        "num_lidar_pts": num_lidar_pts,
        "num_radar_pts": 0,
    }


def visibility_token(share: float) -> str:
    """NuScenes' level of a visible share between 0 and 1; a level's lower bound belongs to it."""
    return max(level for level, (low, _) in VISIBILITIES.items() if share * 100 >= low)


def attributes(box: Box) -> list[str]:
    """Names of a box's attributes: at most one, as in nuScenes."""
    category, moves = box.look.category, box.speed_m_s > _MOVING_M_S
    if category in ("vehicle.bicycle", "vehicle.motorcycle"):
        return ["cycle.with_rider" if box.driven else "cycle.without_rider"]
    if category.startswith("vehicle."):
        return ["vehicle.moving" if moves else "vehicle.stopped" if box.driven else "vehicle.parked"]
    if category.startswith("human.pedestrian.") and not category.endswith(("stroller", "wheelchair")):
        return ["pedestrian.moving" if moves else "pedestrian.standing"]
    return []

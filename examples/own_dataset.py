"""Turn recordings of your own, in no dataset's layout, into shards that all of ogmkit works on.

    python examples/own_dataset.py OUT

OUT/shards is what `ogmkit extract` would have written: `ogmkit train` and own_network.py take it as it is.
OUT/pictures shows it. The recordings are made up here, in `main` and `on_ring`: read your own instead.
"""

import sys
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ogmkit import (
    Boxes,
    ExtractSettings,
    FootprintSettings,
    FrameRecord,
    GridSpec,
    PreviewSettings,
    RecordDataset,
    SceneRecord,
    TargetSettings,
    extract,
    fit_shards,
    neighbours,
    pose_matrix,
    preview,
    render_footprints,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

GRID = GridSpec(m_per_cell=0.25, rows=160, columns=120, ego_row=160, ego_column=60)  # 40 m ahead, 15 m aside
SETTINGS = ExtractSettings(TargetSettings(GRID), cameras=("CAM_FRONT",))
HEIGHT, WIDTH = 180, 320
INTRINSICS = np.array([[250, 0, 159.5], [0, 250, 89.5], [0, 0, 1.0]])
# 1.6 m above the ground. Cameras have x to the right, y down, z ahead; cars x ahead, y to the left, z up.
EGO_FROM_CAMERA = pose_matrix((1.5, 0.0, 1.6), (0.5, -0.5, 0.5, -0.5))


def on_ring(angle: Floats, radius_m: float, z_m: float) -> Floats:
    """Poses (N, 4, 4), global from body, of a car that drives round (60, 60); angles in radians."""
    place = np.stack([60 + radius_m * np.sin(angle), 60 - radius_m * np.cos(angle), np.full_like(angle, z_m)])
    rotation_wxyz = np.stack([np.cos(angle / 2), 0 * angle, 0 * angle, np.sin(angle / 2)])
    return pose_matrix(place.T, rotation_wxyz.T)


def boxes(name: str, cars: list[Floats]) -> Boxes:
    """The cars around a frame of that name, from the poses (4, 4) of their centres."""
    count = len(cars)
    return Boxes(
        annotation_token=tuple(f"{name}-car-{car}" for car in range(count)),
        instance_token=tuple(f"car-{car}" for car in range(count)),  # the same from frame to frame
        category=("vehicle.car",) * count,
        global_from_box=np.stack(cars),
        size_wlh=np.tile([1.9, 4.6, 1.6], (count, 1)),
        visibility=np.zeros(count, np.uint8),  # 0: unknown
        num_lidar_pts=np.zeros(count, np.int64),
    )


def drive(root: Path, name: str, times_us: Integers, ego: Floats, cars: list[Floats]) -> SceneRecord:
    """One recording, from the poses (N, 4, 4) of the ego and of other cars' centres at N times."""
    around_us, around = neighbours(times_us, ego[:, :3, 3])  # whence the past and future of each frame
    frames = tuple(
        FrameRecord(
            dataroot=root,  # the paths below are relative to it
            scene_name=name,
            location="my-town",
            map_path="map.png",
            camera="CAM_FRONT",
            sample_token=f"{name}-{i}",  # any texts that tell frames, images and boxes apart
            sample_data_token=f"{name}-{i}-front",
            timestamp_us=int(times_us[i]),
            image_path=f"{name}-{i}.jpg",
            image_size=(HEIGHT, WIDTH),
            intrinsics=INTRINSICS,
            ego_from_camera=EGO_FROM_CAMERA,
            global_from_ego=ego[i],
            boxes=boxes(f"{name}-{i}", [car[i] for car in cars]),
            neighbour_timestamps_us=around_us[i],
            neighbour_positions_global=around[i],
            lidar=None,
        )
        for i in range(len(times_us))
    )
    return SceneRecord(name, "my-town", {"CAM_FRONT": frames})


def main(out: Path) -> None:
    """Make shards of two drives, one to train on, one to validate."""
    recordings, shards = out / "recordings", out / "shards"
    recordings.mkdir(parents=True, exist_ok=True)
    # The map: 0.1 m a pixel, white where one may drive, its lower left corner at (0, 0), north up.
    road = cv2.circle(np.zeros((1200, 1200), np.uint8), (600, 600), 400, 255, thickness=90)
    cv2.imwrite(str(recordings / "map.png"), road)
    times_us = 500_000 * np.arange(20)  # key frames 0.5 s apart
    scenes = []
    for start, name in enumerate(("drive-1", "drive-2")):
        angle = np.linspace(start, start + 2, len(times_us))  # 4 m on from one to the next
        ahead, parked = on_ring(angle + 0.3, 42.2, 0.8), on_ring(0 * angle + start + 1.3, 37.0, 0.8)
        for i in range(len(times_us)):
            photo = np.full((HEIGHT, WIDTH, 3), (90, 95, 90), np.uint8)
            photo[: HEIGHT // 2] = (230, 200, 160)
            cv2.imwrite(str(recordings / f"{name}-{i}.jpg"), photo)
        scenes.append(drive(recordings, name, times_us, on_ring(angle, 42.2, 0.0), [ahead, parked]))
    dataset = RecordDataset(recordings, "mine", tuple(scenes))
    splits = {"train": ["drive-1"], "val": ["drive-2"]}
    names = dataset.scene_names()
    extract(dataset, shards, SETTINGS, scenes=names, splits=splits, strict=True, cache_dir=out / "cache")
    fit_shards(shards, ("surface",))  # the homography of each frame, from camera to plane
    render_footprints(shards, FootprintSettings(scale=1.0))  # by it, the masks in the camera's view
    preview(shards, out / "pictures", PreviewSettings(views=("targets", "footprints")))


if __name__ == "__main__":
    main(Path(sys.argv[1]))

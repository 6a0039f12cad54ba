"""A whole frame, from record to shard, against the OpenCV and h5py calls that it can't do without."""

import tempfile
from pathlib import Path

import cv2
import h5py
import numpy as np
from measure import show, side_by_side

from ogmkit.geometry.boxes import ground_corners
from ogmkit.geometry.se3 import inverse
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.nuscenes.maps import MaskStore
from ogmkit.raster.vehicles import select
from ogmkit.shards.writer import write_shard
from ogmkit.synthetic.build import synthesize
from ogmkit.synthetic.settings import SynthesisSettings
from ogmkit.target_settings import TargetSettings

FRAMES = 20
REPEATS = 15
SETTINGS = TargetSettings()
GRID = SETTINGS.grid


def main():
    with tempfile.TemporaryDirectory() as folder:
        root, out = Path(folder) / "dataset", Path(folder) / "out"
        out.mkdir()
        settings = SynthesisSettings(
            scenes=1, frames=FRAMES, cameras=("CAM_FRONT",), image_size=(900, 1600), lidar=False
        )
        synthesize(root, settings)
        with Dataset(root) as dataset:
            scene = dataset.scene(dataset.scene_names()[0], ("CAM_FRONT",))
        frames = scene.cameras["CAM_FRONT"]
        masks = MaskStore(Path(folder) / "cache")
        prepared = [prepare(frame, masks) for frame in frames]
        ways = {
            "bare calls": lambda: write_bare(out / "bare.h5", prepared),
            "ogmkit": lambda: write_shard(
                out / "ogmkit.h5", scene, SETTINGS, masks, dataset_version=dataset.version
            ),
        }
        seconds = side_by_side(ways, REPEATS)
    rows = [
        (name, f"{1e3 * value / len(frames):.2f} ms", f"{value / seconds['bare calls']:.2f}×")
        for name, value in seconds.items()
    ]
    show(
        "A whole frame: rasters, boxes, trajectory, image, write (aim: ≤ 2×)",
        ("", "time", "to bare calls"),
        rows,
    )


def prepare(frame, masks):
    """What the bare calls need, worked out beforehand and not timed."""
    mask = masks.open(frame.dataroot / frame.map_path)
    pixel_from_global = np.array([[10.0, 0, 0], [0, -10.0, mask.shape[0]], [0, 0, 1]])
    global_from_level = inverse(frame.level_from_global)[np.ix_([0, 1, 3], [0, 1, 3])]
    boxes = select(frame.boxes)
    corners = ground_corners(frame.level_from_global @ boxes.global_from_box, boxes.size_wlh)
    rays = np.linalg.inv(frame.intrinsics) @ [[0, frame.image_size[1]], [0, 0], [1, 1]]
    directions = (frame.level_from_camera[:3, :3] @ rays)[:2].T
    cone = frame.level_from_camera[:2, 3] + np.concatenate([[[0, 0]], 200 * directions])
    return {
        "mask": mask.window(0, mask.shape[0], 0, mask.shape[1]),
        "pixel_from_bev": (pixel_from_global @ global_from_level @ GRID.level_from_bev)[:2],
        "vehicles": [np.round(ring).astype(np.int32) for ring in GRID.cells(corners)],
        "cone": np.round(GRID.cells(cone)).astype(np.int32),
        "image": frame.dataroot / frame.image_path,
        "boxes": [boxes.global_from_box, boxes.size_wlh, boxes.visibility, boxes.num_lidar_pts],
    }


def write_bare(path, prepared):
    """Warp, fill and write the same rasters, images and box columns with no care for anything else."""
    shape = (len(prepared), *GRID.shape)
    with h5py.File(path, "w") as file:
        drivable, vehicles, seen = (
            file.create_dataset(
                name, shape, np.uint8, chunks=(1, *GRID.shape), compression="gzip", compression_opts=1
            )
            for name in ("drivable", "vehicles", "field_of_view")
        )
        images = file.create_dataset("image", (len(prepared),), h5py.vlen_dtype(np.uint8))
        for i, frame in enumerate(prepared):
            flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
            drivable[i] = cv2.warpAffine(
                frame["mask"], frame["pixel_from_bev"], GRID.shape[::-1], flags=flags
            )
            vehicles[i] = filled(frame["vehicles"])
            seen[i] = filled([frame["cone"]])
            images[i] = np.frombuffer(frame["image"].read_bytes(), np.uint8)
        for column in range(len(prepared[0]["boxes"])):
            rows = np.concatenate([frame["boxes"][column] for frame in prepared])
            file.create_dataset(f"boxes/{column}", data=rows)


def filled(rings):
    canvas = np.zeros(GRID.shape, np.uint8)
    for ring in rings:
        cv2.fillConvexPoly(canvas, ring, 1)
    return canvas


main()

"""The OpenCV and h5py calls that a frame's targets can't do without, and nothing else."""

import cv2
import h5py
import numpy as np

from ogmkit.geometry.boxes import ground_corners
from ogmkit.geometry.se3 import inverse
from ogmkit.raster.vehicles import select

MARGIN = 2


def prepare(frame, masks, grid):
    """What the bare calls need, worked out beforehand and not timed.

    Args:
        frame: a record.
        masks: a `MaskStore`.
        grid: of the rasters.
    """
    mask = masks.open(frame.dataroot / frame.map_path)
    pixel_from_global = np.array([[10.0, 0, 0], [0, -10.0, mask.shape[0]], [0, 0, 1]])
    global_from_level = inverse(frame.level_from_global)[np.ix_([0, 1, 3], [0, 1, 3])]
    window, pixel_from_bev = _around(mask, pixel_from_global @ global_from_level @ grid.level_from_bev, grid)
    boxes = select(frame.boxes)
    corners = ground_corners(frame.level_from_global @ boxes.global_from_box, boxes.size_wlh)
    rays = np.linalg.inv(frame.intrinsics) @ [[0, frame.image_size[1]], [0, 0], [1, 1]]
    directions = (frame.level_from_camera[:3, :3] @ rays)[:2].T
    cone = frame.level_from_camera[:2, 3] + np.concatenate([[[0, 0]], 200 * directions])
    return {
        "shape": grid.shape,
        "mask": window,
        "pixel_from_bev": pixel_from_bev,
        "vehicles": [np.round(ring).astype(np.int32) for ring in grid.cells(corners)],
        "cone": np.round(grid.cells(cone)).astype(np.int32),
        "image": frame.dataroot / frame.image_path,
        "boxes": [boxes.global_from_box, boxes.size_wlh, boxes.visibility, boxes.num_lidar_pts],
    }


def _around(mask, pixel_from_bev, grid):
    """The part of a mask below a grid: OpenCV warps no image of more than 32,767 pixels a side."""
    rows, columns = grid.shape
    corners = pixel_from_bev @ np.array([[0, columns, columns, 0], [0, 0, rows, rows], [1, 1, 1, 1]])
    left, top = np.maximum(np.floor(corners[:2].min(axis=1)).astype(int) - MARGIN, 0)
    right, bottom = np.ceil(corners[:2].max(axis=1)).astype(int) + MARGIN
    bottom, right = min(bottom, mask.shape[0]), min(right, mask.shape[1])
    moved = np.array([[1.0, 0, -left], [0, 1, -top], [0, 0, 1]]) @ pixel_from_bev
    return mask.window(top, bottom, left, right), moved[:2]


def write_bare(path, prepared, *, images=True):
    """Warp, fill and write the same rasters, images and box columns with no care for anything else."""
    shape = (len(prepared), *prepared[0]["shape"])
    with h5py.File(path, "w") as file:
        drivable, vehicles, seen = (
            file.create_dataset(
                name, shape, np.uint8, chunks=(1, *shape[1:]), compression="gzip", compression_opts=1
            )
            for name in ("drivable", "vehicles", "field_of_view")
        )
        stored = file.create_dataset("image", (len(prepared),), h5py.vlen_dtype(np.uint8)) if images else None
        for i, frame in enumerate(prepared):
            flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
            drivable[i] = cv2.warpAffine(frame["mask"], frame["pixel_from_bev"], shape[:0:-1], flags=flags)
            vehicles[i] = filled(shape[1:], frame["vehicles"])
            seen[i] = filled(shape[1:], [frame["cone"]])
            if stored is not None:
                stored[i] = np.frombuffer(frame["image"].read_bytes(), np.uint8)
        for column in range(len(prepared[0]["boxes"])):
            rows = np.concatenate([frame["boxes"][column] for frame in prepared])
            file.create_dataset(f"boxes/{column}", data=rows)


def filled(shape, rings):
    canvas = np.zeros(shape, np.uint8)
    for ring in rings:
        cv2.fillConvexPoly(canvas, ring, 1)
    return canvas

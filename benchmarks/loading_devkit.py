"""The devkit's side of loading.py: samples on the fly, timed; runs in the devkit's environment.

Usage: loading_devkit.py DATAROOT RESULT.npz KIND HEIGHT WIDTH FACTOR SAMPLE_TOKEN…

KIND: sequence or frame.
HEIGHT, WIDTH: of images; 0 0 makes samples without images, their masks and matrices.
FACTOR: cells of 0.1 m along the side of a cell of the BEV truth.
"""

import sys
import time
from pathlib import Path

import cv2
import numpy as np
from nuscenes.map_expansion.map_api import NuScenesMap
from nuscenes.nuscenes import NuScenes
from pyquaternion import Quaternion

CAMERA = "CAM_FRONT"
M_PER_CELL, ROWS, COLUMNS, EGO_ROW, EGO_COLUMN = 0.1, 1000, 550, 1000, 300
STEPS = 6
TURNS = 3


def main(dataroot, result, kind, height, width, factor, *tokens):
    cv2.setNumThreads(1)
    (version,) = (path.name for path in Path(dataroot).glob("v1.0-*"))
    nusc = NuScenes(version, dataroot, verbose=False)
    maps = {}
    for scene in nusc.scene:
        location = nusc.get("log", scene["log_token"])["location"]
        maps[scene["token"]] = maps.get(location) or maps.setdefault(
            location, NuScenesMap(dataroot, location)
        )
    make = {"sequence": sequence, "frame": single}[kind]
    sizes = (int(height), int(width)), int(factor)
    first = make(nusc, maps, tokens[0], *sizes)  # warm, as the other side is
    seconds = np.zeros((TURNS, len(tokens)))
    for turn, place in np.ndindex(seconds.shape):
        start = time.perf_counter()
        make(nusc, maps, tokens[place], *sizes)
        seconds[turn, place] = time.perf_counter() - start
    np.savez(result, seconds=seconds, **first)


def sequence(nusc, maps, token, size, factor):
    """A sample as `ogmkit.learn.data.sequences` describes it."""
    samples = neighbours(nusc, token, -STEPS, 0)
    after = neighbours(nusc, token, 1, STEPS)
    frames = [frame(nusc, maps, sample, size, factor) for sample in samples[1:]]
    level_from_global = np.linalg.inv(global_from_level(pose_of(nusc, samples[-1])))
    path_m = [(level_from_global @ pose_of(nusc, sample)[:, 3])[:2] for sample in samples + after]
    whole = {name: np.stack([one[name] for one in frames]) for name in frames[0]}
    return whole | {
        "past": np.float32(path_m[:STEPS]),
        "future": np.float32(path_m[STEPS + 1 :]),
        "positions": np.float32(path_m[1 : STEPS + 1]),
    }


def single(nusc, maps, token, size, factor):
    """A sample of one image, without a path."""
    return frame(nusc, maps, nusc.get("sample", token), size, factor)


def frame(nusc, maps, sample, size, factor):
    """BEV truth of a frame, and its image with masks and matrices where a size is given."""
    level = global_from_level(pose_of(nusc, sample))
    bev = np.stack([drivable(maps[sample["scene_token"]], level), vehicles(nusc, sample, level)])
    truth = {"bev": majority(bev, factor).astype(np.float32)}
    return (truth | view(nusc, sample, level, bev, size)) if all(size) else truth


def view(nusc, sample, level, bev, size):
    """A frame's image with its masks and matrices."""
    data = nusc.get("sample_data", sample["data"][CAMERA])
    mounting = nusc.get("calibrated_sensor", data["calibrated_sensor_token"])
    level_from_camera = np.linalg.inv(level) @ pose_of(nusc, sample) @ matrix(mounting)
    image = cv2.imread(nusc.get_sample_data_path(data["token"]))
    stretch = np.diag([size[1] / image.shape[1], size[0] / image.shape[0], 1.0])
    stretch[:2, 2] = (np.diag(stretch)[:2] - 1) / 2  # half a pixel: corners on corners
    image = cv2.cvtColor(cv2.resize(image, size[::-1], interpolation=cv2.INTER_AREA), cv2.COLOR_BGR2RGB)
    intrinsics = stretch @ np.array(mounting["camera_intrinsic"])
    bev_from_image = homography(intrinsics, level_from_camera)
    masks = np.stack([warp(mask, bev_from_image, size) for mask in bev])
    return {
        "image": np.ascontiguousarray(image.transpose(2, 0, 1)).astype(np.float32) / 255,
        "masks": masks.astype(np.float32),
        "bev_from_image": bev_from_image,
        "intrinsics": intrinsics,
        "level_from_camera": level_from_camera,
    }


def drivable(vector_map, level):
    """The map's drivable area on the grid, turned with the car."""
    ahead_m, left_m = ROWS * M_PER_CELL, (2 * EGO_COLUMN - COLUMNS) * M_PER_CELL
    centre = level @ [ahead_m / 2, left_m / 2, 0, 1]
    angle = np.degrees(np.arctan2(level[1, 0], level[0, 0])) - 90
    patch = (centre[0], centre[1], ahead_m, COLUMNS * M_PER_CELL)
    return vector_map.get_map_mask(patch, angle, ["drivable_area"], (ROWS, COLUMNS))[0, ::-1]


def vehicles(nusc, sample, level):
    """Ground faces of the vehicles' boxes on the grid."""
    canvas = np.zeros((ROWS, COLUMNS), np.uint8)
    level_from_global = np.linalg.inv(level)
    for box in nusc.get_boxes(sample["data"][CAMERA]):
        if box.name.startswith("vehicle."):
            corners = box.bottom_corners()
            x, y, _ = level_from_global[:3, :3] @ corners + level_from_global[:3, 3:]
            cells = np.stack([EGO_COLUMN - 0.5 - y / M_PER_CELL, EGO_ROW - 0.5 - x / M_PER_CELL], axis=-1)
            cv2.fillPoly(canvas, [np.round(cells).astype(np.int32)], 1)
    return canvas


def homography(intrinsics, level_from_camera):
    """From pixels to cells by calibration, on flat ground: the cheapest there is."""
    level_from_bev = np.array(
        [
            [0, -M_PER_CELL, M_PER_CELL * (EGO_ROW - 0.5)],
            [-M_PER_CELL, 0, M_PER_CELL * (EGO_COLUMN - 0.5)],
            [0, 0, 1],
        ]
    )
    image_from_level = intrinsics @ np.linalg.inv(level_from_camera)[:3, [0, 1, 3]]
    bev_from_image = np.linalg.inv(image_from_level @ level_from_bev)
    return bev_from_image / abs(bev_from_image[2, 2])


def warp(mask, bev_from_image, size):
    """A BEV mask in camera view, nothing above the horizon."""
    flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
    warped = cv2.warpPerspective(mask, bev_from_image, size[::-1], flags=flags)
    w_row, w_column = bev_from_image[2, 1] * np.arange(size[0]), bev_from_image[2, 0] * np.arange(size[1])
    return warped * (w_row[:, None] + w_column > -bev_from_image[2, 2])


def majority(masks, factor):
    """Coarser cells: 1 where at least half of the fine ones are."""
    if factor == 1:
        return masks
    strips = masks.reshape(2, ROWS // factor, factor, COLUMNS).sum(axis=2, dtype=np.uint32)
    counts = strips.reshape(2, ROWS // factor, COLUMNS // factor, factor).sum(axis=-1)
    return 2 * counts >= factor * factor


def neighbours(nusc, token, first, last):
    """Samples at the steps first … last around one."""
    sample = nusc.get("sample", token)
    for _ in range(abs(first)):
        sample = nusc.get("sample", sample["prev" if first < 0 else "next"])
    found = [sample]
    while len(found) < last - first + 1:
        found.append(nusc.get("sample", found[-1]["next"]))
    return found


def pose_of(nusc, sample):
    """(4, 4) global from ego, at the image's time."""
    data = nusc.get("sample_data", sample["data"][CAMERA])
    return matrix(nusc.get("ego_pose", data["ego_pose_token"]))


def global_from_level(global_from_ego):
    """(4, 4) the pose without its roll and pitch."""
    heading = np.arctan2(global_from_ego[1, 0], global_from_ego[0, 0])
    result = np.eye(4)
    result[:2, :2] = [[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]]
    result[:3, 3] = global_from_ego[:3, 3]
    return result


def matrix(record):
    """(4, 4) of a record's rotation and translation."""
    result = np.eye(4)
    result[:3, :3] = Quaternion(record["rotation"]).rotation_matrix
    result[:3, 3] = record["translation"]
    return result


main(*sys.argv[1:])

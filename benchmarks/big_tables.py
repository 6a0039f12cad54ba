"""Tables as large as nuScenes v1.0-trainval's, generated: sound links, invented values, no sensor files.

Sizes follow the published ones: 850 scenes of about 40 key frames; 6 cameras, 5 radars and a LiDAR with all
their sweeps (2.6 M sample_data and poses); 1.17 M annotations of 64 k instances.
"""

import json
from collections.abc import Iterable, Iterator
from pathlib import Path

TABLES = ("sample_data", "ego_pose", "sample_annotation")
KEY_FRAMES = 40
BOXES = 34
TRACK = 18
START_US = 1_532_402_900_000_000
CAMERAS = ("CAM_FRONT", "CAM_FRONT_RIGHT", "CAM_BACK_RIGHT", "CAM_BACK", "CAM_BACK_LEFT", "CAM_FRONT_LEFT")
RADARS = ("RADAR_FRONT", "RADAR_FRONT_LEFT", "RADAR_FRONT_RIGHT", "RADAR_BACK_LEFT", "RADAR_BACK_RIGHT")
SENSORS = {
    **dict.fromkeys(CAMERAS, ("camera", 6, "jpg", 900, 1600)),
    **dict.fromkeys(RADARS, ("radar", 6, "pcd", 0, 0)),
    "LIDAR_TOP": ("lidar", 12, "pcd", 0, 0),
}
"""Channel → modality, images or sweeps a key frame, file format, height, width."""
ROTATION = "[0.9687876119182126, -0.004506968075376869, -0.00792272203393983, 0.24772460658591755]"


def token(kind: int, *numbers: int) -> str:
    """32 hexadecimal digits, as nuScenes' tokens."""
    digits = f"{kind:02x}" + "".join(f"{number:06x}" for number in numbers)
    return digits.ljust(32, "0")


def write_tables(root: Path, version: str, scenes: int) -> dict[str, int]:
    """Write all thirteen tables below root/version; gives their row counts."""
    folder = root / version
    folder.mkdir(parents=True)
    generated = {
        "scene": _scenes(scenes),
        "sample": _samples(scenes),
        "calibrated_sensor": _calibrated_sensors(scenes),
        "sample_data": _sample_data(scenes),
        "ego_pose": _ego_poses(scenes),
        "instance": _instances(scenes),
        "sample_annotation": _annotations(scenes),
        **{name: map(json.dumps, rows) for name, rows in _small_tables(scenes).items()},
    }
    return {name: _write(folder / f"{name}.json", rows) for name, rows in generated.items()}


def _write(path: Path, rows: Iterable[str]) -> int:
    count = 0
    with path.open("w", encoding="utf-8") as file:
        for row in rows:
            # One key a line, as the published files have it.
            file.write(("[\n" if not count else ",\n") + row.replace(', "', ',\n"'))
            count += 1
        file.write("\n]")
    return count


def _small_tables(scenes: int) -> dict[str, list[dict[str, object]]]:
    logs = [
        {"token": token(1, s), "logfile": f"log-{s}", "vehicle": "n015", "date_captured": "2018-07-24",
         "location": "boston-seaport"}
        for s in range(scenes)
    ]  # fmt: skip
    masks = {"token": token(2), "category": "semantic_prior", "filename": "maps/mask.png"}
    levels = ("v0-40", "v40-60", "v60-80", "v80-100")
    return {
        "log": logs,
        "map": [{**masks, "log_tokens": [log["token"] for log in logs]}],
        "sensor": [
            {"token": token(3, i), "channel": name, "modality": SENSORS[name][0]}
            for i, name in enumerate(SENSORS)
        ],
        "category": [{"token": token(4), "name": "vehicle.car", "description": "a car"}],
        "attribute": [{"token": token(5), "name": "vehicle.moving", "description": "moves"}],
        "visibility": [
            {"token": str(i + 1), "level": level, "description": ""} for i, level in enumerate(levels)
        ],
    }


def _chain(kind: int, prefix: tuple[int, ...], number: int, count: int) -> str:
    earlier = token(kind, *prefix, number - 1) if number else ""
    later = token(kind, *prefix, number + 1) if number + 1 < count else ""
    return f'"prev": "{earlier}", "next": "{later}"'


def _scenes(scenes: int) -> Iterator[str]:
    for s in range(scenes):
        yield (
            f'{{"token": "{token(6, s)}", "log_token": "{token(1, s)}", "nbr_samples": {KEY_FRAMES}, '
            f'"first_sample_token": "{token(7, s, 0)}", '
            f'"last_sample_token": "{token(7, s, KEY_FRAMES - 1)}", '
            f'"name": "scene-{s:04d}", "description": "generated"}}'
        )


def _samples(scenes: int) -> Iterator[str]:
    for s in range(scenes):
        for k in range(KEY_FRAMES):
            yield (
                f'{{"token": "{token(7, s, k)}", "timestamp": {START_US + 500_000 * k}, '
                f'{_chain(7, (s,), k, KEY_FRAMES)}, "scene_token": "{token(6, s)}"}}'
            )


def _calibrated_sensors(scenes: int) -> Iterator[str]:
    for s in range(scenes):
        for i, (modality, *_) in enumerate(SENSORS.values()):
            camera = "[[1266.4, 0.0, 816.3], [0.0, 1266.4, 491.5], [0.0, 0.0, 1.0]]"
            yield (
                f'{{"token": "{token(8, s, i)}", "sensor_token": "{token(3, i)}", '
                f'"translation": [1.72, 0.005, 1.51], "rotation": {ROTATION}, '
                f'"camera_intrinsic": {camera if modality == "camera" else "[]"}}}'
            )


def _recordings(scenes: int) -> Iterator[tuple[int, int, str, int, int, int]]:
    """Scene, sensor number, channel, recording's number in the scene, how many there are, time."""
    for s in range(scenes):
        for i, (channel, (_, per_key_frame, *_)) in enumerate(SENSORS.items()):
            count = (KEY_FRAMES - 1) * per_key_frame + 1
            for n in range(count):
                yield s, i, channel, n, count, START_US + 500_000 * n // per_key_frame - 1_000 * i


def _sample_data(scenes: int) -> Iterator[str]:
    for s, i, channel, n, count, time_us in _recordings(scenes):
        _, per_key_frame, suffix, height, width = SENSORS[channel]
        key, rest = divmod(n, per_key_frame)
        folder, is_key_frame = ("sweeps", "false") if rest else ("samples", "true")
        yield (
            f'{{"token": "{token(9, s, i, n)}", "sample_token": "{token(7, s, key + (rest > 0))}", '
            f'"ego_pose_token": "{token(10, s, i, n)}", "calibrated_sensor_token": "{token(8, s, i)}", '
            f'"timestamp": {time_us}, "fileformat": "{suffix}", "is_key_frame": {is_key_frame}, '
            f'"height": {height}, "width": {width}, '
            f'"filename": "{folder}/{channel}/log-{s}__{channel}__{time_us}.{suffix}", '
            f"{_chain(9, (s, i), n, count)}}}"
        )


def _ego_poses(scenes: int) -> Iterator[str]:
    for s, i, _, n, _, time_us in _recordings(scenes):
        along_m = 600 + 5e-6 * (time_us - START_US)
        yield (
            f'{{"token": "{token(10, s, i, n)}", "timestamp": {time_us}, "rotation": {ROTATION}, '
            f'"translation": [{along_m!r}, {1600 + s / 7!r}, 0.0]}}'
        )


def _tracks(scenes: int) -> Iterator[tuple[int, int, int, int]]:
    """Scene, instance number, its first key frame and how many it is annotated in."""
    for s in range(scenes):
        for first in range(0, KEY_FRAMES, TRACK):
            for slot in range(BOXES):
                yield s, first * BOXES + slot, first, min(TRACK, KEY_FRAMES - first)


def _instances(scenes: int) -> Iterator[str]:
    for s, i, _, length in _tracks(scenes):
        yield (
            f'{{"token": "{token(11, s, i)}", "category_token": "{token(4)}", "nbr_annotations": {length}, '
            f'"first_annotation_token": "{token(12, s, i, 0)}", '
            f'"last_annotation_token": "{token(12, s, i, length - 1)}"}}'
        )


def _annotations(scenes: int) -> Iterator[str]:
    for s, i, first, length in _tracks(scenes):
        for n in range(length):
            yield (
                f'{{"token": "{token(12, s, i, n)}", "sample_token": "{token(7, s, first + n)}", '
                f'"instance_token": "{token(11, s, i)}", "visibility_token": "{1 + (i + n) % 4}", '
                f'"attribute_tokens": ["{token(5)}"], '
                f'"translation": [{600 + i / 3!r}, {1600 + n / 9!r}, 0.9], '
                f'"size": [1.9, 4.6, 1.7], "rotation": {ROTATION}, {_chain(12, (s, i), n, length)}, '
                f'"num_lidar_pts": {n}, "num_radar_pts": 0}}'
            )

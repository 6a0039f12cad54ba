"""Tables as large as nuScenes v1.0-trainval's, generated: sound links, invented values, no sensor files.

Sizes follow the published ones: 850 scenes of about 40 key frames; 6 cameras, 5 radars and a LiDAR with all
their sweeps (2.6 M sample_data and poses); 1.17 M annotations of 64 k instances. Scenes take turns with the
four locations.
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

TABLES = ("sample_data", "ego_pose", "sample_annotation")
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
LOOKING_AHEAD = "[0.5, -0.5, 0.5, -0.5]"
LOCATIONS = {
    "boston-seaport": (21_181, 29_795),
    "singapore-hollandvillage": (29_229, 28_083),
    "singapore-onenorth": (20_250, 15_856),
    "singapore-queenstown": (36_871, 32_286),
}
"""Location → rows and columns of its mask, at 0.1 m."""


@dataclass(frozen=True)
class Extent:
    """How much there is.

    Attributes:
        scenes: how many.
        key_frames: of each.
        sweeps: whether there are recordings between key frames.
    """

    scenes: int
    key_frames: int = 40
    sweeps: bool = True

    def rate(self, channel: str) -> int:
        """Recordings of a channel for each key frame."""
        return SENSORS[channel][1] if self.sweeps else 1


def mask_name(location: str) -> str:
    """Path of a location's mask below the root."""
    return f"maps/{location}.png"


def token(kind: int, *numbers: int) -> str:
    """32 hexadecimal digits, as nuScenes' tokens."""
    digits = f"{kind:02x}" + "".join(f"{number:06x}" for number in numbers)
    return digits.ljust(32, "0")


def write_tables(root: Path, version: str, extent: Extent) -> dict[str, int]:
    """Write all thirteen tables below root/version; gives their row counts."""
    folder = root / version
    folder.mkdir(parents=True)
    generated = {
        "scene": _scenes(extent),
        "sample": _samples(extent),
        "calibrated_sensor": _calibrated_sensors(extent),
        "sample_data": _sample_data(extent),
        "ego_pose": _ego_poses(extent),
        "instance": _instances(extent),
        "sample_annotation": _annotations(extent),
        **{name: map(json.dumps, rows) for name, rows in _small_tables(extent).items()},
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


def _small_tables(extent: Extent) -> dict[str, list[dict[str, object]]]:
    places = [*LOCATIONS]
    logs = [
        {"token": token(1, s), "logfile": f"log-{s}", "vehicle": "n015", "date_captured": "2018-07-24",
         "location": places[s % len(places)]}
        for s in range(extent.scenes)
    ]  # fmt: skip
    masks = [
        {"token": token(2, i), "category": "semantic_prior", "filename": mask_name(place),
         "log_tokens": [log["token"] for log in logs if log["location"] == place]}
        for i, place in enumerate(places)
    ]  # fmt: skip
    levels = ("v0-40", "v40-60", "v60-80", "v80-100")
    return {
        "log": logs,
        "map": masks,
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


def _scenes(extent: Extent) -> Iterator[str]:
    for s in range(extent.scenes):
        yield (
            f'{{"token": "{token(6, s)}", "log_token": "{token(1, s)}", "nbr_samples": {extent.key_frames}, '
            f'"first_sample_token": "{token(7, s, 0)}", '
            f'"last_sample_token": "{token(7, s, extent.key_frames - 1)}", '
            f'"name": "scene-{s:04d}", "description": "generated"}}'
        )


def _samples(extent: Extent) -> Iterator[str]:
    for s in range(extent.scenes):
        for k in range(extent.key_frames):
            yield (
                f'{{"token": "{token(7, s, k)}", "timestamp": {START_US + 500_000 * k}, '
                f'{_chain(7, (s,), k, extent.key_frames)}, "scene_token": "{token(6, s)}"}}'
            )


def _calibrated_sensors(extent: Extent) -> Iterator[str]:
    for s in range(extent.scenes):
        for i, (modality, *_) in enumerate(SENSORS.values()):
            camera = "[[1266.4, 0.0, 816.3], [0.0, 1266.4, 491.5], [0.0, 0.0, 1.0]]"
            yield (
                f'{{"token": "{token(8, s, i)}", "sensor_token": "{token(3, i)}", '
                f'"translation": [1.72, 0.005, 1.51], "rotation": {LOOKING_AHEAD}, '
                f'"camera_intrinsic": {camera if modality == "camera" else "[]"}}}'
            )


def _recordings(extent: Extent) -> Iterator[tuple[int, int, str, int, int, int]]:
    """Scene, sensor number, channel, recording's number in the scene, how many there are, time."""
    for s in range(extent.scenes):
        for i, channel in enumerate(SENSORS):
            rate = extent.rate(channel)
            count = (extent.key_frames - 1) * rate + 1
            for n in range(count):
                yield s, i, channel, n, count, START_US + 500_000 * n // rate - 1_000 * i


def _sample_data(extent: Extent) -> Iterator[str]:
    for s, i, channel, n, count, time_us in _recordings(extent):
        _, _, suffix, height, width = SENSORS[channel]
        key, rest = divmod(n, extent.rate(channel))
        folder, is_key_frame = ("sweeps", "false") if rest else ("samples", "true")
        yield (
            f'{{"token": "{token(9, s, i, n)}", "sample_token": "{token(7, s, key + (rest > 0))}", '
            f'"ego_pose_token": "{token(10, s, i, n)}", "calibrated_sensor_token": "{token(8, s, i)}", '
            f'"timestamp": {time_us}, "fileformat": "{suffix}", "is_key_frame": {is_key_frame}, '
            f'"height": {height}, "width": {width}, '
            f'"filename": "{folder}/{channel}/log-{s}__{channel}__{time_us}.{suffix}", '
            f"{_chain(9, (s, i), n, count)}}}"
        )


def _ego_poses(extent: Extent) -> Iterator[str]:
    for s, i, _, n, _, time_us in _recordings(extent):
        along_m = 600 + 5e-6 * (time_us - START_US)
        yield (
            f'{{"token": "{token(10, s, i, n)}", "timestamp": {time_us}, "rotation": {ROTATION}, '
            f'"translation": [{along_m!r}, {1600 + s / 7!r}, 0.0]}}'
        )


def _tracks(extent: Extent) -> Iterator[tuple[int, int, int, int]]:
    """Scene, instance number, its first key frame and how many it is annotated in."""
    for s in range(extent.scenes):
        for first in range(0, extent.key_frames, TRACK):
            for slot in range(BOXES):
                yield s, first * BOXES + slot, first, min(TRACK, extent.key_frames - first)


def _instances(extent: Extent) -> Iterator[str]:
    for s, i, _, length in _tracks(extent):
        yield (
            f'{{"token": "{token(11, s, i)}", "category_token": "{token(4)}", "nbr_annotations": {length}, '
            f'"first_annotation_token": "{token(12, s, i, 0)}", '
            f'"last_annotation_token": "{token(12, s, i, length - 1)}"}}'
        )


def _annotations(extent: Extent) -> Iterator[str]:
    for s, i, first, length in _tracks(extent):
        for n in range(length):
            yield (
                f'{{"token": "{token(12, s, i, n)}", "sample_token": "{token(7, s, first + n)}", '
                f'"instance_token": "{token(11, s, i)}", "visibility_token": "{1 + (i + n) % 4}", '
                f'"attribute_tokens": ["{token(5)}"], '
                f'"translation": [{570 + 2.5 * first + 3.1 * (i % BOXES)!r}, '
                f"{1589 + s / 7 + 7 * i % 23 + n / 9!r}, 0.9], "
                f'"size": [1.9, 4.6, 1.7], "rotation": {ROTATION}, {_chain(12, (s, i), n, length)}, '
                f'"num_lidar_pts": {n}, "num_radar_pts": 0}}'
            )

"""Records a scene: images and sweeps into files, samples and sensor data into tables."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ogmkit.geometry.se3 import pose_matrix
from ogmkit.synthetic.clock import Shot, key_times, shots
from ogmkit.synthetic.lidar import scan
from ogmkit.synthetic.observation import Moment, add_annotations, camera_shares, observe
from ogmkit.synthetic.plan import ScenePlan, token
from ogmkit.synthetic.rendering import encode_jpeg, render_image
from ogmkit.synthetic.sensors import Sensor
from ogmkit.synthetic.settings import SynthesisSettings
from ogmkit.synthetic.stage import Stage
from ogmkit.synthetic.tables import Row, Tables
from ogmkit.typing import FloatArray, IntArray


class Recorder:
    """Records scenes into one dataset.

    Args:
        out: the dataset's root; the folders of the channels exist.
        tables: where rows go.
        settings: of the dataset.
        on_file: called after each image or sweep.
    """

    def __init__(
        self, out: Path, tables: Tables, settings: SynthesisSettings, on_file: Callable[[], None]
    ) -> None:
        self._out = out
        self._tables = tables
        self._settings = settings
        self._on_file = on_file

    def record(self, stage: Stage, sensors: Sequence[Sensor]) -> int:
        """Record one scene; returns the number of its annotations."""
        plan, tables = stage.plan, self._tables
        random = np.random.default_rng([tables.seed, 4, plan.index])
        samples_us = key_times(random, plan.start_us, self._settings.frames)
        self._add_scene(plan, samples_us)
        moments = [observe(stage, int(sample_us)) for sample_us in samples_us]
        lidar_counts = [np.zeros(len(moment.solids), dtype=np.int64) for moment in moments]
        for sensor in sensors:
            rows = []
            for number, shot in enumerate(
                shots(random, samples_us, sensor.channel, sweeps=self._settings.sweeps)
            ):
                moment = moments[shot.sample] if shot.is_key else observe(stage, shot.timestamp_us)
                filename = _filename(plan, sensor, shot)
                hits = self._shoot(stage, sensor, shot, moment, filename)
                if shot.is_key and hits is not None:
                    lidar_counts[shot.sample] = hits
                rows.append(self._add_shot(stage, sensor, shot, filename, number))
                self._on_file()
            tables.add_chain("sample_data", rows)
        shares = [camera_shares(stage, moment, self._settings.annotating) for moment in moments]
        return add_annotations(tables, plan, moments, shares, lidar_counts)

    def _add_scene(self, plan: ScenePlan, samples_us: IntArray) -> None:
        tables, scene = self._tables, self._tables.token("scene", plan.index)
        samples: list[Row] = [
            {"token": tables.token("sample", plan.index, number), "timestamp": int(us), "scene_token": scene}
            for number, us in enumerate(samples_us)
        ]
        tables.add_chain("sample", samples)
        row: Row = {
            "log_token": tables.token("log", plan.log.index),
            "nbr_samples": len(samples),
            "first_sample_token": samples[0]["token"],
            "last_sample_token": samples[-1]["token"],
            "name": plan.name,
            "description": f"Synthetic drive, {plan.log.location.name}",
        }
        tables.add("scene", scene, row)

    def _add_shot(self, stage: Stage, sensor: Sensor, shot: Shot, filename: str, number: int) -> Row:
        """Add the ego's pose; returns the row of the sensor's data."""
        tables, plan = self._tables, stage.plan
        record = tables.token("sample_data", plan.index, sensor.channel, number)
        translation, rotation = stage.ego_pose(shot.timestamp_us)
        pose: Row = {"timestamp": shot.timestamp_us, "rotation": rotation, "translation": translation}
        tables.add("ego_pose", record, pose)
        height, width = (0, 0) if sensor.intrinsics is None else self._settings.image_size
        return {
            "token": record,
            "sample_token": tables.token("sample", plan.index, shot.sample),
            "ego_pose_token": record,
            "calibrated_sensor_token": tables.token("calibrated_sensor", plan.log.index, sensor.channel),
            "timestamp": shot.timestamp_us,
            "fileformat": "pcd" if sensor.intrinsics is None else "jpg",
            "is_key_frame": shot.is_key,
            "height": height,
            "width": width,
            "filename": filename,
        }

    def _shoot(
        self, stage: Stage, sensor: Sensor, shot: Shot, moment: Moment, filename: str
    ) -> IntArray | None:
        """Write an image or a sweep; of a sweep, returns the points on each solid."""
        global_from_sensor = pose_matrix(*stage.ego_pose(shot.timestamp_us)) @ sensor.ego_from_sensor
        path = self._out / filename
        if sensor.intrinsics is not None:
            if self._settings.images:
                path.write_bytes(self._image(stage, sensor.intrinsics, global_from_sensor, moment, filename))
            return None
        points, solid_index = scan(
            stage.scenery, moment.solids, global_from_sensor, azimuths=self._settings.lidar_azimuths
        )
        path.write_bytes(points.tobytes())
        return np.bincount(solid_index[solid_index >= 0], minlength=len(moment.solids))

    def _image(
        self,
        stage: Stage,
        intrinsics: FloatArray,
        global_from_camera: FloatArray,
        moment: Moment,
        filename: str,
    ) -> bytes:
        noise_seed = int(token(self._tables.seed, "noise", filename)[:8], 16)
        image = render_image(
            stage.scenery,
            moment.solids,
            intrinsics,
            global_from_camera,
            self._settings.image_size,
            noise_seed=noise_seed,
        )
        return encode_jpeg(image)


def count_files(plan: ScenePlan, settings: SynthesisSettings) -> int:
    """Images and sweeps of a scene."""
    random = np.random.default_rng([settings.seed, 4, plan.index])
    samples_us = key_times(random, plan.start_us, settings.frames)
    return sum(
        len(shots(random, samples_us, channel, sweeps=settings.sweeps)) for channel in settings.channels
    )


def _filename(plan: ScenePlan, sensor: Sensor, shot: Shot) -> str:
    folder = "samples" if shot.is_key else "sweeps"
    ending = "pcd.bin" if sensor.intrinsics is None else "jpg"
    return f"{folder}/{sensor.channel}/{plan.log.name}__{sensor.channel}__{shot.timestamp_us}.{ending}"

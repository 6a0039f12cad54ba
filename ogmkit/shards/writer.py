"""Writing a shard: one scene, frame by frame, with no more than a frame's rasters in memory."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ogmkit import __version__
from ogmkit.base.atomic import replacing
from ogmkit.base.steps import STEPS
from ogmkit.errors import TableError
from ogmkit.frames import FrameRecord, LeftOutFrame, SceneRecord
from ogmkit.further_targets import Around, following_boxes, instance_numbers
from ogmkit.labels.catalogue import paper
from ogmkit.labels.names import PAPER
from ogmkit.nuscenes.maps import MapMask, MaskStore
from ogmkit.nuscenes.paths import resolve
from ogmkit.shards import fields, schema
from ogmkit.shards.columns import column
from ogmkit.shards.labels_writer import record_text, write_labels
from ogmkit.shards.layout import Rows, attribute_values, create_dataset, store_dataset
from ogmkit.shards.schema_further import FUTURE_VALID, INSTANCE_TOKENS, further_fields
from ogmkit.shards.schema_seen import SEEN
from ogmkit.shards.settings import Compression, ExtractSettings
from ogmkit.shards.sink import ShardFile, create
from ogmkit.target_settings import TargetSettings
from ogmkit.targets import FrameTargets, build_targets, layers_of
from ogmkit.trajectories import Trajectory


@dataclass
class _Tally:
    """What is known of a camera's frames once they are written."""

    trajectories: list[Trajectory]
    points: list[int]
    drivable_cells: int = 0
    vehicle_cells: int = 0
    cells_in_view: int = 0


def write_shard(
    path: Path,
    scene: SceneRecord,
    settings: TargetSettings,
    masks: MaskStore,
    *,
    dataset_version: str,
    compression: Compression = "gzip",
    definitions: tuple[str, ...] = (PAPER,),
) -> None:
    """Write one scene's shard; it appears under its name only when it is whole.

    Args:
        path: the shard's file, in an existing folder.
        scene: its frames; the cameras there are the shard's. Its key frames are needed for labels.
        settings: what targets to make.
        masks: the store of decoded map masks.
        dataset_version: the source's tables, such as `v1.0-mini`.
        compression: of rasters and LiDAR points.
        definitions: names of the labels to store.

    Raises:
        DataFileError: a file of the dataset is absent or damaged.
        TableError: a camera has no frames, or a file name leaves the dataset's root.
        OutputError: the disk is full or refuses otherwise.
    """
    stored = ExtractSettings(settings, tuple(scene.cameras), compression, definitions=definitions)
    with replacing(path) as part, create(part) as file:
        with file.writing() as h5:
            h5.attrs.update(_file_attributes(scene, stored, dataset_version))
        for camera, frames in sorted(scene.cameras.items()):
            if not frames:
                raise TableError(f"scene {scene.name}: has no key frames of {camera}; choose another camera")
            _write_camera(file, camera, (frames, scene.left_out.get(camera, ())), stored, masks)
        write_labels(file, scene, stored, masks)


def _file_attributes(scene: SceneRecord, settings: ExtractSettings, dataset_version: str) -> dict[str, Any]:
    grid = settings.targets.grid
    values: dict[str, Any] = {
        "format": schema.FORMAT,
        "format_version": schema.FORMAT_VERSION,
        "package_version": __version__,
        "dataset_version": dataset_version,
        "scene": scene.name,
        "location": scene.location,
        "log": scene.log,
        "settings": json.dumps(settings.to_dict(), sort_keys=True),
        "grid_m_per_cell": grid.m_per_cell,
        "grid_rows": grid.rows,
        "grid_columns": grid.columns,
        "grid_ego_row": grid.ego_row,
        "grid_ego_column": grid.ego_column,
        "no_map": 1,
    }
    parts = fields.parts_of(settings.targets)
    known = {*parts, "optional"} if scene.log else parts
    return attribute_values(schema.FILE_ATTRIBUTES, values, known)


def _write_camera(
    file: ShardFile,
    camera: str,
    recorded: tuple[Sequence[FrameRecord], Sequence[LeftOutFrame]],
    settings: ExtractSettings,
    masks: MaskStore,
) -> None:
    """Write a camera's group: its frames, and those that are left out."""
    frames, left_out = recorded
    targets, grid = settings.targets, settings.targets.grid
    parts = fields.parts_of(targets, left_out=bool(left_out))
    stored = (*schema.fields(parts), *further_fields(targets))
    numbers = instance_numbers((one.boxes for one in frames), targets) if targets.instances else {}
    sizes = {
        fields.FRAMES: len(frames),
        fields.FRAMES_AND_END: len(frames) + 1,
        fields.BOXES: sum(len(frame.boxes) for frame in frames),
        fields.POINTS: 0,
        fields.LEFT_OUT: len(left_out),
        fields.INSTANCES: len(numbers),
        fields.FUTURE: targets.future,
        fields.ROWS: grid.rows,
        fields.COLUMNS: grid.columns,
    }
    with file.writing() as h5:
        group, rows = h5.create_group(camera), {}
        for field in stored:
            if field == INSTANCE_TOKENS:
                store_dataset(group, field, list(numbers), sizes)
            elif field.storage != "whole" or field == FUTURE_VALID:
                rows[field.name] = create_dataset(group, field, sizes, settings.compression)
    tally = _write_frames(file, rows, frames, targets, masks, numbers)
    with file.writing():
        for field in stored:
            if field.name not in group:
                values = column(field.name, frames, left_out, tally.trajectories, tally.points)
                store_dataset(group, field, values, sizes)
        attributes = _camera_attributes(camera, frames, tally, grid.rows * grid.columns)
        attributes["definition"] = record_text(paper(targets))
        attributes["frames_left_out"] = len(left_out)
        group.attrs.update(attribute_values(schema.CAMERA_ATTRIBUTES, attributes, {*parts, "optional"}))


def _write_frames(
    file: ShardFile,
    rows: Mapping[str, Rows],
    frames: Sequence[FrameRecord],
    settings: TargetSettings,
    masks: MaskStore,
    numbers: Mapping[str, int],
) -> _Tally:
    tally = _Tally([], [])
    map_masks: dict[str, MapMask] = {}
    following = following_boxes(frames, settings)
    for index, frame in enumerate(frames):
        if not settings.no_map and frame.map_path not in map_masks:
            map_masks[frame.map_path] = masks.open(resolve(frame.dataroot, frame.map_path))
        around = Around(layers_of(frame, settings), numbers, following[index])
        targets = build_targets(frame, settings, map_masks.get(frame.map_path), around)
        tally.trajectories.append(targets.trajectory)
        if targets.drivable is not None:
            tally.drivable_cells += int(np.count_nonzero(targets.drivable))
        tally.vehicle_cells += int(np.count_nonzero(targets.vehicles))
        tally.cells_in_view += int(np.count_nonzero(targets.field_of_view))
        with file.writing():
            tally.points.append(_write_frame(rows, index, targets))
    return tally


def _write_frame(rows: Mapping[str, Rows], index: int, targets: FrameTargets) -> int:
    """Store what is stored frame by frame; returns the number of LiDAR points."""
    if targets.drivable is not None:
        rows["drivable"].store(index, targets.drivable)
    rows["vehicles"].store(index, targets.vehicles)
    rows["field_of_view"].store(index, targets.field_of_view)
    for name, row in targets.further.items():
        rows[name].store(index, row)
    for kind, mask in targets.seen.items():
        rows[f"{SEEN}/{kind}"].store(index, mask)
    if targets.image is not None:
        rows["image"].store(index, np.frombuffer(targets.image, np.uint8))
    return 0 if targets.lidar_points is None else rows["lidar/points"].append(targets.lidar_points)


def _camera_attributes(
    camera: str, frames: Sequence[FrameRecord], tally: _Tally, grid_cells: int
) -> dict[str, Any]:
    cells = len(frames) * grid_cells
    steps_s = [
        (frame.neighbour_timestamps_us[STEPS + 1] - frame.timestamp_us) / 1e6
        for frame, trajectory in zip(frames, tally.trajectories, strict=True)
        if trajectory.future_valid[0]
    ] or [np.nan]
    return {
        "channel": camera,
        "valid_trajectories": sum(trajectory.valid for trajectory in tally.trajectories),
        "drivable_share": tally.drivable_cells / cells,
        "vehicle_share": tally.vehicle_cells / cells,
        "field_of_view_share": tally.cells_in_view / cells,
        "step_s": np.median(steps_s),
        "step_min_s": min(steps_s),
        "step_max_s": max(steps_s),
    }

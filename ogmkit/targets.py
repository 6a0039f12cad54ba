"""A frame's training targets from its record, its map's mask and its files."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ogmkit.base.files import fault_of, read_bytes
from ogmkit.base.images import image_size
from ogmkit.errors import DataFileError, FrameFileError
from ogmkit.frames import FrameRecord
from ogmkit.further_targets import NOTHING, Around, Rasters, further_targets
from ogmkit.nuscenes.maps import MapMask, MaskStore
from ogmkit.nuscenes.paths import resolve
from ogmkit.raster.drivable import drivable_mask
from ogmkit.raster.field_of_view import field_of_view_mask
from ogmkit.raster.layers import LayerMap, open_layers
from ogmkit.raster.lidar import lidar_points_level
from ogmkit.raster.seen import seen_masks
from ogmkit.raster.vehicles import select, vehicle_mask
from ogmkit.target_settings import TargetSettings
from ogmkit.trajectories import Trajectory, trajectory
from ogmkit.typing import Float32Array, UInt8Array

_MAX_IMAGE_BYTES = 1 << 26


@dataclass(frozen=True, eq=False)
class FrameTargets:
    """All that is computed or read for one frame; what else a shard holds is in the `FrameRecord`.

    Attributes:
        drivable: (rows, columns) uint8, 1 on the drivable area; None where the settings leave it out.
        vehicles: (rows, columns) uint8, 1 on a selected box.
        field_of_view: (rows, columns) uint8, 1 where the camera sees the flat ground.
        trajectory: past and future of the ego.
        image: the bytes of the original file (JPEG or PNG), None unless the settings keep them.
        lidar_points: (P, 4) float32 x, y, z (metres, level frame) and intensity, None unless asked for.
        further: rasters beside the paper's, by their names in shards, such as `layers/lane`.
        seen: `rays` and `lidar`, as far as they are asked for → (rows, columns) uint8, 1 where the cell is
            seen; all within the field of view.
    """

    drivable: UInt8Array | None
    vehicles: UInt8Array
    field_of_view: UInt8Array
    trajectory: Trajectory
    image: bytes | None
    lidar_points: Float32Array | None
    further: Rasters = field(default_factory=dict)
    seen: Mapping[str, UInt8Array] = field(default_factory=dict)


def frame_targets(
    frame: FrameRecord, settings: TargetSettings | None = None, *, cache_dir: Path | None = None
) -> FrameTargets:
    """Make a frame's targets; its map's mask is decoded once per machine and then only opened.

    Of a frame by itself, instances are numbered in the order of its vehicles. Nothing is known of the frames
    after it: flow is NaN, and no future is valid.

    Args:
        frame: the frame.
        settings: what targets to make; the defaults by default.
        cache_dir: folder of decoded map masks; the platform's cache folder by default.

    Raises:
        DataFileError: the map's mask or expansion, the image or the LiDAR sweep is absent or damaged.
        TableError: a file name leaves the dataset's root.
        OutputError: the cache folder can't be written.
    """
    chosen = settings or TargetSettings()
    map_mask = None
    if not chosen.no_map:
        map_mask = MaskStore(cache_dir).open(resolve(frame.dataroot, frame.map_path))
    return build_targets(frame, chosen, map_mask, Around(layers_of(frame, chosen)))


def layers_of(frame: FrameRecord, settings: TargetSettings) -> LayerMap:
    """The layers of a frame's map that the settings name.

    Raises:
        DataFileError: the map's expansion is absent or damaged.
    """
    if not settings.layers:
        return {}
    return open_layers(frame.dataroot, frame.location, settings.layers, settings.line_m)


def build_targets(
    frame: FrameRecord, settings: TargetSettings, map_mask: MapMask | None, around: Around = NOTHING
) -> FrameTargets:
    """Make a frame's targets.

    Args:
        frame: the frame.
        settings: what targets to make.
        map_mask: the map's; None leaves the drivable area out.
        around: what further rasters need.

    Raises:
        DataFileError: the image or LiDAR sweep is absent or damaged.
        TableError: a file name leaves the dataset's root.
    """
    grid, level_from_global = settings.grid, frame.level_from_global
    image = None if settings.images == "none" else read_image(frame)
    points = lidar_points_level(frame) if settings.lidar_source else None
    view = field_of_view_mask(grid, frame.intrinsics, frame.level_from_camera, frame.image_size)
    shown = select(frame.boxes, *settings.labels)
    return FrameTargets(
        drivable=None if map_mask is None else drivable_mask(grid, level_from_global, map_mask),
        vehicles=vehicle_mask(grid, level_from_global, shown),
        field_of_view=view,
        trajectory=trajectory(frame, settings.gap_s, step_s=settings.step_s),
        image=image if settings.images == "bytes" else None,
        further=further_targets(level_from_global, frame.boxes, settings, around),
        lidar_points=points if settings.lidar else None,
        seen=seen_masks(frame, grid, view, settings.seen, points),
    )


def read_image(frame: FrameRecord) -> bytes:
    """The frame's image as its file holds it, once that has proved whole and of the table's size.

    Raises:
        FrameFileError: the file is absent, not a whole JPEG or PNG, or of another size.
        DataFileError: the system refuses to read it.
        TableError: the file's name leaves the dataset's root.
    """
    path = resolve(frame.dataroot, frame.image_path)
    try:
        data = read_bytes(path, _MAX_IMAGE_BYTES)
        size = image_size(data)
    except OSError as error:
        raise _image_problem(frame, path, f"can't be read ({error.strerror})", fault_of(error)) from error
    except ValueError as error:
        raise _image_problem(frame, path, f"is not a whole JPEG or PNG ({error})", "damaged") from error
    if size != frame.image_size:
        found, expected = (f"{width} × {height}" for height, width in (size, frame.image_size))
        raise _image_problem(frame, path, f"is {found} pixels, by its table {expected}", "of another size")
    return data


def _image_problem(frame: FrameRecord, path: Path, what: str, state: str) -> DataFileError:
    fault = DataFileError if state == "unreadable" else FrameFileError
    return fault(
        f"{path}: image of sample_data {frame.sample_data_token} {what}; restore it, or leave out such "
        "scenes (--only-complete), such frames (--skip-bad-frames) or all images: --images none",
        kind=f"image is {state}",
    )

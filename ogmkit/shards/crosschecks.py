"""Whether what a shard says in one place agrees with what it says in another."""

from collections.abc import Callable, Iterator
from itertools import chain, pairwise, repeat

import numpy as np

from ogmkit.base.images import image_size
from ogmkit.base.steps import STEPS
from ogmkit.geometry.se3 import level_from_global, transform_points
from ogmkit.raster.field_of_view import field_of_view_mask
from ogmkit.raster.vehicles import select, vehicle_mask
from ogmkit.shards.fields import LEFT_OUT_GROUP
from ogmkit.shards.neighbours import neighbour_rows
from ogmkit.shards.reader import Shard
from ogmkit.typing import BoolArray, FloatArray, UInt8Array

_POSE_TOLERANCE = 1e-6
RASTER_TOLERANCE = 1e-4
"""Share of cells that may differ when a raster is made again: other machines round otherwise."""
_SHARES = {
    "drivable": "drivable_share",
    "vehicles": "vehicle_share",
    "field_of_view": "field_of_view_share",
}
"""Raster → the attribute that says its share of cells."""


@np.errstate(invalid="ignore", over="ignore")  # damaged numbers are findings
def cross_problems(shard: Shard, camera: str) -> tuple[str, ...]:
    """Describe what contradicts itself in one camera's group, whose structure is sound.

    Rasters, images and points are read frame by frame.

    Returns:
        A line for each contradiction, naming the dataset and the first frame.
    """
    checks = (_order, _left_out, _poses, _trajectories, _boxes)
    columns = [line for check in checks for line in check(shard, camera)]
    rasters = _rasters(shard, camera, make_again=not columns)
    found = chain(columns, rasters, _images(shard, camera), _lidar(shard, camera))
    return tuple(f"/{camera}/{problem}" for problem in found)


def _order(shard: Shard, camera: str) -> Iterator[str]:
    steps_us = np.diff(shard.dataset(camera, "timestamp_us")[:])
    yield from first_wrong("timestamp_us goes back after", steps_us <= 0)
    for name in ("sample_token", "sample_data_token"):
        if len(set(shard.strings(camera, name))) != shard.frames(camera):
            yield f"{name} has duplicates"


def _poses(shard: Shard, camera: str) -> Iterator[str]:
    for name in ("ego_from_camera", "global_from_ego", "level_from_global"):
        yield from first_wrong(f"{name} is not a rigid transform in", ~rigid(shard.dataset(camera, name)[:]))
    expected = level_from_global(shard.dataset(camera, "global_from_ego")[:])
    found = shard.dataset(camera, "level_from_global")[:]
    wrong = ~np.isclose(found, expected, rtol=1e-9, atol=_POSE_TOLERANCE).all(axis=(1, 2))
    yield from first_wrong("level_from_global contradicts global_from_ego in", wrong)
    intrinsics = shard.dataset(camera, "intrinsics")[:]
    wrong = ~np.isfinite(intrinsics).all(axis=(1, 2)) | ~(np.abs(np.linalg.det(intrinsics)) > 0)
    yield from first_wrong("intrinsics are singular in", wrong)


def _trajectories(shard: Shard, camera: str) -> Iterator[str]:
    positions_global = shard.dataset(camera, "global_from_ego")[:, :3, 3]
    all_valid = np.ones(shard.frames(camera), dtype=np.bool_)
    steps = {"past": range(-STEPS, 0), "future": range(1, STEPS + 1)}
    for name, offsets in steps.items():
        points = shard.dataset(camera, f"trajectory/{name}")[:]
        valid = shard.dataset(camera, f"trajectory/{name}_valid")[:]
        all_valid &= valid.all(axis=1)
        wrong = (np.isfinite(points).all(axis=2) != valid) | (np.isnan(points).all(axis=2) == valid)
        yield from first_wrong(f"trajectory/{name} contradicts {name}_valid in", wrong.any(axis=1))
        expected, comparable = _neighbours(shard, camera, positions_global, offsets)
        same = (np.abs(points - expected) <= _POSE_TOLERANCE).all(axis=2)
        wrong = (valid & comparable & ~same).any(axis=1)
        yield from first_wrong(f"trajectory/{name} contradicts the poses around", wrong)
    stored = shard.dataset(camera, "trajectory/valid")[:]
    yield from first_wrong("trajectory/valid contradicts past_valid and future_valid in", stored != all_valid)
    if stored.sum() != shard.attributes(camera)["valid_trajectories"]:
        yield f"trajectory/valid counts {stored.sum()} frames, not as attribute valid_trajectories says"


def _boxes(shard: Shard, camera: str) -> Iterator[str]:
    count = len(shard.dataset(camera, "boxes/annotation_token"))
    yield from _offsets(shard, camera, "boxes", count)
    if len(set(shard.strings(camera, "boxes/annotation_token"))) != count:
        yield "boxes/annotation_token has duplicates"
    sound = rigid(shard.dataset(camera, "boxes/global_from_box")[:])
    yield from first_wrong("boxes/global_from_box is not a rigid transform in", ~sound, "box")
    positive = (shard.dataset(camera, "boxes/size_wlh")[:] > 0).all(axis=1)
    yield from first_wrong("boxes/size_wlh is not positive in", ~positive, "box")
    yield from first_wrong(
        "boxes/visibility is over 4 in", shard.dataset(camera, "boxes/visibility")[:] > 4, "box"
    )
    empty = np.array([not name for name in shard.strings(camera, "boxes/category")], dtype=np.bool_)
    yield from first_wrong("boxes/category is empty in", empty, "box")


def _rasters(shard: Shard, camera: str, *, make_again: bool) -> Iterator[str]:
    attributes = shard.attributes(camera)
    makers: dict[str, Callable[[Shard, str], Iterator[UInt8Array]] | None] = {
        "drivable": None,
        "vehicles": _vehicles,
        "field_of_view": _fields_of_view,
    }
    for name, make in makers.items():
        if name == "drivable" and shard.settings.targets.no_map:
            continue
        dataset, frames, ones = shard.dataset(camera, name), shard.frames(camera), 0
        binary, same = np.ones((2, frames), dtype=np.bool_)
        again = make(shard, camera) if make is not None and make_again else repeat(None, frames)
        for frame, made in enumerate(again):
            mask = dataset[frame]
            binary[frame] = mask.max() <= 1
            ones += int(np.count_nonzero(mask))
            if made is not None:
                same[frame] = np.count_nonzero(mask != made) <= RASTER_TOLERANCE * mask.size
        yield from first_wrong(f"{name} holds other values than 0 and 1 in", ~binary)
        yield from first_wrong(f"{name} contradicts boxes, poses or calibration in", ~same)
        share = _SHARES[name]
        stated = attributes.get(share)  # field_of_view_share is absent from earlier shards
        if stated is not None and not np.isclose(ones / dataset.size, stated, rtol=1e-9):
            yield f"{name} covers {ones / dataset.size:.6f} of its cells, not as attribute {share} says"


def _vehicles(shard: Shard, camera: str) -> Iterator[UInt8Array]:
    settings, poses = shard.settings.targets, shard.dataset(camera, "level_from_global")[:]
    for to_level, boxes in zip(poses, shard.boxes_by_frame(camera), strict=True):
        yield vehicle_mask(settings.grid, to_level, select(boxes, *settings.labels))


def _fields_of_view(shard: Shard, camera: str) -> Iterator[UInt8Array]:
    names = ("level_from_global", "global_from_ego", "ego_from_camera", "intrinsics", "image_size")
    for to_level, to_global, to_ego, intrinsics, size in zip(
        *(shard.dataset(camera, name)[:] for name in names), strict=True
    ):
        height, width = size.tolist()
        yield field_of_view_mask(shard.grid, intrinsics, to_level @ to_global @ to_ego, (height, width))


def _images(shard: Shard, camera: str) -> Iterator[str]:
    for frame, size in enumerate(shard.dataset(camera, "image_size")[:].tolist()):
        image = shard.image(camera, frame)
        try:
            if image is not None and image_size(image.tobytes()) != tuple(size):
                yield f"image contradicts image_size in frame {frame}"
        except ValueError as error:
            yield f"image is not a whole JPEG or PNG in frame {frame} ({error})"


def _lidar(shard: Shard, camera: str) -> Iterator[str]:
    if not shard.settings.targets.lidar:
        return
    points = shard.dataset(camera, "lidar/points")
    yield from _offsets(shard, camera, "lidar", len(points))
    bounds = shard.dataset(camera, "lidar/offsets")[:].tolist()
    finite = [bool(np.isfinite(points[a:b]).all()) for a, b in pairwise(bounds)]
    yield from first_wrong("lidar/points are not finite in", ~np.array(finite, dtype=np.bool_))


def _offsets(shard: Shard, camera: str, group: str, rows: int) -> Iterator[str]:
    offsets = shard.dataset(camera, f"{group}/offsets")[:]
    if offsets[0] != 0 or offsets[-1] != rows or (np.diff(offsets) < 0).any():
        yield f"{group}/offsets do not rise from 0 to {rows}"


def _neighbours(
    shard: Shard, camera: str, positions_global: FloatArray, steps: range
) -> tuple[FloatArray, BoolArray]:
    """(N, 6, 2) positions of the frames some steps away, in each frame's level frame; NaN without one.

    And (N, 6) whether that can be said: of a frame that is left out, the shard has no pose.
    """
    rows, left_out = neighbour_rows(shard, camera, steps)
    around = np.where((rows >= 0)[..., None], positions_global[rows], np.nan)
    found = transform_points(shard.dataset(camera, "level_from_global")[:], around)[..., :2]
    return found, ~left_out


def _left_out(shard: Shard, camera: str) -> Iterator[str]:
    count = shard.left_out(camera)
    if not count:
        return
    said = shard.attributes(camera)["frames_left_out"]
    if said != count:
        yield f"{LEFT_OUT_GROUP} lists {count} frames, not {said} as attribute frames_left_out says"
    tokens = [
        *shard.strings(camera, "sample_data_token"),
        *shard.strings(camera, f"{LEFT_OUT_GROUP}/sample_data_token"),
    ]
    if len(set(tokens)) != len(tokens):
        yield f"{LEFT_OUT_GROUP}/sample_data_token has duplicates, or names frames that are here"
    steps_us = np.diff(shard.dataset(camera, f"{LEFT_OUT_GROUP}/timestamp_us")[:])
    yield from first_wrong(f"{LEFT_OUT_GROUP}/timestamp_us goes back after", steps_us <= 0)


def rigid(matrices: FloatArray) -> BoolArray:
    """(...) bool: whether (..., 4, 4) transforms are finite, orthonormal, right-handed and affine."""
    rotation = matrices[..., :3, :3]
    products = rotation @ np.swapaxes(rotation, -1, -2)
    with np.errstate(invalid="ignore"):
        orthonormal = (np.abs(products - np.eye(3)) <= _POSE_TOLERANCE).all(axis=(-1, -2))
        right_handed = np.linalg.det(np.where(np.isfinite(rotation), rotation, 0.0)) > 0
    affine = (matrices[..., 3, :] == [0, 0, 0, 1]).all(axis=-1)
    result: BoolArray = orthonormal & right_handed & affine & np.isfinite(matrices).all(axis=(-1, -2))
    return result


def first_wrong(problem: str, wrong: BoolArray, of: str = "frame") -> Iterator[str]:
    """One line for all rows where something is wrong, if there are any.

    Args:
        problem: what is wrong, up to the place.
        wrong: (R,) where.
        of: what a row is.
    """
    rows = np.flatnonzero(wrong)
    if len(rows):
        yield f"{problem} {of} {rows[0]}" + (f" and {len(rows) - 1} more" if len(rows) > 1 else "")

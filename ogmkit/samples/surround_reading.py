"""Reading a key frame's images, calibration and labels round the vehicle from a shard."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ogmkit.frames import KeyFrame
from ogmkit.geometry.camera import image_from_ground, image_from_resized
from ogmkit.labels.centres import centres_of
from ogmkit.labels.definition import Definition
from ogmkit.labels.plane import plane_of
from ogmkit.nuscenes.records import no_boxes
from ogmkit.samples.reading import Rows, read_pixels
from ogmkit.samples.spec import SampleSpec
from ogmkit.samples.surround import SurroundIndex
from ogmkit.samples.surround_spec import SurroundSpec
from ogmkit.shards.reader import Shard
from ogmkit.shards.schema_labels import LABELS, SURROUND
from ogmkit.typing import BoolArray, Float32Array, FloatArray, UInt8Array


@dataclass(frozen=True, eq=False)
class SurroundArrays:
    """One key frame of C cameras, with K classes of labels.

    Attributes:
        image: (C, h, w, 3) uint8 RGB, resized and cropped.
        intrinsics: (C, 3, 3) float64 of the image files.
        cropped_from_image: (C, 3, 3) float64 from pixels of the files to those of `image`.
        reference_from_camera: (C, 4, 4) float64 into the definition's plane and the height over it.
        labels: (K, rows, columns) uint8 0/1.
        visibility: (rows, columns) uint8, of boxes: level of the one drawn last, 255 for none.
        nearness: (rows, columns) float32, of boxes: exp(−d²), d cells from the centre, 0 without one.
        seen: (rows, columns) bool: whether an image shows the cell's centre, by calibration on flat ground.
    """

    image: UInt8Array
    intrinsics: FloatArray
    cropped_from_image: FloatArray
    reference_from_camera: FloatArray
    labels: UInt8Array
    visibility: UInt8Array
    nearness: Float32Array
    seen: BoolArray

    @property
    def cropped_intrinsics(self) -> FloatArray:
        """(C, 3, 3) float64 of `image`."""
        result: FloatArray = self.cropped_from_image @ self.intrinsics
        return result


def read_surround(shard: Shard, index: SurroundIndex, i: int, spec: SurroundSpec) -> SurroundArrays:
    """Read a sample.

    Args:
        shard: its shard, open.
        index: which samples there are.
        i: its place in the index.
        spec: what it holds.

    Raises:
        ShardError: the shard is damaged.
        DataFileError: an image is absent, damaged or of another size than its record.
    """
    row, definition = int(index.row[i]), index.definition
    cameras = [
        Rows(shard, camera, (frame,))
        for camera, frame in zip(index.cameras, index.frames[i].tolist(), strict=True)
    ]
    key_frame = key_frame_of(shard, row)
    boxes = shard.boxes(cameras[0].camera, cameras[0].rows[0])
    plane = plane_of(definition.frame, key_frame)
    reference_from_global = plane.in_space(key_frame.global_from_ego[:3, 3])
    global_from_camera = _each(cameras, "global_from_ego") @ _each(cameras, "ego_from_camera")
    intrinsics, cropped = _each(cameras, "intrinsics"), np.stack([_cropped(one, spec) for one in cameras])
    reference_from_camera: FloatArray = reference_from_global @ global_from_camera
    visibility, nearness = centres_of(boxes, definition, plane)
    return SurroundArrays(
        image=np.stack([_image(one, spec, index.image_root) for one in cameras]),
        intrinsics=intrinsics,
        cropped_from_image=cropped,
        reference_from_camera=reference_from_camera,
        labels=_labels(shard, definition, spec.classes or definition.class_names, row),
        visibility=visibility,
        nearness=nearness,
        seen=seen_cells(definition, cropped @ intrinsics, reference_from_camera, spec.image_size),
    )


def seen_cells(
    definition: Definition,
    intrinsics: FloatArray,
    reference_from_camera: FloatArray,
    image_size: tuple[int, int],
) -> BoolArray:
    """Mark the cells whose centre, on the plane at height 0, an image shows; it reaches half a pixel beyond.

    Args:
        definition: whose cells.
        intrinsics: (C, 3, 3).
        reference_from_camera: (C, 4, 4).
        image_size: (height, width) of all images.

    Returns:
        (rows, columns) bool.
    """
    rows, columns = definition.grid.rows, definition.grid.columns
    seen = np.zeros(definition.grid.shape, dtype=np.bool_)
    for matrix, pose in zip(intrinsics, reference_from_camera, strict=True):
        along = image_from_ground(matrix, pose)
        down, across = along[:, "xy".index(rows.coordinate)], along[:, "xy".index(columns.coordinate)]
        u, v, depth = (
            (down[:, None] * rows.centres_m)[:, :, None]
            + (across[:, None] * columns.centres_m)[:, None, :]
            + along[:, 2, None, None]
        )
        inside = (u >= -depth / 2) & (u < (image_size[1] - 0.5) * depth)
        seen |= inside & (v >= -depth / 2) & (v < (image_size[0] - 0.5) * depth)
    return seen


def key_frame_of(shard: Shard, row: int) -> KeyFrame:
    """A sample as far as planes hang on it: its poses, without boxes and files.

    Args:
        shard: an open shard.
        row: the sample's place among those of the labels round the vehicle.

    Raises:
        ShardError: the shard is damaged or of an earlier version.
    """
    pose, mounting = (shard.dataset(SURROUND, name)[row] for name in ("global_from_ego", "ego_from_lidar"))
    token = shard.strings(SURROUND, "sample_token", slice(row, row + 1))[0]
    return KeyFrame(shard.path.parent, shard.location, token, pose, mounting, "", no_boxes())


def _each(cameras: list[Rows], name: str) -> FloatArray:
    """(C, …) rows of a dataset."""
    return np.concatenate([one.column(name) for one in cameras])


def _cropped(frame: Rows, spec: SurroundSpec) -> FloatArray:
    """(3, 3) pixels of the cropped image from those of the file."""
    height, width = frame.column("image_size")[0].tolist()
    image_from_cropped = image_from_resized((height, width), spec.resized)
    image_from_cropped[1, 2] += spec.crop_top * image_from_cropped[1, 1]
    return np.asarray(np.linalg.inv(image_from_cropped), dtype=np.float64)


def _image(frame: Rows, spec: SurroundSpec, image_root: Path | None) -> UInt8Array:
    pixels = read_pixels(frame, SampleSpec(image_size=spec.resized), image_root)
    return pixels["image"][0, spec.crop_top :]


def _labels(shard: Shard, definition: Definition, classes: tuple[str, ...], row: int) -> UInt8Array:
    group = f"{LABELS}/{definition.name}"
    return np.stack([shard.dataset(SURROUND, f"{group}/{name}")[row] for name in classes])

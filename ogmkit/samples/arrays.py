"""What is read for a sample, before it becomes tensors: the form that augmentation works on."""

from dataclasses import dataclass

from ogmkit.typing import BoolArray, Float32Array, FloatArray, IntArray, UInt8Array


@dataclass(frozen=True, eq=False)
class SampleArrays:
    """T consecutive frames of one camera; parts that are not asked for are None.

    Attributes:
        image_size: (T, 2) int64 height and width that images have, or would have, after resizing.
        image: (T, h, w, 3) uint8 RGB.
        masks: (T, 2, h, w) uint8 0/1 drivable and vehicles, at the images' pixels.
        known_pixels: (T, h, w) uint8 0/1, whether `masks` are the truth there; None where everywhere.
        bev: (T, K, rows, columns) uint8 0/1 drivable and vehicles, or what else the specification names, on
            the shard's grid.
        bev_parts: (T, 2, r, c) float32 shares of each part's cells that are 1 in `bev`.
        known_columns: (columns,) bool of that grid: whether `bev` is the truth there.
        bev_from_image: (T, 3, 3) float64 from pixels of the resized image; NaN where invalid.
        homography_valid: (T,) bool.
        intrinsics: (T, 3, 3) float64 of the resized image.
        level_from_camera: (T, 4, 4) float64.
        points_level: T arrays of (P, 4) float32 x, y, z, intensity.
        past: (6, 2) float64 x, y in metres, level frame of the last frame.
        future: (6, 2) float64, as `past`.
        trajectory_valid: () bool.
        positions: (T, 2) float64 of the ego at each image, level frame of the last one.
        features: (T, 2, F) float32 that a network made of the frames, and of their mirror images; (T, 1, F)
            where no frame is mirrored.
        mirrored: whether left and right have changed places.
    """

    image_size: IntArray
    image: UInt8Array | None = None
    masks: UInt8Array | None = None
    known_pixels: UInt8Array | None = None
    bev: UInt8Array | None = None
    bev_parts: Float32Array | None = None
    known_columns: BoolArray | None = None
    bev_from_image: FloatArray | None = None
    homography_valid: BoolArray | None = None
    intrinsics: FloatArray | None = None
    level_from_camera: FloatArray | None = None
    points_level: tuple[Float32Array, ...] | None = None
    past: FloatArray | None = None
    future: FloatArray | None = None
    trajectory_valid: BoolArray | None = None
    positions: FloatArray | None = None
    features: Float32Array | None = None
    mirrored: bool = False


def scaled(bev_from_image: FloatArray) -> FloatArray:
    """Homographies (..., 3, 3) at the shards' scale, |h33| = 1, their sign kept: w > 0 on the ground."""
    result: FloatArray = bev_from_image / abs(bev_from_image[..., 2:, 2:])
    return result

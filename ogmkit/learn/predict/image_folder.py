"""Samples from a folder of images, or of LiDAR sweeps, that is not a shard."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from torch.utils.data import Dataset

from ogmkit.base.files import read_bytes
from ogmkit.base.images import image_size
from ogmkit.errors import DataFileError
from ogmkit.geometry.camera import image_from_resized
from ogmkit.grid import GridSpec
from ogmkit.homography.result import Homography
from ogmkit.learn.data.tensors import Sample, per_frame_tensors
from ogmkit.learn.predict.calibration_file import Calibration
from ogmkit.raster.lidar import moved_points, read_points
from ogmkit.samples.arrays import SampleArrays, scaled
from ogmkit.samples.coarse import coarse_grid
from ogmkit.samples.images import decode_resized
from ogmkit.samples.spec import SampleSpec
from ogmkit.typing import UInt8Array

IMAGES = (".jpg", ".jpeg", ".png")
SWEEPS = (".pcd.bin",)


class ImageFolder(Dataset[Sample]):
    """Single inputs as `FrameDataset` gives single frames of shards, for prediction.

    Args:
        paths: the inputs.
        calibrations: of each; with what the specification asks for.
        cameras: channels that samples number; those of the calibrations are among them.
        grid: the run's.
        spec: what samples hold.
        homographies: of each, where the specification asks for them.
    """

    def __init__(
        self,
        paths: Sequence[Path],
        calibrations: Sequence[Calibration],
        cameras: tuple[str, ...],
        grid: GridSpec,
        spec: SampleSpec,
        homographies: Sequence[Homography] = (),
    ) -> None:
        self._paths = tuple(paths)
        self._calibrations = tuple(calibrations)
        self._places = [cameras.index(known.camera or "") for known in calibrations]
        self._spec = spec
        self._homographies = tuple(homographies)
        self._own_grid: GridSpec | None = None
        self._factor = 1
        if spec.bev_cell_m is not None:
            self._own_grid, self._factor = coarse_grid(grid, spec.bev_cell_m)

    def __len__(self) -> int:
        return len(self._paths)

    def __getitem__(self, key: tuple[int, int]) -> Sample:
        """Read a sample.

        Args:
            key: its place, and a seed that is of no account.

        Raises:
            DataFileError: the input is absent, damaged, or of another size than its calibration's.
        """
        i, _ = key
        sample = per_frame_tensors(self._arrays(i), self._own_grid, self._factor)
        place = {"camera": torch.tensor(self._places[i]), "index": torch.tensor(i)}
        return {name: frames[0] for name, frames in sample.items()} | place

    def _arrays(self, i: int) -> SampleArrays:
        path, known, spec = self._paths[i], self._calibrations[i], self._spec
        if spec.lidar and known.level_from_lidar is not None:
            points = moved_points(known.level_from_lidar, read_points(path, "replace it"))
            return SampleArrays(np.zeros((1, 2), np.int64), points_level=(points,))
        if spec.image_size is None:
            return SampleArrays(np.zeros((1, 2), np.int64))
        homographies = self._homographies[i : i + 1] if spec.homography is not None else ()
        arrays = image_arrays((path,), (known,), spec.image_size, homographies)
        if spec.calibration and known.intrinsics is not None and known.level_from_camera is not None:
            image_from_pixels = image_from_resized(known.image_size, spec.image_size)
            intrinsics = np.linalg.inv(image_from_pixels) @ known.intrinsics
            pose = known.level_from_camera[None]
            return replace(arrays, intrinsics=intrinsics[None], level_from_camera=pose)
        return arrays


class PlainImages(Dataset[Sample]):
    """Images of any size, resized, and nothing else.

    Args:
        paths: the files.
        size: (height, width) of the results.
    """

    def __init__(self, paths: Sequence[Path], size: tuple[int, int]) -> None:
        self._paths = tuple(paths)
        self._size = size

    def __len__(self) -> int:
        return len(self._paths)

    def __getitem__(self, key: tuple[int, int]) -> Sample:
        """Read an image as `image`, (3, h, w) uint8.

        Args:
            key: its place, and a seed that is of no account.

        Raises:
            DataFileError: it is absent or damaged.
        """
        image = read_image(self._paths[key[0]], None, self._size)
        arrays = SampleArrays(np.array([self._size]), image[None])
        return {name: frames[0] for name, frames in per_frame_tensors(arrays, None, 1).items()}


def image_arrays(
    paths: Sequence[Path],
    calibrations: Sequence[Calibration],
    size: tuple[int, int],
    homographies: Sequence[Homography] = (),
) -> SampleArrays:
    """Read images, and move their homographies to the resized images' pixels.

    Args:
        paths: T files.
        calibrations: T, of each.
        size: (height, width) of the results.
        homographies: T, or none.

    Raises:
        DataFileError: an image is absent, damaged, or of another size than its calibration's.
    """
    images = [read_image(path, one.image_size, size) for path, one in zip(paths, calibrations, strict=True)]
    arrays = SampleArrays(np.tile(size, (len(images), 1)), np.stack(images))
    if not homographies:
        return arrays
    matrices = [
        scaled(found.bev_from_image @ image_from_resized(known.image_size, size))
        for found, known in zip(homographies, calibrations, strict=True)
    ]
    valid = np.array([found.valid for found in homographies])
    return replace(arrays, bev_from_image=np.stack(matrices), homography_valid=valid)


def inputs_in(folder: Path, endings: tuple[str, ...]) -> tuple[Path, ...]:
    """The files of a folder that end so, by name.

    Raises:
        DataFileError: there is none, or two differ in their endings only.
    """
    try:
        found = sorted(path for path in folder.iterdir() if path.name.lower().endswith(endings))
    except OSError as error:
        raise DataFileError(f"{folder}: can't be read ({error.strerror}); choose another folder") from error
    if not found:
        shown = ", ".join(f"*{ending}" for ending in endings)
        raise DataFileError(f"{folder}: holds no {shown}; choose another folder")
    stems: dict[str, Path] = {}
    for path in found:
        other = stems.setdefault(stem(path), path)
        if other is not path:
            raise DataFileError(f"{path}: differs from {other.name} in its ending only; rename one")
    return tuple(found)


def stem(path: Path) -> str:
    """An input's name without its ending."""
    name = path.name
    ending = next(ending for ending in (*IMAGES, *SWEEPS) if name.lower().endswith(ending))
    return name[: -len(ending)]


def read_image(path: Path, source_size: tuple[int, int] | None, size: tuple[int, int]) -> UInt8Array:
    """Read a JPEG or PNG and resize it, corners on corners.

    Args:
        path: the file.
        source_size: (height, width) that it must have; None for any.
        size: (height, width) of the result.

    Returns:
        (h, w, 3) uint8 RGB.

    Raises:
        DataFileError: it is absent, damaged or of another size.
    """
    try:
        data = read_bytes(path)
    except OSError as error:
        raise DataFileError(f"{path}: image can't be read ({error.strerror})") from error
    try:
        found = image_size(data)
    except ValueError as error:
        raise DataFileError(f"{path}: not a whole JPEG or PNG ({error}); replace it") from error
    if source_size is not None and found != source_size:
        raise DataFileError(
            f"{path}: has {found[1]} × {found[0]} pixels, by its calibration {source_size[1]} × "
            f"{source_size[0]}; correct image_size"
        )
    return decode_resized(np.frombuffer(data, np.uint8), found, size, str(path))

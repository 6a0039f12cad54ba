"""Frame samples: one image with what is known of it, as tensors."""

from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor
from torch.utils.data import Dataset

from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.frame_features import FrameFeatures
from ogmkit.learn.data.reader import SampleReader
from ogmkit.learn.data.tensors import Sample, as_float, per_frame_tensors, trajectory_tensors
from ogmkit.samples.arrays import SampleArrays
from ogmkit.samples.coarse import coarse_grid
from ogmkit.samples.index import FrameIndex
from ogmkit.samples.pooling import equal_parts
from ogmkit.samples.spec import SampleSpec


class FrameDataset(Dataset[Sample]):
    """Single frames of shards.

    Samples of trajectories and `bev_parts` alone stay in memory once they are read, up to 1 GiB a process.

    A sample is a dictionary; it holds what the specification asks for:

    - `image`: (3, h, w) float32 RGB, 0 … 1.
    - `masks`: (2, h, w) float32 0/1, drivable and vehicles in camera view, at the image's pixels.
    - `masks_known`: (h, w) float32 0/1, beside masks whose camera was turned: 0 beyond the image's edge.
    - `bev`: (K, R, C) float32 0/1, the specification's rasters (drivable and vehicles unless it names others)
      on the own grid, by majority of the shard's cells.
    - `bev_parts`: (2, r, c) float32 0 … 1, shares of drivable and vehicle cells in equal parts of the shard's
      grid; 0 where a flip brought in cells from outside.
    - `bev_known`: (R, C) float32 0/1, 0 where a flip brought in cells from outside the grid.
    - `bev_from_image`: (3, 3) float64 from pixels of `image` to cells of the shard's grid, w > 0 on ground,
      |h33| = 1; NaN where `homography_valid`, () bool, is False.
    - `intrinsics`: (3, 3) float64 of `image`; `level_from_camera`: (4, 4) float64.
    - `lidar`: (3, R, C) float32 on the own grid (see `ogmkit.samples.lidar_image`).
    - `past`, `future`: (6, 2) float32 metres, level frame; NaN where missing; `trajectory_valid`: () bool.
    - `features`: (F,) float32, in place of all else of the frame, once `keep_features` was called.
    - `camera`: () int64 place among `cameras`; `index`: () int64 place in the dataset; `mirrored`: () bool,
      whether left and right have changed places; these always.

    Args:
        index: which frames.
        spec: what samples hold.
        augment: what is done to samples that are asked for with a seed.
        compact: leave levels and masks as bytes, for `as_float` to convert where the network is.

    Attributes:
        index: see above.
        cameras: channels.
        grid: the shards'.
        step_s: the shards' too.
        own_grid: of BEV truth and LiDAR images; None where neither is asked for.

    Raises:
        SettingsError: the specification contradicts itself or the grid, or a flip does.
    """

    def __init__(
        self,
        index: FrameIndex,
        spec: SampleSpec,
        *,
        augment: Augmentation | None = None,
        compact: bool = False,
    ) -> None:
        if spec.masks is not None and spec.image_size is None:
            raise SettingsError("sample: masks come at the image's pixels, so they need an image size")
        if (spec.bev or spec.lidar) and spec.bev_cell_m is None:
            raise SettingsError("sample: BEV truth and LiDAR images need the side of a BEV cell")
        if spec.bev_parts is not None and not equal_parts(index.grid, spec.bev_parts):
            raise SettingsError(
                f"sample: {spec.bev_parts[0]} × {spec.bev_parts[1]} parts don't divide the grid of "
                f"{index.grid.rows} × {index.grid.columns} cells on both sides of the ego"
            )
        if augment is not None:
            augment.require_grid(index.grid)
        self.cameras = index.cameras
        self.grid = index.grid
        self.step_s = index.step_s
        self.own_grid, self._factor = _own_grid(index.grid, spec)
        self.index = index
        self._spec = spec
        self._augment = augment
        self._compact = compact
        calibrated = replace(spec, calibration=spec.calibration or (augment is not None and augment.turns))
        self._reader = SampleReader(index, calibrated)

    def __len__(self) -> int:
        return len(self.index)

    def __getitem__(self, key: int | tuple[int, int]) -> Sample:
        """Read a sample.

        Args:
            key: its place; or its place and the seed of its augmentation.

        Raises:
            ShardError: the shard is damaged.
            DataFileError: an image is absent or damaged.
        """
        i, seed = (key, None) if isinstance(key, int) else key
        arrays = self._reader.read(i)
        if self._augment is not None and seed is not None:
            arrays = self._augment.apply(arrays, self.grid, seed)
        return self._sample(i, arrays)

    def whole(self, i: int) -> Sample:
        """A sample without augmentation, with its images even where features are kept of them.

        Raises:
            ShardError, DataFileError: as for any sample.
        """
        return self._sample(i, self._reader.read_whole(i))

    def keep_features(self, features: FrameFeatures) -> None:
        """From now on, samples hold trajectories and these features, and no more of their frames."""
        self._reader.keep_features(features)

    def keep_pixels(self, path: Path) -> None:
        """Keep decoded, resized images and masks in a file, which is made, and is the caller's to remove.

        Raises:
            OutputError: the disk is too full, or can't be written to.
        """
        self._reader.keep_pixels(path)

    def place(self, i: int) -> tuple[str, str, int]:
        """Scene, camera and frame of a sample."""
        return self.index.place(i)

    def name(self, i: int) -> str:
        """What messages call a sample: scene, camera, frame and the sample's token."""
        scene, camera, frame = self.place(i)
        token = replace(self._reader.rows(i), rows=(frame,)).texts("sample_token")[0]
        return f"{scene} {camera} frame {frame} ({token})"

    def source_size(self, i: int) -> tuple[int, int]:
        """(height, width) of a sample's image before it is resized; of a sequence, the last one's."""
        height, width = (int(side) for side in self._reader.rows(i).column("image_size")[-1])
        return height, width

    def _sample(self, i: int, arrays: SampleArrays) -> Sample:
        if not self._spec.calibration:
            arrays = replace(arrays, intrinsics=None, level_from_camera=None)
        tensors = self._tensors(arrays)
        return (tensors if self._compact else as_float(tensors)) | {
            "camera": torch.tensor(int(self.index.camera[i])),
            "index": torch.tensor(i),
            "mirrored": torch.tensor(arrays.mirrored),
        }

    def _tensors(self, arrays: SampleArrays) -> dict[str, Tensor]:
        whole = per_frame_tensors(arrays, self.own_grid, self._factor)
        return {name: frames[0] for name, frames in whole.items()} | trajectory_tensors(arrays)


def _own_grid(grid: GridSpec, spec: SampleSpec) -> tuple[GridSpec | None, int]:
    return (None, 1) if spec.bev_cell_m is None else coarse_grid(grid, spec.bev_cell_m)

"""What a sample holds: systems ask for it, datasets provide it."""

from dataclasses import dataclass

TARGETS = ("drivable", "vehicles")
"""The channels of every mask and prediction, in this order."""


@dataclass(frozen=True)
class SampleSpec:
    """The parts of a sample (a dictionary of tensors, see `ogmkit.learn.data.frames`).

    Attributes:
        image_size: (height, width) that images are resized to; masks, intrinsics and homographies follow.
            None where no image is wanted.
        image: whether the images themselves are wanted, beside what follows their size.
        masks: set of camera-view masks, such as `surface`; None where none is wanted.
        homography: source of `bev_from_image`, such as `network`; None where none is wanted.
        bev_cell_m: side of a cell of the own grid that BEV truth (and LiDAR) come on; None where none is
            wanted.
        calibration: whether `intrinsics` and `level_from_camera` are wanted.
        lidar: whether the LiDAR image is wanted; needs `bev_cell_m`.
        bev: whether the BEV truth is wanted; needs `bev_cell_m`.
        rasters: what it holds: datasets of a camera whose cells are 0 or 1, such as `layers/lane`.
        trajectory: whether past and future are wanted.
        bev_parts: (rows, columns) of equal parts of the shard's grid that BEV truth is averaged over; None
            where that is not wanted.
    """

    image_size: tuple[int, int] | None = None
    masks: str | None = None
    homography: str | None = None
    bev_cell_m: float | None = None
    calibration: bool = False
    lidar: bool = False
    bev: bool = False
    trajectory: bool = False
    image: bool = True
    bev_parts: tuple[int, int] | None = None
    rasters: tuple[str, ...] = TARGETS

    @property
    def sees_bev(self) -> bool:
        """Whether BEV truth is wanted, by cells or averaged."""
        return self.bev or self.bev_parts is not None

    @property
    def is_small(self) -> bool:
        """Whether trajectories and averages over parts are all that is wanted."""
        return self == SampleSpec(trajectory=self.trajectory, bev_parts=self.bev_parts)

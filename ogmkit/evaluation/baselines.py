"""Rows that need no training: what guessing earns, and what no network could do better than."""

from collections.abc import Callable, Iterable, Mapping
from typing import Literal

import numpy as np

from ogmkit.errors import ShardError
from ogmkit.evaluation.frames import Frame, FrameReader, Place
from ogmkit.footprints.settings import FootprintSettings
from ogmkit.footprints.warp import warp_to_bev
from ogmkit.geometry.camera import image_from_resized
from ogmkit.grid import GridSpec
from ogmkit.homography.sources import sources_of
from ogmkit.metrics.iou import DRIVABLE, VEHICLES, code_of, masks_of, thresholded
from ogmkit.pipeline.footprint_masks import Renderer, renderer
from ogmkit.shards.faults import REMEDY
from ogmkit.shards.reader import Shard
from ogmkit.typing import IntArray, UInt8Array

ALL_DRIVABLE, MEAN_MAP, CEILING_FULL_BODY = "all-drivable", "mean-map", "ceiling-full-body"

_Exact = Literal["project", "full-body"]


def ceiling(source: str) -> str:
    """The row of true footprints warped by a source of homographies."""
    return f"ceiling-{source}"


def all_drivable(grid: GridSpec) -> UInt8Array:
    """(rows, columns) code: drivable everywhere, vehicles nowhere."""
    return np.full(grid.shape, DRIVABLE, np.uint8)


def mean_maps(
    reader: FrameReader,
    places: Iterable[Place],
    grid: GridSpec,
    threshold: float,
    tick: Callable[[], None],
) -> Mapping[str, UInt8Array]:
    """Each camera's mean raster, frame by frame, with a threshold.

    Args:
        reader: of the training split.
        places: its frames.
        grid: of all frames.
        threshold: cells are set where over this share of the frames have them set.
        tick: called after every frame.

    Returns:
        Camera → (rows, columns) code.

    Raises:
        ShardError: a shard is absent or damaged.
    """
    sums: dict[str, IntArray] = {}
    counts: dict[str, int] = {}
    for place in places:
        camera, truth = place[1], reader.truth(place)
        both = sums.setdefault(camera, np.zeros((2, *grid.shape), np.int64))
        both += np.stack(masks_of(truth))
        counts[camera] = counts.get(camera, 0) + 1
        tick()
    shares = {camera: (both / counts[camera]).astype(np.float32) for camera, both in sums.items()}
    return {camera: thresholded(both, threshold) for camera, both in shares.items()}


class Ceilings:
    """True masks in camera view, laid on the grid by homographies: what these alone cost.

    The masks are exact: ground faces, or whole bodies, and the drivable area on the ground that `surface`
    stands for.

    Args:
        sources: of homographies, which every frame's shard has; each makes a row of true footprints.
        homography: the source that lays whole bodies on the grid; None leaves that row out.
        scale: image size / mask size.
    """

    def __init__(self, sources: tuple[str, ...], homography: str | None, scale: float) -> None:
        self._sources = sources
        self._homography = homography
        self._scale = scale
        self._renderers: dict[tuple[str, str], Renderer] = {}
        self._shard: Shard | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Of the rows."""
        bodies = () if self._homography is None else (CEILING_FULL_BODY,)
        return (*map(ceiling, self._sources), *bodies)

    def codes(self, frame: Frame) -> Mapping[str, UInt8Array]:
        """Row → (rows, columns) code; empty where the frame has no valid homography.

        Raises:
            ShardError, SettingsError: the shard is damaged, or its images have no common size.
        """
        if not self.names:
            return {}
        footprints = self._masks(frame, "project")
        codes = {ceiling(source): on_grid(frame, footprints, source) for source in self._sources}
        if self._homography is not None:
            codes[CEILING_FULL_BODY] = on_grid(frame, self._masks(frame, "full-body"), self._homography)
        return codes

    def _masks(self, frame: Frame, method: _Exact) -> UInt8Array:
        """(height, width) code of the true masks in camera view."""
        if self._shard is not frame.shard:
            self._shard, self._renderers = frame.shard, {}
        key = frame.camera, method
        if key not in self._renderers:
            settings = FootprintSettings(method=method, scale=self._scale)
            self._renderers[key] = renderer(frame.shard, frame.camera, settings)
        made = self._renderers[key](frame.index)
        if made is None:
            raise ShardError(f"{frame.shard.path}: frame {frame.index} gives no footprints; {REMEDY}")
        return code_of(made.drivable, made.vehicles)


def on_grid(frame: Frame, masks: UInt8Array, homography: str) -> UInt8Array:
    """Lay a code of masks in camera view on the grid by stored homographies.

    Args:
        frame: the frame.
        masks: (height, width) code, of the image at any scale.
        homography: its source's name, or one for the drivable area and one for the vehicles.

    Returns:
        (rows, columns) code; 0 where a homography is invalid.

    Raises:
        ShardError: a homography that is called valid has no inverse.
    """
    by_drivable, by_vehicles = sources_of(homography)
    if by_drivable == by_vehicles:
        return _warped(frame, masks, homography)
    drivable = _warped(frame, masks & np.uint8(DRIVABLE), by_drivable)
    return drivable | _warped(frame, masks & np.uint8(VEHICLES), by_vehicles)


def _warped(frame: Frame, masks: UInt8Array, source: str) -> UInt8Array:
    """(rows, columns) of masks by one source; 0 where it is invalid."""
    place = f"homography/{source}"
    if not frame.shard.dataset(frame.camera, f"{place}/valid")[frame.index]:
        return np.zeros_like(frame.truth)
    bev_from_image = frame.shard.dataset(frame.camera, f"{place}/bev_from_image")[frame.index]
    if not (np.isfinite(bev_from_image).all() and np.linalg.det(bev_from_image)):
        raise ShardError(
            f"{frame.shard.path}: {frame.camera}/{place}: frame {frame.index} is called valid but has no "
            f"inverse; {REMEDY}"
        )
    height, width = frame.shard.dataset(frame.camera, "image_size")[frame.index].tolist()
    bev_from_mask = bev_from_image @ image_from_resized((height, width), masks.shape)
    return warp_to_bev(masks, bev_from_mask, frame.truth.shape)

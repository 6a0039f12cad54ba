"""Sets of camera-view masks: read frame by frame, and laid on the plane again."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ogmkit.errors import ShardError
from ogmkit.footprints.warp import warp_to_bev
from ogmkit.geometry.camera import image_from_resized
from ogmkit.homography.sources import SURFACE, sources_of
from ogmkit.shards import schema
from ogmkit.shards.additions import added_values
from ogmkit.shards.crosschecks_added import origin_problem
from ogmkit.shards.faults import REMEDY
from ogmkit.shards.reader import Shard
from ogmkit.shards.remedies import footprints_command, homography_command
from ogmkit.typing import FloatArray, UInt8Array


@dataclass(frozen=True, eq=False)
class Masks:
    """One frame of a set.

    Attributes:
        drivable: (height, width) uint8 0/1; 0 where the shard was made without maps.
        vehicles: as `drivable`; both are 0 where the frame's masks were not made.
        bev_from_mask: (2, 3, 3) pixels of the drivable area's mask, and of the vehicles', to cells; None
            where that can't be.
        reason: why it can't; else empty.
    """

    drivable: UInt8Array
    vehicles: UInt8Array
    bev_from_mask: FloatArray | None
    reason: str

    def rewarped(self, shape: tuple[int, int]) -> tuple[UInt8Array, UInt8Array] | None:
        """Drivable area and vehicles laid on a grid of (rows, columns); None without a homography."""
        if self.bev_from_mask is None:
            return None
        by_drivable, by_vehicles = self.bev_from_mask
        return warp_to_bev(self.drivable, by_drivable, shape), warp_to_bev(self.vehicles, by_vehicles, shape)


@dataclass(frozen=True, eq=False)
class MaskSet:
    """A set in an open shard, with the homography that takes it to the grid.

    Attributes:
        shard: the open shard.
        camera: channel.
        name: of the set.
        method: how it was made.
        scale: image size / mask size.
        homography: the source, or one for the drivable area and one for the vehicles.
    """

    shard: Shard
    camera: str
    name: str
    method: str
    scale: float
    homography: str

    def read(self, index: int) -> Masks:
        """Read one frame.

        Args:
            index: the frame's place among the camera's.

        Raises:
            ShardError: set or homography lack something, or a valid homography has no inverse.
            OSError: a part of the shard is damaged.
        """
        vehicles = self._row(f"footprints/{self.name}/vehicles", index)
        known = not self.shard.settings.targets.no_map
        drivable = self._row(f"footprints/{self.name}/drivable", index) if known else np.zeros_like(vehicles)
        reason = self._why_not(index)
        if reason:
            return Masks(drivable, vehicles, None, reason)
        bev_from_image = np.stack(
            [
                valid_homography(self.shard, self.camera, source, index)
                for source in sources_of(self.homography)
            ]
        )
        height, width = self._row("image_size", index).tolist()
        bev_from_mask = bev_from_image @ image_from_resized((height, width), drivable.shape)
        return Masks(drivable, vehicles, bev_from_mask, "")

    def _why_not(self, index: int) -> str:
        """Why a frame's masks can't go to the grid; empty if they can."""
        for source in sources_of(self.homography):
            if not self._row(f"homography/{source}/valid", index):
                rows = slice(index, index + 1)
                reason = self.shard.strings(self.camera, f"homography/{source}/reason", rows)[0]
                return f"no valid homography: {reason}"
        if not self._row(f"footprints/{self.name}/valid", index):
            return "no masks, though there is a homography"
        return ""

    def _row(self, name: str, index: int) -> Any:  # noqa: ANN401  # arrays and scalars of several dtypes
        return self.shard.dataset(self.camera, name)[index]


def valid_homography(shard: Shard, camera: str, source: str, index: int) -> FloatArray:
    """(3, 3) homography of a frame that has a valid one.

    Raises:
        ShardError: it has no inverse.
    """
    bev_from_image: FloatArray = shard.dataset(camera, f"homography/{source}/bev_from_image")[index]
    if not (np.isfinite(bev_from_image).all() and np.linalg.det(bev_from_image)):
        raise ShardError(
            f"{shard.path}: {camera}/homography/{source}: frame {index} is called "
            f"valid but has no inverse; {REMEDY}"
        )
    return bev_from_image


def open_sets(shard: Shard, camera: str, names: Sequence[str]) -> tuple[MaskSet, ...]:
    """Find sets in a shard, all to be laid on the grid by the last one's homography.

    Args:
        shard: an open shard.
        camera: channel.
        names: of the sets; the last may have been made without homography, then it is the default one.

    Raises:
        ShardError: a set or the homography is absent, or a set was warped by another; the text names the
            command that makes it.
    """
    found = [_values(shard, camera, name) for name in names]
    homography = found[-1]["homography"] or SURFACE
    known = shard.added(camera, schema.HOMOGRAPHY.name)
    for source in sources_of(homography):
        if source not in known:
            raise ShardError(
                f"{shard.path}: {camera} has no homography {source!r} (it has {', '.join(known) or 'none'}); "
                f"run `{homography_command(shard.path.parent, source)}`"
            )
    for name in names:
        problem = origin_problem(shard, camera, name)
        if problem:
            raise ShardError(f"{shard.path}: {camera}/footprints/{name} {problem}")
    return tuple(
        MaskSet(shard, camera, name, values["method"], values["scale"], homography)
        for name, values in zip(names, found, strict=True)
    )


def _values(shard: Shard, camera: str, name: str) -> dict[str, Any]:
    """A set's attributes."""
    values = added_values(shard, camera, schema.FOOTPRINTS, name)
    if values is None:
        known = ", ".join(shard.added(camera, schema.FOOTPRINTS.name)) or "none"
        raise ShardError(
            f"{shard.path}: {camera} has no footprints {name!r} (it has {known}); "
            f"run `{footprints_command(shard.path.parent, name)}`"
        )
    return values

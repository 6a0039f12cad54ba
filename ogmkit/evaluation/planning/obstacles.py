"""The boxes around a sequence's future, by what a definition of planning scores counts as an obstacle."""

import numpy as np

from ogmkit.errors import ShardError
from ogmkit.frames import Boxes
from ogmkit.geometry.boxes import ground_corners
from ogmkit.metrics.open_loop.definition import Obstacles
from ogmkit.metrics.open_loop.horizons import POINTS
from ogmkit.raster.vehicles import select
from ogmkit.shards.faults import REMEDY
from ogmkit.shards.neighbours import neighbour_rows
from ogmkit.shards.reader import Shard
from ogmkit.typing import FloatArray


class CameraObstacles:
    """The boxes of one camera's frames, each frame's read once.

    Args:
        shard: open.
        camera: channel.

    Raises:
        ShardError: the shard is damaged.
    """

    def __init__(self, shard: Shard, camera: str) -> None:
        self._shard, self._camera = shard, camera
        self._rows, _ = neighbour_rows(shard, camera, range(1, POINTS + 1))
        self._level_from_global = shard.dataset(camera, "level_from_global")[:]
        self._global_from_ego = shard.dataset(camera, "global_from_ego")[:]
        self._boxes: dict[int, Boxes] = {}

    def faces(self, frame: int, obstacles: Obstacles) -> tuple[FloatArray | None, ...]:
        """Ground faces of the obstacles at the six steps after a frame.

        Args:
            frame: the present one.
            obstacles: which boxes count.

        Returns:
            Six arrays of (M, 4, 2) corners, metres, in the level frame of the present; None where the frame
            is left out.

        Raises:
            ShardError: the shard is damaged, or a box has no finite pose or size.
        """
        present = set(self._frame(frame).instance_token) if obstacles.present_only else None
        return tuple(
            self._faces(frame, row, obstacles, present) if row >= 0 else None
            for row in self._rows[frame].tolist()
        )

    def headings(self, frame: int) -> FloatArray:
        """(6,) the ego's at the six steps after a frame, radians, in its level frame; NaN if left out."""
        rows = self._rows[frame]
        ahead = self._global_from_ego[np.maximum(rows, 0), :3, 0] @ self._level_from_global[frame, :3, :3].T
        return np.where(rows >= 0, np.arctan2(ahead[:, 1], ahead[:, 0]), np.nan)

    def _faces(self, frame: int, row: int, obstacles: Obstacles, present: set[str] | None) -> FloatArray:
        chosen = select(
            self._frame(row), obstacles.categories, obstacles.min_visibility, obstacles.min_lidar_points
        )
        if present is not None:
            chosen = chosen.selected(np.array([token in present for token in chosen.instance_token], bool))
        level_from_box = self._level_from_global[frame] @ chosen.global_from_box
        corners: FloatArray = ground_corners(level_from_box, chosen.size_wlh)[..., :2]
        if not np.isfinite(corners).all():
            raise ShardError(
                f"{self._shard.path}: {self._camera}: frame {row} has a box whose pose or size is not "
                f"finite; {REMEDY}"
            )
        return corners

    def _frame(self, row: int) -> Boxes:
        if row not in self._boxes:
            self._boxes[row] = self._shard.boxes(self._camera, row)
        return self._boxes[row]

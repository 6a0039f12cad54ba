"""What lies where plans lead: ground that is not drivable, and vehicles that are there by then."""

from dataclasses import dataclass

import numpy as np
import shapely

from ogmkit.errors import ShardError
from ogmkit.evaluation.faces import vehicle_faces
from ogmkit.evaluation.frames import FrameReader, Place
from ogmkit.evaluation.planning.sequences import Sequences, planned_rows
from ogmkit.evaluation.progress import Tick
from ogmkit.evaluation.scope import paths
from ogmkit.grid import GridSpec
from ogmkit.shards.faults import REMEDY, damaged
from ogmkit.typing import FloatArray, UInt8Array


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Around one sequence's future, in the level frame of its last image.

    Attributes:
        drivable: (rows, columns) uint8 0/1, of the last image; None where shards don't know it.
        faces: of each of the points 1 … 5 the (M, 4, 2) corners, in metres, of the ground faces of vehicles
            in the frame that many steps later; None where that is left out.
    """

    drivable: UInt8Array | None
    faces: tuple[FloatArray | None, ...]


def surrounding_values(sequences: Sequences, points: FloatArray, tick: Tick) -> FloatArray:
    """Whether points leave the drivable area, and whether they lie in a vehicle; one pass for all rows.

    Args:
        sequences: N of them.
        points: (R, N, 5, 2) positions of R rows, metres.
        tick: called after every sequence.

    Returns:
        (2, R, N, 5) in the order of `SURROUNDING_METRICS`: 0 or 1; NaN for off-drivable outside the grid, and
        where shards don't know what is there.

    Raises:
        ShardError: a shard is damaged, or a box has no finite pose.
    """
    index = sequences.index
    values = np.empty((2, *points.shape[:-1]))
    with FrameReader(paths(index)) as reader:
        for number in range(len(index)):
            around = read_surroundings(reader, index.place(number))
            own = points[:, number]
            values[0, :, number] = (
                np.nan if around.drivable is None else off_drivable(own, around.drivable, index.grid)
            )
            values[1, :, number] = in_vehicle(own, around.faces)
            tick()
    return values


def read_surroundings(reader: FrameReader, place: Place) -> Surroundings:
    """Read what is around the future of a sequence that ends at a frame.

    Raises:
        ShardError: the shard is damaged, or a box has no finite pose.
    """
    scene, camera, frame = place
    shard = reader.shard(scene)
    try:
        later = planned_rows(shard, camera)[0][frame].tolist()
        faces = [
            vehicle_faces(shard, camera, index, seen_from=frame) if index >= 0 else None for index in later
        ]
    except (OSError, RuntimeError, ValueError) as error:
        raise damaged(shard.path, error) from error
    for index, corners in zip(later, faces, strict=True):
        if corners is not None and not np.isfinite(corners).all():
            raise ShardError(
                f"{shard.path}: {camera}: frame {index} has a box whose pose or size is not finite; {REMEDY}"
            )
    return Surroundings(shard.drivable(camera, frame), tuple(faces))


def off_drivable(points: FloatArray, drivable: UInt8Array, grid: GridSpec) -> FloatArray:
    """Whether the cells of points are not drivable.

    Args:
        points: (..., 2) metres, level frame.
        drivable: (rows, columns) uint8 0/1.
        grid: its grid.

    Returns:
        (...) 1 where not drivable, 0 where drivable, NaN outside the grid.
    """
    column, row_ = np.moveaxis(np.floor(grid.cells(points) + 0.5), -1, 0)
    inside = (row_ >= 0) & (row_ < grid.rows) & (column >= 0) & (column < grid.columns)
    cells = np.where(inside, row_, 0).astype(np.int64), np.where(inside, column, 0).astype(np.int64)
    return np.where(inside, drivable[cells] == 0, np.nan)


def in_vehicle(points: FloatArray, faces: tuple[FloatArray | None, ...]) -> FloatArray:
    """Whether points lie in vehicles, seen from above.

    Args:
        points: (R, T, 2) metres.
        faces: T arrays of (M, 4, 2) corners in order round each vehicle's ground face, or None.

    Returns:
        (R, T) 1 where point t lies within one of the t-th faces, else 0; NaN where they are None.
    """
    found = np.zeros(points.shape[:-1])
    for step, corners in enumerate(faces):
        if corners is None:
            found[:, step] = np.nan
            continue
        x, y = points[:, step].T
        found[:, step] = shapely.contains_xy(shapely.polygons(corners)[:, None], x, y).any(axis=0)
    return found

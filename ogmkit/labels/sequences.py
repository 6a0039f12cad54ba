"""FIERY's targets of a sequence: ids, centres, offsets, flow and motion of the present and of what follows.

Each frame is in its own ego frame; `in_present` are the ids warped into that of the present, to train on.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from ogmkit.errors import SettingsError
from ogmkit.frames import Boxes, KeyFrame
from ogmkit.labels.boxes import box_corners_canvas, paint_boxes
from ogmkit.labels.definition import Definition
from ogmkit.labels.make import passing
from ogmkit.labels.plane import plane_of
from ogmkit.labels.warp import egomotion, inverted, matrix_of, vector_of, warped
from ogmkit.typing import BoolArray, Float32Array, FloatArray, IntArray

PAST, FUTURE = 2, 4
"""Frames of a sequence before the present, and after it."""
NO_VALUE = 255
"""Of `offset` and `flow`: the cell has none."""
_SIGMA_SQUARED = 9.0

Centres = dict[int, tuple[int, int]]
"""Id → row and column."""


@dataclass(frozen=True, eq=False)
class FierySequence:
    """The targets of one sequence; T = 5 frames, the present first.

    Attributes:
        egomotion: (7, 6) float32, from each of all frames into the next: translation in metres, then angles.
        instance: (T, rows, columns) int64 ids, 0 = none; they run on through all frames.
        in_present: (T, rows, columns) int64 the same, warped into the present's frame.
        centerness: (T, rows, columns) float64, exp(−d²/9) with d cells to the nearest centre.
        offset: (T, 2, rows, columns) int64 rows and columns to the own instance's centre, or 255.
        flow: (T, 2, rows, columns) int64 rows and columns from there to its next centre, or 255.
    """

    egomotion: Float32Array
    instance: IntArray
    in_present: IntArray
    centerness: FloatArray
    offset: IntArray
    flow: IntArray


def fiery_sequence(key_frames: Sequence[KeyFrame], present: int, definition: Definition) -> FierySequence:
    """Make the targets of a sequence.

    Args:
        key_frames: all of a scene, in temporal order.
        present: the row of the present; two frames before it and four after must be there.
        definition: whose boxes and cells, such as `PRESETS["fiery"]`.

    Raises:
        SettingsError: the scene has not all seven frames.
    """
    first, stop = present - PAST, present + FUTURE + 1
    if first < 0 or stop > len(key_frames):
        raise SettingsError(
            f"key frame {present} of {len(key_frames)}: a sequence takes {PAST} before and {FUTURE} after it"
        )
    motions = np.array([_motion(key_frames, row) for row in range(first, stop)])
    instance = _instances(key_frames[first:stop], definition)[PAST:]
    into_present = [matrix_of(motion) for motion in motions[PAST:-1]]
    centres = [_centres(ids) for ids in instance]
    return FierySequence(
        motions,
        instance,
        np.array([_in_present(ids, into_present[:row]) for row, ids in enumerate(instance)]),
        np.array([_centerness(ids.shape, found) for ids, found in zip(instance, centres, strict=True)]),
        np.array([_offset(ids, found) for ids, found in zip(instance, centres, strict=True)]),
        np.array([_flow(instance, centres, row, into_present) for row in range(len(instance))]),
    )


def _motion(key_frames: Sequence[KeyFrame], row: int) -> Float32Array:
    """The vector into the next frame; none of a scene's last."""
    if row + 1 == len(key_frames):
        return np.zeros(6, dtype=np.float32)
    here, following = key_frames[row : row + 2]
    return vector_of(egomotion(here.global_from_ego, following.global_from_ego))


def _instances(key_frames: Sequence[KeyFrame], definition: Definition) -> IntArray:
    """(frames, rows, columns) ids, numbered as objects first appear."""
    numbers: dict[str, int] = {}
    drawn = []
    for key_frame in key_frames:
        boxes = key_frame.boxes.selected(_shown(key_frame.boxes, definition))
        ids = [numbers.setdefault(token, len(numbers) + 1) for token in boxes.instance_token]
        corners = box_corners_canvas(definition, plane_of(definition.frame, key_frame), boxes)
        drawn.append(paint_boxes(definition, corners, ids))
    return np.array(drawn, dtype=np.int64)


def _shown(boxes: Boxes, definition: Definition) -> BoolArray:
    classes = np.array([definition.class_of(name) is not None for name in boxes.category], dtype=np.bool_)
    return classes & passing(boxes, definition)


def _in_present(ids: IntArray, motions: Sequence[Float32Array]) -> IntArray:
    """Ids of a frame some motions after the present, warped back over all of them."""
    if not motions:
        return ids
    return warped(ids, vector_of(reduce(np.matmul, [inverted(motion) for motion in motions])))


def _centres(ids: IntArray) -> Centres:
    """The mean row and column of each id's cells, rounded half to even, in float32."""
    rows, columns = np.nonzero(ids)
    found = ids[rows, columns]
    return {
        int(number): (
            int(np.round(rows[found == number].astype(np.float32).mean())),
            int(np.round(columns[found == number].astype(np.float32).mean())),
        )
        for number in np.unique(found)
    }


def _centerness(shape: tuple[int, ...], centres: Centres) -> FloatArray:
    row, column = np.indices(shape)
    squared = np.full(shape, np.inf)
    for centre_row, centre_column in centres.values():
        squared = np.minimum(squared, (centre_row - row) ** 2 + (centre_column - column) ** 2)
    result: FloatArray = np.exp(-squared / _SIGMA_SQUARED)
    return result


def _offset(ids: IntArray, centres: Centres) -> IntArray:
    result = np.full((2, *ids.shape), NO_VALUE, dtype=np.int64)
    for number, centre in centres.items():
        rows, columns = np.nonzero(ids == number)
        result[:, rows, columns] = np.array(centre)[:, None] - [rows, columns]
    return result


def _flow(
    instance: IntArray, centres: Sequence[Centres], row: int, motions: Sequence[Float32Array]
) -> IntArray:
    """Displacement of the centres, the next frame's ids warped into this one's."""
    result = np.full((2, *instance[row].shape), NO_VALUE, dtype=np.int64)
    if row + 1 == len(instance):
        return result
    following = _centres(_in_present(instance[row + 1], motions[row : row + 1]))
    for number, centre in centres[row].items():
        if number in following:
            result[:, instance[row] == number] = (np.array(following[number]) - centre)[:, None]
    return result

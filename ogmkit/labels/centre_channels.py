"""Where each cell's vehicle has its centre, as cross_view_transformers trains on beside its classes."""

import re

import numpy as np

from ogmkit.frames import KeyFrame
from ogmkit.labels.boxes import box_corners_canvas, paint_boxes
from ogmkit.labels.definition import Definition
from ogmkit.labels.plane import plane_of
from ogmkit.typing import Float32Array, FloatArray

CHANNELS = 8
"""Of `centre_channels`."""


def centre_channels(key_frame: KeyFrame, definition: Definition) -> Float32Array:
    """Of each cell under a vehicle, by the box drawn last.

    Args:
        key_frame: one sample.
        definition: whose cells; its `beside_categories` are the vehicles.

    Returns:
        (rows, columns, 8): 255 under a vehicle; exp(−d²) of the distance d to the box's centre; that centre's
        offset along columns and rows; the front's direction along them; half the box's length and width; all
        in cells, 0 elsewhere.
    """
    boxes = key_frame.boxes
    drawn = np.array(
        [bool(re.search(definition.beside_categories, one)) for one in boxes.category], dtype=np.bool_
    )
    corners = box_corners_canvas(definition, plane_of(definition.frame, key_frame), boxes.selected(drawn))
    owner = paint_boxes(definition, corners, range(1, len(corners) + 1))
    found = np.zeros((*owner.shape, CHANNELS), np.float32)
    rows, columns = np.nonzero(owner)
    cells = np.stack([columns, rows], axis=-1)
    found[rows, columns] = _values(corners[owner[rows, columns] - 1], cells.astype(np.float64))
    return found


def _values(corners: FloatArray, cells: FloatArray) -> FloatArray:
    """(K, 8) of (K, 4, 2) corners, front right first and round the box, and (K, 2) cells under it."""
    centre = corners.mean(axis=1)
    ahead = corners[:, :2].mean(axis=1) - centre
    aside = corners[:, [0, 3]].mean(axis=1) - centre
    offset = centre - cells
    length, width = (np.linalg.norm(half, axis=1, keepdims=True) for half in (ahead, aside))
    score = np.exp(-(offset**2).sum(axis=1, keepdims=True))
    return np.concatenate(
        [np.full_like(score, 255), score, offset, ahead / (length + 1e-6), length, width], axis=1
    )

"""ST-P3's occupancy of a sequence: the present, and six future frames of the objects that were observed."""

from collections.abc import Sequence

import numpy as np

from ogmkit.errors import SettingsError
from ogmkit.frames import KeyFrame
from ogmkit.labels.boxes import box_corners_canvas, paint_boxes
from ogmkit.labels.definition import Definition
from ogmkit.labels.make import passing
from ogmkit.labels.plane import plane_of
from ogmkit.typing import BoolArray, UInt8Array

OBSERVED, FUTURE = 3, 6
"""Frames up to the present, and after it."""


def stp3_sequence(key_frames: Sequence[KeyFrame], present: int, definition: Definition) -> UInt8Array:
    """Draw the present and the future frames, each in its own ego frame.

    In future frames no filter holds; instead, only objects count that passed it in one of the three observed
    frames: one that appears later is not there.

    Args:
        key_frames: all of a scene, in temporal order.
        present: the row of the present; two frames before it and six after must be there.
        definition: whose classes, filters and cells, such as `PRESETS["stp3"]`.

    Returns:
        (7, classes, rows, columns) uint8 0/1, classes as the definition's.

    Raises:
        SettingsError: the scene has not all nine frames.
    """
    first, stop = present - OBSERVED + 1, present + FUTURE + 1
    if first < 0 or stop > len(key_frames):
        raise SettingsError(
            f"key frame {present} of {len(key_frames)}: a sequence takes {OBSERVED - 1} before and {FUTURE} "
            "after it"
        )
    known: set[str] = set()
    for observed in key_frames[first : present + 1]:
        known.update(observed.boxes.selected(_shown(observed, definition)).instance_token)
    now = _drawn(key_frames[present], definition, _shown(key_frames[present], definition))
    later = [
        _drawn(one, definition, np.array([token in known for token in one.boxes.instance_token], np.bool_))
        for one in key_frames[present + 1 : stop]
    ]
    return np.array([now, *later])


def _shown(key_frame: KeyFrame, definition: Definition) -> BoolArray:
    """(M,) boxes of a class that pass the filters."""
    named = [definition.class_of(name) is not None for name in key_frame.boxes.category]
    return np.array(named, dtype=np.bool_) & passing(key_frame.boxes, definition)


def _drawn(key_frame: KeyFrame, definition: Definition, shown: BoolArray) -> UInt8Array:
    """(classes, rows, columns) of some boxes."""
    plane = plane_of(definition.frame, key_frame)
    boxes = key_frame.boxes.selected(shown)
    classes = np.array([definition.class_of(name) or "" for name in boxes.category], dtype=np.str_)
    corners = box_corners_canvas(definition, plane, boxes)
    drawn = [
        paint_boxes(definition, corners[classes == name], [1] * int(np.count_nonzero(classes == name)))
        for name in definition.class_names
    ]
    return np.array(drawn, dtype=np.uint8)

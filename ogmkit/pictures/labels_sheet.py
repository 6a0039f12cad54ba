"""Where labels of several definitions disagree with the exact raster, in one key frame."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ogmkit.drawing.canvas import framed, resize
from ogmkit.drawing.cells import overlap
from ogmkit.drawing.palette import theme
from ogmkit.drawing.png import write_png
from ogmkit.drawing.sheet import Heading, Panel, draw_sheet, draw_tile
from ogmkit.evaluation.label_comparison import frame_masks
from ogmkit.labels.compare import VEHICLES
from ogmkit.labels.definition import Definition
from ogmkit.nuscenes.dataset import Dataset
from ogmkit.typing import UInt8Array

_MEANING = {"both": 3, "only exact": 1, "only label": 2}
_PX_PER_CELL, _SWATCH = 3, 20


def draw_disagreement(
    path: Path,
    dataset: Dataset,
    place: tuple[str, int],
    definitions: Sequence[Definition],
    *,
    lidar: str = "LIDAR_TOP",
    camera: str = "CAM_FRONT",
) -> None:
    """Write a picture: for each definition its class `vehicle`, or its first, over the exact one.

    Args:
        path: the PNG file; what was there is replaced.
        dataset: the dataset.
        place: scene, and which of its key frames from 0.
        definitions: in the order of the panels.
        lidar: as of `compare_labels`.
        camera: likewise.

    Raises:
        OutputError: the file can't be written.
    """
    scene, number = place
    key_frame = dataset.key_frames(scene, lidar=lidar, camera=camera)[number]
    masks = frame_masks(key_frame, definitions)
    tiles = []
    for definition in definitions:
        label, exact = masks[definition.name, False], masks[definition.name, True]
        shown = VEHICLES if VEHICLES in exact else next(iter(exact))
        colours = _colours()[exact[shown].astype(int) + 2 * label[shown].astype(int)]
        everywhere = np.ones(definition.grid.shape, np.uint8)
        iou = overlap(exact[shown].view(np.uint8), label[shown].view(np.uint8), everywhere)
        subtitle = f"{shown}, IoU {iou:.3f}"
        tiles.append(draw_tile([Panel(_upright(definition, colours), definition.name, subtitle)]))
    heading = Heading(scene, f"key frame {number}", "labels over their exact rasters; ahead is up")
    write_png(path, draw_sheet(heading, tiles, 3, [("cells", _swatches)]))


def _upright(definition: Definition, colours: UInt8Array) -> UInt8Array:
    """Colours of cells that grow along coordinates, ahead up and left to the left, enlarged."""
    if definition.frame == "lidar-heading":  # rows grow to the right, columns ahead
        turned = colours.transpose(1, 0, 2)[::-1]
    elif definition.frame == "camera":  # columns grow to the right
        turned = colours[::-1]
    else:
        turned = colours[::-1, ::-1]
    rows, columns = turned.shape[:2]
    size = rows * _PX_PER_CELL, columns * _PX_PER_CELL
    return framed(resize(np.ascontiguousarray(turned), size))


def _swatches() -> list[tuple[UInt8Array, str]]:
    shape = (_SWATCH, _SWATCH, 3)
    return [(np.full(shape, _colours()[code], np.uint8), text) for text, code in _MEANING.items()]


def _colours() -> UInt8Array:
    """(4, 3) by exact + 2 · label; rims one cell wide must be told from what both have."""
    colours = theme()
    return np.array([colours.ground, colours.first, colours.second, colours.drivable], np.uint8)

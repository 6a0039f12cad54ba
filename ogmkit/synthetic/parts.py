"""Solids as the convex boxes that sensors meet: a tree becomes a trunk and a crown of turned boxes."""

from dataclasses import dataclass

import numpy as np

from ogmkit.geometry.boxes import box_corners
from ogmkit.synthetic.scenery import BUILDING, TREE, Solids
from ogmkit.typing import FloatArray, IntArray

_TRUNK_BGR = (52.0, 72.0, 96.0)
# Crown boxes of a tree: turn about z in radians; width, bottom and top as shares of the tree's box.
_CROWN = ((0.3, 0.98, 0.42, 0.80), (1.0, 0.80, 0.34, 0.90), (0.65, 0.62, 0.52, 1.0))
_TRUNK_WIDTH, _TRUNK_TOP = 0.12, 0.5


@dataclass(frozen=True, eq=False)
class Parts:
    """Convex boxes, P of them; annotated solids are exactly one part each.

    Attributes:
        global_from_part: (P, 4, 4).
        size_wlh: (P, 3) metres.
        look: P names of what covers the faces: "car", "large", "two-wheeler", "person", "cone", "barrier",
            "building", "leaves" or "plain".
        colour_bgr: (P, 3).
        solid_index: (P,) the solid that each part belongs to.
    """

    global_from_part: FloatArray
    size_wlh: FloatArray
    look: tuple[str, ...]
    colour_bgr: FloatArray
    solid_index: IntArray

    def corners(self) -> FloatArray:
        """(P, 8, 3) in `global`."""
        return box_corners(self.global_from_part, self.size_wlh)


def split_into_parts(solids: Solids) -> Parts:
    """The parts of all solids, in the solids' order."""
    poses, sizes, looks, colours, owners = [], [], [], [], []
    for index, category in enumerate(solids.category):
        pose, size, colour = solids.global_from_box[index], solids.size_wlh[index], solids.colour_bgr[index]
        if category == TREE:
            pieces = [
                _tree_piece(pose, size, 0.0, _TRUNK_WIDTH, 0.0, _TRUNK_TOP),
                *(_tree_piece(pose, size, *crown) for crown in _CROWN),
            ]
            looks += ["plain"] + ["leaves"] * len(_CROWN)
            colours += [np.array(_TRUNK_BGR)] + [colour] * len(_CROWN)
        else:
            pieces = [(pose, size)]
            looks.append(_look(category))
            colours.append(colour)
        poses += [piece[0] for piece in pieces]
        sizes += [piece[1] for piece in pieces]
        owners += [index] * len(pieces)
    return Parts(
        np.array(poses).reshape(-1, 4, 4),
        np.array(sizes).reshape(-1, 3),
        tuple(looks),
        np.array(colours).reshape(-1, 3),
        np.array(owners, dtype=np.int64),
    )


def _tree_piece(
    pose: FloatArray, size_wlh: FloatArray, turn: float, width: float, bottom: float, top: float
) -> tuple[FloatArray, FloatArray]:
    """A box inside a tree's box: turned about z, of a share of its width, between shares of its height."""
    tree_from_piece = np.eye(4)
    cosine, sine = np.cos(turn), np.sin(turn)
    tree_from_piece[:2, :2] = [[cosine, -sine], [sine, cosine]]
    tree_from_piece[2, 3] = ((bottom + top) / 2 - 0.5) * size_wlh[2]
    # A turned square stays within the unturned one when it shrinks by |cos| + |sin|.
    inside = width / (abs(cosine) + abs(sine)) * size_wlh[:2].min()
    return pose @ tree_from_piece, np.array([inside, inside, (top - bottom) * size_wlh[2]])


def _look(category: str) -> str:
    prefixes = (
        (BUILDING, "building"),
        ("vehicle.car", "car"),
        ("vehicle.emergency.police", "car"),
        ("vehicle.bicycle", "two-wheeler"),
        ("vehicle.motorcycle", "two-wheeler"),
        ("vehicle.", "large"),
        ("human.", "person"),
        ("movable_object.trafficcone", "cone"),
        ("movable_object.barrier", "barrier"),
    )
    return next((look for prefix, look in prefixes if category.startswith(prefix)), "plain")

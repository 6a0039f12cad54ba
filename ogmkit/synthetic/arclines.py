"""Lanes as chains of circular arcs, in the map expansion's `arcline_path_3` form."""

import numpy as np

from ogmkit.synthetic.curves import Path, direction
from ogmkit.typing import FloatArray

_KNOT_M = 18.0
_STRAIGHT_PER_M = 1e-5
_STRAIGHT_RADIUS_M = 999.999


def arcline_path(path: Path) -> list[dict[str, object]]:
    """Arcs that follow a path, tangents continuous, through points some `_KNOT_M` apart.

    Each record has a start and an end pose (x, y, heading), a shape (three letters: left, straight, right), a
    radius and three segment lengths, of which one is not zero here: one arc or one straight.
    """
    knots_m = np.linspace(0.0, path.length, max(3, round(path.length / _KNOT_M) + 1))
    points, headings = path.at(knots_m), path.heading(knots_m)
    records = []
    for index in range(len(knots_m) - 1):
        start, end = points[index], points[index + 1]
        joint, heading = _biarc_joint(start, float(headings[index]), end, float(headings[index + 1]))
        records.append(_arc(start, float(headings[index]), joint))
        records.append(_arc(joint, heading, end))
    return records


def _biarc_joint(
    start: FloatArray, start_heading: float, end: FloatArray, end_heading: float
) -> tuple[FloatArray, float]:
    """Where the two arcs of a biarc with equal tangent lengths meet, and the heading there."""
    chord = end - start
    one, two = direction(start_heading), direction(end_heading)
    along = float(chord @ (one + two))
    bend = 2 * (1 - float(one @ two))
    # Of the quadratic's two forms, the one that doesn't cancel where the path is almost straight.
    tangent_m = float(chord @ chord) / (along + np.sqrt(along**2 + bend * float(chord @ chord)))
    joint = (start + tangent_m * one + end - tangent_m * two) / 2
    return joint, start_heading + _turn_rad(joint - start, one)


def _turn_rad(chord: FloatArray, tangent: FloatArray) -> float:
    """How much an arc turns over a chord that it leaves along a tangent."""
    return 2 * float(np.arctan2(tangent[0] * chord[1] - tangent[1] * chord[0], tangent @ chord))


def _arc(start: FloatArray, heading: float, end: FloatArray) -> dict[str, object]:
    chord_m = float(np.linalg.norm(end - start))
    turn_rad = _turn_rad(end - start, direction(heading))
    curvature = 2 * float(np.sin(turn_rad / 2)) / chord_m
    straight = abs(curvature) < _STRAIGHT_PER_M
    length_m = chord_m if straight else turn_rad / curvature
    return {
        "start_pose": _rounded(*start, heading),
        "end_pose": _rounded(*end, heading + turn_rad),
        "shape": "LSL" if curvature > 0 else "RSR",
        "radius": _STRAIGHT_RADIUS_M if straight else round(abs(1 / curvature), 6),
        "segment_length": _rounded(0.0, length_m, 0.0) if straight else _rounded(length_m, 0.0, 0.0),
    }


def _rounded(*values: float) -> list[float]:
    return [round(float(value), 4) for value in values]

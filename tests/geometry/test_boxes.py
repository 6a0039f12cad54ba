from itertools import combinations, pairwise

import numpy as np
from pyquaternion import Quaternion

from ogmkit.geometry.boxes import EDGES, FACES, GROUND_FACE, box_corners, ground_corners
from ogmkit.geometry.se3 import pose_matrix


def test_corners_of_an_upright_box_by_hand():
    corners = box_corners(pose_matrix([[10, 20, 1]], [[1, 0, 0, 0]]), np.array([[2.0, 4.0, 1.0]]))
    by_hand = [
        [12, 21, 1.5], [12, 19, 1.5], [12, 19, 0.5], [12, 21, 0.5],
        [8, 21, 1.5], [8, 19, 1.5], [8, 19, 0.5], [8, 21, 0.5],
    ]  # fmt: skip
    np.testing.assert_allclose(corners, [by_hand])


def test_ground_face_is_the_lower_one_in_order_round_it():
    ground = ground_corners(pose_matrix([[10, 20, 1]], [[1, 0, 0, 0]]), np.array([[2.0, 4.0, 1.0]]))
    np.testing.assert_allclose(ground, [[[12, 19, 0.5], [12, 21, 0.5], [8, 21, 0.5], [8, 19, 0.5]]])


def test_turned_boxes_agree_with_pyquaternion():
    rng = np.random.default_rng(0)
    centres, sizes = rng.normal(size=(6, 3)) * 50, rng.uniform(0.3, 8, (6, 3))
    turns = [Quaternion.random() for _ in range(6)]
    corners = box_corners(pose_matrix(centres, [turn.elements for turn in turns]), sizes)
    upright = box_corners(np.tile(np.eye(4), (6, 1, 1)), sizes)
    for turn, centre, own, reference in zip(turns, centres, corners, upright, strict=True):
        np.testing.assert_allclose(own, [turn.rotate(corner) + centre for corner in reference], atol=1e-12)


def test_the_twelve_edges_have_the_box_s_lengths():
    (corners,) = box_corners(np.eye(4)[None], np.array([[2.0, 4.0, 1.0]]))
    lengths = sorted(np.linalg.norm(corners[a] - corners[b]) for a, b in EDGES)
    np.testing.assert_allclose(lengths, [1] * 4 + [2] * 4 + [4] * 4)


def test_no_boxes_give_no_corners():
    assert box_corners(np.empty((0, 4, 4)), np.empty((0, 3))).shape == (0, 8, 3)


def test_edges_join_corners_along_one_side_and_the_first_four_go_round_the_front():
    (corners,) = box_corners(np.eye(4)[None], np.array([[2.0, 4.0, 1.0]]))
    along_one = {
        frozenset((a, b)) for a, b in combinations(range(8), 2) if (corners[a] != corners[b]).sum() == 1
    }
    assert {frozenset(edge) for edge in EDGES} == along_one
    assert [edge[0] for edge in EDGES[:4]] == [(edge[1] - 1) % 4 for edge in EDGES[:4]] == [0, 1, 2, 3]


def test_faces_are_the_six_sides_each_in_order_round_it():
    (corners,) = box_corners(np.eye(4)[None], np.array([[2.0, 4.0, 1.0]]))
    sides = [(0, 2.0), (0, -2.0), (2, 0.5), (2, -0.5), (1, -1.0), (1, 1.0)]
    for face, (axis, side) in zip(FACES, sides, strict=True):
        assert sorted(face) == np.flatnonzero(corners[:, axis] == side).tolist()
        assert {frozenset(pair) for pair in pairwise((*face, face[0]))} <= {frozenset(edge) for edge in EDGES}
    assert FACES[3] == GROUND_FACE

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from ogmkit.footprints.faces import NEAR_M, body_faces, fill, ground_faces
from ogmkit.footprints.view import View
from ogmkit.geometry.boxes import ground_corners
from ogmkit.geometry.camera import project
from ogmkit.geometry.se3 import pose_matrix

SIZE = (450, 800)
INTRINSICS = np.array([[633.0, 0, 408], [0, 633, 245], [0, 0, 1]])
CAMERA = np.eye(4)
CAMERA[:3] = [[0.0, 0.02, 1.0, 1.7], [-1, 0.01, 0, 0], [0, -1, 0.02, 1.5]]
CAMERA[:3, :3] = np.linalg.svd(CAMERA[:3, :3])[0] @ np.linalg.svd(CAMERA[:3, :3])[2]
VIEW = View(INTRINSICS, CAMERA, SIZE)
IMAGE = shapely.box(-0.5, -0.5, SIZE[1] - 0.5, SIZE[0] - 0.5)
EVERYWHERE = shapely.box(-500, -500, 500, 500)


def box(x, y, yaw=0.0, size=(1.9, 4.5, 1.6), bottom=0.0, roll=0.0):
    half = np.array([yaw, roll]) / 2
    (c, d), (s, r) = np.cos(half), np.sin(half)
    pose = pose_matrix([x, y, bottom + size[2] / 2], [c * d, c * r, s * r, s * d])
    return pose[None], np.array([size])


def visible_part(level_from_box, size_wlh):
    """The visible part of a ground face, found in the face's own plane, where nothing is at infinity.

    Depth, and the image's borders times depth, are linear there: each leaves a half-plane, cut by shapely.
    """
    width, length, height = size_wlh
    camera_from_box = np.linalg.inv(CAMERA) @ level_from_box
    camera_from_face = camera_from_box[:3] @ np.array([[1, 0, 0], [0, 1, 0], [0, 0, -height / 2], [0, 0, 1]])
    u, v, depth = INTRINSICS @ camera_from_face
    near = depth - [0, 0, NEAR_M]
    inside = (near, u + depth / 2, (SIZE[1] - 0.5) * depth - u, v + depth / 2, (SIZE[0] - 0.5) * depth - v)
    face = shapely.box(-length / 2, -width / 2, length / 2, width / 2)
    for a, b, c in inside:
        norm = np.hypot(a, b)
        if norm * 100 <= abs(c):  # the line passes far off the face: it is all on one side
            face = face if c >= 0 else shapely.Polygon()
            continue
        normal, along = np.array([a, b]) / norm, np.array([-b, a]) / norm
        foot = -c / norm * normal
        half_plane = [foot + 900 * along, foot - 900 * along, foot - 900 * along + 900 * normal]
        face = shapely.intersection(face, shapely.Polygon([*half_plane, foot + 900 * (along + normal)]))
    if face.is_empty:
        return shapely.Polygon()
    corners = shapely.get_coordinates(face)[:-1]
    pixels, _ = project(INTRINSICS, np.c_[corners, np.ones(len(corners))] @ camera_from_face.T)
    return shapely.Polygon(pixels)


@settings(max_examples=300, deadline=None)
@given(
    st.floats(-12, 60),
    st.floats(-25, 25),
    st.floats(-np.pi, np.pi),
    st.sampled_from([(1.9, 4.5, 1.6), (2.9, 12.0, 3.4), (0.7, 1.8, 1.2), (15.0, 30.0, 3.0)]),
    st.floats(-1.4, 1.2),
    st.floats(-0.3, 0.3),
)
def test_ground_faces_are_what_shapely_leaves_of_them(x, y, yaw, size, bottom, roll):
    pose, size_wlh = box(x, y, yaw, size, bottom, roll)
    expected = visible_part(pose[0], size_wlh[0])
    (found,) = ground_faces(VIEW, pose, size_wlh)
    polygon = shapely.Polygon(found) if len(found) > 2 else shapely.Polygon()
    assert polygon.difference(IMAGE.buffer(1e-6)).area == pytest.approx(0, abs=1e-6)
    assert polygon.area == pytest.approx(expected.area, rel=1e-6, abs=1e-6)
    if expected.area > 1:
        with np.errstate(invalid="ignore"):  # which shapely 2.0 raises on sound polygons too
            common = shapely.intersection(polygon.buffer(0), expected.buffer(0)).area
        assert common / (polygon.area + expected.area - common) >= 0.99


def test_a_face_inside_the_image_is_its_projected_corners():
    pose, size_wlh = box(20, 2, yaw=0.4)
    corners = ground_corners(np.linalg.inv(CAMERA) @ pose, size_wlh)
    (found,) = ground_faces(VIEW, pose, size_wlh)
    np.testing.assert_allclose(found, project(INTRINSICS, corners)[0][0])


def test_nothing_is_seen_of_a_box_behind_or_beside():
    poses, sizes = (np.concatenate(parts) for parts in zip(box(-8, 0), box(5, 30), box(20, 0), strict=True))
    assert [len(polygon) for polygon in ground_faces(VIEW, poses, sizes)] == [0, 0, 4]
    assert [len(polygon) > 0 for polygon in body_faces(VIEW, poses, sizes)] == [False] * 12 + [True] * 6


def test_a_vehicle_under_the_camera_fills_the_bottom_of_the_image():
    pose, size_wlh = box(0, 0, size=(30.0, 14.0, 1.0))
    mask = fill(ground_faces(VIEW, pose, size_wlh), SIZE)
    assert mask[-1].all()
    shown = np.flatnonzero(mask.any(axis=1))
    far_edge = np.linalg.inv(CAMERA) @ [7.0, 0, 0, 1]
    _, v = project(INTRINSICS, far_edge[:3])[0]
    assert shown[0] == pytest.approx(v, abs=3)  # the camera is rolled a little
    assert mask[shown[-1]].all()


def test_no_boxes_give_an_empty_mask():
    none = np.empty((0, 4, 4)), np.empty((0, 3))
    assert ground_faces(VIEW, *none) == []
    assert not fill(body_faces(VIEW, *none), SIZE).any()


@given(st.floats(4, 50), st.floats(-20, 20), st.floats(-np.pi, np.pi))
def test_a_body_is_the_hull_of_its_corners(x, y, yaw):
    pose, size_wlh = box(x + 4, y, yaw)
    corners = np.array([[a, b, c, 1] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]) / 2
    corners = corners * [*size_wlh[0][[1, 0, 2]], 2]
    in_camera = corners @ (np.linalg.inv(CAMERA) @ pose[0]).T
    hull = shapely.MultiPoint(project(INTRINSICS, in_camera[:, :3])[0]).convex_hull
    found = [shapely.Polygon(polygon) for polygon in body_faces(VIEW, pose, size_wlh) if len(polygon) > 2]
    with np.errstate(invalid="ignore"):
        expected = shapely.intersection(hull, IMAGE)
        union = shapely.union_all(shapely.set_precision(found, 1e-6))
        assert union.symmetric_difference(expected).area <= 1e-3 + 1e-4 * expected.area


def test_a_camera_inside_a_box_sees_nothing_else():
    pose, size_wlh = box(1.7, 0, size=(4.0, 8.0, 3.0))
    assert fill(body_faces(VIEW, pose, size_wlh), SIZE).all()


def test_overlapping_footprints_unite():
    poses, sizes = (np.concatenate(parts) for parts in zip(box(20, 0), box(21, 0.5), strict=True))
    both = fill(ground_faces(VIEW, poses, sizes), SIZE)
    each = [fill(ground_faces(VIEW, poses[i : i + 1], sizes[i : i + 1]), SIZE) for i in range(2)]
    np.testing.assert_array_equal(both, each[0] | each[1])
    assert (each[0] & each[1]).any()

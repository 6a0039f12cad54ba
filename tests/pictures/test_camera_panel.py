"""The camera's picture: boxes lie where a pinhole camera has them."""

import dataclasses

import numpy as np
import pytest

from ogmkit.drawing.palette import theme
from ogmkit.geometry.se3 import pose_matrix
from ogmkit.pictures.camera_panel import (
    DRIVABLE_OPACITY,
    VEHICLE_OPACITY,
    draw_camera,
    draw_masks,
)
from ogmkit.pictures.views import read_view
from ogmkit.shards.reader import Shard

SIZE = 540, 960
INTRINSICS = np.array([[600.0, 0, 479.5], [0, 600.0, 269.5], [0, 0, 1]])
CAMERA_FROM_FRONT_LEFT_UP = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])


@pytest.fixture
def view(make_shards):
    with Shard(make_shards() / "scene-0001.h5") as shard:
        whole = read_view(shard, "CAM_FRONT", 0)
    return dataclasses.replace(whole, image=None, image_size=SIZE, intrinsics=INTRINSICS)


def with_boxes(view, *centres_camera, category="vehicle.car"):
    poses = np.stack([np.eye(4) for _ in centres_camera])
    poses[:, :3, :3] = CAMERA_FROM_FRONT_LEFT_UP
    poses[:, :3, 3] = centres_camera
    size = np.tile([2.0, 4.0, 1.6], (len(poses), 1))
    return dataclasses.replace(view, camera_from_box=poses, size_wlh=size, category=(category,) * len(poses))


def distance_to_nearest(points, others):
    return np.sqrt(((points[:, None] - others[None]) ** 2).sum(axis=2).min(axis=1))


@pytest.mark.parametrize("centre", [(1.0, 1.2, 8.0), (-3.0, 1.0, 5.0), (1.6, 1.0, 0.5)])
def test_edges_lie_on_densely_projected_ones_also_where_the_box_reaches_behind_the_camera(view, centre):
    canvas = draw_camera(with_boxes(view, centre), SIZE)
    edges = []
    for axis, other, third in ((0, 1, 2), (1, 0, 2), (2, 0, 1)):
        for a in (-1, 1):
            for b in (-1, 1):
                points = np.empty((20_000, 3))
                points[:, axis], points[:, other], points[:, third] = np.linspace(-1, 1, 20_000), a, b
                edges.append(points * [2.0, 1.0, 0.8])
    camera = np.concatenate(edges) @ CAMERA_FROM_FRONT_LEFT_UP.T + centre
    camera = camera[camera[:, 2] >= 0.1]
    pixels = camera[:, :2] / camera[:, 2:] * 600 + (479.5, 269.5)
    expected = np.unique(np.rint(pixels[((pixels > 4) & (pixels < (955, 535))).all(axis=1)]), axis=0)
    full = (canvas.pixels == theme().vehicle).all(axis=2)
    coloured = np.argwhere(full)[:, ::-1].astype(float)

    assert len(expected) > 100
    assert distance_to_nearest(expected, coloured).max() < 2.5
    inner = coloured[((coloured > 8) & (coloured < (951, 531))).all(axis=1)]
    assert distance_to_nearest(inner, expected).max() < 2.5


def test_the_front_face_alone_is_filled(view):
    oncoming = with_boxes(view, (0.0, 0.0, 12.0))
    turned = oncoming.camera_from_box.copy()
    turned[0, :3, :3] = CAMERA_FROM_FRONT_LEFT_UP @ pose_matrix([0, 0, 0], [0, 0, 0, 1])[:3, :3]
    centre = 270, 480

    near_face = draw_camera(dataclasses.replace(oncoming, camera_from_box=turned), SIZE)
    assert near_face.pixels[centre].tolist() != list(theme().empty)
    # 10 m is the near face, 14 m the far one: only the near one reaches ±60 px, and only there is it filled.
    assert near_face.pixels[270, 480 + 50].tolist() != list(theme().empty)
    far_face = draw_camera(oncoming, SIZE)
    assert far_face.pixels[centre].tolist() != list(theme().empty)
    assert far_face.pixels[270, 480 + 50].tolist() == list(theme().empty)


def test_boxes_wholly_behind_the_camera_leave_no_trace(view):
    behind, none = with_boxes(view, (0.0, 0.0, -6.0)), with_boxes(view, (0.0, 0.0, 6.0))
    empty = dataclasses.replace(
        none, camera_from_box=np.empty((0, 4, 4)), size_wlh=np.empty((0, 3)), category=()
    )

    np.testing.assert_array_equal(draw_camera(behind, SIZE).pixels, draw_camera(empty, SIZE).pixels)


@pytest.mark.parametrize(
    ("category", "colour"),
    [("human.pedestrian.adult", theme().second), ("static_object.bicycle_rack", theme().muted)],
)
def test_a_category_has_its_colour(view, category, colour):
    canvas = draw_camera(with_boxes(view, (0.0, 1.0, 8.0), category=category), SIZE)

    assert (canvas.pixels == colour).all(axis=2).any()
    assert not (canvas.pixels == theme().vehicle).all(axis=2).any()


def test_the_image_is_scaled_to_the_panel_and_boxes_with_it(make_shards):
    with Shard(make_shards() / "scene-0001.h5") as shard:
        view = read_view(shard, "CAM_FRONT", 0)
    canvas = draw_camera(view, SIZE)

    assert canvas.shape == SIZE
    assert abs(canvas.pixels[20, 20].astype(int) - (30, 90, 200)).max() < 6
    # The car's rear face: 8.25 m ahead of the camera, 3 ± 0.95 m to the left, 0.7 ± 0.8 m below; the panel is
    # six times the image, so that a pixel u of the image is 6 u + 2.5 of the panel.
    left, right = (6 * (79.5 - 100 * y / 8.25) + 2.5 for y in (3.95, 2.05))
    top, bottom = (6 * (44.5 + 100 * y / 8.25) + 2.5 for y in (-0.1, 1.5))
    for column, row in ((left, (top + bottom) / 2), (right, bottom - 20), ((left + right) / 2, bottom)):
        assert canvas.pixels[round(row), round(column)].tolist() == list(theme().vehicle)


def test_masks_lie_over_the_image_vehicles_on_top_and_scaled_to_it(view):
    drivable, vehicles = np.zeros((54, 96), np.uint8), np.zeros((27, 48), np.uint8)
    drivable[:, :48], vehicles[:, 12:36] = 1, 1
    both = draw_masks(view, SIZE, vehicles=vehicles, drivable=drivable).pixels
    alone = draw_masks(view, SIZE, vehicles=vehicles).pixels

    def mixed(*tints):
        colour = np.array(theme().empty, float)
        for over, opacity in tints:
            colour = np.rint(colour + opacity * (np.array(over) - colour))
        return colour.tolist()

    road, vehicle = (theme().drivable, DRIVABLE_OPACITY), (theme().vehicle, VEHICLE_OPACITY)
    row, columns = 400, (100, 300, 600, 900)
    expected = [mixed(road), mixed(road, vehicle), mixed(vehicle), mixed()]
    assert [both[row, column].tolist() for column in columns] == expected
    assert [alone[row, column].tolist() for column in columns] == [
        mixed(),
        *[mixed(vehicle)] * 2,
        mixed(),
    ]


def test_masks_have_outlines_of_their_own_colour(view):
    vehicles = np.zeros((54, 96), np.uint8)
    vehicles[20:30, 40:60] = 1
    pixels = draw_masks(view, SIZE, vehicles=vehicles).pixels

    assert tuple(pixels[200, 500].tolist()) == theme().vehicle
    assert tuple(pixels[250, 400].tolist()) == theme().vehicle
    assert tuple(pixels[250, 500].tolist()) != theme().vehicle

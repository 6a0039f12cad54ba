import numpy as np
import pytest
import torch

from ogmkit.errors import SettingsError
from ogmkit.geometry.camera import project
from ogmkit.geometry.se3 import inverse
from ogmkit.grid import GridSpec
from ogmkit.learn.models.oft_pooling import box_means, integral_image, voxel_boxes, voxel_corners

GRID = GridSpec(2.0, 9, 6, 10.0, 2.0)
HEIGHTS_M = (-0.5, 1.0, 3.0)
SIZE = (60, 100)


@pytest.fixture(params=[{}, {"yaw": 70.0, "roll": 10.0}], ids=["ahead", "to the side"])
def camera(request, make_camera):
    return make_camera(SIZE, pitch=2.0, **request.param)


def boxes_px(camera, grid=GRID, heights_m=HEIGHTS_M):
    intrinsics, level_from_camera = (torch.from_numpy(matrix)[None] for matrix in camera)
    return voxel_boxes(voxel_corners(grid, heights_m), intrinsics, level_from_camera)


def slow_boxes_px(camera):
    """Voxel by voxel: eight corners, projected; None behind the camera."""
    intrinsics, level_from_camera = camera
    for layer in range(len(HEIGHTS_M) - 1):
        for row in range(GRID.rows):
            for column in range(GRID.columns):
                corners = []
                for z in HEIGHTS_M[layer : layer + 2]:
                    for x_m in (2.0 * (10 - row), 2.0 * (9 - row)):  # ego 10 cells from the top edge
                        for y_m in (2.0 * (2 - column), 2.0 * (1 - column)):
                            corners.append((x_m, y_m, z, 1.0))
                points_camera = (np.array(corners) @ inverse(level_from_camera).T)[:, :3]
                pixels, depth_m = project(intrinsics, points_camera)
                visible = depth_m.min() > 0.1
                yield (layer, row, column), (*pixels.min(0), *pixels.max(0)) if visible else None


def slow_mean(features, box, size):
    """Mean over a box of (C, h, w) features that are constant over unit squares, None if it is empty."""
    left, right = np.clip([box[0], box[2]], 0, size[1])
    top, bottom = np.clip([box[1], box[3]], 0, size[0])
    if left >= right or top >= bottom:
        return None, 0.0
    u, v = np.arange(features.shape[2]), np.arange(features.shape[1])
    across = np.clip(np.minimum(u + 1, right) - np.maximum(u, left), 0, None)
    down = np.clip(np.minimum(v + 1, bottom) - np.maximum(v, top), 0, None)
    smallest = min(right - left, bottom - top)
    return np.einsum("cvu,v,u->c", features, down, across) / (down.sum() * across.sum()), smallest


def test_integrals_are_the_sums_over_rectangles():
    features = torch.rand(2, 3, 5, 7, dtype=torch.float64)
    integral = integral_image(features)
    assert integral.shape == (2, 3, 6, 8)
    for row in range(6):
        for column in range(8):
            expected = features[..., :row, :column].sum((-1, -2))
            torch.testing.assert_close(integral[..., row, column], expected, rtol=1e-12, atol=1e-12)
    assert integral_image(features.bfloat16()).dtype == torch.float32


def test_voxels_stand_on_their_cells():
    corners = voxel_corners(GRID, HEIGHTS_M)
    assert corners.shape == (3, 10, 7, 3)
    assert corners[0, 0, 0].tolist() == [
        20,
        4,
        -0.5,
    ]  # ahead and left of the ego, which is 10 and 2 cells away
    assert corners[2, 9, 6].tolist() == [2, -8, 3]


@pytest.mark.parametrize("heights_m", [(1.0,), (1.0, 1.0), (2.0, 1.0, 3.0)])
def test_heights_must_rise(heights_m):
    with pytest.raises(SettingsError, match="rise"):
        voxel_corners(GRID, heights_m)


def test_boxes_hold_the_eight_corners(camera):
    boxes = boxes_px(camera)
    assert boxes.shape == (1, 2, 9, 6, 4)
    behind = 0
    for place, box in slow_boxes_px(camera):
        behind += box is None
        expected = np.zeros(4) if box is None else np.array(box) + 0.5  # from the image's corner
        np.testing.assert_allclose(boxes[(0, *place)], expected, rtol=1e-9, atol=1e-9)
    assert behind < boxes[..., 0].numel()


def test_means_are_those_of_a_slow_loop(camera):
    stride, size = 4, (SIZE[0] / 4, SIZE[1] / 4)
    features = np.random.default_rng(1).normal(size=(3, 17, 28))  # padded by 2 rows and 3 columns
    integral = integral_image(torch.from_numpy(features)[None])
    boxes = boxes_px(camera) / stride
    means = torch.stack([box_means(integral, boxes[:, layer], size)[0] for layer in range(2)]).numpy()
    compared = 0
    for (layer, row, column), box_px in slow_boxes_px(camera):
        if box_px is None:
            assert not means[layer, :, row, column].any()
            continue
        expected, smallest = slow_mean(features, (np.array(box_px) + 0.5) / stride, size)
        if expected is None:
            assert not means[layer, :, row, column].any()
        elif smallest > 0.125:  # smaller boxes are enlarged
            np.testing.assert_allclose(means[layer, :, row, column], expected, rtol=1e-9, atol=1e-9)
            compared += 1
    assert compared > 5


def test_a_constant_map_has_constant_means_inside_the_image(camera):
    integral = integral_image(torch.full((1, 2, 15, 25), 3.0))
    boxes = boxes_px(camera) / 4
    for layer in range(2):
        means = box_means(integral, boxes[:, layer], (15.0, 25.0))
        inside = means[0, 0] != 0
        assert inside.any()
        torch.testing.assert_close(
            means[0][:, inside], torch.full_like(means[0][:, inside], 3.0), rtol=1e-4, atol=0
        )


def test_boxes_smaller_than_a_feature_give_that_feature():
    features = torch.rand(1, 1, 40, 60) + 100
    box = torch.tensor([[[[30.5, 20.5, 30.5 + 1e-4, 20.5 + 1e-4]]]], dtype=torch.float64)
    value = box_means(integral_image(features), box, (40.0, 60.0))
    torch.testing.assert_close(value.item(), features[0, 0, 20, 30].item(), rtol=0.02, atol=0)


def test_boxes_out_of_the_image_or_in_its_padding_are_empty():
    integral = integral_image(torch.ones(1, 1, 4, 4))
    outside = [[-3, 0, -1, 2], [0, 5, 2, 6], [3.2, 0, 3.9, 2], [0, 3.5, 4, 4], [0, 0, 0, 0]]
    boxes = torch.tensor(outside, dtype=torch.float64)[None, None]
    assert not box_means(integral, boxes, (3.5, 3.0)).any()


def test_a_known_place_of_the_ground_comes_out_in_its_cell(make_camera):
    size, grid = (240, 400), GridSpec(1.0, 12, 8, 18.0, 3.0)
    camera = make_camera(size, pitch=5.0)
    row, column = 4, 5
    x_m, y_m = grid.positions_m(np.array([float(column), float(row)]))  # 13.5 m ahead, 2.5 m to the right
    assert (x_m, y_m) == (13.5, -2.5)
    pixels, _ = project(camera[0], (inverse(camera[1]) @ [x_m, y_m, 0.0, 1.0])[:3])
    u, v = np.round(pixels).astype(int)
    features = torch.zeros(1, 1, *size)
    features[0, 0, v, u] = 1
    boxes = boxes_px(camera, grid, (-0.01, 0.01))
    means = box_means(integral_image(features), boxes[:, 0], (240.0, 400.0))[0, 0]
    # Boxes around the slanting cells beside it overlap, those before and behind it do not.
    found = torch.nonzero(means > 1e-3 * means.max())
    assert [row, column] in found.tolist()
    assert (found[:, 0] == row).all()
    assert (found[:, 1] - column).abs().max() <= 1


def test_gradients_reach_the_features(camera):
    features = torch.rand(1, 1, 6, 10, dtype=torch.float64, requires_grad=True)
    boxes = boxes_px(camera)[:, 0] / 10
    assert torch.autograd.gradcheck(lambda f: box_means(integral_image(f), boxes, (6.0, 10.0)), features)

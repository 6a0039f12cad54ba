import cv2
import numpy as np
import pytest
import torch

from ogmkit.footprints.warp import warp_to_bev as warp_by_opencv
from ogmkit.geometry.camera import image_from_ground
from ogmkit.grid import GridSpec
from ogmkit.learn.models.warp import rescaled, warp_to_bev

GRID = GridSpec(0.25, 160, 110, 170.0, 35.0)
SIZE = (90, 160)
POSES = {"ahead": {}, "nose down, rolled": {"pitch": 8, "roll": 6}, "to the side": {"yaw": 60, "pitch": 3}}


@pytest.fixture(params=POSES.values(), ids=POSES)
def matrix(request, make_homography):
    return make_homography(GRID, SIZE, **request.param)


def blotches(shape, seed=0):
    coarse = np.random.default_rng(seed).integers(0, 2, (shape[0] // 6, shape[1] // 8), dtype=np.uint8)
    return np.kron(coarse, np.ones((6, 8), np.uint8))


def warp(image, matrix, mode="bilinear"):
    maps = torch.from_numpy(image).float()[None, None]
    return warp_to_bev(maps, torch.from_numpy(matrix)[None], GRID.shape, mode=mode)[0, 0].numpy()


def seen(matrix):
    """Cells in front of the camera: the third coordinate of the inverse is positive."""
    row, column = np.mgrid[: GRID.rows, : GRID.columns]
    return np.stack([column, row, np.ones_like(row)], -1) @ np.linalg.inv(matrix)[2] > 0


def test_nearest_agrees_with_opencv_but_where_rounding_decides(matrix):
    image = blotches(SIZE)
    ours, theirs = warp(image, matrix, "nearest"), warp_by_opencv(image, matrix, GRID.shape)
    assert theirs.any()
    differing = np.argwhere(ours != theirs)
    assert len(differing) <= 0.01 * theirs.size
    # Where they differ, the pixel asked for is half-way between two, to 1/32 px, OpenCV's step.
    homogeneous = np.column_stack([differing[:, ::-1], np.ones(len(differing))]) @ np.linalg.inv(matrix).T
    places = homogeneous[:, :2] / homogeneous[:, 2:]
    assert (np.abs(places - np.floor(places) - 0.5).min(axis=1) < 1 / 32).all()


def test_bilinear_agrees_with_opencv_to_its_steps_of_a_32nd_of_a_pixel(matrix):
    image = blotches(SIZE).astype(np.float32)
    theirs = cv2.warpPerspective(image, matrix, GRID.shape[::-1]) * seen(matrix)
    difference = np.abs(warp(image, matrix) - theirs)
    assert np.count_nonzero(difference > 1 / 16) <= 0.01 * difference.size
    assert theirs.max() > 0.9


def test_nothing_comes_from_above_the_horizon(make_homography):
    matrix = make_homography(GRID, SIZE, yaw=75)  # looks to the left: the right part of the grid is behind
    everywhere = warp(np.ones(SIZE, np.uint8), matrix)
    aliased = cv2.warpPerspective(np.ones(SIZE, np.uint8), matrix, GRID.shape[::-1])
    assert aliased[~seen(matrix)].any()
    assert not everywhere[~seen(matrix)].any()
    assert everywhere[seen(matrix)].any()


def test_masks_of_a_known_ground_come_back_to_their_cells(make_camera):
    """The image is made by the law of rays, pixel by pixel, not by any homography."""
    size = (360, 640)
    intrinsics, level_from_camera = make_camera(size, pitch=4, yaw=5)
    rectangles = [(6.0, 10.0, -1.0, 1.0), (9.0, 12.0, -4.5, -2.2), (13.0, 18.0, 2.0, 4.0)]

    def occupied(x, y):
        return np.any([(x > a) & (x < b) & (y > c) & (y < d) for a, b, c, d in rectangles], axis=0)

    v, u = np.mgrid[: size[0], : size[1]]
    rays = np.stack([u, v, np.ones_like(u)], -1) @ np.linalg.inv(intrinsics).T @ level_from_camera[:3, :3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = -level_from_camera[2, 3] / rays[..., 2]
        ground = level_from_camera[:2, 3] + reach[..., None] * rays[..., :2]
    image = occupied(ground[..., 0], ground[..., 1]) & (rays[..., 2] < 0)
    matrix = GRID.bev_from_level @ np.linalg.inv(image_from_ground(intrinsics, level_from_camera))
    result = warp(image.astype(np.uint8), matrix) >= 0.5
    row, column = np.mgrid[: GRID.rows, : GRID.columns]
    truth = occupied(*np.moveaxis(GRID.positions_m(np.stack([column, row], -1)), -1, 0))
    assert truth.sum() > 300
    assert (result & truth).sum() / (result | truth).sum() > 0.95


def test_a_frame_without_homography_is_empty_and_gives_no_gradient(make_homography):
    valid = torch.from_numpy(make_homography(GRID, SIZE))
    broken = torch.full((3, 3), torch.nan, dtype=torch.float64)
    matrices = torch.stack([broken, valid, torch.ones(3, 3, dtype=torch.float64)]).requires_grad_()
    maps = torch.rand(3, 2, *SIZE, requires_grad=True)
    result = warp_to_bev(maps, matrices, GRID.shape)
    assert not result[[0, 2]].any()
    assert result[1].any()
    result.square().sum().backward()
    assert torch.isfinite(maps.grad).all()
    assert torch.isfinite(matrices.grad).all()
    assert maps.grad.flatten(1).any(1).tolist() == [False, True, False]


def test_gradients_are_those_of_finite_differences(make_homography):
    grid, size = GridSpec(1.0, 7, 5, 9.0, 2.0), (6, 8)
    matrix = torch.from_numpy(make_homography(grid, size, pitch=10))[None]
    maps = torch.rand(1, 2, *size, dtype=torch.float64, requires_grad=True)
    assert warp_to_bev(maps, matrix, grid.shape).any()
    assert torch.autograd.gradcheck(lambda m: warp_to_bev(m, matrix, grid.shape), maps)


def test_half_precision_maps_are_placed_in_single_precision(make_homography):
    matrix = make_homography(GRID, SIZE)
    image = blotches(SIZE)
    maps = torch.from_numpy(image).to(torch.bfloat16)[None, None]
    result = warp_to_bev(maps, torch.from_numpy(matrix)[None], GRID.shape)
    assert result.dtype == torch.float32
    np.testing.assert_array_equal(result[0, 0].numpy(), warp(image, matrix))


def test_a_resized_image_has_the_same_ground(make_homography):
    matrix = torch.from_numpy(make_homography(GRID, (90, 160)))[None]
    half = rescaled(matrix, (90, 160), (45, 40))
    # By hand: pixel (9.5, 30.5) of the copy has its corner-based centre (10, 31), in the original (40, 62).
    there = matrix @ torch.tensor([39.5, 61.5, 1.0], dtype=torch.float64)
    here = half @ torch.tensor([9.5, 30.5, 1.0], dtype=torch.float64)
    torch.testing.assert_close(here / here[:, 2:], there / there[:, 2:])
    assert half[0, 2, 2] == -1

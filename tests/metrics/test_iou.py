"""Counts and IoU by hand."""

from itertools import product

import numpy as np
import pytest

from ogmkit.grid import GridSpec
from ogmkit.metrics.iou import (
    BEV_SHAPE,
    IMAGE_SHAPE,
    BevCounter,
    code_of,
    count_image,
    iou,
    masks_of,
    resized,
    thresholded,
)

# Rows of 10 m: 0 and 1 are far, 2 … 6 near; columns 2 and 3 are within 10 m of the ego.
GRID = GridSpec(m_per_cell=10, rows=7, columns=5, ego_row=7, ego_column=3)


def masks(*cells):
    found = np.zeros((2, 7, 5), np.uint8)
    for target, row, column in cells:
        found[target, row, column] = 1
    return code_of(*found)


def test_a_code_holds_both_masks():
    drivable, vehicles = np.array([[1, 0, 1]], np.uint8), np.array([[0, 0, 1]], np.uint8)
    code = code_of(drivable, vehicles)

    np.testing.assert_array_equal(code, [[1, 0, 3]])
    np.testing.assert_array_equal(masks_of(code), [drivable, vehicles])


def test_a_probability_must_exceed_the_threshold():
    probabilities = np.array([[[0.5, 0.51]], [[0.2, 0.9]]], np.float32)

    np.testing.assert_array_equal(thresholded(probabilities, 0.5), [[0, 3]])
    np.testing.assert_array_equal(thresholded(probabilities, 0.0), [[3, 3]])


def test_four_pixels_by_hand():
    truth = code_of(np.array([[1, 1], [0, 0]], np.uint8), np.array([[0, 0], [0, 1]], np.uint8))
    predicted = code_of(np.array([[1, 0], [1, 0]], np.uint8), np.array([[0, 0], [0, 1]], np.uint8))
    counts = count_image(truth, predicted)

    np.testing.assert_array_equal(counts, [[1, 1, 1, 1], [1, 0, 0, 3]])  # tp, fp, fn, tn
    np.testing.assert_allclose(iou(counts), [[1 / 3, 1 / 3], [1, 1]])


def test_mean_is_of_foreground_and_background():
    np.testing.assert_allclose(iou(np.array([2, 1, 1, 6])), [2 / 4, (2 / 4 + 6 / 8) / 2])


@pytest.mark.parametrize(("counts", "expected"), [((0, 0, 0, 5), (np.nan,) * 2), ((5, 0, 0, 0), (1, np.nan))])
def test_an_empty_union_has_no_iou(counts, expected):
    np.testing.assert_array_equal(iou(np.array(counts)), expected)


def test_cells_by_region_and_view():
    # Drivable: one hit far, one miss close, one false alarm beside. Vehicles: a hit close, out of view.
    truth = masks((0, 0, 4), (0, 3, 2), (1, 6, 3))
    predicted = masks((0, 0, 4), (0, 5, 0), (1, 6, 3))
    seen = np.ones((7, 5), np.uint8)
    seen[6, 3] = seen[5, 0] = 0
    drivable, vehicles = BevCounter(GRID).count(truth, seen, predicted)

    np.testing.assert_array_equal(drivable[0], [[1, 1, 1, 32], [1, 0, 1, 31]])  # full: 35 cells, 33 in view
    np.testing.assert_array_equal(drivable[1], [[0, 0, 1, 9], [0, 0, 1, 8]])  # close: 10 cells, 9 in view
    np.testing.assert_array_equal(drivable[2], [[1, 0, 0, 9], [1, 0, 0, 9]])  # far: 10 cells
    np.testing.assert_array_equal(vehicles[0], [[1, 0, 0, 34], [0, 0, 0, 33]])
    np.testing.assert_array_equal(vehicles[1], [[1, 0, 0, 9], [0, 0, 0, 9]])
    np.testing.assert_array_equal(vehicles[2], [[0, 0, 0, 10], [0, 0, 0, 10]])


def test_every_combination_against_plain_sums():
    generator = np.random.default_rng(3)
    truth, predicted = generator.integers(0, 4, (2, 7, 5)).astype(np.uint8)
    seen = generator.integers(0, 2, (7, 5)).astype(np.uint8)
    counts = BevCounter(GRID).count(truth, seen, predicted)

    close, far = np.zeros((7, 5), bool), np.zeros((7, 5), bool)
    close[2:, 2:4] = far[:2] = True
    for target, bit in enumerate((1, 2)):
        true, found = truth & bit > 0, predicted & bit > 0
        for region, inside in enumerate((np.ones_like(close), close, far)):
            for kind, counted in enumerate((inside, inside & (seen > 0))):
                expected = [
                    (counted & one & two).sum()
                    for one, two in ((true, found), (~true, found), (true, ~found), (~true, ~found))
                ]
                np.testing.assert_array_equal(counts[target, region, kind], expected)


def test_inputs_stay_as_they_were():
    truth, seen, predicted = masks((0, 1, 1)), np.ones((7, 5), np.uint8), masks((1, 2, 2))
    before = truth.copy(), seen.copy(), predicted.copy()
    BevCounter(GRID).count(truth, seen, predicted)

    for one, kept in zip((truth, seen, predicted), before, strict=True):
        np.testing.assert_array_equal(one, kept)


def test_resizing_lays_corners_on_corners():
    probabilities = np.array([[[0.0, 1.0]], [[1.0, 1.0]]], np.float32)

    # Centres of four pixels fall a quarter pixel outside, between and outside the two.
    np.testing.assert_allclose(resized(probabilities, (1, 4))[0], [[0, 0.25, 0.75, 1]])
    np.testing.assert_allclose(resized(probabilities, (1, 4))[1], np.ones((1, 4)))


def test_shapes_of_counts_are_those_that_are_told():
    empty = masks()

    assert BevCounter(GRID).count(empty, np.ones((7, 5), np.uint8), empty).shape == BEV_SHAPE == (2, 3, 2, 4)
    assert count_image(empty, empty).shape == IMAGE_SHAPE == (2, 4)


def test_every_pair_of_codes_counts_as_its_outcome():
    for true, predicted in product(range(4), repeat=2):
        counts = count_image(np.full((2, 3), true, np.uint8), np.full((2, 3), predicted, np.uint8))
        for target, bit in enumerate((1, 2)):
            outcome = {(1, 1): 0, (0, 1): 1, (1, 0): 2, (0, 0): 3}[bool(true & bit), bool(predicted & bit)]
            assert counts[target].tolist() == [6 * (place == outcome) for place in range(4)]


def test_resizing_is_linear_on_each_axis_and_leaves_the_size_itself_alone():
    ramp = np.mgrid[:4, :6].astype(np.float32)
    found = resized(ramp, (8, 3))
    rows, columns = (np.arange(8) + 0.5) / 2 - 0.5, (np.arange(3) + 0.5) * 2 - 0.5

    assert found.dtype == np.float32
    np.testing.assert_allclose(found[0], np.broadcast_to(rows.clip(0, 3)[:, None], (8, 3)), atol=1e-6)
    np.testing.assert_allclose(found[1], np.broadcast_to(columns.clip(0, 5), (8, 3)), atol=1e-6)
    assert resized(ramp, (4, 6)) is ramp

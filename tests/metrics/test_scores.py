"""Scores by hand, and against the counts that they are made of."""

import numpy as np
import pytest

from ogmkit.errors import SettingsError
from ogmkit.grid import GridSpec
from ogmkit.metrics.scores import IouTally, displacement_errors

GRID = GridSpec(10.0, 8, 3, 8.0, 1.0)
"""80 m ahead; columns from 10 m left of the ego to 20 m right: the first two are close, rows 3 to 7."""
NOTHING = np.zeros(GRID.shape, np.uint8)


def masks(*cells):
    """Drivable area of these cells; no vehicle."""
    mask = NOTHING.copy()
    for row, column in cells:
        mask[row, column] = 1
    return np.stack([mask, NOTHING])


def test_frames_add_up_by_region_and_field_of_view():
    view = NOTHING.copy()
    view[:, 0] = 1
    tally = IouTally(GRID)
    tally.add("a", masks((0, 0), (4, 0), (4, 1)), masks((0, 0), (4, 0), (5, 0)), view)
    tally.add("b", masks((4, 1)), masks((4, 1), (0, 2)).astype(bool), view)

    found = tally.result()

    # Over both frames, hits / union.
    full, close, far = 3 / 6, 2 / 4, 1 / 2
    np.testing.assert_allclose(found.value[0, :, 0, 0], [full, close, far])
    np.testing.assert_allclose(found.value[0, :, 1, 0], [2 / 3, 1 / 2, 1])  # the first column alone
    assert np.isnan(found.value[1, :, :, 0]).all()  # no vehicle anywhere
    background = (48 - 6) / (48 - 3)
    assert found.value[0, 0, 0, 1] == pytest.approx((full + background) / 2)
    # Of two scenes, draws are all of one, all of the other, or both: 2 / 4, 1 / 2 and 3 / 6.
    assert found.low[0, 0, 0, 0] == found.high[0, 0, 0, 0] == 0.5


@pytest.mark.parametrize("wrong", [0, 1, 2])
def test_arrays_of_another_shape_are_refused(wrong):
    arrays = [masks(), masks(), NOTHING]
    arrays[wrong] = arrays[wrong][..., :2]

    name = ("truth", "prediction", "field of view")[wrong]
    with pytest.raises(SettingsError, match=rf"IoU: {name} has shape .*8, 2\), expected .*8, 3\)"):
        IouTally(GRID).add("a", *arrays)


def test_a_tally_of_nothing_is_refused():
    with pytest.raises(SettingsError, match="no frame was added"):
        IouTally(GRID).result()


TRUTH = np.arange(30.0).reshape(3, 5, 2)
OFFSETS = np.array([[3.0, 4.0], [0.0, -1.0], [6.0, 8.0], [-5.0, 12.0], [-8.0, 15.0]])
"""Lengths 5, 1, 10, 13 and 17."""


def test_displacements_at_and_up_to_each_horizon():
    predicted = TRUTH + np.stack([OFFSETS, 0 * OFFSETS, 0 * OFFSETS])

    found = displacement_errors(predicted, TRUTH, ["a", "b", "b"])

    expected = [[5 / 3, 5 / 3], [10 / 3, 16 / 9], [17 / 3, 46 / 15]]
    np.testing.assert_allclose(found.value, expected)
    # Draws without scene a have no error, draws without scene b have all of it.
    np.testing.assert_allclose(found.low, 0)
    np.testing.assert_allclose(found.high, 3 * np.array(expected))


def test_points_that_are_missing_do_not_count():
    truth = TRUTH.copy()
    truth[0, 2:] = np.nan

    found = displacement_errors(TRUTH + OFFSETS, truth, "aab")

    np.testing.assert_allclose(found.value, [[5, 5], [10, (3 * 5 + 3 * 1 + 2 * 10) / 8], [17, 98 / 12]])


@pytest.mark.parametrize(
    ("predicted", "truth", "scenes"),
    [
        (TRUTH, TRUTH, "ab"),
        (TRUTH[:, :4], TRUTH, "abc"),
        (TRUTH, TRUTH[..., 0], "abc"),
        (TRUTH[:0], TRUTH[:0], ""),
    ],
)
def test_displacements_of_shapes_that_do_not_fit_are_refused(predicted, truth, scenes):
    with pytest.raises(SettingsError, match=r"displacement: .*expected \(N, 5, 2\) twice"):
        displacement_errors(predicted, truth, scenes)

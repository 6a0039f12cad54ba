import numpy as np
import pytest

from ogmkit.grid import GridSpec
from ogmkit.homography.given import estimate

GRID = GridSpec(0.5, 40, 30, 38.0, 12.0)
SIZE = (60, 100)
# Ground 1 m below a level camera at the ego, focal length 50 px, principal point (45, 20): pixel (u, v) sees
# x = 50 / (v − 20), y = −(u − 45) / (v − 20); in cells of 0.5 m, the ego at row 38 and column 12.
BEV_FROM_IMAGE = np.array([[2.0, 11.5, -90 - 11.5 * 20], [0.0, 37.5, -37.5 * 20 - 100], [0.0, 1.0, -20.0]])


@pytest.mark.parametrize("factor", [1.0, -1.0, 3e-4, -250.0])
def test_any_scale_and_sign_comes_out_with_the_ground_in_front(factor):
    found = estimate(factor * BEV_FROM_IMAGE, SIZE, GRID)
    assert found.reasons == ("",)
    mapped = found.level_from_image[0] @ (55, 45, 1)
    assert mapped[2] > 0
    np.testing.assert_allclose(mapped[:2] / mapped[2], (2.0, -0.4))


@pytest.mark.parametrize(
    ("matrix", "reason"),
    [
        (np.zeros((3, 3)), "singular or not finite"),
        (np.full((3, 3), np.nan), "singular or not finite"),
        (np.where(np.eye(3) == 1, np.inf, 0), "singular or not finite"),
        (BEV_FROM_IMAGE * [[-1], [1], [1]], "from below"),
        (-BEV_FROM_IMAGE * [[-1], [1], [1]], "from below"),
    ],
)
def test_what_is_no_view_from_above_is_refused(matrix, reason):
    found = estimate(matrix, SIZE, GRID)
    assert reason in found.reasons[0]
    assert np.isnan(found.level_from_image).all()

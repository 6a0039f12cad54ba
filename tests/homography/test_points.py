import numpy as np
import pytest

from ogmkit.errors import SettingsError
from ogmkit.homography.points import homography_from_points
from ogmkit.homography.projective import apply

SQUARE = [(0, 0), (8, 0), (8, 8), (0, 8)]
TRAPEZOID = [(2, 0), (6, 0), (8, 8), (0, 8)]


def test_a_square_seen_as_a_trapezoid_by_hand():
    # The far side is half as wide as the near one.
    matrix = homography_from_points(TRAPEZOID, SQUARE)

    mapped, w = apply(matrix, np.array(TRAPEZOID, float))
    np.testing.assert_allclose(mapped, SQUARE, atol=1e-9)
    assert (w > 0).all()
    assert abs(matrix[2, 2]) == pytest.approx(1)
    # The diagonals cross in the square's middle, and in the trapezoid where they part 1 : 2.
    middle, _ = apply(matrix, np.array([[4.0, 8 / 3]]))
    np.testing.assert_allclose(middle, [[4, 4]], atol=1e-9)


@pytest.mark.parametrize("factor", [1.0, -1.0])
def test_many_points_of_one_homography_give_it_back(factor):
    expected = np.array([[0.5, 0.02, 3.0], [0.1, -0.7, 40.0], [0.0004, -0.002, 1.0]])
    source = np.random.default_rng(2).uniform(0, 300, (30, 2))
    destination, w = apply(factor * expected, source)
    assert (factor * w > 0).all()

    np.testing.assert_allclose(homography_from_points(source, destination), expected, rtol=1e-6)


def test_h33_is_minus_one_where_the_first_pixel_is_above_the_horizon():
    expected = np.array([[0.5, 0.02, 3.0], [0.1, -0.7, 40.0], [0.0, 0.02, -1.0]])
    source = np.random.default_rng(3).uniform(60, 300, (9, 2))

    found = homography_from_points(source, apply(expected, source)[0])

    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(
    ("source", "destination", "problem"),
    [
        (SQUARE, TRAPEZOID[:3], r"shapes \(4, 2\) and \(3, 2\), expected \(N, 2\) twice"),
        (np.zeros((4, 3)), np.zeros((4, 3)), r"shapes \(4, 3\) and \(4, 3\)"),
        (SQUARE[:3], TRAPEZOID[:3], "3 points, fewer than 4"),
        ([*SQUARE[:3], (np.nan, 0)], TRAPEZOID, "a point holds a number that is not finite"),
        ([(0, 0), (1, 1), (2, 2), (5, 0)], TRAPEZOID, r"degenerate \(three in a line"),
        (SQUARE, [(0, 0), (8, 8), (8, 0), (0, 8)], "the horizon would run through the points"),
        # w = v: the horizon is the row 0.
        ([(1, 1), (2, 1), (1, 2), (4, 2)], [(1, 1), (2, 1), (0.5, 0.5), (2, 0.5)], r"runs through \(0, 0\)"),
    ],
    ids=["lengths", "columns", "too few", "not finite", "in a line", "crossed", "no scale"],
)
def test_what_gives_no_homography_is_refused(source, destination, problem):
    with pytest.raises(SettingsError, match=problem):
        homography_from_points(source, destination)

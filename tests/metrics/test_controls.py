"""Controls against the motions that they are made for."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ogmkit.metrics.controls import CONTROLS, constant_velocity, cubic, straight_line

T = np.arange(-6.0, 7.0)
COEFFICIENTS = arrays(np.float64, (3, 2), elements=st.floats(-5, 5))
"""Of t, t² and t³, for x and y."""


def driven(coefficients):
    """Past, what is to be planned, and destination of a polynomial motion through (0, 0) at t = 0."""
    degree = np.arange(1, len(coefficients) + 1)
    xy = (T[:, None] ** degree) @ coefficients
    return xy[None, :6], xy[None, 7:12], xy[None, 12]


@given(COEFFICIENTS)
def test_the_cubic_is_exact_on_every_cubic(coefficients):
    past, future, destination = driven(coefficients)

    np.testing.assert_allclose(cubic(past, destination), future, atol=1e-9)


@given(COEFFICIENTS)
def test_constant_velocity_is_exact_on_every_line_and_needs_no_destination(coefficients):
    past, future, destination = driven(coefficients[:1])

    np.testing.assert_allclose(constant_velocity(past, destination + 9), future, atol=1e-9)


@given(COEFFICIENTS)
def test_the_straight_line_is_exact_on_every_line_and_needs_no_past(coefficients):
    past, future, destination = driven(coefficients[:1])

    np.testing.assert_allclose(straight_line(past * np.nan, destination), future, atol=1e-9)


def test_by_hand():
    past = np.zeros((2, 6, 2))
    past[:, -1] = [-3.0, 1.0]
    destination = np.array([[12.0, 6.0], [0.0, 0.0]])

    steps = np.arange(1, 6)
    np.testing.assert_allclose(constant_velocity(past, destination), [np.outer(steps, [3, -1])] * 2)
    np.testing.assert_allclose(straight_line(past, destination), [np.outer(steps, [2, 1]), np.zeros((5, 2))])


def test_their_names():
    assert tuple(CONTROLS) == ("constant-velocity", "straight-line", "cubic")

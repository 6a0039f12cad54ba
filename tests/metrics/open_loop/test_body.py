"""The ego's box along plans, against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ogmkit.metrics.open_loop.body import corners, headings, outline, placed
from ogmkit.metrics.open_loop.definition import EgoBox

BOX = EgoBox(4.0, 2.0, 1.5, turned=True)


def circle(step_rad, radius_m, count=6):
    angle = step_rad * np.arange(1, count + 1)
    return radius_m * np.column_stack([np.sin(angle), 1 - np.cos(angle)]), angle


def test_straight_on_keeps_the_heading():
    points = np.column_stack([np.arange(1.0, 7.0), np.zeros(6)])

    np.testing.assert_allclose(headings(points), 0.0, atol=1e-12)


@given(st.floats(0.5, 20), st.floats(-3, 3))
def test_a_slanted_line_has_its_direction_on_either_side_of_the_ego(step_m, angle):
    points = step_m * np.arange(1, 7)[:, None] * [np.cos(angle), np.sin(angle)]

    # Behind the ego's side it is driven in reverse.
    expected = angle if np.cos(angle) >= 0 else angle + np.pi
    np.testing.assert_allclose(np.cos(headings(points) - expected), 1.0, atol=1e-9)


def test_on_a_circle_headings_are_tangents():
    points, angle = circle(0.1, 30.0)
    found = headings(points)

    np.testing.assert_allclose(found[:-1], angle[:-1], atol=1e-9)  # chords of neighbours are parallel to it
    assert found[-1] == pytest.approx(angle[-1], abs=5e-3)  # at the end by a parabola


def test_the_last_point_that_there_is_counts_as_the_end():
    points, _ = circle(0.1, 30.0)
    cut = points.copy()
    cut[5] = np.nan

    np.testing.assert_allclose(headings(cut)[:5], headings(points[:5]))
    assert np.isnan(headings(cut)[5])


def test_standing_keeps_the_heading_whatever_the_noise():
    points, angle = circle(0.2, 10.0, 3)
    standing = points[-1] + [[0.01, -0.02], [-0.02, 0.01], [0.0, 0.02]]
    found = headings(np.concatenate([points, standing]))

    assert found[3] == found[4] == found[5]
    assert abs(found[3] - angle[-1]) < 0.3
    assert not headings(np.full((6, 2), 0.01)).any()


def test_the_box_stands_ahead_of_the_point_and_turns_with_it():
    points = np.stack([np.zeros(6), np.arange(1.0, 7.0)], axis=-1)  # to the left
    found = placed(points, BOX, corners(BOX))

    # From 0.5 m behind the point to 3.5 m ahead of it, which is to the left: y.
    np.testing.assert_allclose(found[2].min(axis=0), [-1.0, 2.5], atol=1e-9)
    np.testing.assert_allclose(found[2].max(axis=0), [1.0, 6.5], atol=1e-9)
    fixed = placed(points, EgoBox(4.0, 2.0, 1.5, turned=False), corners(BOX))
    np.testing.assert_allclose(fixed[2].min(axis=0), [-0.5, 2.0])
    np.testing.assert_allclose(fixed[2].max(axis=0), [3.5, 4.0])


def test_an_outline_goes_round_by_small_steps():
    found = outline(BOX, 0.3)
    gaps = np.linalg.norm(found - np.roll(found, 1, axis=0), axis=1)

    assert gaps.max() <= 0.3
    assert gaps.sum() == pytest.approx(12.0)
    assert np.all(np.isclose(np.abs(found[:, 0]), 2.0) | np.isclose(np.abs(found[:, 1]), 1.0))

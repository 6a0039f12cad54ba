import numpy as np
import pytest

from ogmkit.synthetic.scenery import TREE, Solids
from ogmkit.synthetic.visibility import visible_fraction

INTRINSICS = np.array([[800.0, 0, 399.5], [0, 800, 224.5], [0, 0, 1]])
SIZE = (450, 800)
# Looks along global x from 1.5 m above the origin.
AHEAD = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.5], [0, 0, 0, 1]])


def solids(*boxes, category="vehicle.car"):
    """Upright boxes given as (x, y, z of the centre, width, length, height)."""
    poses = np.tile(np.eye(4), (len(boxes), 1, 1))
    poses[:, :3, 3] = [box[:3] for box in boxes]
    sizes = np.array([box[3:] for box in boxes], dtype=float)
    return Solids(
        poses, sizes, (category,) * len(boxes), np.full((len(boxes), 3), 128.0), np.ones(len(boxes), bool)
    )


def test_alone_in_view_is_wholly_visible_and_behind_the_camera_not_at_all():
    boxes = solids((20, 0, 1, 2, 4, 2), (-20, 0, 1, 2, 4, 2), (20, 100, 1, 2, 4, 2))
    assert visible_fraction(boxes, [(INTRINSICS, AHEAD, SIZE)]).tolist() == [1, 0, 0]


@pytest.mark.parametrize("share", [0.25, 0.5, 0.8])
def test_thin_wall_in_front_covers_its_share(share):
    """A flat panel at 20 m, and at 10 m a wall that covers the given share of it from its left edge on."""
    panel = (20.0, 0.0, 1.5, 4.0, 1e-3, 2.0)
    left_edge = 2.0 * 10 / 20
    covered = share * 4.0 * 10 / 20
    wall = (10.0, left_edge - covered / 2, 1.5, covered, 1e-3, 3.0)
    fractions = visible_fraction(solids(panel, wall), [(INTRINSICS, AHEAD, SIZE)])
    assert fractions[0] == pytest.approx(1 - share, abs=0.04)
    assert fractions[1] == 1


def test_order_of_the_solids_does_not_matter():
    near, far = (10.0, 0.3, 1.5, 1.0, 1.0, 3.0), (20.0, 0.0, 1.5, 4.0, 1.0, 2.0)
    view = [(INTRINSICS, AHEAD, SIZE)]
    assert (
        visible_fraction(solids(near, far), view).tolist()
        == visible_fraction(solids(far, near), view)[::-1].tolist()
    )


def test_hidden_behind_a_larger_box_is_zero():
    boxes = solids((30, 0, 1, 2, 4, 2), (10, 0, 1.5, 4, 1, 3))
    assert visible_fraction(boxes, [(INTRINSICS, AHEAD, SIZE)]).tolist() == [0, 1]


def test_views_are_counted_together():
    """Hidden in one camera, free in a second at the same distance: half of all pixels are seen."""
    beyond = np.array([[0.0, 0, -1, 40], [1, 0, 0, 0], [0, -1, 0, 1.5], [0, 0, 0, 1]])
    boxes = solids((20, 0, 1.5, 2, 1e-3, 2), (10, 0, 1.5, 6, 1e-3, 6))
    views = [(INTRINSICS, AHEAD, SIZE), (INTRINSICS, beyond, SIZE)]
    assert visible_fraction(boxes, views)[0] == pytest.approx(0.5, abs=0.02)


def test_box_that_reaches_behind_the_camera_covers_what_it_should():
    beside = (0.0, 1.5, 1.5, 1.0, 30.0, 3.0)
    left, right = (20.0, 6.0, 1.5, 1, 1, 2), (20.0, -6.0, 1.5, 1, 1, 2)
    fractions = visible_fraction(solids(beside, left, right), [(INTRINSICS, AHEAD, SIZE)])
    assert fractions[1] == 0
    assert fractions[2] == 1


def test_one_pixel_box_is_still_judged():
    """At 90 m a cone covers four pixels; half of it stands behind a wall's edge."""
    cone, wall = (90.0, 0.0, 1.5, 0.4, 0.01, 0.4), (45.0, 5.0, 1.5, 10.0, 0.01, 3.0)
    fractions = visible_fraction(solids(cone, wall), [(INTRINSICS, AHEAD, SIZE)])
    assert fractions[0] == pytest.approx(0.5, abs=0.07)


def test_parts_of_a_tree_do_not_hide_each_other():
    tree = solids((20, 0, 3, 4, 4, 6), category=TREE)
    assert visible_fraction(tree, [(INTRINSICS, AHEAD, SIZE)]).tolist() == [1]


def test_no_views_show_nothing():
    assert visible_fraction(solids((20, 0, 1, 2, 4, 2)), []).tolist() == [0]

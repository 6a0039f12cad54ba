import numpy as np
import shapely
from pyquaternion import Quaternion

from ogmkit.frames import Boxes
from ogmkit.geometry.se3 import level_from_global, pose_matrix
from ogmkit.grid import GridSpec
from ogmkit.raster.vehicles import select, vehicle_mask

_FACING_NORTH = level_from_global(pose_matrix([10, 20, 0], [np.sqrt(0.5), 0, 0, np.sqrt(0.5)]))


def _picture(mask):
    return ["".join(".#"[cell] for cell in row) for row in mask]


def test_a_box_ahead_on_the_left_stands_up_left_of_the_ego_s_cell(boxes_of):
    # Ego faces north at (10, 20); a box of 2 m × 1 m, along its way, 3 m ahead and 1.5 m to the left.
    grid = GridSpec(m_per_cell=0.5, rows=9, columns=7, ego_row=9, ego_column=5)
    boxes = boxes_of([[8.5, 23, 1]], [np.pi / 2], [[1, 2, 1.5]])
    by_hand = [".......", *[".##...."] * 4, *["......."] * 4]
    assert _picture(vehicle_mask(grid, _FACING_NORTH, boxes)) == by_hand


def test_overlapping_boxes_unite(boxes_of):
    grid = GridSpec(m_per_cell=0.1, rows=100, columns=100, ego_row=100, ego_column=50)
    centres, headings, sizes = [[10, 24, 0], [10.4, 24.3, 0]], [1.0, 2.0], [[2, 4, 1], [2, 5, 1]]
    together = vehicle_mask(grid, _FACING_NORTH, boxes_of(centres, headings, sizes))
    apart = [
        vehicle_mask(grid, _FACING_NORTH, boxes_of([centre], [heading], [size]))
        for centre, heading, size in zip(centres, headings, sizes, strict=True)
    ]
    assert (apart[0] & apart[1]).any()
    np.testing.assert_array_equal(together, apart[0] | apart[1])


def test_no_boxes_give_an_empty_canvas(boxes_of):
    mask = vehicle_mask(GridSpec(rows=5, columns=4), np.eye(4), boxes_of([], [], []))
    np.testing.assert_array_equal(mask, np.zeros((5, 4), np.uint8))


def test_selection_goes_by_category_s_beginning_and_visibility_and_keeps_the_unknown(boxes_of):
    boxes = boxes_of(
        np.zeros((5, 3)),
        np.zeros(5),
        np.ones((5, 3)),
        [
            "vehicle.car",
            "human.pedestrian.adult",
            "vehicle.bus.rigid",
            "vehicle.car",
            "movable_object.barrier",
        ],
        [1, 4, 3, 0, 4],
    )
    assert select(boxes).annotation_token == ("annotation 0", "annotation 2", "annotation 3")
    assert select(boxes, min_visibility=3).annotation_token == ("annotation 2", "annotation 3")
    assert select(boxes, ("vehicle.bus", "human.")).annotation_token == ("annotation 1", "annotation 2")
    assert len(select(select(boxes, ("static_object.",)))) == 0


def test_selection_goes_by_lidar_points_and_keeps_the_unknown(boxes_of):
    boxes = boxes_of(np.zeros((5, 3)), np.zeros(5), np.ones((5, 3)), points=[0, 1, 5, -1, 4])
    assert len(select(boxes)) == 5
    kept = {
        least: [int(token[-1]) for token in select(boxes, min_lidar_points=least).annotation_token]
        for least in (1, 5, 6)
    }
    assert kept == {1: [1, 2, 3, 4], 5: [2, 3], 6: [3]}


def _real_boxes(annotations):
    return Boxes(
        annotation_token=tuple(annotation["token"] for annotation in annotations),
        instance_token=tuple(annotation["instance_token"] for annotation in annotations),
        category=("vehicle.car",) * len(annotations),
        global_from_box=pose_matrix(
            [annotation["translation"] for annotation in annotations],
            [annotation["rotation"] for annotation in annotations],
        ),
        size_wlh=np.array([annotation["size"] for annotation in annotations]),
        visibility=np.zeros(len(annotations), np.uint8),
        num_lidar_pts=np.zeros(len(annotations), np.int64),
    )


def _footprint_in_cells(annotation, pose):
    """A box's ground face in (column, row) of the default grid, by pyquaternion and the design's formulas."""
    width, length, height = annotation["size"]
    turn = Quaternion(annotation["rotation"])
    corners = [
        turn.rotate(np.array([x * length / 2, y * width / 2, -height / 2])) + annotation["translation"]
        for x, y in ((1, 1), (1, -1), (-1, -1), (-1, 1))
    ]
    forward = Quaternion(pose["rotation"]).rotation_matrix[:2, 0]
    forward = forward / np.hypot(*forward)
    offsets = np.array(corners)[:, :2] - pose["translation"][:2]
    ahead, left = offsets @ forward, offsets @ [-forward[1], forward[0]]
    return shapely.Polygon(np.stack([300 - 0.5 - left / 0.1, 1000 - 0.5 - ahead / 0.1], axis=-1))


def test_real_vehicles_fill_the_cells_whose_centre_is_inside(real_frames):
    grid = GridSpec()
    whole_grid = shapely.box(-0.5, -0.5, grid.columns - 0.5, grid.rows - 0.5)
    intersection = union = 0
    cells = area = 0.0
    for frame in real_frames:
        pose = frame.pose
        global_from_ego = pose_matrix(pose["translation"], pose["rotation"])
        mask = vehicle_mask(grid, level_from_global(global_from_ego), _real_boxes(frame.vehicles))
        footprints = [_footprint_in_cells(annotation, pose) for annotation in frame.vehicles]
        expected = np.zeros(grid.shape, bool)
        for footprint in footprints:
            _mark_centres_inside(expected, footprint)
        intersection += (mask & expected).sum()
        union += (mask | expected).sum()
        cells += mask.sum()
        area += shapely.intersection(shapely.union_all(footprints), whole_grid).area
    assert len(real_frames) == 41
    assert intersection / union >= 0.999
    assert abs(cells / area - 1) < 0.002


def _mark_centres_inside(canvas, polygon):
    left, top, right, bottom = np.clip(np.round(polygon.bounds), 0, 1000).astype(int)
    window = canvas[top : bottom + 1, left : right + 1]
    rows, columns = np.mgrid[: window.shape[0], : window.shape[1]]
    window |= shapely.contains_xy(polygon, columns + left, rows + top)

import numpy as np
import pytest
from shapely.geometry import MultiLineString, MultiPolygon, box

from ogmkit.errors import SettingsError
from ogmkit.geometry.se3 import inverse, pose_matrix, transform_points
from ogmkit.synthetic.lidar import MAX_RANGE_M, ray_directions, scan
from ogmkit.synthetic.rig import LIDAR_MOUNT
from ogmkit.synthetic.scenery import GroundLayers, Palette, Scenery, Solids

GLOBAL_FROM_EGO = pose_matrix([30.0, 20.0, 0.0], [np.cos(0.35), 0, 0, np.sin(0.35)])
GLOBAL_FROM_LIDAR = GLOBAL_FROM_EGO @ pose_matrix(LIDAR_MOUNT.translation_m, LIDAR_MOUNT.rotation_wxyz)
NOTHING, NO_LINES = MultiPolygon(), MultiLineString()


def scenery(height=None, **layers):
    empty = dict.fromkeys(("drivable", "walkway", "crossings", "islands"), NOTHING)
    lines = dict.fromkeys(("lane_dividers", "road_edges", "parking_lines"), NO_LINES)
    return Scenery(GroundLayers(**{**empty, **lines, **layers}), height, Palette.from_seed(0), (0, 0, 60, 40))


def solids(poses, sizes):
    count = len(poses)
    return Solids(
        np.reshape(np.array(poses, dtype=float), (-1, 4, 4)),
        np.reshape(np.array(sizes, dtype=float), (-1, 3)),
        ("vehicle.car",) * count,
        np.full((count, 3), 90.0),
        np.ones(count, dtype=bool),
    )


def random_solids(seed, count):
    """Boxes all about the sensor, turned every way, touching and intersecting one another."""
    random = np.random.default_rng(seed)
    centres = np.column_stack(
        [random.uniform(5, 55, count), random.uniform(-5, 45, count), random.uniform(0, 4, count)]
    )
    far = np.hypot(*(centres[:, :2] - GLOBAL_FROM_LIDAR[:2, 3]).T) > 5
    return solids(
        pose_matrix(centres, random.normal(size=(count, 4)))[far], random.uniform(0.3, 5, (count, 3))[far]
    )


def nearest_hits(boxes, global_from_lidar, directions):
    """Brute force: cut every ray with every face's plane and see whether the cut lies on the face."""
    best, owner = np.full(len(directions), np.inf), np.full(len(directions), -1)
    for index in range(len(boxes)):
        box_from_lidar = inverse(boxes.global_from_box[index]) @ global_from_lidar
        start, rays = box_from_lidar[:3, 3], directions @ box_from_lidar[:3, :3].T
        half = boxes.size_wlh[index, [1, 0, 2]] / 2
        for axis in range(3):
            others = [other for other in range(3) if other != axis]
            for side in (-half[axis], half[axis]):
                distance = (side - start[axis]) / rays[:, axis]
                cut = start + distance[:, None] * rays
                hit = (
                    (np.abs(cut[:, others]) <= half[others]).all(axis=1) & (distance > 0) & (distance < best)
                )
                best[hit], owner[hit] = distance[hit], index
    return best, owner


def test_empty_flat_world_gives_the_closed_form_of_every_ring():
    global_from_lidar = pose_matrix([30.0, 20.0, 1.84], [1, 0, 0, 0])
    points, owner = scan(scenery(), solids([], []), global_from_lidar, azimuths=12)
    assert (owner == -1).all()
    elevations = np.radians(np.linspace(-30.67, 10.67, 32))
    expected = [
        1.84 / np.sin(-angle) for angle in elevations if angle < 0 and 1.84 / np.sin(-angle) < MAX_RANGE_M
    ]
    assert len(points) == 12 * len(expected)
    for ring, range_m in enumerate(expected):
        of_ring = points[points[:, 4] == ring]
        np.testing.assert_allclose(np.linalg.norm(of_ring[:, :3], axis=1), range_m, rtol=1e-6)
        np.testing.assert_allclose(of_ring[:, 2], -1.84, rtol=1e-6)
    np.testing.assert_allclose(np.arctan2(points[0, 1], points[0, 0]), 0, atol=1e-6)


def test_points_are_float32_with_a_ring_and_an_intensity_in_range():
    points, owner = scan(scenery(), random_solids(1, 30), GLOBAL_FROM_LIDAR, azimuths=200)
    assert points.dtype == np.float32
    assert points.shape == (len(owner), 5)
    assert set(np.unique(points[:, 4])) <= set(range(32))
    assert points[:, 3].min() >= 0
    assert points[:, 3].max() <= 255


@pytest.mark.parametrize("seed", [2, 3])
def test_every_return_equals_brute_force_over_all_faces(seed):
    boxes = random_solids(seed, 40)
    points, owner = scan(scenery(), boxes, GLOBAL_FROM_LIDAR, azimuths=180)
    directions = ray_directions(32, 180).reshape(-1, 3)
    boxes_m, hit = nearest_hits(boxes, GLOBAL_FROM_LIDAR, directions)
    down = (directions @ GLOBAL_FROM_LIDAR[:3, :3].T)[:, 2]
    ground_m = np.where(down < 0, -GLOBAL_FROM_LIDAR[2, 3] / np.minimum(down, -1e-12), np.inf)
    expected_m = np.minimum(boxes_m, ground_m)
    hit[ground_m <= boxes_m] = -1
    kept = (expected_m >= 1) & (expected_m <= MAX_RANGE_M)
    assert len(set(hit[kept])) > 15
    np.testing.assert_array_equal(owner, hit[kept])
    np.testing.assert_allclose(points[:, :3], directions[kept] * expected_m[kept, None], atol=2e-5)


def test_asymmetric_scene_shows_no_flip():
    """A box ahead and to the left of the ego is hit in the sensor's own frame where its corners are."""
    ahead_left = GLOBAL_FROM_EGO @ pose_matrix([12.0, 5.0, 0.8], [1, 0, 0, 0])
    points, owner = scan(scenery(), solids([ahead_left], [[2, 4, 1.6]]), GLOBAL_FROM_LIDAR)
    on_box = transform_points(inverse(ahead_left) @ GLOBAL_FROM_LIDAR, points[owner == 0, :3].astype(float))
    assert len(on_box) > 100
    assert (np.abs(on_box) <= np.array([2, 1, 0.8]) + 1e-4).all()
    # x of the sensor points to the ego's right, y ahead.
    assert (points[owner == 0, 0] < 0).all()
    assert (points[owner == 0, 1] > 5).all()


def test_returns_from_the_vehicle_itself_are_dropped():
    at_sensor = GLOBAL_FROM_LIDAR.copy()
    at_sensor[:3, 3] += GLOBAL_FROM_LIDAR[:3, 0] * 0.7
    _, owner = scan(scenery(), solids([at_sensor], [[0.2, 0.2, 0.2]]), GLOBAL_FROM_LIDAR)
    assert (owner == -1).all()


def test_painted_lines_are_brighter_than_grass():
    bright = scenery(parking_lines=MultiLineString([[(20, 26), (40, 26)]]))
    ego_level = pose_matrix([30.0, 20.0, 1.84], [1, 0, 0, 0])
    points, _ = scan(bright, solids([], []), ego_level)
    on_line = (np.abs(points[:, 1] - 6) < 0.05) & (np.abs(points[:, 0]) < 8)
    beside = (np.abs(points[:, 1] - 6.6) < 0.3) & (np.abs(points[:, 0]) < 8)
    assert points[on_line, 3].mean() > 1.5 * points[beside, 3].mean()


def test_relief_is_met_on_its_surface_and_hides_what_lies_behind():
    def height(points):
        return 2.5 * np.exp(-(((points[..., 0] - 45) / 4) ** 2))

    sensor = pose_matrix([30.0, 20.0, 1.84], [1, 0, 0, 0])
    low = pose_matrix([55.0, 20.0, 0.4], [1, 0, 0, 0])
    points, owner = scan(scenery(height), solids([low], [[2, 4, 0.8]]), sensor)
    ground = transform_points(sensor, points[owner == -1, :3].astype(float))
    error_m = np.abs(ground[:, 2] - height(ground[:, :2]))
    assert np.quantile(error_m, 0.99) < 1e-3
    assert (owner == -1).all()
    _, flat_owner = scan(scenery(), solids([low], [[2, 4, 0.8]]), sensor)
    assert (flat_owner == 0).sum() > 5


@pytest.mark.parametrize("arguments", [{"beams": 0}, {"azimuths": 0}])
def test_scan_without_rays_is_refused(arguments):
    with pytest.raises(SettingsError, match="no rays"):
        scan(scenery(), solids([], []), GLOBAL_FROM_LIDAR, **arguments)


def test_sensor_below_the_ground_is_refused():
    with pytest.raises(SettingsError, match="not above the ground"):
        scan(scenery(lambda points: np.full(points.shape[:-1], 5.0)), solids([], []), GLOBAL_FROM_LIDAR)


def test_drivable_area_with_a_hole_can_be_scanned():
    ring = box(10, 10, 50, 30).difference(box(28, 18, 32, 22))
    points, _ = scan(scenery(drivable=ring), solids([], []), GLOBAL_FROM_LIDAR, azimuths=90)
    assert len(points) > 0

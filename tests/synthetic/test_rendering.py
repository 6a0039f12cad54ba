from dataclasses import replace

import cv2
import numpy as np
import pytest
import shapely
from shapely.geometry import MultiLineString, MultiPolygon

from ogmkit.errors import SettingsError
from ogmkit.geometry.boxes import box_corners
from ogmkit.geometry.camera import image_from_ground, project
from ogmkit.geometry.se3 import inverse, pose_matrix, transform_points
from ogmkit.synthetic.drawing import draw_parts
from ogmkit.synthetic.parts import split_into_parts
from ogmkit.synthetic.rendering import encode_jpeg, render_image
from ogmkit.synthetic.rig import CAMERA_MOUNTS, scaled_intrinsics
from ogmkit.synthetic.scenery import GroundLayers, Palette, Scenery, Solids
from ogmkit.synthetic.view import View

SIZE = (225, 400)
INTRINSICS = scaled_intrinsics("CAM_FRONT", SIZE)
MOUNT = CAMERA_MOUNTS["CAM_FRONT"]
EGO_FROM_CAMERA = pose_matrix(MOUNT.translation_m, MOUNT.rotation_wxyz)
GLOBAL_FROM_EGO = pose_matrix([20.0, 30.0, 0.0], [np.cos(0.1), 0, 0, np.sin(0.1)])
GLOBAL_FROM_CAMERA = GLOBAL_FROM_EGO @ EGO_FROM_CAMERA
PALETTE = Palette.from_seed(0)
CLEAR_NOON = replace(PALETTE, sun_direction=(0.0, 0.0, 1.0), haze_m=1e6)


def scenery(height=None, palette=CLEAR_NOON, **layers):
    nothing = dict.fromkeys(("drivable", "walkway", "crossings", "islands"), MultiPolygon())
    no_lines = dict.fromkeys(("lane_dividers", "road_edges", "parking_lines"), MultiLineString())
    return Scenery(GroundLayers(**{**nothing, **no_lines, **layers}), height, palette, (0, 0, 80, 60))


def solids(poses, sizes, colours=None, category="static"):
    count = len(poses)
    return Solids(
        np.reshape(np.array(poses, dtype=float), (-1, 4, 4)),
        np.reshape(np.array(sizes, dtype=float), (-1, 3)),
        (category,) * count,
        np.full((count, 3), 200.0) if colours is None else np.array(colours, dtype=float),
        np.ones(count, dtype=bool),
    )


def ahead(x, y, z, yaw=0.0):
    """A pose given in the ego's frame."""
    return GLOBAL_FROM_EGO @ pose_matrix([x, y, z], [np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)])


def draw_only(boxes, intrinsics=INTRINSICS, global_from_camera=GLOBAL_FROM_CAMERA, size=SIZE):
    """Boxes alone, without ground: their image and 1/depth, which is −1 where nothing is."""
    image, inverse_depth = np.zeros((*size, 3), np.float32), np.full(size, -1, np.float32)
    view = View(intrinsics, global_from_camera, size, None)
    draw_parts(image, inverse_depth, split_into_parts(boxes), view, CLEAR_NOON)
    return image, inverse_depth


def hull_in_image(boxes, index):
    corners = box_corners(boxes.global_from_box, boxes.size_wlh)[index]
    pixels, depth = project(INTRINSICS, transform_points(inverse(GLOBAL_FROM_CAMERA), corners))
    assert depth.min() > 0
    return shapely.MultiPoint(pixels).convex_hull


def pixel_centres():
    return np.meshgrid(np.arange(SIZE[1]), np.arange(SIZE[0]))


def seen(image, hull, margin_px=-1.0):
    """Median colour of the pixels well inside an outline."""
    return np.median(image[shapely.contains_xy(hull.buffer(margin_px), *pixel_centres())], axis=0)


def cast(boxes, origin, rays):
    """Brute force: 1/t (N,) at which rays first cut a face of any box; −1 where they cut none."""
    found = np.full(len(rays), -1.0)
    for pose, size in zip(boxes.global_from_box, boxes.size_wlh, strict=True):
        start, directions = transform_points(inverse(pose), origin[None])[0], rays @ pose[:3, :3]
        half = size[[1, 0, 2]] / 2
        for axis in range(3):
            others = [other for other in range(3) if other != axis]
            for side in (-half[axis], half[axis]):
                distance = (side - start[axis]) / directions[:, axis]
                cut = start + distance[:, None] * directions
                hit = (np.abs(cut[:, others]) <= half[others]).all(axis=1) & (distance > 0)
                found[hit] = np.maximum(found[hit], 1 / distance[hit])
    return found


@pytest.mark.parametrize("place", [(12, 2, 0.9, 0.4), (30, -6, 1.2, 1.9), (60, 10, 0.8, -0.7)])
def test_drawn_silhouette_holds_exactly_the_pixel_centres_inside_the_projected_box(place):
    boxes = solids([ahead(*place)], [[1.9, 4.6, 1.7]])
    _, inverse_depth = draw_only(boxes)
    hull = hull_in_image(boxes, 0)
    centres = pixel_centres()
    # Pixels whose centre lies on the outline itself, to rounding, may fall either way.
    surely = shapely.contains_xy(hull.buffer(-1e-3), *centres)
    maybe = shapely.contains_xy(hull.buffer(1e-3), *centres)
    drawn = inverse_depth > 0
    assert surely.sum() > 20
    assert (drawn >= surely).all()
    assert (drawn <= maybe).all()


def test_whole_pipeline_changes_no_pixel_beyond_a_box_and_every_pixel_in_it():
    """The box hangs in the air where there is no sun, so that no shadow falls on the ground."""
    world = scenery(palette=replace(CLEAR_NOON, sun_strength=0.0))
    boxes = solids([ahead(15, 2, 1.9, 0.5)], [[1.9, 4.6, 1.7]], [(250, 20, 250)])
    without = render_image(world, solids([], []), INTRINSICS, GLOBAL_FROM_CAMERA, SIZE, noise_seed=3)
    with_box = render_image(world, boxes, INTRINSICS, GLOBAL_FROM_CAMERA, SIZE, noise_seed=3)
    changed = (without != with_box).any(axis=-1)
    hull = hull_in_image(boxes, 0)
    inside = shapely.contains_xy(hull, *pixel_centres())
    around = shapely.contains_xy(hull.buffer(0.9), *pixel_centres())
    assert inside.sum() > 1000
    assert (changed >= inside).all()
    assert (changed <= around).all()


def test_depth_of_every_pixel_equals_brute_force_with_intersecting_boxes_and_boxes_beside_the_camera():
    random = np.random.default_rng(5)
    poses = [GLOBAL_FROM_EGO @ pose_matrix(centre, turn) for centre, turn in _random_poses(random, 25)]
    sizes = random.uniform(0.4, 4, (25, 3))
    # Long walls that reach behind the camera, to be cut at the near plane.
    poses += [ahead(0, 4, 1, 0.0), ahead(2, -5, 2, 0.05)]
    boxes = solids(poses, [*sizes, (1, 40, 3), (2, 30, 1)])
    _, inverse_depth = draw_only(boxes)
    view = View(INTRINSICS, GLOBAL_FROM_CAMERA, SIZE, None)
    rays = view.directions(np.arange(225.0), np.arange(400.0)).reshape(3, -1).T.astype(float)
    expected = cast(boxes, view.origin, rays).reshape(SIZE)
    # Rays through an edge may fall either way in single precision.
    agrees = np.isclose(inverse_depth, expected, rtol=1e-3)
    assert (expected > 0).mean() > 0.3
    assert agrees.mean() > 0.9995


def _random_poses(random, count):
    centres = np.column_stack(
        [random.uniform(6, 25, count), random.uniform(-7, 7, count), random.uniform(0, 4, count)]
    )
    return zip(centres, random.normal(size=(count, 4)), strict=True)


def test_nearer_box_covers_the_farther_whatever_their_order():
    near, far = ahead(10, 0.5, 1), ahead(25, 0, 1)
    red, green = (0, 0, 250), (0, 250, 0)
    sizes = [[2, 2, 2], [6, 2, 2]]
    forwards = render_image(
        scenery(),
        solids([near, far], sizes, [red, green]),
        INTRINSICS,
        GLOBAL_FROM_CAMERA,
        SIZE,
        noise_seed=0,
    )
    boxes = solids([far, near], sizes[::-1], [green, red])
    backwards = render_image(scenery(), boxes, INTRINSICS, GLOBAL_FROM_CAMERA, SIZE, noise_seed=0)
    np.testing.assert_array_equal(forwards, backwards)
    front, back = hull_in_image(boxes, 1), hull_in_image(boxes, 0)
    assert np.argmax(seen(forwards, front)) == 2
    assert np.argmax(seen(forwards, back.difference(front))) == 1


@pytest.mark.parametrize("size", [(450, 800), (180, 600)])
def test_painted_letter_appears_where_its_homography_puts_it_and_nowhere_mirrored(size):
    """An F of painted lines on the road: not symmetric under any flip or swap of axes."""
    strokes_ego = [((7, 1.5), (11, 1.5)), ((11, 1.5), (11, -1.5)), ((9, 1.5), (9, -0.5))]
    strokes = [transform_points(GLOBAL_FROM_EGO, np.array([(*a, 0), (*b, 0)], float)) for a, b in strokes_ego]
    world = scenery(parking_lines=MultiLineString([stroke[:, :2] for stroke in strokes]))
    intrinsics = scaled_intrinsics("CAM_FRONT", size)
    image = render_image(world, solids([], []), intrinsics, GLOBAL_FROM_CAMERA, size, noise_seed=0)
    brightness = image.mean(axis=-1)

    def along(strokes_level):
        points = np.concatenate([np.linspace(a, b, 40)[4:-4] for a, b in strokes_level])
        mapped = (
            np.column_stack([points, np.ones(len(points))]) @ image_from_ground(intrinsics, EGO_FROM_CAMERA).T
        )
        u, v = np.round(mapped[:, :2] / mapped[:, 2:]).astype(int).T
        return brightness[v, u]

    left_right_swapped = ((7, -1.5), (11, -1.5))
    front_back_swapped = ((7, 1.0), (7, -1.5))
    shifted = ((7, 1.9), (11, 1.9))
    grass = np.median(brightness[-10:])
    assert np.quantile(along(strokes_ego), 0.1) > 1.3 * grass
    for absent in (left_right_swapped, front_back_swapped, shifted):
        assert np.median(along([absent])) < 1.2 * grass


def test_level_height_function_draws_the_same_ground_as_none():
    flat = View(INTRINSICS, GLOBAL_FROM_CAMERA, SIZE, None)
    level = View(INTRINSICS, GLOBAL_FROM_CAMERA, SIZE, lambda points: np.zeros(points.shape[:-1]))
    rays = flat.directions(np.arange(225.0), np.arange(400.0))
    np.testing.assert_allclose(
        np.maximum(level.ground_inverse_depth(rays), 1 / 400),
        np.maximum(flat.ground_inverse_depth(rays), 1 / 400),
        atol=2e-4,
        rtol=2e-3,
    )


def rolling(points):
    return 1.2 * np.sin(points[..., 0] / 9) + 0.8 * np.cos(points[..., 1] / 7)


def test_relief_is_met_where_a_fine_march_along_the_ray_meets_it():
    pose = GLOBAL_FROM_CAMERA.copy()
    pose[2, 3] += rolling(pose[:2, 3])
    view = View(INTRINSICS, pose, SIZE, rolling)
    rays = view.directions(np.arange(120.0, 225, 15), np.arange(0.0, 400, 40))
    depths = np.arange(0.5, 60, 0.01)
    points = view.origin + depths[:, None] * rays.reshape(3, -1).T[:, None].astype(float)
    below = points[..., 2] < rolling(points[..., :2])
    expected = np.where(below.any(axis=1), depths[below.argmax(axis=1)], np.inf)
    found = 1 / np.maximum(view.ground_inverse_depth(rays).reshape(-1), 1e-9)
    near = (expected < 60) & (found < 60)
    assert near.sum() > 30
    assert np.quantile(np.abs(found / expected - 1)[near], 0.9) < 0.01


def test_no_ray_passes_through_a_ridge_on_its_way_to_the_ground():
    def ridge(points):
        return np.exp(-(((points[..., 0] - 28) / 1.5) ** 2)) + np.exp(-(((points[..., 0] - 45) / 2) ** 2))

    view = View(INTRINSICS, GLOBAL_FROM_CAMERA, SIZE, ridge)
    rays = view.directions(np.arange(110.0, 190), np.arange(0.0, 400, 40))
    inverse_depth = view.ground_inverse_depth(rays).reshape(-1)
    landed = inverse_depth > 1 / 150
    depths = np.linspace(0, 0.98, 400) / inverse_depth[landed, None]
    points = view.origin + depths[..., None] * rays.reshape(3, -1).T[landed, None].astype(float)
    beyond = points[:, -1, 0] > 47
    assert beyond.sum() > 20
    assert (points[..., 2] > ridge(points[..., :2]) - 0.05).all()


def test_hill_hides_the_box_behind_it():
    def hill(points):
        return 3 * np.exp(-(((points[..., 0] - 35) / 4) ** 2))

    boxes = solids([ahead(28, 0, 0.6)], [[2, 4, 1.2]], [(250, 20, 250)])
    images = [
        render_image(scenery(height), boxes, INTRINSICS, GLOBAL_FROM_CAMERA, SIZE, noise_seed=0).astype(int)
        for height in (None, hill)
    ]
    magenta = [
        (image[..., 0] > image[..., 1] + 60) & (image[..., 2] > image[..., 1] + 60) for image in images
    ]
    assert magenta[0].sum() > 100
    assert magenta[1].sum() == 0


def test_same_seed_gives_the_same_pixels_and_another_seed_other_noise():
    boxes = solids([ahead(12, 1, 0.8)], [[2, 4, 1.6]], category="vehicle.car")
    first, again, other = (
        render_image(scenery(), boxes, INTRINSICS, GLOBAL_FROM_CAMERA, SIZE, noise_seed=seed)
        for seed in (7, 7, 8)
    )
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()
    assert np.abs(first.astype(int) - other).max() < 20


@pytest.mark.parametrize(("yaw", "red_end"), [(np.pi / 2, "right"), (-np.pi / 2, "left")])
def test_tail_lamps_are_at_the_end_away_from_the_heading(yaw, red_end):
    """A grey car crosses ahead, to the ego's left or right."""
    boxes = solids([ahead(9, 0, 0.8, yaw)], [[1.9, 4.5, 1.6]], category="vehicle.car")
    image, inverse_depth = draw_only(boxes)
    columns = np.nonzero((image[..., 2] > 2 * image[..., 1]) & (image[..., 2] > 60))[1]
    middle = np.nonzero(inverse_depth > 0)[1].mean()
    assert len(columns) > 5
    assert (columns > middle).all() if red_end == "right" else (columns < middle).all()


@pytest.mark.parametrize(("yaw", "red"), [(0.0, True), (np.pi, False)])
def test_red_lamps_are_seen_from_behind_only(yaw, red):
    image, _ = draw_only(solids([ahead(9, 0, 0.8, yaw)], [[1.9, 4.5, 1.6]], category="vehicle.car"))
    assert ((image[..., 2] > 2 * image[..., 1]) & (image[..., 2] > 60)).any() == red


def test_vehicle_casts_a_shadow_away_from_the_sun():
    """The sun stands low to the ego's left, so the ground to the right of the box is dark."""
    sun = GLOBAL_FROM_EGO[:3, :3] @ [0, np.cos(0.6), np.sin(0.6)]
    world = scenery(palette=replace(CLEAR_NOON, sun_direction=tuple(sun), sun_strength=1.0))
    boxes = solids([ahead(14, 0, 1)], [[1, 4, 2]])
    image = render_image(world, boxes, INTRINSICS, GLOBAL_FROM_CAMERA, SIZE, noise_seed=0).mean(axis=-1)
    ground = np.array([[14.0, -1.8, 1], [14.0, 1.8, 1]]) @ image_from_ground(INTRINSICS, EGO_FROM_CAMERA).T
    (right_u, right_v), (left_u, left_v) = np.round(ground[:, :2] / ground[:, 2:]).astype(int)
    assert image[right_v, right_u] < 0.7 * image[left_v, left_u]


def test_jpeg_decodes_to_about_the_same_picture():
    image = render_image(scenery(), solids([], []), INTRINSICS, GLOBAL_FROM_CAMERA, SIZE, noise_seed=0)
    decoded = cv2.imdecode(np.frombuffer(encode_jpeg(image), np.uint8), cv2.IMREAD_COLOR)
    assert decoded.shape == (225, 400, 3)
    assert np.abs(decoded.astype(int) - image).mean() < 4


@pytest.mark.parametrize("depth_m", [0.0, -3.0])
def test_camera_that_is_not_above_the_ground_is_refused(depth_m):
    pose = GLOBAL_FROM_CAMERA.copy()
    pose[2, 3] = depth_m
    with pytest.raises(SettingsError, match="not above the ground"):
        render_image(scenery(), solids([], []), INTRINSICS, pose, SIZE, noise_seed=0)


def test_image_without_pixels_is_refused():
    with pytest.raises(SettingsError, match="no pixels"):
        render_image(scenery(), solids([], []), INTRINSICS, GLOBAL_FROM_CAMERA, (0, 400), noise_seed=0)

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ogmkit.footprints.warp import warp_to_bev
from ogmkit.geometry.camera import project
from ogmkit.geometry.se3 import inverse, transform_points
from ogmkit.learn.data.augment import Augmentation
from ogmkit.learn.data.frames import FrameDataset
from ogmkit.learn.data.turn import turned
from ogmkit.samples.arrays import SampleArrays
from ogmkit.samples.index import index_frames
from ogmkit.samples.spec import SampleSpec

HEIGHT, WIDTH = 90, 160
INTRINSICS = np.array([[126.0, 0.0, 84.0], [0.0, 121.0, 47.0], [0.0, 0.0, 1.0]])
"""Off-centre, and not square."""
LEVEL_FROM_CAMERA = np.eye(4)
LEVEL_FROM_CAMERA[:3, :3] = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
LEVEL_FROM_CAMERA[:3, 3] = [1.7, 0.1, 1.5]


def bev_from_image(level_from_camera):
    """The homography of z = 0 by its definition: cells of 0.5 m, ego at (40, 60)."""
    camera_from_level = inverse(level_from_camera)
    image_from_plane = INTRINSICS @ camera_from_level[:3, [0, 1, 3]]
    cell_from_plane = np.array([[0, -2.0, 39.5], [-2.0, 0, 59.5], [0, 0, 1]])
    matrix = cell_from_plane @ np.linalg.inv(image_from_plane)
    return -matrix / abs(matrix[2, 2]) if matrix[2, 2] > 0 else matrix / abs(matrix[2, 2])


def sample(**parts):
    y, x = np.indices((HEIGHT, WIDTH))
    near = ((x > 40) & (x < 110) & (y > 55) & (y < 80)).astype(np.uint8)
    return SampleArrays(
        np.array([[HEIGHT, WIDTH]]),
        image=np.stack([x, y, 0 * x], axis=-1).astype(np.uint8)[None],
        masks=np.stack([np.ones_like(near), near])[None],
        bev_from_image=bev_from_image(LEVEL_FROM_CAMERA)[None],
        intrinsics=INTRINSICS[None],
        level_from_camera=LEVEL_FROM_CAMERA[None],
        **parts,
    )


angles = st.floats(-6, 6).map(np.radians)


@given(angles, angles)
def test_a_turned_camera_is_where_scipy_has_it(pitch, roll):
    found = turned(sample(), pitch, roll).level_from_camera[0]
    # Turned about its own axes: first down about x, then clockwise about the new z.
    expected = LEVEL_FROM_CAMERA[:3, :3] @ Rotation.from_euler("XZ", [-pitch, roll]).as_matrix()
    np.testing.assert_allclose(found[:3, :3], expected, atol=1e-12)
    np.testing.assert_array_equal(found[:3, 3], LEVEL_FROM_CAMERA[:3, 3])


@given(angles, angles)
def test_the_homography_is_the_turned_camera_s(pitch, roll):
    found = turned(sample(), pitch, roll)
    np.testing.assert_allclose(
        found.bev_from_image[0], bev_from_image(found.level_from_camera[0]), rtol=1e-6, atol=1e-6
    )


def test_turning_down_moves_the_world_up():
    before = sample()
    down = turned(before, np.radians(3), 0.0)
    clockwise = turned(before, 0.0, np.radians(3))
    ahead = np.array([[30.0, 0.1, 1.5], [30.0, -8.0, 1.5]])  # on the axis, and to its right
    (old, old_right), _ = project(INTRINSICS, transform_points(inverse(LEVEL_FROM_CAMERA), ahead))
    for after, places in ((down, (0,)), (clockwise, (1,))):
        seen, _ = project(INTRINSICS, transform_points(inverse(after.level_from_camera[0]), ahead))
        for place in places:
            assert seen[place, 1] < (old, old_right)[place][1] - 1


@given(angles, angles)
def test_pixels_follow_the_world(pitch, roll):
    """Image and masks, by places that project into both."""
    before = sample()
    after = turned(before, pitch, roll)
    y, x = np.indices((HEIGHT, WIDTH))
    rays = np.linalg.inv(INTRINSICS) @ np.stack([x.ravel(), y.ravel(), np.ones(x.size)])
    old_from_new = inverse(before.level_from_camera[0]) @ after.level_from_camera[0]
    pixels, _ = project(INTRINSICS, (old_from_new[:3, :3] @ rays).T)
    pixels = pixels.reshape(HEIGHT, WIDTH, 2)
    inside = ((pixels >= 0) & (pixels <= [WIDTH - 1, HEIGHT - 1])).all(-1)
    assert np.abs(after.image[0, ..., :2].astype(float) - pixels)[inside].max() < 1.01
    known = after.known_pixels[0].astype(bool)
    clear = ((pixels >= -0.4) & (pixels <= [WIDTH - 0.6, HEIGHT - 0.6])).all(-1)
    assert known[clear].all()
    beyond = ((pixels < -0.6) | (pixels > [WIDTH - 0.4, HEIGHT - 0.4])).any(-1)
    assert not known[beyond].any()
    assert not after.masks[0, :, ~known].any()


def test_masks_stay_on_their_truth():
    before, after = sample(), turned(sample(), np.radians(1.5), np.radians(-2))
    truth, found = (warp_to_bev(one.masks[0, 1], one.bev_from_image[0], (60, 80)) for one in (before, after))
    known = warp_to_bev(after.known_pixels[0], after.bev_from_image[0], (60, 80)) > 0
    assert truth[known].sum() > 20
    assert ((truth > 0) & (found > 0) & known).sum() > 0.9 * ((truth + found > 0) & known).sum()


def test_no_angle_changes_nothing():
    before, after = sample(), turned(sample(), 0.0, 0.0)
    for name in ("image", "masks"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    assert after.known_pixels.all()
    np.testing.assert_allclose(after.bev_from_image, before.bev_from_image)


def test_samples_are_turned_and_hold_no_more_than_asked(sample_shards):
    spec = SampleSpec((30, 64), "calibration", "calibration")
    index = index_frames(sample_shards, ["scene-0002"], ["CAM_FRONT"], needs=spec)
    augmentation = Augmentation(0.0, 0.0, pitch_deg=4.0, roll_deg=4.0)
    dataset = FrameDataset(index, spec, augment=augmentation)
    plain, after = dataset[0], dataset[(0, 7)]
    assert set(after) == {*plain, "masks_known"}
    assert 0 < after["masks_known"].mean() < 1
    assert not np.allclose(after["bev_from_image"], plain["bev_from_image"])
    geometry = FrameDataset(index, replace(spec, masks=None, image=False), augment=augmentation)[(0, 7)]
    assert "image" not in geometry
    np.testing.assert_array_equal(geometry["bev_from_image"], after["bev_from_image"])


@pytest.mark.parametrize("angle", ["pitch_deg", "roll_deg"])
def test_each_angle_stays_within_its_bound(angle):
    augmentation = Augmentation(0.0, 0.0, **{angle: 2.0})
    made = [augmentation.apply(sample(), None, seed).level_from_camera[0, :3, :3] for seed in range(60)]
    angles_deg = [
        np.degrees(Rotation.from_matrix(LEVEL_FROM_CAMERA[:3, :3].T @ one).magnitude()) for one in made
    ]
    assert 1.5 < max(angles_deg) <= 2.0
    axis = {"pitch_deg": 0, "roll_deg": 2}[angle]
    turns = [Rotation.from_matrix(LEVEL_FROM_CAMERA[:3, :3].T @ one).as_rotvec() for one in made]
    assert np.abs(np.delete(turns, axis, axis=1)).max() < 1e-9
    assert min(np.array(turns)[:, axis]) < 0 < max(np.array(turns)[:, axis])

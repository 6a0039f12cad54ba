"""Ground corners in the image against the devkit's `bottom_corners` and `view_points`."""

import numpy as np
import pytest
from nuscenes.utils.geometry_utils import BoxVisibility, view_points

from ogmkit.geometry.boxes import ground_corners
from ogmkit.geometry.camera import project
from ogmkit.geometry.se3 import inverse
from ogmkit.nuscenes.dataset import Dataset

CASES = {
    "real-0103": ("real_world", "scene-0103", "CAM_FRONT"),
    "real-0061": ("real_world", "scene-0061", "CAM_BACK_LEFT"),
    "hilly": ("hilly_world", "scene-0001", "CAM_FRONT_LEFT"),
}


@pytest.mark.parametrize("case", CASES)
def test_ground_corners_lie_on_the_devkits(request, case):
    fixture, scene_name, camera = CASES[case]
    world = request.getfixturevalue(fixture)
    with Dataset(world.root) as dataset:
        frames = dataset.scene(scene_name, (camera,)).cameras[camera]
    compared = 0
    for frame in frames:
        camera_from_box = inverse(frame.global_from_ego @ frame.ego_from_camera) @ frame.boxes.global_from_box
        pixels, depth_m = project(frame.intrinsics, ground_corners(camera_from_box, frame.boxes.size_wlh))
        _, boxes, intrinsics = world.nusc.get_sample_data(
            frame.sample_data_token, box_vis_level=BoxVisibility.NONE
        )
        assert [box.token for box in boxes] == list(frame.boxes.annotation_token)
        for ours, depth, box in zip(pixels, depth_m, boxes, strict=True):
            if depth.min() > 1:
                theirs = view_points(box.bottom_corners(), intrinsics, normalize=True)[:2].T
                np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-3)
                compared += 1
    assert compared > len(frames)

import cv2
import numpy as np

from ogmkit.grid import GridSpec
from ogmkit.homography.leave_out import left_out_errors
from ogmkit.homography.methods import fit
from ogmkit.homography.projective import apply
from ogmkit.homography.settings import FitSettings


def through(frame, index):
    pixels = frame.ground_corners_px[index].astype(np.float32)
    places = frame.ground_corners_level[index, :, :2].astype(np.float32)
    return cv2.getPerspectiveTransform(pixels, places)


def test_it_is_opencvs_fit_through_the_nearest_usable_car(make_frame):
    frame = make_frame([(30, 2), (-7, 0), (12, -1), (20, 3)])
    expected = GridSpec().bev_from_level @ through(frame, 2)
    matrix = fit("four-point", frame, GridSpec(), FitSettings()).bev_from_image
    np.testing.assert_allclose(matrix, expected / -expected[2, 2], rtol=1e-9)


def test_the_nearest_car_left_out_is_measured_by_the_next(make_frame):
    frame = make_frame([(30, 2), (12, -1), (20, 3)], ground=lambda points: 0.001 * points[..., 0] ** 2)
    landed, _ = apply(through(frame, 2), frame.ground_corners_px[1])
    expected = np.linalg.norm(landed - frame.ground_corners_level[1, :, :2], axis=1).mean()
    np.testing.assert_allclose(left_out_errors("four-point", frame, FitSettings()).error_m[1], expected)

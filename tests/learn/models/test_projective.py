import cv2
import numpy as np
import torch

from ogmkit.learn.models.projective import apply, inverse_or_nan, through_four_points, unit_h33

SOURCE = np.array([[10.0, 90.0], [150.0, 92.0], [110.0, 60.0], [50.0, 61.0]])
DESTINATION = np.array([[20.0, 70.0], [60.0, 70.0], [75.0, 10.0], [5.0, 12.0]])


def test_h33_becomes_one_and_keeps_its_sign():
    matrices = torch.tensor([[[2.0, 4, 6], [0, 2, 0], [1, 1, -2]], [[2.0, 4, 6], [0, 2, 0], [1, 1, 4]]])
    result = unit_h33(matrices)
    assert result[:, 2, 2].tolist() == [-1, 1]
    torch.testing.assert_close(result * torch.tensor([2.0, 4.0])[:, None, None], matrices)


def test_singular_matrices_have_nan_for_inverse_and_leave_others_alone():
    singular, infinite = torch.ones(3, 3), torch.full((3, 3), torch.inf)
    result = inverse_or_nan(torch.stack([singular, 2 * torch.eye(3), infinite]))
    torch.testing.assert_close(result[1], torch.eye(3) / 2)
    assert result[[0, 2]].isnan().all()


def test_points_go_through_and_tell_their_depth():
    matrix = torch.tensor([[[1.0, 0, 2], [0, 1, 0], [0, 1, -1]]])
    mapped, w = apply(matrix, torch.tensor([[4.0, 3.0], [4.0, 0.0]]))
    torch.testing.assert_close(mapped, torch.tensor([[[3.0, 1.5], [-6.0, 0.0]]]))
    assert w.tolist() == [[2, -1]]


def test_four_points_agree_with_opencv():
    matrix = through_four_points(torch.tensor(SOURCE)[None], torch.tensor(DESTINATION)[None])[0].numpy()
    expected = cv2.getPerspectiveTransform(SOURCE.astype(np.float32), DESTINATION.astype(np.float32))
    np.testing.assert_allclose(matrix / matrix[2, 2], expected, rtol=1e-9)


def test_four_points_have_w_positive_where_they_are():
    mapped, w = apply(
        through_four_points(torch.tensor(SOURCE)[None], torch.tensor(DESTINATION)[None]), torch.tensor(SOURCE)
    )
    torch.testing.assert_close(mapped[0], torch.tensor(DESTINATION))
    assert (w > 0).all()


def test_points_on_a_line_or_in_one_place_or_nowhere_give_nan():
    line = torch.tensor([[0.0, 0], [1, 1], [2, 2], [5, 1]], dtype=torch.float64)
    place = torch.ones(4, 2, dtype=torch.float64)
    nowhere = torch.full((4, 2), torch.nan, dtype=torch.float64)
    source = torch.stack([line, place, nowhere, torch.tensor(SOURCE)])
    result = through_four_points(source, torch.tensor(DESTINATION).expand(4, 4, 2))
    assert result[:3].isnan().all()
    assert result[3].isfinite().all()

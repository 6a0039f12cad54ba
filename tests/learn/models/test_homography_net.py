import pytest
import torch
from torch.nn import functional

from ogmkit.learn.models.homography_net import HomographyNet, area_weights


@pytest.mark.parametrize(("batch", "size"), [(2, (65, 97)), (1, (32, 32))])
def test_codes_of_images_of_odd_sizes(check_network, batch, size):
    result = check_network(lambda: HomographyNet("resnet18", None, 9), (torch.rand(batch, 3, *size),))
    assert result.shape == (batch, 9)


def test_training_begins_at_the_mean_homography():
    assert HomographyNet("resnet18", None, 8)(torch.rand(4, 3, 64, 96)).abs().max() < 0.1


def test_where_something_is_matters():
    net = HomographyNet("resnet18", None, 9).eval()
    images = torch.zeros(2, 3, 64, 96)
    images[0, :, :32], images[1, :, 32:] = 1.0, 1.0
    with torch.no_grad():
        first, second = net(images)
    assert not torch.allclose(first, second, rtol=1e-2)


def test_pixels_count_by_their_share_in_a_part():
    expected = torch.tensor([[2 / 3, 1 / 3, 0], [0, 1 / 3, 2 / 3]])
    torch.testing.assert_close(area_weights(2, 3), expected)
    torch.testing.assert_close(area_weights(3, 1), torch.ones(3, 1))


def test_parts_of_whole_pixels_are_those_of_adaptive_pooling():
    features = torch.rand(2, 4, 6, 15)
    pooled = area_weights(3, 6) @ features @ area_weights(5, 15).T
    torch.testing.assert_close(pooled, functional.adaptive_avg_pool2d(features, (3, 5)))

import pytest
import torch
from torch.nn import functional

from ogmkit.grid import GridSpec
from ogmkit.learn.models.oft import OftNet, OrthographicTransform
from ogmkit.learn.models.oft_pooling import box_means, integral_image

GRID = GridSpec(1.5, 14, 9, 15.0, 3.0)


@pytest.mark.parametrize(
    ("batch", "size", "encoder"), [(2, (65, 97), "resnet18"), (1, (45, 77), "mobilenet_v2")]
)
def test_masks_of_images_of_odd_sizes(check_network, make_camera, batch, size, encoder):
    camera = [torch.from_numpy(matrix).expand(batch, -1, -1) for matrix in make_camera(size)]

    def make():
        return OftNet(encoder, None, GRID, channels=20, blocks=2)

    assert check_network(make, (torch.rand(batch, 3, *size), *camera)).shape == (batch, 2, 14, 9)


def test_frames_of_a_batch_have_calibrations_of_their_own(make_camera):
    torch.manual_seed(0)  # other sums round otherwise: some 1e-5
    net = OftNet("resnet18", None, GRID, channels=16, blocks=1).eval()
    image = torch.rand(1, 3, 64, 96)
    cameras = [make_camera((64, 96), yaw=yaw) for yaw in (0.0, 40.0)]
    intrinsics, level_from_camera = (
        torch.stack([torch.from_numpy(m) for m in c]) for c in zip(*cameras, strict=True)
    )
    with torch.no_grad():
        together = net(image.expand(2, -1, -1, -1), intrinsics, level_from_camera)
        for index in range(2):
            alone = net(image, intrinsics[index : index + 1], level_from_camera[index : index + 1])
            torch.testing.assert_close(together[index], alone[0], rtol=1e-3, atol=1e-4)
    assert not torch.allclose(together[0], together[1], atol=1e-3)


def test_height_is_collapsed_by_one_linear_layer():
    """Layer by layer, it is the product of all layers' features, one after the other, with one matrix."""
    transform = OrthographicTransform(channels=3, layers=2)
    features = torch.rand(2, 3, 6, 8)
    low = 4 * torch.rand(2, 2, 5, 4, 2, dtype=torch.float64)
    boxes = torch.cat([low, low + 2], dim=-1)
    means = [box_means(integral_image(features), boxes[:, layer], (6.0, 8.0)) for layer in range(2)]
    stacked = torch.cat(means, dim=1).movedim(1, -1)
    expected = functional.relu(transform.collapse(stacked)).movedim(-1, 1)
    torch.testing.assert_close(transform(features, boxes, (6.0, 8.0)), expected)


def test_the_default_has_sixteen_layers_top_down():
    net = OftNet("resnet18", None, GRID)
    convolutions = [m for m in net.top_down.modules() if isinstance(m, torch.nn.Conv2d)]
    assert len(convolutions) == 16
    assert {m.out_channels for m in convolutions} == {256}

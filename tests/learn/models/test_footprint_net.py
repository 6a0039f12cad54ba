import pytest
import torch

from ogmkit.errors import SettingsError
from ogmkit.learn.models.footprint_net import FootprintNet


@pytest.mark.parametrize(
    ("encoder", "batch", "size"),
    [("resnet18", 2, (64, 96)), ("resnet18", 1, (45, 77)), ("mobilenet_v2", 1, (32, 32))],
)
def test_masks_of_images_of_odd_sizes(check_network, encoder, batch, size):
    result = check_network(lambda: FootprintNet(encoder), (torch.rand(batch, 3, *size),))
    assert result.shape == (batch, 2, *size)


@pytest.mark.parametrize("width", [8, 48])
def test_narrow_decoders_hold_less_and_see_as_much(check_network, width):
    result = check_network(lambda: FootprintNet("resnet18", width=width), (torch.rand(1, 3, 64, 96),))
    assert result.shape == (1, 2, 64, 96)
    narrow, usual = (
        sum(weight.numel() for weight in net.decoders.parameters())
        for net in (FootprintNet("resnet18", width=width), FootprintNet("resnet18"))
    )
    assert narrow < usual / 4


def test_lidar_images_are_taken_as_they_are():
    net, plain = FootprintNet("resnet18").eval(), FootprintNet("resnet18", normalise=False).eval()
    plain.load_state_dict(net.state_dict())
    image = torch.rand(1, 3, 64, 64)
    mean, std = net.encoder.mean, net.encoder.std
    with torch.no_grad():
        torch.testing.assert_close(plain((image - mean) / std), net(image))


def test_the_targets_share_no_decoder():
    net = FootprintNet("resnet18")
    net(torch.rand(2, 3, 64, 64))[:, 0].sum().backward()
    for branch in (net.decoders, net.heads):
        assert all(p.grad.any() for p in branch[0].parameters())
        assert not any(p.grad.any() for p in branch[1].parameters())


def test_a_mask_lies_where_its_image_does():
    """The best shift of prediction on image is none: an untrained decoder passes on where things are."""
    net = FootprintNet("resnet18").eval()
    blank, image = torch.zeros(1, 3, 128, 192), torch.zeros(1, 3, 128, 192)
    image[..., 64:80, 128:144] = 8.0
    with torch.no_grad():
        change = (net(image) - net(blank)).abs()[0].sum(0)
    # Far from the spot the whole image is changed by pooling over all of it.
    change = (change - change.median()).clamp(min=change.max() / 4)
    change = change - change.min()
    rows, columns = torch.arange(128.0), torch.arange(192.0)
    assert abs((change.sum(1) @ rows) / change.sum() - 71.5) < 8
    assert abs((change.sum(0) @ columns) / change.sum() - 135.5) < 8


def test_an_encoder_without_dilation_is_refused():
    with pytest.raises(SettingsError, match="vgg11"):
        FootprintNet("vgg11")

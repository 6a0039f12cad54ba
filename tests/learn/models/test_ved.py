import pytest
import torch
from torch import nn
from torch.distributions import Normal
from torch.distributions import kl_divergence as divergence
from torch.nn import functional

from ogmkit.errors import SettingsError
from ogmkit.learn.models.ved import VedNet, kl_divergence

SIZE = (45, 77)


def make(shape=(21, 13), encoder="resnet18"):
    return VedNet(encoder, None, SIZE, shape, latent=16)


@pytest.mark.sampled(2)
@pytest.mark.parametrize(
    ("encoder", "shape"), [("resnet18", (21, 13)), ("vgg11_bn", (10, 7)), ("resnet18", (9, 1))]
)
def test_masks_on_grids_of_odd_shapes(check_network, encoder, shape):
    result = check_network(lambda: make(shape, encoder), (torch.rand(2, 3, *SIZE),))
    assert result.shape == (2, 1, *shape)


def test_the_published_grid_has_the_published_seed():
    assert VedNet("resnet18", None, (256, 512), (64, 64)).seed_shape == (2, 2)
    assert VedNet("resnet18", None, (64, 64), (100, 55)).seed_shape == (7, 4)  # doubled four times: 112 × 64


def test_the_decoder_doubles_bilinearly_to_begin_with():
    doublings = [layer for layer in make().decoder if isinstance(layer, nn.ConvTranspose2d)]
    values = torch.rand(1, 256, 5, 4)
    expected = functional.interpolate(values, scale_factor=2, mode="bilinear", align_corners=False)
    with torch.no_grad():
        torch.testing.assert_close(doublings[1](values)[..., 1:-1, 1:-1], expected[..., 1:-1, 1:-1])


def test_one_image_is_a_batch():
    logits, mu, logvar = make().train()(torch.rand(1, 3, *SIZE))
    assert logits.shape == (1, 1, 21, 13)
    assert mu.shape == logvar.shape == (1, 16)


def test_the_latent_is_sampled_in_training_and_is_the_mean_otherwise():
    net, image = make(), torch.rand(2, 3, *SIZE)
    assert not torch.equal(net(image)[0], net(image)[0])
    net.eval()
    with torch.no_grad():
        logits, mu, logvar = net(image)
        assert torch.equal(net(image, torch.zeros(2, 16))[0], logits)
        noise = torch.randn(2, 16)
        sampled = net(image, noise)[0]
        net.to_mu.weight.zero_(), net.to_logvar.weight.zero_()
        # Every image has now the same distribution: the biases'. The first one's sample, as a mean:
        net.to_mu.bias.copy_(mu[0] + noise[0] * (logvar[0] / 2).exp())
        torch.testing.assert_close(net(image)[0][0], sampled[0])


def test_an_extreme_variance_stays_finite():
    net = make()
    with torch.no_grad():
        net.to_logvar.bias.fill_(1e6)
    logits, mu, logvar = net(torch.rand(2, 3, *SIZE))
    assert torch.isfinite(logits).all()
    assert torch.isfinite(kl_divergence(mu, logvar)).all()


def test_images_of_another_size_are_refused():
    with pytest.raises(SettingsError, match=r"\(64, 64\).*\(45, 77\)"):
        make()(torch.rand(2, 3, 64, 64))


def test_divergence_from_the_prior_is_torchs():
    mu, logvar = torch.randn(5, 7), torch.randn(5, 7)
    expected = divergence(Normal(mu, (logvar / 2).exp()), Normal(0.0, 1.0)).sum(1)
    torch.testing.assert_close(kl_divergence(mu, logvar), expected)
    assert kl_divergence(torch.zeros(1, 3), torch.zeros(1, 3)).item() == 0
    assert kl_divergence(mu.bfloat16(), logvar.bfloat16()).dtype == torch.float32

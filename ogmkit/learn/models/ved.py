"""Variational encoder–decoder from an image to the grid (Lu, van de Molengraft & Dubbelman, RA-L 2019)."""

import math
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from ogmkit.errors import SettingsError
from ogmkit.learn.models.encoders import MULTIPLE_PX, ImageEncoder, padded_size

_NARROWED = (256, 128)
_SEED_WIDTH = 128
_WIDTHS = (256, 256, 256, 256, 256, 128, 64, 32)
"""Channels after each doubling: five as published, then fewer, the last for all further ones."""
_SEED_SIDE = 2
_LOGVAR_LIMIT = 10.0


class VedNet(nn.Module):
    """Convolutional encoder → sampled latent → transposed convolutions → one mask on the grid.

    As published: encoder features are narrowed by two convolutions and pooled once more, the latent has 512
    numbers, and a seed of 2 × 2 is doubled five times by transposed convolutions, which are bilinear at the
    start, each followed by two convolutions of 256 channels. Here the seed has about the grid's proportions,
    is doubled until it has as many cells, and the result is resampled to the grid.

    Args:
        encoder: as `ImageEncoder`.
        weights: as `ImageEncoder`.
        image_size: (height, width) of the images; the layers that are fully connected depend on it.
        shape: (rows, columns) of the grid.
        latent: size of the latent.

    Raises:
        SettingsError: as `ImageEncoder`.
        CheckpointError: as `ImageEncoder`.
    """

    def __init__(
        self,
        encoder: str,
        weights: str | None,
        image_size: tuple[int, int],
        shape: tuple[int, int],
        *,
        latent: int = 512,
    ) -> None:
        super().__init__()
        self.image_size = image_size
        self.shape = shape
        self.encoder = ImageEncoder(encoder, weights)
        widths = (self.encoder.out_channels[-1], *_NARROWED)
        narrow = [_convolution(before, after) for before, after in pairwise(widths)]
        self.narrow = nn.Sequential(*narrow, nn.MaxPool2d(2, ceil_mode=True))
        rows, columns = (math.ceil(side / MULTIPLE_PX / 2) for side in padded_size(image_size))
        self.to_mu = nn.Linear(_NARROWED[-1] * rows * columns, latent)
        self.to_logvar = nn.Linear(_NARROWED[-1] * rows * columns, latent)
        doublings = max(math.floor(math.log2(min(shape) / _SEED_SIDE)), 0)
        self.seed_shape = tuple(math.ceil(side / 2**doublings) for side in shape)
        self.to_seed = nn.Linear(latent, _SEED_WIDTH * math.prod(self.seed_shape))
        self.decoder = _decoder(doublings)

    def forward(self, image: Tensor, noise: Tensor | None = None) -> tuple[Tensor, Tensor, Tensor]:
        """Logits, and the distribution of the latent that they come from.

        Args:
            image: (B, 3, h, w) of `image_size`.
            noise: (B, latent), standard normal, to sample the latent with; None draws it in training and
                takes the mean otherwise.

        Returns:
            (B, 1, rows, columns) logits, (B, latent) mean and (B, latent) logarithm of the variance.

        Raises:
            SettingsError: the image is of another size.
        """
        if tuple(image.shape[-2:]) != self.image_size:
            raise SettingsError(
                f"image of {tuple(image.shape[-2:])} (height, width) for a network of {self.image_size}"
            )
        code = self.narrow(self.encoder(image)[-1]).flatten(1)
        mu: Tensor = self.to_mu(code)
        logvar: Tensor = self.to_logvar(code).clamp(-_LOGVAR_LIMIT, _LOGVAR_LIMIT)
        if noise is None and self.training:
            noise = torch.randn_like(mu)
        sample = mu if noise is None else mu + noise * (logvar / 2).exp()
        seed = self.to_seed(sample).unflatten(1, (_SEED_WIDTH, *self.seed_shape))
        logits = functional.interpolate(
            self.decoder(seed), size=self.shape, mode="bilinear", align_corners=False
        )
        return logits, mu, logvar


def kl_divergence(mu: Tensor, logvar: Tensor) -> Tensor:
    """KL(N(mu, exp(logvar)) ‖ N(0, 1)), summed over the latent (Kingma & Welling 2014, appendix B).

    Args:
        mu: (B, L).
        logvar: (B, L).

    Returns:
        (B,) float32 at least.
    """
    mu, logvar = (values.to(torch.promote_types(values.dtype, torch.float32)) for values in (mu, logvar))
    return 0.5 * (mu.square() + logvar.exp() - 1 - logvar).sum(dim=1)


def _convolution(before: int, after: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(before, after, 3, padding=1, bias=False), nn.BatchNorm2d(after), nn.ReLU(inplace=True)
    )


def _decoder(doublings: int) -> nn.Sequential:
    """(B, 128, h, w) → (B, 1, h · 2^doublings, w · 2^doublings)."""
    layers: list[nn.Module] = []
    width = _SEED_WIDTH
    for step in range(doublings):
        after = _WIDTHS[min(step, len(_WIDTHS) - 1)]
        layers += [_doubling(width), _convolution(width, after), _convolution(after, after)]
        width = after
    return nn.Sequential(*layers, nn.Conv2d(width, 1, 3, padding=1))


def _doubling(channels: int) -> nn.ConvTranspose2d:
    """Learnt upsampling by 2 that is bilinear to begin with, each channel for itself."""
    layer = nn.ConvTranspose2d(channels, channels, 4, stride=2, padding=1, bias=False)
    side = torch.tensor([0.25, 0.75, 0.75, 0.25])
    with torch.no_grad():
        layer.weight.zero_()
        layer.weight[range(channels), range(channels)] = torch.outer(side, side)
    return layer

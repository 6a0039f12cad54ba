"""DeepLab v3+ with one decoding head a target (paper, Footprint segmentation)."""

import math

import torch
from segmentation_models_pytorch.decoders.deeplabv3.decoder import ASPPPooling, DeepLabV3PlusDecoder
from torch import Tensor, nn
from torch.nn import functional

from ogmkit.learn.models.encoders import ImageEncoder, padded_size
from ogmkit.samples.spec import TARGETS

_OUTPUT_STRIDE = 16
_ATROUS_RATES = (6, 12, 18)
"""Of Chen et al. 2018 for output stride 16; the library's own are those for stride 8."""
_DROPOUT = 0.1
_GROUPS = 16


class FootprintNet(nn.Module):
    """A shared encoder of output stride 16 and, for each target, a decoder and head of its own.

    For images and, with `normalise=False`, for LiDAR images.

    Args:
        encoder: as `ImageEncoder`.
        weights: as `ImageEncoder`.
        in_channels: of the input.
        normalise: whether it is RGB, 0 … 1.
        width: channels of each decoder; 256 is that of Chen et al. 2018.

    Raises:
        SettingsError: as `ImageEncoder`.
        CheckpointError: as `ImageEncoder`.
    """

    def __init__(
        self,
        encoder: str = "resnet101",
        weights: str | None = None,
        *,
        in_channels: int = 3,
        normalise: bool = True,
        width: int = 256,
    ) -> None:
        super().__init__()
        self.encoder = ImageEncoder(
            encoder, weights, in_channels=in_channels, output_stride=_OUTPUT_STRIDE, normalise=normalise
        )
        self.decoders = nn.ModuleList(_decoder(self.encoder.out_channels, width) for _ in TARGETS)
        self.heads = nn.ModuleList(nn.Conv2d(width, 1, kernel_size=1) for _ in TARGETS)

    def forward(self, image: Tensor) -> Tensor:
        """(B, in_channels, h, w) → logits (B, 2, h, w) of drivable and vehicles."""
        height, width = image.shape[-2:]
        features = self.encoder(image)
        branches = zip(self.decoders, self.heads, strict=True)
        logits = torch.cat([head(decoder(features)) for decoder, head in branches], dim=1)
        full = functional.interpolate(
            logits, size=padded_size((height, width)), mode="bilinear", align_corners=False
        )
        return full[..., :height, :width]


def _decoder(encoder_channels: tuple[int, ...], width: int) -> nn.Module:
    decoder: nn.Module = DeepLabV3PlusDecoder(
        encoder_channels=encoder_channels,
        encoder_depth=5,
        out_channels=width,
        atrous_rates=_ATROUS_RATES,
        output_stride=_OUTPUT_STRIDE,
        aspp_separable=True,
        aspp_dropout=_DROPOUT,
    )
    for module in decoder.modules():
        if isinstance(module, ASPPPooling):
            # It normalises one value a channel: over a batch of one frame, batch statistics don't exist, and
            # neither does a group of one channel have any.
            module[2] = nn.GroupNorm(min(math.gcd(_GROUPS, width), width // 2), width)
    return decoder

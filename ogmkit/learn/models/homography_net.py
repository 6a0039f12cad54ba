"""The network that regresses a homography's code from an image (paper, Homography estimation)."""

import torch
from torch import Tensor, nn

from ogmkit.learn.models.encoders import ImageEncoder

_POOLED = (3, 5)
_WIDTHS = (1024, 256, 64)
_FIRST_SPREAD = 1e-3


class HomographyNet(nn.Module):
    """An encoder (the paper's is ResNet-18) and four fully connected layers.

    The last features are averaged over 3 × 5 parts of the image and flattened: the average over all of it, as
    for classification, would lose where the horizon and the lanes are. The last layer begins near 0, so that
    training begins at the mean homography of the training split.

    Args:
        encoder: as `ImageEncoder`.
        weights: as `ImageEncoder`.
        outputs: size of the code.

    Raises:
        SettingsError: as `ImageEncoder`.
        CheckpointError: as `ImageEncoder`.
    """

    def __init__(self, encoder: str, weights: str | None, outputs: int) -> None:
        super().__init__()
        self.encoder = ImageEncoder(encoder, weights)
        width = self.encoder.out_channels[-1] * _POOLED[0] * _POOLED[1]
        layers: list[nn.Module] = []
        for hidden in _WIDTHS:
            layers += [nn.Linear(width, hidden), nn.ReLU()]
            width = hidden
        last = nn.Linear(width, outputs)
        nn.init.normal_(last.weight, std=_FIRST_SPREAD)
        nn.init.zeros_(last.bias)
        self.layers = nn.Sequential(*layers, last)

    def forward(self, image: Tensor) -> Tensor:
        """(B, 3, h, w) → (B, outputs)."""
        features = self.encoder(image)[-1]
        rows, columns = (
            area_weights(parts, side).to(features)
            for parts, side in zip(_POOLED, features.shape[-2:], strict=True)
        )
        pooled = rows @ features @ columns.T
        result: Tensor = self.layers(pooled.flatten(1))
        return result


def area_weights(parts: int, side: int) -> Tensor:
    """(parts, side) weights that average an axis over equal parts; a pixel counts by its share in the part.

    `adaptive_avg_pool2d` does that with whole pixels; a product with these weights goes to ONNX at any size.
    """
    edges = torch.arange(parts + 1) * (side / parts)
    pixels = torch.arange(side)
    overlap = torch.minimum(edges[1:, None], pixels + 1) - torch.maximum(edges[:-1, None], pixels)
    return overlap.clamp(min=0) * (parts / side)

"""Encoders of segmentation-models-pytorch, with the normalisation of their inputs inside."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import segmentation_models_pytorch as smp
import torch
from torch import Tensor, nn
from torch.nn import functional

from ogmkit.base.names import unknown
from ogmkit.base.news import Waiting, tell
from ogmkit.errors import CheckpointError, SettingsError
from ogmkit.learn.models.encoder_weights import TIMM, load_weights, packaged_weights, reason
from ogmkit.samples.images import IMAGENET_STATISTICS

MULTIPLE_PX = 32
"""What sides of encoded images are multiples of: the encoders halve them five times."""

_LITE = f"{TIMM}tf_efficientnet_lite"
_LITE_STATISTICS = {"mean": (127 / 255,) * 3, "std": (128 / 255,) * 3}
"""Of the authors' training: timm has 1/2 for both."""
_IMAGENET = "imagenet"
_SMALLEST_PX = 64
"""A side of 32 px would leave one place at stride 32: too few for batch normalisation of a single frame."""


def padded_size(size: tuple[int, int]) -> tuple[int, int]:
    """(height, width) that an image of this (height, width) is padded to before it is encoded."""
    height, width = (max(math.ceil(side / MULTIPLE_PX) * MULTIPLE_PX, _SMALLEST_PX) for side in size)
    return height, width


class ImageEncoder(nn.Module):
    """Features of an image at strides 1, 2, 4, 8, 16 and 32.

    Images are padded at the right and at the bottom, after normalisation, so that no pixel moves: feature
    (i, j) of stride s stands for rows s·i to s·(i + 1) and columns s·j to s·(j + 1), ends not included.

    Args:
        name: an encoder of segmentation-models-pytorch, `tu-…` for one of timm's.
        weights: an existing file, as `load_weights` has it, or a name of segmentation-models-pytorch's, such
            as `imagenet`, which is downloaded unless an installed package holds it; None is random.
        in_channels: of the images.
        output_stride: 32, or 16 where the last stage is dilated instead of strided.
        normalise: whether images are RGB, 0 … 1, to be standardised by the statistics that the encoder's
            published weights were trained with: ImageNet's, for most.

    Attributes:
        out_channels: of the features, from stride 1 on.

    Raises:
        SettingsError: encoder or weights are unknown, the encoder can't be dilated, or statistics for RGB are
            asked for on images that are not.
        CheckpointError: the file isn't one of this encoder's weights, or the download failed.
    """

    mean: Tensor
    std: Tensor

    def __init__(
        self,
        name: str,
        weights: str | None = None,
        *,
        in_channels: int = 3,
        output_stride: int = 32,
        normalise: bool = True,
    ) -> None:
        super().__init__()
        if normalise and in_channels != len(IMAGENET_STATISTICS["mean"]):
            raise SettingsError(f"images of {in_channels} channels have no ImageNet statistics")
        file = _file_of(weights, name)
        self.net = _build(name, None if file else weights, in_channels, output_stride)
        if file:
            load_weights(self.net, file, name)
        self.out_channels: tuple[int, ...] = tuple(cast("list[int]", self.net.out_channels))
        self.normalise = normalise
        for buffer, values in _statistics(name, self.net).items():
            self.register_buffer(buffer, torch.tensor(values)[:, None, None], persistent=False)

    def forward(self, image: Tensor) -> list[Tensor]:
        """(B, in_channels, h, w) → six features (B, C, H/s, W/s), where (H, W) = `padded_size((h, w))`."""
        height, width = image.shape[-2:]
        padded_height, padded_width = padded_size((height, width))
        standard = (image - self.mean) / self.std if self.normalise else image
        standard = functional.pad(standard, (0, padded_width - width, 0, padded_height - height))
        return list(self.net(standard))


def _file_of(weights: str | None, name: str) -> Path | None:
    """The file that holds the weights; None where they are random or to be downloaded."""
    if weights is None or Path(weights).is_file():
        return None if weights is None else Path(weights)
    return packaged_weights(name) if weights == _IMAGENET else None


def _build(name: str, weights: str | None, in_channels: int, output_stride: int) -> nn.Module:
    """The encoder, with random weights or with named ones, which are downloaded."""
    from_timm = name.startswith(TIMM)
    if not from_timm:
        _require_known(name, weights)
    elif weights not in (None, _IMAGENET):
        raise SettingsError(f"{weights}: no such file; weights of {name} are {_IMAGENET}, or a file's")
    if weights is not None:
        tell(Waiting(f"fetching weights {weights} of encoder {name}, unless they were downloaded before"))
    try:
        encoder: nn.Module = smp.encoders.get_encoder(
            name,
            in_channels=in_channels,
            depth=5,
            weights=weights if weights is None or not from_timm else True,  # the name says which
            output_stride=output_stride,
        )
    except OSError as error:
        raise CheckpointError(
            f"weights {weights!r} of encoder {name} can't be fetched ({reason(error)}); give a file"
        ) from error
    except (ValueError, RuntimeError, TypeError, AttributeError) as error:
        raise SettingsError(
            f"encoder {name} can't be built with output stride {output_stride} ({reason(error)}); "
            "choose another, such as resnet18"
        ) from error
    return encoder


def _require_known(name: str, weights: str | None) -> None:
    names = smp.encoders.get_encoder_names()
    if name not in names:
        raise SettingsError(unknown("encoder", name, names))
    available = sorted(smp.encoders.encoders[name]["pretrained_settings"])
    if weights is not None and weights not in available:
        raise SettingsError(f"no such file; {unknown(f'weights of {name}', weights, available)}")


def _statistics(name: str, net: nn.Module) -> Mapping[str, tuple[float, ...]]:
    """Mean and deviation, of RGB from 0 to 1, that an encoder's published weights expect."""
    if name.startswith(_LITE):
        return _LITE_STATISTICS
    if name.startswith(TIMM):
        found: Mapping[str, Any] = getattr(net.model, "pretrained_cfg", {})
    else:
        published = smp.encoders.encoders[name]["pretrained_settings"]
        found = published.get(_IMAGENET) or next(iter(published.values()), {})
    if "mean" not in found or max(found.get("input_range") or (1,)) > 1:
        return IMAGENET_STATISTICS
    return {what: tuple(found[what]) for what in IMAGENET_STATISTICS}

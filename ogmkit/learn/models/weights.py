"""What a file has to hold to be weights."""

from collections.abc import Mapping
from pathlib import Path
from typing import TypeGuard

import torch
from torch import Tensor

from ogmkit.errors import CheckpointError


def are_weights(found: object) -> TypeGuard[dict[str, Tensor]]:
    """Whether it is names and tensors, and nothing else."""
    return isinstance(found, dict) and all(
        isinstance(name, str) and isinstance(value, Tensor) for name, value in found.items()
    )


def require_finite(path: Path, weights: Mapping[str, Tensor]) -> None:
    """Refuse weights that no training can start from.

    Raises:
        CheckpointError: a number is not finite; names the tensor.
    """
    for name, value in weights.items():
        if not bool(torch.isfinite(value).all()):
            raise CheckpointError(f"{path}: {name} holds numbers that are not finite; choose another file")

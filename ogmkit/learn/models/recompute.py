"""Gradients through residual blocks worked out a second time: memory for time (Chen et al. 2016)."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial

from torch import Tensor, nn
from torch.nn.modules.batchnorm import _BatchNorm
from torch.utils.checkpoint import checkpoint
from torchvision.models.resnet import BasicBlock, Bottleneck

from ogmkit.errors import SettingsError

_BLOCKS = (BasicBlock, Bottleneck)


def recompute_blocks(encoder: nn.Module) -> None:
    """Have each residual block keep its input only, and go through its inside again for the gradients.

    Values and gradients stay what they were, and so do the running statistics of batch normalisation.

    Raises:
        SettingsError: the encoder isn't made of residual blocks.
    """
    blocks = [module for module in encoder.modules() if isinstance(module, _BLOCKS)]
    if not blocks:
        raise SettingsError("checkpoint_gradients: knows encoders of ResNet's blocks only, such as resnet101")
    for block in blocks:
        block.forward = partial(_recomputed, block, block.forward)


def _recomputed(block: nn.Module, forward: "partial[Tensor]", features: Tensor) -> Tensor:
    if not block.training:
        return forward(features)
    contexts = partial(_contexts, block)
    result: Tensor = checkpoint(forward, features, use_reentrant=False, context_fn=contexts)
    return result


def _contexts(block: nn.Module) -> tuple[AbstractContextManager[None], AbstractContextManager[None]]:
    """Around the first pass, and around the second."""
    return nullcontext(), _statistics_kept(block)


@contextmanager
def _statistics_kept(block: nn.Module) -> Iterator[None]:
    """Normalisation by the batch, without learning its statistics a second time."""
    norms = [module for module in block.modules() if isinstance(module, _BatchNorm)]
    momenta = [norm.momentum for norm in norms]
    for norm in norms:
        norm.momentum = 0.0
    try:
        yield
    finally:
        for norm, momentum in zip(norms, momenta, strict=True):
            norm.momentum = momentum
            if norm.num_batches_tracked is not None:
                norm.num_batches_tracked.sub_(1)

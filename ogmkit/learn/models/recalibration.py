"""Statistics of batch normalisation recomputed, for images of another kind than a network has learnt from."""

from collections.abc import Iterator
from contextlib import contextmanager

from torch import nn
from torch.nn.modules.batchnorm import _BatchNorm


def batch_norms(module: nn.Module) -> tuple[_BatchNorm, ...]:
    """The layers that normalise by statistics which they keep."""
    layers = (layer for layer in module.modules() if isinstance(layer, _BatchNorm))
    return tuple(layer for layer in layers if layer.track_running_stats)


@contextmanager
def recalibrating(module: nn.Module) -> Iterator[None]:
    """Have the layers normalise by the batch, and keep the mean of all batches' statistics; weights stay.

    Whatever else behaves differently in training, such as dropout, predicts. Afterwards the module predicts
    with the new statistics (Li et al. 2016, Revisiting Batch Normalization For Practical Domain Adaptation).
    """
    module.eval()
    layers = batch_norms(module)
    momenta = [layer.momentum for layer in layers]
    for layer in layers:
        layer.reset_running_stats()
        layer.momentum = None  # a plain mean over batches
        layer.train()
    try:
        yield
    finally:
        for layer, momentum in zip(layers, momenta, strict=True):
            layer.momentum = momentum
            layer.eval()

"""Statistics of batch normalisation recomputed, for images of another kind than a network has learnt from."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch
from torch import Tensor, nn
from torch.nn.modules.batchnorm import _BatchNorm


def batch_norms(module: nn.Module) -> tuple[_BatchNorm, ...]:
    """The layers that normalise by statistics which they keep."""
    layers = (layer for layer in module.modules() if isinstance(layer, _BatchNorm))
    return tuple(layer for layer in layers if layer.track_running_stats)


@contextmanager
def recalibrating(module: nn.Module, share: float = 1.0) -> Iterator[None]:
    """Have the layers normalise by the batch, and keep the mean of all batches' statistics; weights stay.

    Whatever else behaves differently in training, such as dropout, predicts. Afterwards the module predicts
    with the new statistics (Li et al. 2016, Revisiting Batch Normalization For Practical Domain Adaptation),
    or with means and variances between the new and the former ones (Schneider et al. 2020, Improving
    robustness against common corruptions by covariate shift adaptation, section 3).

    Args:
        module: the network.
        share: of the new statistics, from 0 to 1; the former ones have the rest.
    """
    module.eval()
    layers = batch_norms(module)
    momenta = [layer.momentum for layer in layers]
    former = [[one.clone() for one in _statistics(layer)] for layer in layers]
    for layer in layers:
        layer.reset_running_stats()
        layer.momentum = None  # a plain mean over batches
        layer.train()
    try:
        yield
    finally:
        for layer, momentum, before in zip(layers, momenta, former, strict=True):
            for new, old in zip(_statistics(layer), before, strict=True):
                new.copy_(torch.lerp(old, new, share))
            layer.momentum = momentum
            layer.eval()


def _statistics(layer: _BatchNorm) -> tuple[Tensor, Tensor]:
    """Mean and variance, (C,) each, of a layer that keeps them."""
    mean, variance = layer.running_mean, layer.running_var
    if mean is None or variance is None:
        raise ValueError("the layer keeps no statistics")
    return mean, variance

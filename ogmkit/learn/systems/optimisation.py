"""Optimiser and learning rate of a training, as its settings say."""

import math
from collections.abc import Callable, Iterator

from lightning.pytorch.utilities.types import OptimizerLRSchedulerConfig
from torch.nn import Module, Parameter
from torch.optim import SGD, AdamW, Optimizer
from torch.optim.lr_scheduler import LambdaLR, LRScheduler, OneCycleLR

from ogmkit.learn.models.encoders import ImageEncoder
from ogmkit.learn.settings import TrainSettings


def optimisation(
    net: Module, settings: TrainSettings, encoder_lr: float, steps: Callable[[], float]
) -> Optimizer | OptimizerLRSchedulerConfig:
    """Optimiser of what a network learns, and the schedule of its learning rate by steps.

    Args:
        net: the network; weights that need no gradient are left out.
        settings: of the training.
        encoder_lr: the encoders' learning rate as a factor of the others'.
        steps: tells the number of steps of the whole training.
    """
    groups = list(_groups(net, settings.lr, encoder_lr))
    if settings.optimizer == "adamw":
        optimizer: Optimizer = AdamW(groups, weight_decay=settings.weight_decay)
    else:
        optimizer = SGD(groups, momentum=settings.momentum, weight_decay=settings.weight_decay)
    if settings.schedule == "constant" and not settings.warm_up:
        return optimizer
    schedule = _schedule(optimizer, settings, int(steps()))
    return {"optimizer": optimizer, "lr_scheduler": {"scheduler": schedule, "interval": "step"}}


def lr_factor(step: int, *, steps: int, warm_up: int, cosine: bool) -> float:
    """The learning rate of a step, counted from 0, as a part of the settings'.

    It rises in even parts over the steps of the warm-up; then it stays, or falls to 0 by half a cosine
    (Loshchilov & Hutter 2017, without restarts).
    """
    if step < warm_up:
        return (step + 1) / (warm_up + 1)
    if not cosine:
        return 1.0
    return (1 + math.cos(math.pi * min((step - warm_up) / max(steps - warm_up, 1), 1.0))) / 2


def _schedule(optimizer: Optimizer, settings: TrainSettings, steps: int) -> LRScheduler:
    if settings.schedule == "one-cycle":
        highest = [group["lr"] for group in optimizer.param_groups]
        return OneCycleLR(optimizer, highest, total_steps=steps, cycle_momentum=False)
    cosine = settings.schedule == "cosine"
    return LambdaLR(
        optimizer, lambda step: lr_factor(step, steps=steps, warm_up=settings.warm_up, cosine=cosine)
    )


def _groups(net: Module, lr: float, encoder_lr: float) -> Iterator[dict[str, object]]:
    """Weights that are learnt, the encoders' apart where they have a learning rate of their own."""
    encoders = [module for module in net.modules() if isinstance(module, ImageEncoder)]
    apart = {id(one) for encoder in encoders for one in encoder.parameters()} if encoder_lr != 1 else set()
    learnt = [one for one in net.parameters() if one.requires_grad]
    others: list[Parameter] = [one for one in learnt if id(one) not in apart]
    if others:
        yield {"params": others, "lr": lr}
    own = [one for one in learnt if id(one) in apart]
    if own:
        yield {"params": own, "lr": lr * encoder_lr}

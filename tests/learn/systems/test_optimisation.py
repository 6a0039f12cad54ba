"""Learning rates: schedules against torch's, warm-up by hand, the encoder's own."""

import pytest
import torch
from torch import nn

from ogmkit.errors import SettingsError
from ogmkit.learn.catalogue import CATALOGUE
from ogmkit.learn.models.encoders import ImageEncoder
from ogmkit.learn.systems.optimisation import lr_factor, optimisation

STEPS = 20


def rates(net, encoder_lr=1.0, **values):
    """Learning rates of each step, one row a group of weights."""
    settings = CATALOGUE["footprints"].settings(lr=0.5, **values)
    found = optimisation(net, settings, encoder_lr, lambda: STEPS)
    if isinstance(found, torch.optim.Optimizer):
        return [[group["lr"] for group in found.param_groups]] * STEPS
    rows = []
    for _ in range(STEPS):
        rows.append([group["lr"] for group in found["optimizer"].param_groups])
        found["optimizer"].step()
        found["lr_scheduler"]["scheduler"].step()
    return rows


@pytest.mark.parametrize("optimizer", ["sgd", "adamw"])
def test_a_cosine_is_torchs(optimizer):
    net = nn.Linear(2, 2)
    plain = torch.optim.SGD(net.parameters(), 0.5)
    cosine = torch.optim.lr_scheduler.CosineAnnealingLR(plain, STEPS)
    expected = []
    for _ in range(STEPS):
        expected.append(pytest.approx([plain.param_groups[0]["lr"]]))
        plain.step()
        cosine.step()
    assert rates(net, schedule="cosine", optimizer=optimizer) == expected


def test_a_warm_up_rises_in_even_parts():
    factors = [lr_factor(step, steps=10, warm_up=3, cosine=False) for step in range(10)]
    assert factors == [0.25, 0.5, 0.75] + [1.0] * 7
    falling = [lr_factor(step, steps=11, warm_up=3, cosine=True) for step in range(12)]
    assert falling[:4] == [0.25, 0.5, 0.75, 1.0]
    assert falling[3:] == sorted(falling[3:], reverse=True)
    assert falling[7] == pytest.approx(0.5)
    assert falling[11] == pytest.approx(0)
    assert [row[0] for row in rates(nn.Linear(2, 2), warm_up=3)][:4] == [0.125, 0.25, 0.375, 0.5]


def test_one_cycle_rises_to_the_learning_rate_and_falls_to_almost_nothing():
    found = [row[0] for row in rates(nn.Linear(2, 2), schedule="one-cycle")]
    highest = found.index(max(found))
    assert max(found) == pytest.approx(0.5, rel=0.02)
    assert 0 < highest < STEPS / 2
    assert found[0] < 0.03
    assert found[-1] < 0.001
    with pytest.raises(SettingsError, match="warm_up: the schedule one-cycle has its own"):
        rates(nn.Linear(2, 2), schedule="one-cycle", warm_up=1)


def test_the_encoder_has_a_learning_rate_of_its_own_and_frozen_weights_none():
    net = nn.ModuleDict({"encoder": ImageEncoder("tu-test_resnet"), "head": nn.Linear(2, 2)})
    net["head"].bias.requires_grad_(requires_grad=False)
    settings = CATALOGUE["footprints"].settings(lr=0.5)
    together = optimisation(net, settings, 1.0, lambda: STEPS)
    assert len(together.param_groups) == 1
    apart = optimisation(net, settings, 0.1, lambda: STEPS)
    others, encoder = apart.param_groups
    assert others["params"] == [net["head"].weight]
    assert others["lr"] == 0.5
    assert encoder["lr"] == pytest.approx(0.05)
    assert {id(one) for one in encoder["params"]} == {id(one) for one in net["encoder"].parameters()}
    assert rates(net, encoder_lr=0.1, schedule="one-cycle")[3][1] == pytest.approx(
        0.1 * rates(net, encoder_lr=0.1, schedule="one-cycle")[3][0]
    )


def test_weights_of_encoders_alone_are_learnt_where_all_else_is_frozen():
    net = nn.ModuleDict({"encoder": ImageEncoder("tu-test_resnet"), "head": nn.Linear(2, 2)})
    net["head"].requires_grad_(requires_grad=False)
    (group,) = optimisation(net, CATALOGUE["footprints"].settings(lr=0.5), 0.1, lambda: 1).param_groups
    assert group["lr"] == pytest.approx(0.05)

import math

import pytest
import torch

from ogmkit.learn.models.losses import (
    binary_cross_entropy,
    elbo,
    perception_loss,
    summed_perception_loss,
)

# σ(0) = 1/2; σ(log 3) = 3/4.
LOGITS = torch.tensor([[[[0.0, math.log(3)]], [[math.log(3), 0.0]]], [[[0.0, 0.0]], [[0.0, 0.0]]]])
TARGET = torch.tensor([[[[1.0, 1.0]], [[0.0, 1.0]]], [[[0.0, 0.0]], [[1.0, 0.0]]]])
HALF, RIGHT, WRONG = math.log(2), math.log(4 / 3), math.log(4)
KNOWN = torch.tensor([[[1.0, 0.0]], [[1.0, 1.0]]])


def test_the_mean_is_over_cells_and_targets():
    expected = (HALF + RIGHT + WRONG + HALF + 4 * HALF) / 8
    assert binary_cross_entropy(LOGITS, TARGET).item() == pytest.approx(expected)


def test_unknown_cells_do_not_count():
    expected = (HALF + WRONG + 4 * HALF) / 6
    assert binary_cross_entropy(LOGITS, TARGET, KNOWN).item() == pytest.approx(expected)
    everywhere = binary_cross_entropy(LOGITS, TARGET, torch.ones_like(KNOWN))
    torch.testing.assert_close(everywhere, binary_cross_entropy(LOGITS, TARGET))


def test_nothing_known_is_no_loss():
    logits = LOGITS.clone().requires_grad_()
    loss = binary_cross_entropy(logits, TARGET, torch.zeros_like(KNOWN))
    loss.backward()
    assert loss.item() == 0
    assert not logits.grad.any()


def test_perception_is_the_sum_of_two_means():
    drivable, vehicles = (HALF + 2 * HALF) / 3, (WRONG + 2 * HALF) / 3
    assert perception_loss(LOGITS, TARGET, KNOWN).item() == pytest.approx(drivable + vehicles)
    assert perception_loss(LOGITS, TARGET).item() == pytest.approx(
        (HALF + RIGHT + 2 * HALF) / 4 + (WRONG + HALF + 2 * HALF) / 4
    )


def test_sums_are_over_cells_and_targets_and_means_over_frames():
    assert summed_perception_loss(LOGITS, TARGET, KNOWN).item() == pytest.approx(
        (HALF + WRONG + 4 * HALF) / 2
    )
    assert summed_perception_loss(LOGITS, TARGET).item() == pytest.approx(
        (HALF + RIGHT + WRONG + HALF + 4 * HALF) / 2
    )


def test_the_bound_is_cross_entropy_and_divergence_a_cell():
    mu = torch.tensor([[2.0, 0.0], [0.0, 0.0]])  # KL = 2²/2 = 2 and 0: 1 on average, over two cells
    logvar = torch.zeros(2, 2)
    value = elbo(LOGITS[:, :1], TARGET[:, :1], KNOWN, mu, logvar, 0.5)
    assert value.item() == pytest.approx((HALF + 2 * HALF) / 3 + 0.5 * 1 / 2)
    unweighted = elbo(LOGITS[:, :1], TARGET[:, :1], None, mu, logvar, 0.0)
    torch.testing.assert_close(unweighted, binary_cross_entropy(LOGITS[:, :1], TARGET[:, :1]))

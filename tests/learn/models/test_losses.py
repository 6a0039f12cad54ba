import math

import pytest
import torch
from torch.nn import functional

from ogmkit.learn.models.losses import (
    CellLoss,
    elbo,
    mean_of_known,
    perception_loss,
    summed_perception_loss,
)

# σ(0) = 1/2; σ(log 3) = 3/4.
LOGITS = torch.tensor([[[[0.0, math.log(3)]], [[math.log(3), 0.0]]], [[[0.0, 0.0]], [[0.0, 0.0]]]])
TARGET = torch.tensor([[[[1.0, 1.0]], [[0.0, 1.0]]], [[[0.0, 0.0]], [[1.0, 0.0]]]])
HALF, RIGHT, WRONG = math.log(2), math.log(4 / 3), math.log(4)
LOSSES = torch.tensor([[[[HALF, RIGHT]], [[WRONG, HALF]]], [[[HALF, HALF]], [[HALF, HALF]]]])
KNOWN = torch.tensor([[[1.0, 0.0]], [[1.0, 1.0]]])


def test_the_paper_s_cells_cost_their_cross_entropy():
    torch.testing.assert_close(CellLoss("none", 2)(LOGITS, TARGET), LOSSES)
    assert not CellLoss("none", 2).state_dict()


def test_positive_cells_weigh_the_root_of_how_rare_they_are():
    """Of the first target's three known cells one is set, and of the second's two."""
    loss = CellLoss("weighted", 2)
    loss.fit([(TARGET[:1], KNOWN[:1]), (TARGET[1:], KNOWN[1:])])
    expected = torch.tensor([2.0, 2.0]).sqrt()  # one of three is set in both
    torch.testing.assert_close(loss.positive_weight, expected)

    weights = torch.where(TARGET > 0, expected[:, None, None], 1.0)
    torch.testing.assert_close(loss(LOGITS, TARGET), LOSSES * weights)
    again = CellLoss("weighted", 2)
    again.load_state_dict(loss.state_dict())
    torch.testing.assert_close(again(LOGITS, TARGET), LOSSES * weights)


def test_weights_are_worked_out_by_hand():
    masks = torch.zeros(2, 2, 5, 10)
    masks[:, 0, :, :8] = 1  # 80 of 100: √(20 / 80)
    masks[0, 1, 0, :4] = 1  # 4 of 100: √(96 / 4)
    loss = CellLoss("weighted", 2)
    loss.fit([(masks, None)])
    torch.testing.assert_close(loss.positive_weight, torch.tensor([0.5, math.sqrt(24)]))


def test_a_target_that_is_nowhere_or_everywhere_weighs_one():
    loss = CellLoss("weighted", 2)
    loss.fit([(torch.stack([torch.zeros(3, 4), torch.ones(3, 4)])[None], None)])
    assert loss.positive_weight.tolist() == [1, 1]


def test_focal_losses_are_as_published():
    """(1 − p)² of cross-entropy, where p is the probability of what is true."""
    right = torch.where(TARGET > 0, LOGITS.sigmoid(), 1 - LOGITS.sigmoid())
    expected = (1 - right) ** 2 * functional.binary_cross_entropy_with_logits(
        LOGITS, TARGET, reduction="none"
    )
    torch.testing.assert_close(CellLoss("focal", 2)(LOGITS, TARGET), expected)


def test_the_mean_is_over_cells_and_targets():
    expected = (HALF + RIGHT + WRONG + HALF + 4 * HALF) / 8
    assert mean_of_known(LOSSES).item() == pytest.approx(expected)


def test_unknown_cells_do_not_count():
    expected = (HALF + WRONG + 4 * HALF) / 6
    assert mean_of_known(LOSSES, KNOWN).item() == pytest.approx(expected)
    everywhere = mean_of_known(LOSSES, torch.ones_like(KNOWN))
    torch.testing.assert_close(everywhere, mean_of_known(LOSSES))


def test_nothing_known_is_no_loss():
    losses = LOSSES.clone().requires_grad_()
    loss = mean_of_known(losses, torch.zeros_like(KNOWN))
    loss.backward()
    assert loss.item() == 0
    assert not losses.grad.any()


def test_perception_is_the_sum_of_two_means():
    drivable, vehicles = (HALF + 2 * HALF) / 3, (WRONG + 2 * HALF) / 3
    assert perception_loss(LOSSES, KNOWN).item() == pytest.approx(drivable + vehicles)
    assert perception_loss(LOSSES).item() == pytest.approx(
        (HALF + RIGHT + 2 * HALF) / 4 + (WRONG + HALF + 2 * HALF) / 4
    )


def test_sums_are_over_cells_and_targets_and_means_over_frames():
    assert summed_perception_loss(LOSSES, KNOWN).item() == pytest.approx((HALF + WRONG + 4 * HALF) / 2)
    assert summed_perception_loss(LOSSES).item() == pytest.approx(
        (HALF + RIGHT + WRONG + HALF + 4 * HALF) / 2
    )


def test_the_bound_is_cross_entropy_and_divergence_a_cell():
    mu = torch.tensor([[2.0, 0.0], [0.0, 0.0]])  # KL = 2²/2 = 2 and 0: 1 on average, over two cells
    logvar = torch.zeros(2, 2)
    value = elbo(LOSSES[:, :1], KNOWN, mu, logvar, 0.5)
    assert value.item() == pytest.approx((HALF + 2 * HALF) / 3 + 0.5 * 1 / 2)
    unweighted = elbo(LOSSES[:, :1], None, mu, logvar, 0.0)
    torch.testing.assert_close(unweighted, mean_of_known(LOSSES[:, :1]))

import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch.nn import functional

from ogmkit.errors import SettingsError
from ogmkit.learn.models.gaussian import negative_log_likelihood
from ogmkit.learn.models.planner import Planner, polar
from ogmkit.metrics.linear import LinearPlan, fit_linear_plan

METRES = st.floats(-80, 80)


def inputs(features=7, count=3):
    torch.manual_seed(2)
    return torch.randn(count, 6, features), 5 * torch.randn(count, 6, 2), 10 * torch.randn(count, 2)


@given(METRES, METRES)
def test_polar_coordinates_lead_back(x, y):
    r, angle = polar(torch.tensor([x, y], dtype=torch.float64)).tolist()
    assert r == pytest.approx(math.hypot(x, y))
    assert (r * math.cos(angle), r * math.sin(angle)) == pytest.approx((x, y), abs=1e-9)


@given(st.floats(0.1, 80), st.floats(-3, 3), st.floats(-3, 3))
def test_a_turn_of_the_frame_is_added_to_the_angle(r, angle, turn):
    at = [r * math.cos(angle + turn), r * math.sin(angle + turn)]
    found = polar(torch.tensor(at, dtype=torch.float64))
    assert float(found[0]) == pytest.approx(r)
    assert math.remainder(float(found[1]) - angle - turn, math.tau) == pytest.approx(0, abs=1e-9)


def test_the_origin_has_angle_0():
    assert polar(torch.zeros(1, 2)).tolist() == [[0.0, 0.0]]


def lstm_step(values, hidden, cell, weights):
    """One step by the textbook (Hochreiter & Schmidhuber with forget gates; gates in torch's order)."""
    into, recurrent, bias_in, bias_recurrent = weights
    gates = values @ into.T + bias_in + hidden @ recurrent.T + bias_recurrent
    enter, forget, content, leave = gates.chunk(4, dim=-1)
    cell = forget.sigmoid() * cell + enter.sigmoid() * content.tanh()
    return leave.sigmoid() * cell.tanh(), cell


def by_hand(net, features, positions, destination):
    """The paper's two equations, written out with the network's weights."""
    state = {name: value.double() for name, value in net.state_dict().items()}

    def linear(name, values):
        return values @ state[f"{name}.weight"].T + state[f"{name}.bias"]

    def lstm(name, suffix=""):
        parts = ("weight_ih", "weight_hh", "bias_ih", "bias_hh")
        return [state[f"{name}.{part}{suffix}"] for part in parts]

    def standard(name, values):
        return (values - state[f"{name}.mean"]) / state[f"{name}.spread"]

    told = destination is not None
    features, positions = features.double(), positions.double()
    unit, base = "of_targets", torch.zeros(6, 1, 2)
    if net.linear_mean:
        names = ("centre", "weights", "middle")
        plan = LinearPlan(*(state[f"linear_mean.{name}"].numpy() for name in names))
        base = torch.from_numpy(plan(positions.numpy(), destination.double().numpy() if told else None))
        unit, base = "linear_mean.of_residuals", base.transpose(0, 1)
    center, spread = state[f"{unit}.mean"], state[f"{unit}.spread"]
    hidden = cell = torch.zeros(len(positions), net.decoder.hidden_size, dtype=torch.float64)
    for t in range(6):
        embedded = [
            linear("embed_features.0", features[:, t]).relu(),
            linear("embed_position.0", standard("of_positions", positions[:, t])).relu(),
        ]
        hidden, cell = lstm_step(torch.cat(embedded, 1), hidden, cell, lstm("encoder", "_l0"))
    place = []
    if told:
        r, angle = destination.norm(dim=1), torch.atan2(destination[:, 1], destination[:, 0])
        place = [standard("of_destination", torch.stack([r, angle], dim=1))]
    estimate, means, sigmas, rhos = torch.zeros_like(positions[:, 0]), [], [], []
    for step in range(5 if told else 6):
        embedded = linear("embed_estimate.0", standard("of_targets", estimate)).relu()
        hidden, cell = lstm_step(embedded, hidden, cell, lstm("decoder"))
        raw = linear("head.1", linear("head.0.0", torch.cat([hidden, *place], 1)).relu())
        estimate = raw[:, :2] * spread + center + base[step]
        means.append(estimate)
        sigmas.append(functional.softplus(raw[:, 2:4]) * spread + 0.05)
        rhos.append(0.999 * raw[:, 4].tanh())
    return torch.stack(means, 1), torch.stack(sigmas, 1), torch.stack(rhos, 1)


@pytest.mark.parametrize("told", [True, False])
@pytest.mark.parametrize("linear_mean", [False, True])
def test_the_recurrence_is_the_papers(linear_mean, told):
    net = Planner(7, hidden=11, linear_mean=linear_mean, told=told).double()
    features, positions, destination = (value.double() for value in inputs())
    given_inputs = features, positions, destination if told else None
    net.fit(2 + 5 * torch.randn(30, 6, 2), torch.randn(30, 6, 2) * torch.tensor([8.0, 0.3]))
    found = net(*given_inputs)
    for ours, theirs in zip(found, by_hand(net, *given_inputs), strict=True):
        torch.testing.assert_close(ours, theirs, rtol=0, atol=1e-6)
    points = 5 if told else 6
    assert found.mean.shape == found.sigma.shape == (3, points, 2)
    assert found.rho.shape == (3, points)


def test_coordinates_are_standardised_by_what_was_seen():
    net = Planner(0)
    positions, future = torch.rand(40, 6, 2), 5 + torch.randn(40, 6, 2)
    future[:, :, 1] = 0.25  # nobody leaves his lane
    net.fit(positions, future)
    for standard, values in (
        (net.of_positions, positions),
        (net.of_targets, future[:, :5]),
        (net.of_destination, polar(future[:, 5])),
    ):
        found = standard(values).reshape(-1, 2)
        torch.testing.assert_close(found.mean(0), torch.zeros(2), atol=1e-4, rtol=0)
        assert float(found.std(0).max()) < 1.1
    assert net.of_targets.spread.tolist() == pytest.approx([float(future[:, :5, 0].std()), 1e-3], rel=0.02)


def test_gradients_reach_every_weight():
    net = Planner(7)
    found = net(*inputs())
    negative_log_likelihood(found, torch.randn(3, 5, 2)).sum().backward()
    untouched = [name for name, weight in net.named_parameters() if not weight.grad.any()]
    assert untouched == []


def test_without_the_past_positions_do_not_matter():
    net = Planner(7, past=False)
    features, positions, destination = inputs()
    assert torch.equal(net(features, positions, destination).mean, net(features, None, destination).mean)
    with_past = Planner(7)
    there, elsewhere = (with_past(features, place, destination).mean for place in (positions, positions + 1))
    assert not torch.equal(there, elsewhere)


def test_the_destination_matters_and_so_does_the_past():
    net = Planner(0)
    _, positions, destination = inputs()
    here, there = (net(None, positions, place).mean for place in (destination, destination + 1))
    assert not torch.allclose(here, there)


@pytest.mark.parametrize("more", [{"features": 0}, {"features": 7, "linear_mean": True}])
def test_a_planner_that_needs_the_past_is_refused_without(more):
    with pytest.raises(SettingsError, match="leave out --no-past"):
        Planner(**more, past=False)


class TestLinearMean:
    """A planner whose means are learnt on top of the linear plan."""

    @pytest.fixture
    def training(self):
        """Positions and futures of 40 sequences; the ego is at (0, 0) at the last position."""
        torch.manual_seed(3)
        positions = torch.randn(40, 6, 2) * torch.tensor([9.0, 0.4])
        positions[:, -1] = 0
        return positions, torch.randn(40, 6, 2) * torch.tensor([12.0, 0.8]) + torch.tensor([20.0, 0.0])

    @pytest.fixture
    def net(self, training):
        net = Planner(0, linear_mean=True)
        net.fit(*training)
        return net

    @pytest.fixture
    def linear(self, training):
        """The control of the same sequences."""
        positions, future = (values.double().numpy() for values in training)
        return fit_linear_plan(positions, future[:, 5], future[:, :5])

    def test_before_it_has_learnt_anything_it_plans_as_the_linear_control(self, net, linear):
        for weight in net.head.parameters():
            torch.nn.init.zeros_(weight)
        _, positions, destination = inputs(count=9)

        found = net(None, positions, destination).mean.detach()
        expected = linear(positions.double().numpy(), destination.double().numpy())
        np.testing.assert_allclose(found, expected, atol=1e-4)

    def test_without_the_destination_it_begins_as_least_squares_from_the_past_alone(self, training):
        net = Planner(0, linear_mean=True, told=False)
        net.fit(*training)
        for weight in net.head.parameters():
            torch.nn.init.zeros_(weight)
        _, positions, _ = inputs(count=9)

        found = net(None, positions, None).mean.detach()
        past, future = (values.double().numpy() for values in training)
        expected = fit_linear_plan(past, None, future)(positions.double().numpy(), None)
        np.testing.assert_allclose(found, expected, atol=1e-4)

    def test_what_the_linear_plan_leaves_over_is_standardised(self, net, linear, training):
        positions, future = (values.double().numpy() for values in training)
        left = future[:, :5] - linear(positions, future[:, 5])

        standard = net.linear_mean.of_residuals
        np.testing.assert_allclose(standard.mean, [0, 0], atol=1e-5)
        np.testing.assert_allclose(standard.spread, left.reshape(-1, 2).std(axis=0), rtol=1e-5)

    def test_it_travels_with_the_weights_and_only_where_it_is_asked_for(self, net):
        other = Planner(0, linear_mean=True)
        other.load_state_dict(net.state_dict())
        _, positions, destination = inputs()
        assert torch.equal(other(None, positions, destination).mean, net(None, positions, destination).mean)
        assert not [name for name in Planner(0).state_dict() if "linear" in name]

    def test_it_keeps_its_digits_in_mixed_precision(self, net):
        _, positions, destination = inputs()
        exact = net.linear_mean(positions, destination)
        with torch.autocast("cpu", dtype=torch.bfloat16):
            torch.testing.assert_close(net.linear_mean(positions, destination), exact, atol=1e-5, rtol=1e-6)

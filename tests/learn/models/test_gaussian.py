import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from torch.distributions import MultivariateNormal

from ogmkit.learn.models.gaussian import Gaussians, gaussian_of, negative_log_likelihood

REAL = st.floats(-30, 30)
PARAMETERS = st.tuples(REAL, REAL, st.floats(0.05, 20), st.floats(0.05, 20), st.floats(-0.99, 0.99))


def gaussians(*parameters):
    x, y, sigma_x, sigma_y, rho = torch.tensor(parameters, dtype=torch.float64)
    return Gaussians(
        torch.stack([x, y])[None, None], torch.stack([sigma_x, sigma_y])[None, None], rho[None, None]
    )


@given(PARAMETERS, REAL, REAL)
def test_likelihood_is_that_of_torch_and_of_scipy(parameters, x, y):
    mean_x, mean_y, sigma_x, sigma_y, rho = parameters
    found = negative_log_likelihood(gaussians(*parameters), torch.tensor([[[x, y]]], dtype=torch.float64))
    shared = rho * sigma_x * sigma_y
    covariance = np.array([[sigma_x**2, shared], [shared, sigma_y**2]])
    point, mean = np.array([x, y]), np.array([mean_x, mean_y])
    by_torch = MultivariateNormal(torch.tensor(mean), torch.tensor(covariance)).log_prob(torch.tensor(point))
    assert float(found) == pytest.approx(-float(by_torch), rel=1e-5, abs=1e-5)
    by_scipy = stats.multivariate_normal(mean, covariance).logpdf(point)
    assert float(found) == pytest.approx(-by_scipy, rel=1e-5, abs=1e-5)


def test_likelihood_in_single_precision_is_as_good():
    torch.manual_seed(0)
    mean, sigma, rho = gaussian_of(torch.randn(200, 5), torch.zeros(2), torch.full((2,), 10.0))
    found = Gaussians(mean[:, None], sigma[:, None], rho[:, None])
    points = (mean + torch.randn(200, 2) * sigma)[:, None]
    exact = negative_log_likelihood(Gaussians(*(value.double() for value in found)), points.double())
    torch.testing.assert_close(negative_log_likelihood(found, points).double(), exact, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("size", [0.0, 1.0, 1e3, 1e6])
@pytest.mark.parametrize(
    "signs", [(1, 1, 1, 1, 1), (-1, 1, -1, -1, -1), (1, -1, 1, -1, 1), (1, 1, -1, -1, 1)]
)
def test_extreme_answers_have_finite_likelihoods_and_gradients(size, signs):
    raw = (size * torch.tensor([signs], dtype=torch.float32)).requires_grad_()
    mean, sigma, rho = gaussian_of(raw, torch.tensor([9.0, 0.1]), torch.tensor([7.0, 0.4]))
    assert float(sigma.detach().min()) >= 0.05
    assert float(rho.detach().abs().max()) < 1
    places = torch.tensor([[[-1e4, 1e4]]])
    loss = negative_log_likelihood(Gaussians(mean[None], sigma[None], rho[None]), places).sum()
    loss.backward()
    assert bool(torch.isfinite(loss))
    assert bool(torch.isfinite(raw.grad).all())


def test_parameters_by_hand():
    raw, middle_m, unit_m = torch.tensor([[1.0, -0.5, 0.0, 2.0, 0.5]]), torch.tensor([7.0, 1.0]), [10.0, 2.0]
    mean, sigma, rho = gaussian_of(raw, middle_m, torch.tensor(unit_m))
    assert mean.tolist() == [[17.0, 0.0]]
    assert sigma[0].tolist() == pytest.approx([10 * np.log(2) + 0.05, 2 * np.log1p(np.exp(2.0)) + 0.05])
    assert float(rho) == pytest.approx(0.999 * np.tanh(0.5))

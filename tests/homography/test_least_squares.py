import numpy as np

from ogmkit.homography.least_squares import minimise


def logarithm(parameters):
    """One point whose x residual is log(p); nothing is allowed at p <= 0, where a full step would lead."""
    with np.errstate(invalid="ignore", divide="ignore"):
        value, slope = np.log(parameters[:, 0]), 1 / parameters[:, 0]
    residual, jacobian = np.zeros((len(parameters), 1, 2)), np.zeros((len(parameters), 1, 2, 1))
    residual[:, 0, 0], jacobian[:, 0, 0, 0] = value, slope
    return residual, jacobian


def test_steps_to_where_nothing_is_allowed_are_taken_back_and_shortened():
    found = minimise(np.array([[10.0], [0.2]]), logarithm, np.ones((2, 1)), steps=30)
    np.testing.assert_allclose(found, 1.0, atol=1e-6)


def test_a_start_that_is_not_allowed_stays():
    found = minimise(np.array([[-3.0], [2.0]]), logarithm, np.ones((2, 1)), steps=30)
    np.testing.assert_allclose(found, [[-3.0], [1.0]], atol=1e-6)


def test_soft_l1_of_one_dimension_lies_between_mean_and_median():
    values = np.array([0.0, 1.0, 2.0, 100.0])

    def model(parameters):
        residual = np.zeros((len(parameters), 4, 2))
        residual[..., 0] = parameters - values
        jacobian = np.zeros((len(parameters), 4, 2, 1))
        jacobian[..., 0, 0] = 1.0
        return residual, jacobian

    start, weights = np.array([[50.0], [50.0]]), np.ones((2, 4))
    mean = minimise(start, model, weights, steps=40)
    robust = minimise(start, model, weights, steps=40, soft_l1=np.array([1.0, 1e6]))
    np.testing.assert_allclose(mean, 25.75, atol=1e-6)
    assert 1.0 < robust[0, 0] < 3.0
    assert abs(robust[1, 0] - 25.75) < 1e-3

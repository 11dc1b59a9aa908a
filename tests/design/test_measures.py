"""The smooth measures against the exact ones, and their gradients against differences."""

import numpy as np
import pytest

from workbench.analysis.analysis import analyse
from workbench.control.gains import GAIN_NAMES, TIME_CONSTANTS, Gains
from workbench.design.measures import GAPS, GroupMeasures, static_error_function
from workbench.design.starts import CENTRE
from workbench.design.steering import Programme
from workbench.files.problem import load_problem
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.peak_sensitivity import exact_peaks
from workbench.lti.delay import pade

GAINS = Gains(**CENTRE)
THETA = np.array(list(GAINS.as_dict().values()))


@pytest.fixture(scope="module")
def problem():
    return load_problem("comfort_limit")


@pytest.fixture(scope="module")
def groups(problem):
    return [GroupMeasures(problem.setting, s) for s in problem.subjects]


def test_mean_squares_on_the_steering_grid_agree_with_the_lyapunov_equation(problem, groups):
    exact = analyse(problem.setting, GAINS)
    total: dict[str, float] = {}
    for group in groups:
        mean = group.responses(THETA).mean
        for name, value in zip(group.classes, mean.value, strict=True):
            total[name] = total.get(name, 0.0) + value
    for name, (quantity, end) in {
        "gap, front": ("gap", "front"),
        "gap, rear": ("gap", "rear"),
        "lateral gap, front": ("gap_lateral", "front"),
        "acceleration z, front": ("weighted_z", "front"),
        "acceleration y, rear": ("weighted_y", "rear"),
    }.items():
        # guide, Definitions: a grid must agree to 1e-3 of the mean square over 0…∞
        assert total[name] == pytest.approx(exact.rms[quantity][end] ** 2, rel=1e-3)
    assert total["currents"] == pytest.approx(exact.sum_alpha_squared, rel=1e-3)


def test_every_gradient_of_the_group_measures_is_the_derivative(groups):
    for group in groups:
        found = group.responses(THETA)
        mean, peak = found.mean, found.peak
        for k, name in enumerate(GAIN_NAMES):
            step = 1e-5 * max(abs(THETA[k]), 0.1)
            ends = [THETA + sign * step * np.eye(17)[k] for sign in (1, -1)]
            (mean_up, peak_up), (mean_down, peak_down) = (
                (found.mean.value, found.peak.value) for found in map(group.responses, ends)
            )
            # central differences of step 1e-5 relative are good to about 1e-7 of the largest slope
            for ours, up, down in ((mean.gradient, mean_up, mean_down), (peak.gradient, peak_up, peak_down)):
                theirs = (up - down) / (2 * step)
                assert np.abs(ours[:, k] - theirs).max() <= 1e-5 * (np.abs(theirs).max() + np.abs(up).max()), name


def test_eigenvalue_derivatives_are_those_of_the_eigenvalues(groups):
    # distinct time constants: at equal ones the filters' eigenvalues coincide and have no derivative
    theta = THETA.copy()
    theta[[GAIN_NAMES.index(t) for t in TIME_CONSTANTS]] = (0.5, 0.15, 0.7, 0.25)
    for group in groups:
        values, slopes = (a.copy() for a in group.eigenvalues(theta))
        for k in (0, 1, 2, 9, 10, 15):
            step = 1e-6
            moved = group.eigenvalues(theta + step * np.eye(17)[k])[0]
            nearest = moved[np.abs(moved[None, :] - values[:, None]).argmin(axis=1)]
            # forward difference: error of the order of the step times the second derivative
            np.testing.assert_allclose(
                (nearest - values) / step, slopes[:, k], atol=2e-3 * (1 + np.abs(slopes[:, k]).max())
            )


def test_the_smooth_static_error_is_the_exact_one(problem):
    exact = analyse(problem.setting, GAINS).static_error
    smooth = static_error_function(problem.setting)(THETA)[0].full().ravel()
    by_name = dict(zip(GAPS, smooth, strict=True))
    # the smoothing of |x| adds at most 1e-6 m/(m/s²) × 8 sensors × the bias of 0.02 m/s²
    assert max(by_name["gap, front"], by_name["gap, rear"]) == pytest.approx(exact["gap"], abs=2e-7)
    assert max(by_name["lateral gap, front"], by_name["lateral gap, rear"]) == pytest.approx(
        exact["gap_lateral"], abs=2e-7
    )


def test_no_node_of_the_grid_exceeds_the_exact_peak_sensitivity(problem, groups):
    for number, _, value in exact_peaks(Flown(problem.setting, GAINS)):
        nodes = np.sqrt(groups[number].responses(THETA).peak.value.max())
        assert value * 0.9 < nodes <= value * (1 + 1e-9)  # the grid is dense enough to come within a tenth


def test_a_watched_frequency_is_measured_exactly(problem):
    group = GroupMeasures(problem.setting, problem.subjects[0])
    ((_, omega, value), *_) = exact_peaks(Flown(problem.setting, GAINS))
    assert np.sqrt(group.watching([omega]).responses(THETA).peak.value[-1]) == pytest.approx(value, rel=1e-8)
    assert not len(group.watched)  # what is asked later is asked of another record


def test_variables_and_gains_translate_both_ways(problem):
    programme = Programme(problem)
    x = programme.x(GAINS)
    back = programme.gains(x).as_dict()
    for name in problem.free:
        assert back[name] == pytest.approx(GAINS.as_dict()[name], rel=1e-12)


def test_gradients_of_the_whole_programme_are_derivatives(problem):
    programme = Programme(problem)
    x = programme.x(GAINS.with_values(tau_h=0.5, tau_z=0.7, tau_y=0.25))
    point = programme.at(x)
    direction = np.cos(np.arange(len(x)))
    step = 1e-6
    up, down = programme.at(x + step * direction), programme.at(x - step * direction)
    assert (up.objective - down.objective) / (2 * step) == pytest.approx(point.slope @ direction, rel=1e-6)
    np.testing.assert_allclose(
        (up.constraints - down.constraints) / (2 * step), point.jacobian @ direction, rtol=1e-4, atol=1e-5
    )


def test_the_fraction_of_a_dead_time_turns_by_its_angle_and_changes_no_size():
    for order, most in ((2, 0.2), (4, 6e-4), (6, 3e-7)):
        A, B, C, D = pade(1.0, order)
        for turn in (0.01, 1.0, 3.0):
            value = (D + C @ np.linalg.solve(1j * turn * np.eye(order) - A, B)).item()
            assert abs(value) == pytest.approx(1.0, rel=1e-12)
            # the error of a Padé fraction of e^−s at s = 3j: (n!)²/((2n)! (2n + 1)!) 3^(2n+1)
            assert abs(np.angle(value * np.exp(1j * turn))) < most


def test_noise_of_the_gaps_is_that_of_the_lyapunov_equation_of_the_analysis(problem, groups):
    exact = analyse(problem.setting, GAINS).sensor_noise_rms
    for kind in ("gap", "gap_lateral"):
        ends = [f"{kind}_{i + 1}" for i in problem.setting.ends]
        square = sum(group.noise(THETA, ends).value for group in groups)
        assert np.sqrt(square.max()) == pytest.approx(exact[kind], rel=1e-9)


def test_gradients_of_noise_and_of_damping_with_dead_time_are_derivatives(groups):
    theta = THETA.copy()  # distinct time constants: equal filters have no derivative of their roots
    theta[[GAIN_NAMES.index(t) for t in TIME_CONSTANTS]] = (0.5, 0.15, 0.7, 0.25)
    move = np.cos(np.arange(17)) * np.maximum(np.abs(theta), 0.05)
    step = 1e-6
    for group in groups:
        for measure, more in ((group.noise, (["gap_1", "gap_3"],)), (group.delayed_damping, (0.004, 3))):
            up, down = (measure(theta + sign * step * move, *more).value for sign in (1, -1))
            # central differences: 1e-12 of curvature, 1e-10 of rounding over the step
            np.testing.assert_allclose(
                (up - down) / (2 * step), measure(theta, *more).gradient @ move, rtol=1e-5, atol=1e-6 * np.abs(up).max()
            )

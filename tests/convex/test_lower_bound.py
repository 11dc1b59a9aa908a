"""Bounds from below: the preview optimum against a discrete-time regulator, duality against given gains."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_are

from workbench.convex.bound import Dual, achieved_by, lower_bound
from workbench.convex.preview import Cost, Measured, PreviewRegulator
from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.goals.ride.currents import MeanSquareCurrents

A = np.array([[0.0, 1.0], [-2.0, -0.3]])
B, FRONT, REAR = np.array([[0.0], [1.0]]), np.array([[0.2], [1.0]]), np.array([[0.1], [-0.6]])
COSTS = [Cost(np.array([[1.0, 0.4]]), np.array([[0.0]])), Cost(np.array([[0.0, 0.0]]), np.array([[1.0]]))]
COEFFICIENTS, DELAY = np.array([1.0, 0.5]), 0.4
SEEN = Measured(states=2, C=np.array([[1.0, 0.0]]), intensity=np.array([0.05]))

CURRENTS = MeanSquareCurrents.kind


@pytest.fixture(scope="module")
def vehicle():
    return load_problem("heave_pitch")


def discrete_optimum(cells: int, *, noise: bool) -> float:
    """The same problem sampled, with every cell of the delay line a state: a textbook LQG of order 2 + cells."""
    h = DELAY / cells
    n = 2 + cells
    whole = expm(np.block([[A, B], [np.zeros((1, 3))]]) * h)
    step, push, read = np.zeros((n, n)), np.zeros((n, 1)), np.zeros((1, n))
    step[:2, :2], push[:2, 0] = whole[:2, :2], whole[:2, 2]
    step[:2, -1] = REAR[:, 0]  # what left the front `cells` steps ago
    step[3:, 2:-1] = np.eye(cells - 1)
    enter = np.zeros((n, 1))
    enter[:2, 0], enter[2, 0] = FRONT[:, 0], 1.0
    read[0, :2] = SEEN.C
    cost = np.zeros((n, n))
    cost[:2, :2] = h * COSTS[0].C.T @ COSTS[0].C
    R = np.array([[h * COEFFICIENTS[1]]])
    P = solve_discrete_are(step, push, cost, R)
    K = np.linalg.solve(R + push.T @ P @ push, push.T @ P @ step)
    value = float((enter.T @ P @ enter)[0, 0])  # noise of variance h, cost per time: h/h
    if noise:
        V = SEEN.intensity[0] / h
        M = solve_discrete_are(step.T, read.T, h * enter @ enter.T, np.array([[V]]))
        known = M - M @ read.T @ read @ M / (read @ M @ read.T + V)
        value += float(np.trace((R + push.T @ P @ push) @ K @ known @ K.T)) / h
    return value


@pytest.mark.parametrize("noise", [False, True])
def test_the_preview_optimum_is_the_limit_of_sampled_regulators_with_a_delay_line(noise):
    # errors fall in proportion to the cell: extrapolated from 40 and 80 cells
    coarse, fine = discrete_optimum(40, noise=noise), discrete_optimum(80, noise=noise)
    ours = PreviewRegulator(A, B, FRONT, REAR, DELAY, COSTS, SEEN if noise else None).at(COEFFICIENTS).value
    assert abs(coarse - fine) > 1e-4  # or there would be nothing to extrapolate
    assert ours == pytest.approx(2 * fine - coarse, rel=2e-3)  # second order of 1/40 of a delay of 0.4 s at 1.4 rad/s


def test_preview_lowers_the_cost_and_sensor_noise_raises_it():
    blind = PreviewRegulator(A, B, np.hstack([FRONT, REAR]), np.zeros((2, 2)), 0.0, COSTS, None).at(COEFFICIENTS).value
    seen = PreviewRegulator(A, B, FRONT, REAR, 0.0, COSTS, None).at(COEFFICIENTS).value
    ahead = PreviewRegulator(A, B, FRONT, REAR, DELAY, COSTS, None).at(COEFFICIENTS).value
    noisy = PreviewRegulator(A, B, FRONT, REAR, DELAY, COSTS, SEEN).at(COEFFICIENTS).value
    assert ahead < noisy
    assert seen != pytest.approx(blind, rel=0.01)  # the correlation of front and rear counts
    louder = replace(SEEN, intensity=100 * SEEN.intensity)
    assert noisy < PreviewRegulator(A, B, FRONT, REAR, DELAY, COSTS, louder).at(COEFFICIENTS).value


@pytest.mark.parametrize("noise", [False, True])
def test_slopes_are_those_of_differences(noise):
    regulator = PreviewRegulator(A, B, FRONT, REAR, DELAY, COSTS, SEEN if noise else None)
    slopes = regulator.at(COEFFICIENTS).slopes
    for i, step in enumerate(1e-4 * np.eye(2)):
        difference = (regulator.at(COEFFICIENTS + step).value - regulator.at(COEFFICIENTS - step).value) / 2e-4
        assert slopes[i] == pytest.approx(difference, rel=1e-6)  # h² of the central difference
    # the cost is of the first degree in its coefficients
    assert slopes @ COEFFICIENTS == pytest.approx(regulator.at(COEFFICIENTS).value, rel=1e-9)


@pytest.mark.parametrize("noise", [False, True])
def test_no_multipliers_lift_the_dual_above_the_lagrangian_of_given_gains(vehicle, noise):
    dual = Dual(vehicle, noise=noise)
    cost, usage = achieved_by(vehicle, vehicle.gains, noise=noise)
    excess = np.array([usage[name] for name in dual.names]) - 1
    random = np.random.default_rng(4)
    for _ in range(3):
        multipliers = cost * 10 ** random.uniform(-3, 1, len(dual.names))
        value, slopes, parts, residual = dual.at(multipliers)
        assert value < cost + multipliers @ excess
        assert residual < 1e-9
        # of the first degree in the coefficients: value = J + Σ λ (g/limit − 1), so J itself follows, and is positive
        assert parts.sum() - multipliers @ (slopes + 1) > 0


def test_the_cost_of_the_approved_gains_is_that_of_the_analysis(vehicle):
    from workbench.analysis.analysis import analyse

    whole = analyse(vehicle.setting, vehicle.gains)
    cost, usage = achieved_by(vehicle, vehicle.gains, noise=False)
    assert cost == pytest.approx(whole.cost, rel=1e-9)  # one Lyapunov equation, two ways to sum
    limit = {r.name: r.limit for r in vehicle.requirements}
    assert usage["rms gap, front"] == pytest.approx(
        (whole.rms["gap"]["front"] / limit["rms gap, front"]) ** 2, rel=1e-9
    )
    assert usage[CURRENTS] == pytest.approx(whole.sum_alpha_squared / limit[CURRENTS], rel=1e-9)


@pytest.mark.slow
def test_the_bound_lies_below_the_approved_gains_and_noise_brings_it_nearer(vehicle):
    with_noise = lower_bound(vehicle)
    without, *_ = Dual(vehicle, noise=False).at(list(with_noise.multipliers.values()))
    assert 0 < without < with_noise.bound < with_noise.cost
    assert with_noise.ratio == pytest.approx(np.sqrt(with_noise.bound / with_noise.cost))
    assert with_noise.active == (CURRENTS,)
    # where a multiplier is positive its limit is met with equality; the others keep theirs: saddle point of the dual
    assert with_noise.usage[CURRENTS] == pytest.approx(1.0, abs=1e-4)  # gradient at which the search ends
    assert all(value <= 1 for name, value in with_noise.usage.items() if name != CURRENTS)


@pytest.mark.slow
def test_the_comfort_limit_is_within_twice_the_rms_of_any_linear_controller():
    found = lower_bound(load_problem("comfort_limit"))
    assert 0.5 < found.ratio < 1


def test_problems_without_a_mean_square_limit_of_the_control_are_refused(vehicle):
    free = vehicle.with_requirements(r for r in vehicle.requirements if r.name != CURRENTS)
    with pytest.raises(InputError, match="without which control costs nothing"):
        lower_bound(free)
    with pytest.raises(InputError, match="has a motor"):
        lower_bound(load_problem("hybrid_motor"))
    with pytest.raises(InputError, match="penalise every control"):
        PreviewRegulator(A, B, FRONT, REAR, DELAY, COSTS, None).at([1.0, 0.0])

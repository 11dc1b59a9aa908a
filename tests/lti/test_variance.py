"""Stationary covariances under white noise met at the front and, a wheel base later, at the rear."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.linalg import expm

from workbench.errors import InputError
from workbench.lti.norm import frequency_response
from workbench.lti.variance import stationary

quick = settings(max_examples=25, deadline=None, derandomize=True)


def random_state(seed, largest=8):
    """A stable state of 2 to `largest` variables with 1 to 3 noises at both ends."""
    rng = np.random.default_rng(seed)
    n, k = rng.integers(2, largest + 1), rng.integers(1, 4)
    A = rng.standard_normal((n, n))
    A -= (np.linalg.eigvals(A).real.max() + 10 ** rng.uniform(-2, 0.5)) * np.eye(n)
    return A, rng.standard_normal((n, k)), rng.standard_normal((n, k))


# ---------------------------------------------------------------- closed forms


@pytest.mark.parametrize(("omega", "damping"), [(2 * math.pi * 0.6, 0.6), (2 * math.pi * 1.413, 0.01), (1.0, 1.0)])
def test_a_skyhook_ride_has_the_closed_form_acceleration_and_gap(omega, damping):
    # ride reference: one-sided velocity density A V: σ_a² = A V π ω³/(4ζ), σ_gap² = A V π (4ζ² + 1)/(4ζ ω)
    roughness, speed = 8.475e-7, 134.0
    A = np.array([[0, 1], [-(omega**2), -2 * damping * omega]])  # gap, body velocity
    B = np.array([[-1.0], [0]]) * math.sqrt(math.pi * roughness * speed)
    state = stationary(A, B)
    acceleration, gap = state.mean_squares([A[1], [1, 0]])[0]
    level = math.pi * roughness * speed
    assert acceleration == pytest.approx(level * omega**3 / (4 * damping), rel=1e-12)  # rounding over damping
    assert gap == pytest.approx(level * (4 * damping**2 + 1) / (4 * damping * omega), rel=1e-12)
    assert state.decay == pytest.approx(damping * omega, rel=1e-7)  # a double pole at critical damping


def test_the_skyhook_anchor_of_the_ride_reference_is_met():
    # A = 8.475e-7 m, 0.6 Hz, ζ = 0.6, 134 m/s: 0.0892 m/s² and 9.81 mm, three digits
    omega, damping = 2 * math.pi * 0.6, 0.6
    A = np.array([[0, 1], [-(omega**2), -2 * damping * omega]])
    squares = stationary(A, [[-math.sqrt(math.pi * 8.475e-7 * 134)], [0]]).mean_squares([A[1], [1, 0]])[0]
    assert math.sqrt(squares[0]) == pytest.approx(0.0892, abs=5e-5)
    assert math.sqrt(squares[1]) == pytest.approx(9.81e-3, abs=5e-6)


def test_a_lag_that_meets_its_noise_twice_has_the_exponential_cross_term():
    # x' = −a x + b w(t) + c w(t − T): (b² + c² + 2bc e^(−aT))/(2a)
    a, b, c, delay = 0.7, 2.0, -3.0, 0.4
    state = stationary([[-a]], [[b]], [[c]], delay=delay)
    exact = (b * b + c * c + 2 * b * c * math.exp(-a * delay)) / (2 * a)
    assert state.covariance[0, 0, 0] == pytest.approx(exact, rel=1e-14)


# ---------------------------------------------------------------- other routes


@quick
@given(st.integers(0, 10**6))
def test_the_covariance_solves_the_lyapunov_equation_written_out_entry_by_entry(seed):
    A, front, rear = random_state(seed)
    delay, one = 0.37, np.eye(len(A))
    state = stationary(A, front, rear, delay=delay)
    operator = np.kron(A, one) + np.kron(one, A)
    for k, P in enumerate(state.covariance):
        f, r = front[:, [k]], rear[:, [k]]
        cross = expm(A * delay) @ f @ r.T
        Q = f @ f.T + r @ r.T + cross + cross.T
        exact = np.linalg.solve(operator, -Q.ravel()).reshape(Q.shape)
        assert np.abs(P - exact).max() < 1e-9 * np.abs(exact).max()  # damping from 1e-2 on


@pytest.mark.parametrize("seed", range(6))
def test_a_mean_square_is_the_area_under_the_density(seed):
    # ∫ |C (jω − A)⁻¹ (B_F + e^(−jωT) B_R)|² dω/2π over all ω, adaptively; two lags at the output end it soon
    A, front, rear = random_state(seed, largest=4)
    n, delay = len(A), 0.3
    A = np.block([[A, np.zeros((n, 2))], [np.vstack([np.ones(n), np.zeros(n)]), np.array([[-5, 0], [1, -5]])]])
    front, rear = (np.vstack([B, np.zeros((2, B.shape[1]))]) for B in (front, rear))
    C = np.eye(n + 2)[[-1]]

    def density(omega):
        first, second = (frequency_response(A, B, C, None, [omega])[0, 0] for B in (front, rear))
        return float(np.sum(np.abs(first + np.exp(-1j * omega * delay) * second) ** 2))

    points = sorted({*np.abs(np.linalg.eigvals(A).imag), 5.0})
    ends = zip([0, *points], [*points, 300], strict=True)
    area = sum(quad(density, low, high, limit=200, epsrel=1e-8)[0] for low, high in ends)
    # the tail behind 300 rad/s falls with the sixth power: below 1e-9 of the area
    assert stationary(A, front, rear, delay=delay).mean_squares(C).sum() == pytest.approx(area / math.pi, rel=1e-6)


@quick
@given(st.integers(0, 10**6))
def test_without_delay_both_ends_add_and_after_a_long_one_they_are_independent(seed):
    A, front, rear = random_state(seed)
    together = stationary(A, front + rear).covariance
    assert np.allclose(stationary(A, front, rear).covariance, together, rtol=0, atol=1e-9 * np.abs(together).max())
    decay = stationary(A, front).decay
    apart = stationary(A, front).covariance + stationary(A, rear).covariance
    late = stationary(A, front, rear, delay=60 / decay).covariance
    # e^(−60) times the transient growth of a random matrix
    assert np.allclose(late, apart, rtol=0, atol=1e-9 * np.abs(apart).max())


@quick
@given(st.integers(0, 10**6))
def test_independent_noises_add_and_correlated_ones_mix(seed):
    A, front, rear = random_state(seed)
    k = front.shape[1]
    mix = np.random.default_rng(seed).standard_normal((k, k))
    alone = stationary(A, front, rear, delay=0.2)
    (together,) = stationary(A, front, rear, delay=0.2, correlation=np.eye(k)).covariance
    scale = 1e-9 * np.abs(alone.covariance).max()
    assert np.allclose(alone.covariance.sum(axis=0), together, rtol=0, atol=scale)
    # noises v = mix w have the correlation mix mix' and enter w through B mix
    (mixed,) = stationary(A, front, rear, delay=0.2, correlation=mix @ mix.T).covariance
    direct = stationary(A, front @ mix, rear @ mix, delay=0.2).covariance.sum(axis=0)
    assert np.allclose(mixed, direct, rtol=0, atol=1e-9 * np.abs(direct).max())


@quick
@given(st.integers(0, 10**6))
def test_the_covariance_does_not_depend_on_the_units_of_the_states(seed):
    A, front, rear = random_state(seed)
    units = 10.0 ** np.random.default_rng(seed).uniform(-5, 5, len(A))
    plain = stationary(A, front, rear, delay=0.2)
    scaled = stationary(A / units * units[:, None], front * units[:, None], rear * units[:, None], delay=0.2)
    back = scaled.covariance / np.outer(units, units)
    variances = np.sqrt(np.einsum("kii->ki", plain.covariance))
    assert np.all(np.abs(back - plain.covariance) < 1e-8 * (variances[:, :, None] * variances[:, None, :]) + 1e-12)


# ---------------------------------------------------------------- error bound


@pytest.mark.parametrize("damping", [2**-1, 2**-8, 2**-20])
def test_the_error_bound_holds_against_exact_rationals(damping):
    # integers and powers of two, so that A and Q are exact and only the solution is rounded
    from flint import fmpq, fmpq_mat

    A = np.array([[0, 1, 0, 0], [-4, -damping, 1, 0], [0, 0, 0, 1], [0, 0, -9, -damping]])
    B = np.array([[0.0], [3], [1], [-5]])
    state = stationary(A, B)
    one = np.eye(4)
    operator = np.kron(A, one) + np.kron(one, A)

    def rational(M):
        return fmpq_mat(*M.shape, [fmpq(*float(x).as_integer_ratio()) for x in M.ravel()])

    exact = rational(operator).solve(rational(-(B @ B.T).reshape(-1, 1)))
    for i in range(4):
        for sign in (1, -1):
            for j in range(4):
                v = np.eye(4)[i] + sign * np.eye(4)[j]
                weights = rational(np.outer(v, v).reshape(1, -1))
                error = (weights * exact)[0, 0] - (weights * rational(state.covariance[0].reshape(-1, 1)))[0, 0]
                assert abs(float(error.p) / float(error.q)) <= v @ state.error[0] @ v
    # the bound is of use: rounding over damping, with three digits for norms and sizes
    assert state.relative_error() < 1e3 * 2.2e-16 / damping * 10


def test_bounds_of_outputs_follow_their_states():
    A, front, rear = random_state(11)
    state = stationary(A, front, rear, delay=0.1)
    C = np.eye(len(A))
    assert state.mean_square_bounds(C) == pytest.approx(np.einsum("kii->ki", state.error))
    assert 0 < state.relative_error() < 1e-9


# ---------------------------------------------------------------- power


def test_a_damper_takes_the_power_that_the_noise_puts_in():
    # m v' = −d v − k x + w: the noise puts in 1/(2m), the damper takes d E[v²], the spring nothing
    m, d, k = 3.0, 0.4, 2.0
    state = stationary([[0, 1], [-k / m, -d / m]], [[0], [1 / m]])
    force, velocity = [[0, -d], [-k, 0]], [[0, 1], [0, 1]]
    assert state.products(force, velocity)[0] == pytest.approx([-1 / (2 * m), 0], abs=1e-15)
    assert state.power(force, velocity) == pytest.approx([-1 / (2 * m)], rel=1e-13)


# ---------------------------------------------------------------- refusals


def test_an_unstable_state_has_no_covariance():
    with pytest.raises(
        InputError, match=r"A must be stable; got the pole 0 ± 0j 1/s\. An unstable state has no stationary"
    ):
        stationary([[0.0]], [[1.0]])


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"delay": -0.1}, r"delay must be a time of zero or more; got -0\.1 s"),
        ({"delay": math.nan}, "delay must be a time of zero or more; got nan s"),
        ({"B_rear": np.ones((2, 2))}, "B_front and B_rear must have one row per state"),
        ({"correlation": [[1.0, 0], [0, 1]]}, r"correlation must be positive semidefinite and \(1, 1\)"),
        ({"correlation": [[-1.0]]}, "correlation must be positive semidefinite"),
    ],
)
def test_input_that_does_not_fit_is_named(changes, sentence):
    with pytest.raises(InputError, match=sentence):
        stationary(**({"A": -np.eye(2), "B_front": np.ones((2, 1))} | changes))


def test_outputs_must_see_the_same_states():
    state = stationary(-np.eye(2), np.ones((2, 1)))
    with pytest.raises(InputError, match="C must have 2 columns, one per state"):
        state.mean_squares(np.ones((1, 3)))
    with pytest.raises(InputError, match="C1 and C2 must have the same shape"):
        state.power(np.ones((1, 2)), np.ones((2, 2)))

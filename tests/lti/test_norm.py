"""Largest gain, H₂ norm and frequency response of linear systems."""

import math

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loop_of_1975 import heave_pitch, sway_roll_yaw
from scipy.linalg import block_diag, solve_continuous_lyapunov

from workbench.errors import InputError
from workbench.lti.margin import sensitivity
from workbench.lti.norm import frequency_response, h2_norm, intervals_above, peak_gain, proposals

EPS = 2.2e-16
quick = settings(max_examples=25, deadline=None, derandomize=True)


def oscillator(damping, frequency=1.0, gain=1.0):
    """gain ω²/(s² + 2ζωs + ω²)."""
    return (
        np.array([[0, 1], [-(frequency**2), -2 * damping * frequency]]),
        np.array([[0], [1.0]]),
        np.array([[gain * frequency**2, 0]]),
    )


def peak_of_oscillator(damping):
    return 1 / (2 * damping * math.sqrt(1 - damping**2))


def random_system(seed, feedthrough=True):
    """Stable, 1 to 12 states, 1 to 4 inputs and outputs, damping from heavy to light."""
    rng = np.random.default_rng(seed)
    n, m, p = rng.integers(1, 13), rng.integers(1, 5), rng.integers(1, 5)
    A = rng.standard_normal((n, n))
    A -= (np.linalg.eigvals(A).real.max() + 10 ** rng.uniform(-4, 1)) * np.eye(n)
    D = rng.standard_normal((p, m)) * (rng.random() < 0.7 if feedthrough else 0)
    return A, rng.standard_normal((n, m)), rng.standard_normal((p, n)), D


# ---------------------------------------------------------------- known peaks


@pytest.mark.parametrize("damping", [0.5, 1e-2, 1e-4, 1e-6, 1e-8])
def test_the_peak_of_an_oscillator_is_the_textbook_one_within_its_bracket(damping):
    peak = peak_gain(*oscillator(damping))
    exact = peak_of_oscillator(damping)
    assert peak.lower <= exact <= peak.upper
    # the bracket is as wide as asked, or as rounding moves the peak: nε of A moves it by nε/ζ, either way
    assert peak.upper - peak.lower <= exact * (2e-9 + 20 * EPS / damping)


def test_of_two_needles_between_grid_points_the_higher_is_found():
    # 1e-6 wide at 1.02 and at 1.37 rad/s, a tenth of a percent apart in height: a grid of 4001 points sees neither
    systems = [oscillator(1e-6, 1.02), oscillator(1e-6, 1.37, gain=1.001)]
    A, B, C = (block_diag(*parts) for parts in zip(*systems, strict=True))
    peak = peak_gain(A, B, C)
    assert peak.frequency == pytest.approx(1.37, rel=1e-7)  # the needle's own width
    assert peak.lower <= 1.001 * peak_of_oscillator(1e-6) <= peak.upper
    grid = frequency_response(A, B, C, None, np.geomspace(0.5, 2, 4001))
    assert np.linalg.svd(grid, compute_uv=False).max() < 0.1 * peak.value


def test_of_two_nearly_equal_resonances_and_two_outputs_of_different_size_the_higher_peak_is_found():
    # two modes at 22.15 and 22.27 rad/s, outputs a hundred times apart, feedthrough: the peak lies above both modes.
    # SLICOT's AB13DD (ctrlsys 1.1.1, tolerance 1e-9) ends at a lower crest and calls it the norm
    A = block_diag([[0, 1], [-495.9529, -3.91952]], [[0, 1], [-490.6225, -5.0502]])
    B = np.array([[0.0], [0.6], [0.0], [-3.8]])
    C, D = np.array([[-2.0, -1, -15, 12], [-110.0, -220, 180, 110]]), np.array([[-10.0], [60.0]])
    peak = peak_gain(A, B, C, D)
    omega = np.linspace(20, 30, 200_001)
    sizes = np.linalg.norm(frequency_response(A, B, C, D, omega)[:, :, 0], axis=1)
    # the grid's nearest point to a smooth crest of width 1 is 2.5e-5 off: 1e-9 of height
    assert sizes.max() == pytest.approx(peak.value, rel=1e-8)
    assert peak.frequency == pytest.approx(omega[np.argmax(sizes)], abs=1e-3)
    import ctrlsys

    order = (np.asfortranarray(M) for M in (A, np.eye(4), B, C, D))
    theirs = ctrlsys.ab13dd("C", "I", "S", "D", 4, 1, 2, np.array([0.0, 1.0]), *order, 1e-9)[0]
    assert np.ravel(theirs)[0] < 0.99 * peak.value


def test_proposed_frequencies_hit_every_interval_above_a_level():
    system = random_system(3)
    level = 0.7 * peak_gain(*system).value
    proposed = proposals(*system, level)
    for low, high in intervals_above(*system, level):
        assert np.any((proposed >= low) & (proposed <= high))


def test_a_low_pass_peaks_at_rest_and_a_high_pass_at_infinity():
    low = peak_gain([[-2.0]], [[1.0]], [[4.0]])
    high = peak_gain([[-2.0]], [[1.0]], [[-6.0]], [[3.0]])  # 3 s/(s + 2)
    assert (low.value, low.frequency) == (2.0, 0.0)
    assert (high.value, high.frequency) == (3.0, math.inf)
    for peak in (low, high):
        assert peak.lower <= peak.value <= peak.upper <= peak.value * (1 + 1e-8)


def test_an_all_pass_has_its_gain_at_every_frequency():
    # (1 − s)/(1 + s): the level is touched everywhere, so no frequency stands out and the bracket must still close
    peak = peak_gain([[-1.0]], [[1.0]], [[2.0]], [[-1.0]])
    assert peak.lower <= 1 <= peak.upper <= 1 + 1e-8


def test_a_peak_just_above_the_feedthrough_is_found():
    # |1 + k s/((s+1)² )|² exceeds 1 by 2k/2 at ω = 1 to first order: the peak sits 1e-6 above σ(D) = 1
    k = 1e-6
    peak = peak_gain([[0, 1], [-1, -2]], [[0], [1.0]], [[0, k]], [[1.0]])
    assert peak.frequency == pytest.approx(1.0, abs=2e-3)  # flat: height 1e-9 of 1e-6 is a width of 1e-3
    assert peak.value - 1 == pytest.approx(k / 2, rel=2e-3)  # bracket 1e-9 of the total


def test_a_constant_matrix_has_its_largest_singular_value():
    D = np.array([[3.0, 0, 1], [0, 4, 0]])
    peak = peak_gain(np.zeros((0, 0)), np.zeros((0, 3)), np.zeros((2, 0)), D)
    assert peak.value == pytest.approx(4.0, rel=1e-15)
    assert peak.lower <= 4 <= peak.upper


def test_a_system_that_does_nothing_has_no_gain():
    peak = peak_gain(-np.eye(3), np.ones((3, 2)), np.zeros((1, 3)))
    assert (peak.value, peak.lower, peak.upper) == (0, 0, 0)


def test_the_report_loops_have_peak_sensitivities_of_5_59_and_8_60():
    # dynamics reference: 5.593 and 8.606 from unrounded coefficients; here they have five printed digits, and the
    # static softening multiplies their rounding by about the peak
    assert peak_gain(*sensitivity(*heave_pitch())).value == pytest.approx(5.593, abs=5e-3)
    assert peak_gain(*sensitivity(*sway_roll_yaw())).value == pytest.approx(8.606, abs=5e-3)


# ---------------------------------------------------------------- properties


@quick
@given(st.integers(0, 10**6))
def test_no_frequency_exceeds_the_upper_bound_and_one_attains_the_value(seed):
    system = random_system(seed)
    peak = peak_gain(*system)
    omega = np.concatenate([[0.0], np.geomspace(1e-4, 1e4, 2000), np.abs(np.linalg.eigvals(system[0]).imag)])
    sizes = np.linalg.svd(frequency_response(*system, omega), compute_uv=False)[:, 0]
    assert sizes.max() <= peak.upper
    attained = np.linalg.svd(frequency_response(*system, [peak.frequency])[0], compute_uv=False)[0]
    assert peak.lower <= attained <= peak.upper
    # twice the tolerance: bracket and its rounding; the damping here keeps rounding below 1e-10
    assert peak.upper - peak.lower <= 2e-9 * peak.value + 1e-300


@quick
@given(st.integers(0, 10**6))
def test_the_peak_does_not_depend_on_the_units_of_the_states(seed):
    A, B, C, D = random_system(seed)
    scale = 10.0 ** np.random.default_rng(seed).uniform(-6, 6, len(A))
    rescaled = peak_gain(A / scale[:, None] * scale, B / scale[:, None], C * scale, D)
    assert rescaled.value == pytest.approx(peak_gain(A, B, C, D).value, rel=4e-9)  # the two brackets


@quick
@given(st.integers(0, 10**6), st.floats(1e-3, 1e3))
def test_a_faster_clock_moves_the_peak_and_keeps_its_height(seed, speed):
    A, B, C, D = random_system(seed)
    slow, fast = peak_gain(A, B, C, D), peak_gain(speed * A, speed * B, C, D)
    assert fast.value == pytest.approx(slow.value, rel=4e-9)  # the two brackets
    where = np.linalg.svd(frequency_response(A, B, C, D, [fast.frequency / speed])[0], compute_uv=False)[0]
    assert where == pytest.approx(slow.value, rel=4e-9)


@quick
@given(st.integers(0, 10**6))
def test_the_peak_of_a_square_system_is_that_of_python_control(seed):
    A, B, C, D = random_system(seed)
    size = min(D.shape)  # python-control 0.10.2 fails on the others
    system = A, B[:, :size], C[:size], D[:size, :size]
    other = control.norm(control.ss(*system), p="inf", tol=1e-8)
    assert peak_gain(*system).value == pytest.approx(
        other, rel=5e-6
    )  # its axis test allows 1e-8, a needle's width or more


@quick
@given(st.integers(0, 10**6), st.floats(0.3, 0.99))
def test_between_its_intervals_the_gain_is_below_the_level_and_inside_above(seed, share):
    system = random_system(seed)
    level = share * peak_gain(*system).value
    intervals = intervals_above(*system, level)
    omega = np.concatenate([[0.0], np.geomspace(1e-3, 1e3, 1500)])
    above = np.linalg.svd(frequency_response(*system, omega), compute_uv=False)[:, 0] > level
    inside = np.zeros(len(omega), dtype=bool)
    edge = np.zeros(len(omega), dtype=bool)
    for low, high in intervals:
        inside |= (omega >= low) & (omega <= high)
        edge |= np.isclose(omega, low, rtol=1e-6) | np.isclose(omega, high, rtol=1e-6)  # a crossing moves by rounding
    assert np.array_equal(inside[~edge], above[~edge])


def test_an_oscillator_exceeds_a_level_between_the_two_roots_of_its_quadratic():
    damping, level = 0.1, 2.0
    ((low, high),) = intervals_above(*oscillator(damping), None, level)
    # (1 − w)² + 4ζ²w = 1/γ² in w = ω²
    half, rest = 1 - 2 * damping**2, 1 - level**-2
    roots = half + np.array([-1, 1]) * math.sqrt(half**2 - rest)
    assert [low, high] == pytest.approx(np.sqrt(roots), rel=1e-12)  # simple roots: rounding only


# ---------------------------------------------------------------- H₂


def test_the_h2_norm_of_an_oscillator_is_the_textbook_one():
    # ∫ |ω²/(…)|² dω/2π = ω/(4ζ)
    assert h2_norm(*oscillator(0.05, 3.0)) == pytest.approx(math.sqrt(3 / 0.2), rel=1e-13)


@quick
@given(st.integers(0, 10**6))
def test_the_h2_norm_is_the_same_from_the_inputs_and_from_the_outputs(seed):
    # trace C P C' = trace B' X B with A'X + X A + C'C = 0, here by SciPy's solver
    A, B, C, _ = random_system(seed)
    X = solve_continuous_lyapunov(A.T, -C.T @ C)
    assert h2_norm(A, B, C) == pytest.approx(
        math.sqrt(np.trace(B.T @ X @ B)), rel=1e-9
    )  # rounding over damping squared


# ---------------------------------------------------------------- frequency response


def test_a_chain_of_equal_lags_is_answered_to_full_accuracy():
    # (1/(1 + s))^8: one eigenvector for eight poles, where an eigenvector method has no digits left
    n = 8
    A = -np.eye(n) + np.diag(np.ones(n - 1), 1)
    B, C = np.eye(n)[:, [-1]], np.eye(n)[[0]]
    omega = np.geomspace(1e-2, 1e2, 200)
    exact = (1 + 1j * omega) ** -n
    assert np.abs(frequency_response(A, B, C, None, omega)[:, 0, 0] / exact - 1).max() < 1e-13  # a few hundred ε


@quick
@given(st.integers(0, 10**6))
def test_the_response_solves_the_shifted_system_at_every_frequency(seed):
    A, B, C, D = random_system(seed)
    omega = np.array([0.0, 1e-3, 0.7, 5.0, 1e3])
    direct = np.array([D + C @ np.linalg.solve(1j * w * np.eye(len(A)) - A, B) for w in omega])
    scale = 1 + np.abs(direct).max()
    assert np.abs(frequency_response(A, B, C, D, omega) - direct).max() < 1e-9 * scale  # damping down to 1e-4


def test_negative_frequencies_give_the_conjugate_and_infinite_ones_the_feedthrough():
    system = random_system(5)
    there, back, end = frequency_response(*system, [2.0, -2.0, math.inf])
    assert np.allclose(back, there.conj(), rtol=1e-13, atol=0)
    assert np.array_equal(end, system[3])


# ---------------------------------------------------------------- refusals


def test_an_unstable_system_has_no_peak():
    with pytest.raises(InputError, match=r"A must be stable; got the pole 1 ± 0j 1/s\. The peak of an unstable system"):
        peak_gain([[1.0]], [[1.0]], [[1.0]])


def test_a_pole_on_the_axis_has_no_response():
    with pytest.raises(InputError, match=r"omega must avoid the poles on the imaginary axis; got 0\.0 rad/s"):
        frequency_response([[0.0]], [[1.0]], [[1.0]], None, [0.0, 1.0])


@pytest.mark.parametrize(
    ("A", "B", "C", "D", "sentence"),
    [
        (np.zeros((2, 3)), np.ones((2, 1)), np.ones((1, 2)), None, r"A must be square; got shape \(2, 3\)"),
        (-np.eye(2), np.ones((3, 1)), np.ones((1, 2)), None, r"B must have shape \(2, 1\)"),
        (-np.eye(2), np.ones((2, 1)), np.ones((1, 2)), np.ones((2, 2)), r"D must have shape \(1, 1\)"),
        (-np.eye(2), np.ones(2), np.ones((1, 2)), None, "B must be a real matrix; got 1 dimensions"),
        (-np.eye(2) * 1j, np.ones((2, 1)), np.ones((1, 2)), None, "A must be a real matrix"),
        (-np.eye(2) * np.nan, np.ones((2, 1)), np.ones((1, 2)), None, "A must be finite; got nan"),
        (-np.eye(2), np.ones((2, 0)), np.ones((1, 2)), None, "D must have at least one row and one column"),
    ],
)
def test_matrices_that_do_not_fit_are_named(A, B, C, D, sentence):
    with pytest.raises(InputError, match=sentence):
        peak_gain(A, B, C, D)


def test_a_tolerance_below_rounding_is_refused():
    with pytest.raises(InputError, match=r"tolerance must lie between 1e-13 and 0\.1"):
        peak_gain([[-1.0]], [[1.0]], [[1.0]], tolerance=0.0)


def test_a_level_of_zero_is_refused():
    with pytest.raises(InputError, match="level must be positive; got 0"):
        intervals_above([[-1.0]], [[1.0]], [[1.0]], None, 0)


@pytest.mark.parametrize("unit", [1e-9, 1e-6, 1.0, 1e6, 1e9])
def test_a_gain_that_is_largest_at_infinity_is_as_narrowly_bracketed_in_any_unit_of_time(unit):
    # s (s + 1)/(s² + 3s + 1) stays below its limit 1 at infinity, where the level's problem is a pencil
    A = unit * np.array([[0.0, 1.0], [-1.0, -3.0]])
    B, C = unit * np.array([[0.0], [1.0]]), np.array([[-1.0, -2.0]])
    peak = peak_gain(A, B, C, [[1.0]])
    assert peak.frequency == math.inf
    assert 1.0 <= peak.upper <= 1 + 2e-9  # the tolerance asked for is 1e-9

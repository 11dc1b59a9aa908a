"""The multiloop disk margin and the structured singular value behind it."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loop_of_1975 import heave_pitch, sway_roll_yaw

from workbench.errors import InputError
from workbench.lti.disk import disk_margin
from workbench.lti.margin import channel_margin, sensitivity
from workbench.lti.norm import frequency_response, peak_gain
from workbench.lti.structured import scaling_below, worst_turn

few = settings(max_examples=8, deadline=None, derandomize=True)


def random_loop(seed):
    rng = np.random.default_rng(seed)
    n, m = rng.integers(3, 9), rng.integers(2, 5)
    A, B, C = rng.standard_normal((n, n)), rng.standard_normal((n, m)), rng.standard_normal((m, n))
    decay = np.linalg.eigvals(A - B @ C).real.max() + 10 ** rng.uniform(-1, 0)
    return A - decay * np.eye(n), B, C


def static(S):
    """A sensitivity without states."""
    count = len(S)
    return np.zeros((0, 0)), np.zeros((0, count)), np.zeros((count, 0)), S


# ---------------------------------------------------------------- one channel


def test_for_one_channel_the_disk_margin_is_the_inverse_of_the_peak():
    # L = 4/(s + 1)³; α = 1/‖S − 1/2‖∞
    A = np.array([[-3.0, -3, -1], [1, 0, 0], [0, 1, 0]])
    S = sensitivity(A, np.eye(3)[:, :1], 4 * np.eye(3)[2:])
    margin = disk_margin(*S)
    exact = 1 / peak_gain(S.A, S.B, S.C, S.D - 0.5).value
    assert margin.lower <= exact <= margin.upper * (1 + 1e-6)
    assert margin.upper == pytest.approx(exact, rel=1e-6)  # climbing along ω stops at 1e-7
    channel = channel_margin(*S, channel=0)
    assert margin.gain_up <= channel.gain_up
    assert margin.gain_down >= channel.gain_down
    assert margin.phase <= channel.phase


def test_an_integrator_has_the_largest_balanced_disk():
    # S − 1/2 = (s − 1)/(s + 1)/2 has gain 1/2 everywhere: α = 2, any gain, ±90°
    margin = disk_margin(*sensitivity([[0.0]], [[1.0]], [[1.0]]), tolerance=1e-4)
    assert margin.upper == pytest.approx(2, rel=1e-12)
    assert margin.lower == pytest.approx(2, rel=2e-4)  # the tolerance
    assert margin.phase == pytest.approx(math.pi / 2, abs=2e-4)


# ---------------------------------------------------------------- several channels


@few
@given(st.integers(0, 10**6))
def test_the_known_perturbation_puts_a_pole_on_the_axis(seed):
    A, B, C = random_loop(seed)
    margin = disk_margin(*sensitivity(A, B, C))
    f = margin.perturbation
    if not np.isfinite(f).all():
        return
    delta = 2 * (f - 1) / (f + 1)
    assert np.abs(delta) == pytest.approx(
        np.full(len(f), margin.upper), rel=1e-9
    )  # on the edge of the disk, all of them
    L = frequency_response(A, B, C, None, [margin.frequency])[0]
    sizes = np.linalg.svd(np.eye(len(f)) + L @ np.diag(f), compute_uv=False)
    assert sizes[-1] < 1e-8 * sizes[0]  # a solved eigenvalue


@few
@given(st.integers(0, 10**6))
def test_the_bands_cover_all_frequencies_and_prove_the_lower_bound(seed):
    S = sensitivity(*random_loop(seed))
    margin = disk_margin(*S)
    ends = [(band.low, band.high) for band in margin.bands]
    assert ends[0][0] == 0
    assert ends[-1][1] == math.inf
    assert all(left[1] == right[0] for left, right in pairwise(ends))
    half = np.eye(len(S.D)) / 2
    for band in margin.bands:
        omega = np.geomspace(max(band.low, 1e-4), min(band.high, 1e4), 300)
        M = frequency_response(*S, omega) - half
        scaled = band.scaling[:, None] * M / band.scaling
        sizes = np.linalg.svd(scaled, compute_uv=False)[:, 0]
        assert sizes.max() <= (1 + 1e-8) / margin.lower  # at a band's ends the gain is the level, to rounding
    assert (
        margin.upper <= margin.lower * 1.02
    )  # up to three channels to 1e-3; four may have a true gap of a percent or two


@few
@given(st.integers(0, 10**6))
def test_perturbations_inside_the_disk_never_destabilise(seed):
    A, B, C = random_loop(seed)
    margin = disk_margin(*sensitivity(A, B, C))
    rng = np.random.default_rng(seed)
    alpha = min(margin.lower, 1.999)
    for _ in range(100):
        # real δ: gains; δ = α (a − s)/(a + s) and its negative: all-pass, every phase somewhere
        factors = np.array([(1 + x) / (1 - x) for x in alpha / 2 * rng.choice([-1, 1], B.shape[1])])
        assert np.linalg.eigvals(A - B @ np.diag(factors) @ C).real.max() < 0
        corner, sign = 10 ** rng.uniform(-2, 2, B.shape[1]), alpha / 2 * rng.choice([-1, 1], B.shape[1])
        # f = (1 + e)/(1 − e), e = h (a − s)/(a + s): direct gain (1 − h)/(1 + h), then one state
        direct, pole = (1 - sign) / (1 + sign), corner * (1 - sign) / (1 + sign)
        residue = corner - direct * pole
        closed = np.block([[A - B @ np.diag(direct) @ C, -B @ np.diag(residue)], [C, -np.diag(pole)]])
        assert np.linalg.eigvals(closed).real.max() < 0


def test_the_report_loops_bear_less_together_than_channel_by_channel():
    for open_loop in (heave_pitch(), sway_roll_yaw()):
        S = sensitivity(*open_loop)
        margin = disk_margin(*S)
        alone = [channel_margin(*S, channel=i) for i in range(2)]
        assert margin.gain_up < min(channel.gain_up for channel in alone)
        assert margin.phase < min(channel.phase for channel in alone)
        # never less than without scalings, never more than the tolerance apart for two channels
        assert margin.upper >= 1 / peak_gain(S.A, S.B, S.C, S.D - np.eye(2) / 2).upper
        assert margin.upper / margin.lower == pytest.approx(1.001, abs=1e-6)


def test_scaling_the_channels_changes_nothing():
    A, B, C = random_loop(8)
    units = 10.0 ** np.arange(B.shape[1])
    plain, scaled = (disk_margin(*sensitivity(*system)) for system in ((A, B, C), (A, B / units, C * units[:, None])))
    assert scaled.lower == pytest.approx(plain.lower, rel=2e-3)  # the two brackets


def test_a_loop_that_halves_every_signal_bears_everything():
    margin = disk_margin(*static(np.eye(2) / 2))
    assert (margin.lower, margin.upper) == (math.inf, math.inf)
    assert (margin.gain_down, margin.gain_up) == (0, math.inf)


# ---------------------------------------------------------------- μ itself


def test_a_matrix_of_rank_one_has_its_structured_singular_value_in_closed_form():
    # M = u v': μ = Σ |u_i v_i|, whatever the number of channels
    rng = np.random.default_rng(0)
    u, v = (rng.standard_normal(4) + 1j * rng.standard_normal(4) for _ in range(2))
    M = np.outer(u, v)
    exact = np.sum(np.abs(u * v))
    x, above, _ = scaling_below(M[None], 0.0, np.zeros(4))
    below, _, _ = worst_turn(lambda omega: np.array([M]), 0.0, x)
    assert above == pytest.approx(exact, rel=2e-5)  # the cutting planes' tolerance
    assert below == pytest.approx(exact, rel=1e-8)  # a smooth maximum, gradient to 1e-5


def test_a_four_channel_matrix_is_known_whose_best_scaling_stays_above():
    # Morton and Doyle's matrix: min σ(D M D⁻¹) = 1, μ = 0.87
    root = math.sqrt(3)
    gamma, beta = 3 + root, root - 1
    a, b = math.sqrt(2 / gamma), 1 / math.sqrt(gamma)
    d, f = -math.sqrt(beta / gamma), (1 + 1j) / math.sqrt(gamma * beta)
    U = np.array([[a, 0], [b, b], [b, 1j * b], [d, f]])
    V = np.array([[0, a], [b, -b], [b, -1j * b], [-1j * f, -d]])
    M = U @ V.conj().T
    x, above, _ = scaling_below(M[None], 0.0, np.zeros(4))
    below, _, _ = worst_turn(lambda omega: np.array([M]), 0.0, x)
    assert above == pytest.approx(1, abs=1e-5)
    assert below == pytest.approx(0.87, abs=5e-3)


def test_channels_that_do_not_interact_have_the_smallest_of_their_margins():
    margin = disk_margin(*static(0.5 * np.eye(4) + np.diag([0.1, -0.2, 0.3, 0.4])))
    assert margin.upper == pytest.approx(2.5, rel=1e-9)  # 1/0.4, an eigenvalue of a diagonal matrix
    assert margin.lower == pytest.approx(2.5, rel=2e-3)  # the tolerance


# ---------------------------------------------------------------- refusals


def test_an_unstable_loop_has_no_disk_margin():
    with pytest.raises(InputError, match=r"the closed loop must be stable; got the pole 1 ± 0j 1/s"):
        disk_margin([[1.0]], [[1.0]], [[1.0]], [[1.0]])


def test_a_sensitivity_that_is_not_square_is_refused():
    with pytest.raises(InputError, match=r"the sensitivity must be square; got D of shape \(1, 2\)"):
        disk_margin([[-1.0]], [[1.0, 1]], [[1.0]], [[1.0, 0]])


def test_a_tolerance_finer_than_the_scalings_is_refused():
    with pytest.raises(InputError, match=r"tolerance must lie between 1e-4 and 0\.1; got 1e-09"):
        disk_margin([[-1.0]], [[1.0]], [[1.0]], [[1.0]], tolerance=1e-9)


@pytest.mark.parametrize("time", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("way", ["both ways", "one way", "not at all"])
def test_the_margins_are_the_same_in_all_units_of_time_states_and_channels(time, way):
    rng = np.random.default_rng(4)
    A, B, C = rng.normal(size=(4, 4)), rng.normal(size=(4, 3)), 0.2 * rng.normal(size=(3, 4))
    A = A - (np.linalg.eigvals(A).real.max() + 0.5) * np.eye(4) + (B @ C if way == "both ways" else 0)  # closed: stable
    if way != "both ways":  # channel 1 does not see what the others do, and they see it or not
        A, B, C = (np.kron(np.eye(2), M) for M in (A[:2, :2], B[:2, :1], C[:1, :2]))
        C[1, 0] = 0.3 if way == "one way" else 0.0
    count, plain = len(C), disk_margin(*sensitivity(A, B, C, np.zeros((len(C), len(C)))))
    assert plain.lower >= plain.upper / 1.0011
    for _ in range(2):
        T, S = (np.diag(10 ** rng.uniform(-6, 6, size=k)) for k in (len(A), count))
        loop = time * T @ A @ np.linalg.inv(T), time * T @ B @ np.linalg.inv(S), S @ C @ np.linalg.inv(T)
        found = disk_margin(*sensitivity(*loop, np.zeros((count, count))))
        assert found.lower == pytest.approx(plain.lower, rel=1e-6)
        assert found.upper == pytest.approx(plain.upper, rel=1e-6)

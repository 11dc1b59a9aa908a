"""Gain, phase and delay margins, peaks of S and T."""

import math

import control
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from loop_of_1975 import heave_pitch, sway_roll_yaw

from workbench.errors import InputError
from workbench.lti.margin import channel_margin, complementary, margins, sensitivity
from workbench.lti.norm import frequency_response

quick = settings(max_examples=25, deadline=None, derandomize=True)


def loop(numerator, denominator):
    system = control.ss(control.tf(numerator, denominator))
    return system.A, system.B, system.C, system.D


def only_channel(*system):
    (channel,) = margins(*sensitivity(*system)).channels
    return channel


def random_loop(seed, channels=None):
    """A stable closed loop whose open loop is stable or not."""
    rng = np.random.default_rng(seed)
    n, m = rng.integers(2, 9), channels or rng.integers(1, 4)
    A, B, C = rng.standard_normal((n, n)), rng.standard_normal((n, m)), rng.standard_normal((m, n))
    decay = np.linalg.eigvals(A - B @ C).real.max() + 10 ** rng.uniform(-1.5, 0)
    return A - decay * np.eye(n), B, C


def closed_poles(A, B, C, factors):
    """Eigenvalues with each channel multiplied by its factor."""
    return np.linalg.eigvals(A - B @ np.diag(factors) @ C)


# ---------------------------------------------------------------- textbook loops


def test_three_equal_lags_have_the_textbook_margins():
    # L = 4/(s + 1)³: −180° at ω = √3 where |L| = 1/2; |L| = 1 at ω² = 4^⅔ − 1
    channel = only_channel(*loop([4], [1, 3, 3, 1]))
    crossover = math.sqrt(4 ** (2 / 3) - 1)
    phase = math.pi - 3 * math.atan(crossover)
    assert channel.gain_up == pytest.approx(2, rel=1e-12)  # simple crossings: rounding only
    assert channel.gain_up_frequency == pytest.approx(math.sqrt(3), rel=1e-12)
    assert (channel.gain_down, channel.gain_down_frequency) == (0, None)
    assert channel.phase == pytest.approx(phase, rel=1e-12)
    assert channel.phase_frequency == pytest.approx(crossover, rel=1e-12)
    assert channel.delay == pytest.approx(phase / crossover, rel=1e-12)


def test_an_integrator_bears_any_gain_and_a_right_angle():
    channel = only_channel([[0.0]], [[1.0]], [[5.0]])
    assert (channel.gain_up, channel.gain_up_frequency) == (math.inf, None)
    assert channel.gain_down == 0
    assert channel.phase == pytest.approx(math.pi / 2, rel=1e-14)
    assert channel.delay == pytest.approx(math.pi / 10, rel=1e-14)


def test_an_unstable_plant_bears_no_loss_of_gain_beyond_its_static_limit():
    # L = 3(s + 2)/(s² − 1): closed s² + 3k s + 6k − 1, stable for k > 1/6, lost at s = 0
    channel = only_channel(*loop([3, 6], [1, 0, -1]))
    assert channel.gain_down == pytest.approx(1 / 6, rel=1e-13)
    assert channel.gain_down_frequency == 0
    assert channel.gain_up == math.inf


def test_a_conditionally_stable_loop_has_the_limits_of_routh():
    # L = 15 (s + 1)²/s³: closed s³ + 15k(s² + 2s + 1), stable for k > 1/30
    channel = only_channel(*loop([15, 30, 15], [1, 0, 0, 0]))
    assert channel.gain_down == pytest.approx(
        1 / 30, rel=1e-10
    )  # a triple pole at the origin: its third root of rounding
    assert channel.gain_down_frequency == pytest.approx(1.0, rel=1e-10)
    assert channel.gain_up == math.inf


def test_an_undamped_plant_under_rate_feedback_bears_what_its_polynomial_says():
    # L = 0.4 s/((s² + 1)(0.1s + 1)): closed 0.1s³ + s² + (0.1 + 0.4k)s + 1, stable for all k > 0
    channel = only_channel(*loop([0.4, 0], [0.1, 1, 0.1, 1]))
    assert channel.gain_up == math.inf
    assert channel.gain_down == 0


def test_margins_at_a_needle_between_grid_points_are_found():
    # a lag and a flexible mode of damping 1e-5 behind 90 degrees of filters: the mode alone sets the gain margin
    mode = control.ss(control.tf([7.3**2 * 2e-5], [1, 2e-5 * 7.3, 7.3**2]))
    system = (mode + control.ss(control.tf([0.3], [1, 0.1]))) * control.ss(control.tf([7.3**2], [1, 2 * 7.3, 7.3**2]))
    open_loop = system.A, system.B, system.C, system.D
    channel = only_channel(*open_loop)
    assert channel.gain_up_frequency == pytest.approx(7.3, rel=1e-4)
    at = closed_poles(*open_loop[:3], [channel.gain_up])
    assert abs(at.real.max()) < 1e-9  # a pole on the axis, to rounding
    assert closed_poles(*open_loop[:3], [0.999 * channel.gain_up]).real.max() < 0
    _, phase, *_ = control.stability_margins(system)
    assert channel.phase == pytest.approx(math.radians(phase), rel=1e-6)


def test_a_loop_with_direct_gain_above_one_bears_no_delay():
    channel = only_channel([[-1.0]], [[1.0]], [[1.0]], [[2.0]])
    assert (channel.delay, channel.delay_frequency) == (0.0, math.inf)


# ---------------------------------------------------------------- properties: what a margin means


@quick
@given(st.integers(0, 10**6))
def test_a_gain_at_its_margin_puts_a_pole_on_the_axis_and_any_smaller_change_does_not(seed):
    A, B, C = random_loop(seed)
    found = margins(*sensitivity(A, B, C)).channels
    for i, channel in enumerate(found):
        for limit, frequency in (
            (channel.gain_up, channel.gain_up_frequency),
            (channel.gain_down, channel.gain_down_frequency),
        ):
            far = frequency is None
            end = (1e4 if limit > 1 else 0.0) if far else limit
            factors = np.ones((200, len(found)))
            factors[:, i] = 1 + (end - 1) * np.linspace(0, 1 if far and end > 1 else 0.9999, 200)
            closed = A - (B[None] * factors[:, None, :]) @ C
            assert np.linalg.eigvals(closed).real.max() < 0
            if not far:
                factor = factors[0].copy()
                factor[i] = limit
                poles = closed_poles(A, B, C, factor)
                assert np.abs(poles - 1j * frequency).min() < 1e-7 * (
                    1 + abs(limit)
                )  # simple pole, moderate conditioning


@quick
@given(st.integers(0, 10**6))
def test_a_delay_at_its_margin_solves_the_characteristic_equation_and_a_shorter_one_is_stable(seed):
    A, B, C = random_loop(seed, channels=1)
    channel = only_channel(A, B, C)
    assume(channel.delay < 1e3)
    omega = channel.delay_frequency
    L = frequency_response(A, B, C, None, [omega])[0, 0, 0]
    assert abs(1 + L * np.exp(-1j * omega * channel.delay)) < 1e-9  # a crossing to full precision
    for share, stable in ((0.5, True), (0.99, True), (1.01, False)):
        delay = control.ss(*_transport(share * channel.delay))
        closed = control.feedback(control.ss(A, B, C, 0) * delay, 1)
        assert (closed.poles().real.max() < 0) == stable


def _transport(delay):
    """Four Padé steps of order 3 in a row; phase error below 1e-4 rad while ω·delay is below 2π."""
    step = control.ss(control.tf(*control.pade(delay / 4, 3)))
    chain = step * step * step * step
    return chain.A, chain.B, chain.C, chain.D


@quick
@given(st.integers(0, 10**6))
def test_a_rotation_at_the_phase_margin_meets_minus_one_and_no_crossover_is_closer(seed):
    A, B, C = random_loop(seed)
    S = sensitivity(A, B, C)
    i = seed % B.shape[1]
    channel = channel_margin(*S, channel=i)
    omega = np.geomspace(1e-3, 1e3, 1500)
    broken = 1 / frequency_response(*S, omega)[:, i, i] - 1
    at_one = np.flatnonzero(np.diff(np.sign(np.abs(broken) - 1)))
    if channel.phase_frequency is None:
        assert len(at_one) == 0
        return
    L = 1 / frequency_response(*S, [channel.phase_frequency])[0, i, i] - 1
    assert abs(L) == pytest.approx(1, abs=1e-9)
    assert abs(np.angle(-L)) == pytest.approx(channel.phase, abs=1e-9)
    if len(at_one):
        # the grid's nearest neighbours of a crossover: a step of 1 % times slopes up to a few
        assert np.abs(np.angle(-broken[at_one])).min() >= channel.phase - 0.1


@quick
@given(st.integers(0, 10**6))
def test_a_channel_with_the_others_closed_has_the_broken_loop_one_over_s_minus_one(seed):
    A, B, C = random_loop(seed, channels=2 + seed % 2)
    omega = np.geomspace(0.1, 10, 5)
    i = 1
    others = [0, *range(2, B.shape[1])]
    direct = frequency_response(A - B[:, others] @ C[others], B[:, [i]], C[[i]], None, omega)[:, 0, 0]
    S = frequency_response(*sensitivity(A, B, C), omega)[:, i, i]
    assert np.abs(1 / S - 1 - direct).max() < 1e-8 * (1 + np.abs(direct).max())  # poles up to the axis


@quick
@given(st.integers(0, 10**6))
def test_the_margins_of_one_channel_are_those_of_python_control(seed):
    A, B, C = random_loop(seed, channels=1)
    channel = only_channel(A, B, C)
    ups, lags, _, _, _, _ = control.stability_margins(control.ss(A, B, C, 0), returnall=True)
    above, below = [k for k in ups if k > 1], [k for k in ups if 0 < k < 1]
    # its polynomials carry rounding times the spread of their coefficients
    assert channel.gain_up == pytest.approx(min(above, default=math.inf), rel=1e-4)
    assert channel.gain_down == pytest.approx(max(below, default=0), rel=1e-4)
    degrees = [min(abs(lag) % 360, 360 - abs(lag) % 360) for lag in lags]
    assert channel.phase == pytest.approx(math.radians(min(degrees)) if degrees else math.inf, rel=1e-4)


# ---------------------------------------------------------------- S and T


@quick
@given(st.integers(0, 10**6))
def test_s_and_t_add_to_one_and_close_the_loop(seed):
    A, B, C = random_loop(seed)
    S = sensitivity(A, B, C)
    omega = np.geomspace(0.01, 100, 20)
    s, t = frequency_response(*S, omega), frequency_response(*complementary(*S), omega)
    one = np.eye(B.shape[1])
    assert np.abs(s + t - one).max() < 1e-12 * np.abs(s).max()
    L = frequency_response(A, B, C, None, omega)
    assert np.abs((one + L) @ s - one).max() < 1e-9 * (1 + np.abs(L).max()) * np.abs(s).max()


def test_the_report_heave_loop_is_lost_to_a_fifth_more_gain_at_rest():
    # B.5, heave alone: the gap gain softens 3.5749e6 N/m by 4·2.155·3.3981e5; dynamics reference: lost at +22 %
    mass, force = 444800 / 9.80665, 4 * 3.3981e5
    A = [[0, 1, 0], [-3.5749e6 / mass, 0, -force / mass], [0, 0, -100.0]]
    C = [[2.155, -0.15, 0]]
    S = sensitivity(A, [[0], [0], [100.0]], C)
    channel = channel_margin(*S, channel=0)
    static = 3.5749e6 / (2.155 * force)
    assert channel.gain_up == pytest.approx(static, rel=1e-12)
    assert channel.gain_up == pytest.approx(1.22, abs=5e-3)
    assert abs(frequency_response(*S, [0.0])[0, 0, 0]) == pytest.approx(1 / (1 - 1 / static), rel=1e-12)


def test_margins_show_the_smallest_of_each_kind():
    found = margins(*sensitivity(*sway_roll_yaw()), channels=["front", "rear"])
    rows = {name: value for name, value, _ in found.rows()}
    assert rows["smallest phase margin"] == min(channel.phase for channel in found.channels)
    assert rows["peak sensitivity"] == found.peak_S.value
    assert [channel.channel for channel in found.channels] == ["front", "rear"]


# ---------------------------------------------------------------- refusals


def test_an_unstable_loop_has_no_margins():
    # L = 10/(s + 1)³ closes to an unstable loop, for which python-control prints a gain margin of 0.8
    with pytest.raises(
        InputError, match=r"the closed loop must be stable; got the pole .* Margins of an unstable loop"
    ):
        only_channel(*loop([10], [1, 3, 3, 1]))


def test_a_loop_that_has_no_solution_is_refused():
    with pytest.raises(InputError, match=r"I \+ D must be invertible for the loop to close"):
        sensitivity([[-1.0]], [[1.0]], [[1.0]], [[-1.0]])


def test_a_loop_that_is_not_square_is_refused():
    with pytest.raises(InputError, match="the loop must have as many outputs as inputs"):
        sensitivity(-np.eye(2), np.ones((2, 1)), np.eye(2))


def test_a_channel_that_is_not_there_is_refused():
    S = sensitivity(*heave_pitch())
    with pytest.raises(InputError, match=r"channel must be 0 … 1; got 2"):
        channel_margin(*S, channel=2)
    with pytest.raises(InputError, match="channels must name each of the 2 channels"):
        margins(*S, channels=["front"])


def test_a_loop_gain_of_exactly_one_at_rest_has_no_crossing_and_bears_any_dead_time():
    for unit in (1e-6, 1.0, 1e6):
        A, B, C = np.array([[-1.0 / unit]]), np.array([[1.0 / unit]]), np.eye(1)
        found = margins(*sensitivity(A, B, C)).channels[0]
        assert found.delay == math.inf
        assert found.phase == math.inf
        # 1.0001/(s + 1): |L| = 1 at √(1.0001² − 1)
        omega = math.sqrt(1.0001**2 - 1)
        delay = margins(*sensitivity(A, 1.0001 * B, C)).channels[0].delay
        assert delay == pytest.approx((math.pi - math.atan(omega)) / omega * unit, rel=1e-9)

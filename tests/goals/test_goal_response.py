"""Goals in the time domain against closed formulas and python-control's simulations."""

import math

import control
import numpy as np
import pytest
from goal_cases import loop_of, plant, random_plant

from workbench.control.structure.block import Controller
from workbench.errors import InputError
from workbench.goals.time import Overshoot, StepRejection
from workbench.goals.tracking import StepTracking, Transient

NOTHING = Controller.static([[0.0]])
ONE = {"inputs": "w", "outputs": "z"}


def _alone(system, sample_time=None):
    """The channel w → z equal to a python-control system, beside a loop that does nothing."""
    P = control.ss(system)
    n = P.nstates
    whole = plant(
        P.A, np.hstack([P.B, np.zeros((n, 1))]), np.vstack([P.C, np.zeros((1, n))]), np.diag([float(P.D[0, 0]), 0.0]),
        inputs=["w", "u"], outputs=["z", "y"],
    )  # fmt: skip
    return loop_of(whole, controls=["u"], measured=["y"], sample_time=sample_time)


def _second(zeta, omega=1.0):
    return control.tf([omega**2], [1.0, 2 * zeta * omega, omega**2])


@pytest.mark.parametrize(("zeta", "omega"), [(0.1, 1.0), (0.5, 30.0), (0.7, 0.02)])
def test_the_overshoot_is_the_textbook_one(zeta, omega):
    bound = Overshoot(**ONE, percent=20.0).bind(_alone(_second(zeta, omega)))
    expected = math.exp(-math.pi * zeta / math.sqrt(1 - zeta**2)) / 0.2
    found = bound.evaluate(NOTHING)
    assert found.value == pytest.approx(expected, rel=1e-10)
    assert found.time == pytest.approx(math.pi / (omega * math.sqrt(1 - zeta**2)), rel=1e-8)
    assert bound.exact(NOTHING).value == pytest.approx(expected, rel=1e-6)  # integrated to 1e-9


def test_a_response_without_overshoot_has_the_value_zero():
    bound = Overshoot(**ONE).bind(_alone(control.tf([1.0], [1.0, 3.0, 3.0, 1.0])))
    assert bound.evaluate(NOTHING).value == pytest.approx(0.0, abs=1e-12)  # rounding of a settled response over 10 %
    assert bound.exact(NOTHING).value == pytest.approx(0.0, abs=1e-7)  # the integrator's error over 10 %


@pytest.mark.slow
def test_the_overshoot_of_fast_and_slow_modes_together_is_that_of_a_fine_simulation():
    system = control.tf([0.2 * 400.0**2], [1.0, 160.0, 400.0**2]) + control.tf([0.8], [5.0, 1.0])
    value = Overshoot(**ONE, percent=1.0).bind(_alone(system)).evaluate(NOTHING).value
    times = np.linspace(0, 40, 400001)
    _, y = control.step_response(system, times)
    assert value == pytest.approx(max(y.max() - 1, 0) / 0.01, abs=1e-6)


def test_a_response_that_ends_at_zero_has_no_overshoot():
    value = Overshoot(**ONE).bind(_alone(control.tf([1.0, 0.0], [1.0, 1.0, 1.0]))).evaluate(NOTHING)
    assert value.value == math.inf
    assert "ends at zero" in value.reason


def test_a_step_disturbance_is_judged_by_its_peak_and_its_remainder():
    system = control.tf([1.0, 0.0], [1.0, 1.0, 4.0])
    loop = _alone(system)
    times = np.linspace(0, 40, 40001)
    _, y = control.step_response(system, times)
    for settling in (1.0, 5.0):
        expected = max(np.abs(y).max() / 0.3, np.abs(y[times >= settling]).max() / (0.3 * 0.05))
        bound = StepRejection(**ONE, peak=0.3, settling_time=settling).bind(loop)
        assert bound.evaluate(NOTHING).value == pytest.approx(expected, rel=1e-5)  # instants 1e-3 s apart
        assert bound.exact(NOTHING).value == pytest.approx(expected, rel=1e-5)


def test_a_remainder_that_never_goes_counts_at_the_end():
    bound = StepRejection(**ONE, peak=10.0, settling_time=1.0).bind(_alone(control.tf([1.0], [1.0, 1.0])))
    assert bound.evaluate(NOTHING).value == pytest.approx(1 / 0.5, rel=1e-12)
    assert bound.evaluate(NOTHING).time == math.inf


def test_a_sampled_step_response_is_judged_at_its_samples():
    discrete = control.c2d(_second(0.2), 0.5)
    _, y = control.step_response(discrete, np.arange(200) * 0.5)
    value = Overshoot(**ONE, percent=10.0).bind(_alone(discrete, 0.5)).evaluate(NOTHING)
    assert value.value == pytest.approx((y.max() - 1) / 0.1, rel=1e-9)
    assert value.time == pytest.approx(0.5 * np.argmax(y), rel=1e-12)


def test_step_tracking_is_the_relative_energy_of_the_difference():
    # 1/(s + 1) against 1/(2s + 1): ∫ (e^{−t} − e^{−t/2})² dt = 1/2 + 1 − 2/1.5; ∫ e^{−t} dt = 1
    bound = StepTracking(**ONE, time_constant=2.0, gap=0.1).bind(_alone(control.tf([1.0], [1.0, 1.0])))
    expected = math.sqrt(1.5 - 4 / 3) / 0.1
    assert bound.evaluate(NOTHING).value == pytest.approx(expected, rel=1e-10)
    assert bound.exact(NOTHING).value == pytest.approx(expected, rel=1e-10)


def test_a_reference_with_an_overshoot_has_that_overshoot():
    loop = _alone(_second(0.5))
    percent = 100 * math.exp(-math.pi * 0.5 / math.sqrt(0.75))
    found = StepTracking(**ONE, time_constant=1.0, overshoot_percent=percent).bind(loop).evaluate(NOTHING)
    assert found.value == pytest.approx(0.0, abs=1e-6)  # the same model; square root of rounding over the gap


def test_a_static_error_counts_by_its_own_limit():
    bound = StepTracking(**ONE, time_constant=1.0, static_error=0.02).bind(_alone(control.tf([0.9], [1.0, 1.0])))
    found = bound.evaluate(NOTHING)
    assert found.value == pytest.approx(0.1 / 0.02, rel=1e-10)
    assert "static error" in found.channel


@pytest.mark.parametrize("signal", ["impulse", "step", "ramp"])
def test_transients_are_those_of_a_simulation(signal):
    system, reference = control.tf([2.0], [1.0, 1.4, 2.0]), control.tf([1.0], [1.0, 1.4, 1.0])
    # for the ramp the lags 0.7 s and 1.4 s differ, which is the static part; only the transient is compared
    bound = Transient(**ONE, reference=reference, signal=signal, gap=0.5, static_error=1e9).bind(_alone(system))
    t = np.linspace(0, 60, 24001)
    order = {"impulse": 0, "step": 1, "ramp": 2}[signal]

    def response(G):
        if order == 0:
            return control.impulse_response(G, t)[1]
        return control.forced_response(G, t, np.ones_like(t) if order == 1 else t)[1]

    y, r = response(system), response(reference)
    last = {0: 0.0, 1: 1.0, 2: t - 1.4}[order]
    mine = {0: 0.0, 1: 1.0, 2: t - 0.7}[order]
    energy = np.trapezoid((y - mine - (r - last)) ** 2, t) / np.trapezoid((r - last) ** 2, t)
    assert bound.evaluate(NOTHING).value == pytest.approx(math.sqrt(energy) / 0.5, rel=1e-5)  # trapezia of 2.5e-3 s
    assert bound.exact(NOTHING).value == pytest.approx(math.sqrt(energy) / 0.5, rel=1e-5)


def test_a_ramp_lag_counts_against_the_static_limit():
    system, reference = control.tf([2.0], [1.0, 1.4, 2.0]), control.tf([1.0], [1.0, 1.4, 1.0])
    bound = Transient(**ONE, reference=reference, signal="ramp", gap=100.0, static_error=0.1).bind(_alone(system))
    assert bound.evaluate(NOTHING).value == pytest.approx(0.7 / 0.1, rel=1e-10)  # lags 0.7 and 1.4 s


def test_stiff_responses_agree_between_the_two_measures():
    P = random_plant(7, 6, 1, 1)
    system = control.ss(P.A, P.B, P.C, 0) * control.tf([1e4], [1.0, 1e4])
    bound = StepRejection(**ONE, peak=1.0, settling_time=2.0).bind(_alone(system))
    assert bound.evaluate(NOTHING).value == pytest.approx(bound.exact(NOTHING).value, rel=1e-6)


def test_misused_time_goals_are_refused():
    with pytest.raises(InputError, match="a reference or a time_constant, not both"):
        StepTracking(**ONE)
    with pytest.raises(InputError, match="impulse, step or ramp"):
        Transient(**ONE, reference=1.0, signal="sine")
    with pytest.raises(InputError, match="percent must be positive"):
        Overshoot(**ONE, percent=0.0)
    with pytest.raises(InputError, match="must have a transient"):
        Transient(**ONE, reference=1.0).bind(_alone(_second(0.5)))
    with pytest.raises(InputError, match="fraction must lie above 0"):
        StepRejection(**ONE, peak=1.0, settling_time=1.0, fraction=0.0)

"""Limits that are zero or infinite where the frequency axis ends, and limits that keep their smallest coefficients."""

import math

import control
import numpy as np
import pytest
from goal_cases import loop_of, plant
from test_goal_response import _alone

from workbench.control.structure.block import Controller
from workbench.control.structure.loop import Loop
from workbench.control.structure.space import state_space
from workbench.control.structure.structure import Structure
from workbench.goals.gain import Gain, WeightedGain
from workbench.goals.loop_shape import LoopShape, MaxLoopGain, MinLoopGain, Rejection
from workbench.goals.spectrum import RmsLimit, Spectrum
from workbench.lti import Plant
from workbench.lti.model import Model
from workbench.lti.weight import profile_of

NOTHING = Controller.static([[0.0]])
ONE = {"inputs": "w", "outputs": "z"}


def _loop(unit=1.0, lag=1.0, **delays):
    """The plant 1/(lag s + 1) at u → y under a controller of one state."""
    system = plant([[-unit / lag]], [[unit / lag]], [[1.0]], inputs=["u"], outputs=["y"])
    return Loop(Model("lag", system, **delays), Structure([state_space(["y"], ["u"], 1)]))


def _proportional(k, unit=1.0):
    return Controller(-np.eye(1) * unit, np.zeros((1, 1)), np.zeros((1, 1)), np.array([[-k]]))


def _pi(k, ki, unit=1.0):
    return Controller(np.zeros((1, 1)), np.array([[ki * unit]]), np.array([[-1.0]]), np.array([[-k]]))


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_a_disturbance_is_rejected_for_ever_only_with_integral_action(unit):
    loop = _loop(unit)
    bound = Rejection(points="u", attenuation=([0.01 * unit], [1.0, 0.0])).bind(loop)
    without = bound.exact(_proportional(5.0, unit))
    assert without.value == math.inf
    assert "towards ω = 0" in without.reason
    K = _pi(5.0, 2.0, unit)  # S = s (s + 1)/(s (s + 1) + 5 s + 2): S/s → 1/2 at 0
    for found in (bound.evaluate(K), bound.exact(K)):
        assert found.value == pytest.approx(0.005, rel=1e-9)
    assert bound.evaluate(K).gradients


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_loop_gains_are_asked_for_at_the_ends_of_the_axis(unit):
    loop, K = _loop(unit), _pi(5.0, 2.0, unit)
    proportional = _proportional(5.0, unit)
    least = MinLoopGain(points="y", profile=([1.0 * unit], [1.0, 0.0])).bind(loop)
    assert least.exact(proportional).value == math.inf
    # p/|L| → 1/2 at 0; at ω = 1 it is 1·√2/|5j + 2| = 0.26
    assert least.exact(K).value == pytest.approx(0.5, rel=1e-9)
    most = MaxLoopGain(points="y", profile=([10.0 * unit], [1.0, 0.0])).bind(loop)
    assert most.exact(proportional).value == pytest.approx(0.5, rel=1e-9)  # |L| → 5/ω far out
    steeper = MaxLoopGain(points="y", profile=([10.0 * unit**2], [1.0, 0.0, 0.0])).bind(loop)
    assert steeper.exact(K).value == math.inf
    assert "towards ω = ∞" in steeper.exact(K).reason
    shape = LoopShape(points="y", crossover=4.0 * unit).bind(loop)
    assert shape.exact(proportional).value == math.inf
    assert math.isfinite(shape.exact(K).value)


def test_a_gain_under_a_limit_that_vanishes_is_compared_by_its_first_term():
    bound = Gain(**ONE, limit=([2.0, 0.0], [1.0, 1.0])).bind(_alone(control.tf([3.0, 0.0], [1.0, 4.0])))
    assert bound.exact(NOTHING).value == pytest.approx(1.5, rel=1e-9)  # 3 (s + 1)/(2 (s + 4)): 3/2 at ∞
    bound = Gain(**ONE, limit=([2.0, 0.0], [1.0, 9.0])).bind(_alone(control.tf([3.0, 0.0], [1.0, 4.0])))
    assert bound.exact(NOTHING).value == pytest.approx(27 / 8, rel=1e-9)  # 3 (s + 9)/(2 (s + 4)): 27/8 at 0
    lag = _alone(control.tf([1.0], [1.0, 1.0]))
    assert Gain(**ONE, limit=([2.0, 0.0], [1.0, 1.0])).bind(lag).exact(NOTHING).value == math.inf
    assert Gain(**ONE, limit=([1.0], [1.0, 0.0]), focus=(0.0, 5.0)).bind(lag).exact(NOTHING).value == pytest.approx(
        5 / math.sqrt(26), rel=1e-9
    )
    assert Gain(**ONE, limit=([1.0], [1.0, 0.0, 0.0])).bind(lag).exact(NOTHING).value == math.inf
    both = WeightedGain(**ONE, left=([1.0], [1.0, 1.0])).bind(lag)
    assert both.exact(NOTHING).value == pytest.approx(1.0, rel=1e-8)


@pytest.mark.parametrize(
    "limit",
    [
        control.tf([1e-12, 1.0], [1.0, 2e-3, 1.0]), control.tf([1e-15, 0.0, 1.0], [1e-6, 2.0, 1.0, 3.0]),
        control.tf([1.0, 1e9], [1.0, 1e5, 1e3]), control.tf([1e-8, 1e4, 0.0], [1.0, 1e6, 2.0]),
    ],
    ids=str,
)  # fmt: skip
def test_a_limit_keeps_its_smallest_coefficients_in_whichever_form_it_comes(limit):
    top, bottom = limit.num[0][0], limit.den[0][0]
    omega = np.geomspace(1e-9, 1e14, 60)
    expected = np.abs(np.polyval(top, 1j * omega) / np.polyval(bottom, 1j * omega))
    states = control.ss(limit)
    plant_ = Plant.from_matrices(states.A, states.B, states.C, states.D)
    for form in (limit, states, plant_, (top, bottom)):
        profile = profile_of("limit", form)
        np.testing.assert_allclose(profile.magnitude(omega), expected, rtol=1e-9)
        for far, at in ((False, 1e-14), (True, 1e20)):
            power, size = profile.end(far=far)
            near = abs(np.polyval(top, 1j * at) / np.polyval(bottom, 1j * at))
            assert size * at**power == pytest.approx(near, rel=1e-6)


def test_the_rms_under_a_density_that_grows_without_bound_is_infinite():
    lag, washout = _alone(control.tf([1.0], [1.0, 1.0])), _alone(control.tf([1.0, 0.0], [1.0, 1.0]))
    drift = ([1.0], [1.0, 0.0])  # PSD 1/ω²
    assert RmsLimit(**ONE, limit=1.0, density=drift).bind(lag).exact(NOTHING).value == math.inf
    # |1/(jω + 1)|² over 0 … ∞, one-sided: ∫ df = 1/4
    assert RmsLimit(**ONE, limit=1.0, density=drift, focus=(1e-9, math.inf)).bind(lag).exact(NOTHING).value > 100
    found = RmsLimit(**ONE, limit=1.0, density=([1.0], [1.0, 0.0])).bind(washout).exact(NOTHING)
    assert found.value == pytest.approx(0.5, rel=1e-8)
    mask = Spectrum(**ONE, mask=1.0, density=drift)
    assert mask.bind(lag).exact(NOTHING).value == math.inf
    assert mask.bind(washout).exact(NOTHING).value == pytest.approx(1.0, rel=1e-9)


def test_the_rms_of_a_feedthrough_behind_a_dead_time_is_infinite():
    system = plant(
        [[-1.0]], [[1.0, 0.0]], [[1.0], [0.0]], np.diag([0.1, 0.0]), inputs=["w", "u"], outputs=["z", "y"]
    )  # fmt: skip
    loop = loop_of(system, controls=["u"], measured=["y"], input_delay={"w": 0.3})
    found = RmsLimit(**ONE, limit=1.0).bind(loop).exact(NOTHING)
    assert found.value == math.inf
    assert "does not fall off" in found.reason


@pytest.mark.parametrize("written", [([1.0], [1.0, 0.0, 4.0]), control.ss(control.tf([1.0], [1.0, 0.0, 4.0]))])
def test_a_limit_with_a_pole_on_the_axis_inside_the_band_is_infinite_there(written):
    # attenuation 1/(s² + 4) asks for S(2j) = 0, which a proportional controller does not give
    bound = Rejection(points="u", attenuation=written).bind(_loop())
    K = _proportional(3.0)
    for value in (bound.evaluate(K), bound.exact(K)):
        assert math.isinf(value.value)
        assert "at 2 rad/s" in value.reason


def test_a_limit_that_vanishes_on_the_axis_inside_the_band_is_never_met():
    bound = Gain(inputs="u", outputs="y", limit=([1.0, 0.0, 4.0], [1.0, 2.0, 4.0])).bind(_loop())
    assert "at 2 rad/s" in bound.exact(_proportional(3.0)).reason


@pytest.mark.parametrize("unit", [1e-5, 1.0, 1e5])
@pytest.mark.parametrize("order", [3, 4])
def test_a_limit_that_falls_as_steeply_as_the_response_is_met_up_to_infinity(unit, order):
    # 1/(s + 1)ⁿ below 1.1/(s + 1)ⁿ and 1.1 (s + 3)/(3 (s + 1)ⁿ): far out both are below the response's own rounding
    lag = np.poly([-unit] * order)
    A, B = np.eye(order, k=1), np.eye(order, 1, k=1 - order)
    A[-1] = -lag[:0:-1]
    loop = _alone(control.ss(A, B, unit**order * np.eye(1, order), 0))
    size = 1.1 * unit**order
    same = Gain(**ONE, limit=([size], lag)).bind(loop).exact(NOTHING)
    assert same.value == pytest.approx(1 / 1.1, rel=1e-8)  # the quotient is right to 1e-9
    assert same.upper == pytest.approx(1 / 1.1, rel=1e-4)
    flatter = Gain(**ONE, limit=([size / 3 / unit, size], lag)).bind(loop).exact(NOTHING)  # |limit/response| > 1.1
    assert flatter.upper == pytest.approx(1 / 1.1, rel=1e-4)
    steeper = Gain(**ONE, limit=([size], np.polymul(lag, [1 / unit, 1.0]))).bind(loop).exact(NOTHING)
    assert math.isinf(steeper.value)

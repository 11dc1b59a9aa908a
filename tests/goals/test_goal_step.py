"""Step responses judged over all time: long, stiff, lightly damped, beating, defective, sampled, with dead times."""

import math

import control
import numpy as np
import pytest
from goal_cases import loop_of, plant
from scipy.linalg import expm
from test_goal_response import _alone

from workbench.control.structure.block import Controller
from workbench.goals.time import Overshoot, StepRejection
from workbench.lti import modes as goal_modes
from workbench.lti.march import Lined, lined_difference, lined_series, step_pieces
from workbench.lti.modes import largest, step_response
from workbench.lti.realisation import Realisation

NOTHING = Controller.static([[0.0]])
ONE = {"inputs": "w", "outputs": "z"}


def _second(zeta, omega=1.0, size=1.0):
    return control.tf([size * omega**2], [1.0, 2 * zeta * omega, omega**2])


def _overshoot(zeta):
    return math.exp(-math.pi * zeta / math.sqrt(1 - zeta**2))


def _system(transfer):
    P = control.ss(transfer)
    return Realisation(P.A, P.B, P.C, P.D)


def test_a_slow_response_sampled_a_million_times_a_radian_has_its_overshoot():
    zeta, h = 0.64, 1e-6
    loop = _alone(control.c2d(control.ss(_second(zeta)), h), h)
    bound = Overshoot(**ONE, percent=10.0).bind(loop)
    # z − 1 of 1e-6 leaves ten digits of the poles
    for found in (bound.evaluate(NOTHING), bound.exact(NOTHING)):
        assert found.value == pytest.approx(_overshoot(zeta) / 0.1, rel=1e-6)
        assert found.time == pytest.approx(math.pi / math.sqrt(1 - zeta**2), rel=1e-4)
    late = StepRejection(**ONE, peak=2.0, settling_time=10.0, fraction=0.6).bind(loop)
    t = np.linspace(10, 20, 100_001)
    root = math.sqrt(1 - zeta**2)
    y = 1 - np.exp(-zeta * t) * (np.cos(root * t) + zeta / root * np.sin(root * t))
    for found in (late.evaluate(NOTHING), late.exact(NOTHING)):
        assert found.value == pytest.approx(np.abs(y).max() / 1.2, rel=1e-6)


@pytest.mark.parametrize("unit", [1e-6, 1e-3, 1.0, 1e3, 1e6])
def test_the_overshoot_of_a_companion_form_is_the_same_in_every_time_unit(unit):
    bottom = np.poly([-1.0, -2.0, -0.4 + 0.9j, -0.4 - 0.9j]).real
    top = bottom[-1:] * unit**4
    bottom = bottom * unit ** np.arange(5.0)
    A = np.vstack([-bottom[None, 1:], np.eye(4)[:3]])
    system = plant(
        A, np.hstack([np.eye(4)[:, :1], np.zeros((4, 1))]), np.vstack([np.r_[0, 0, 0, top], np.zeros(4)]),
        inputs=["w", "u"], outputs=["z", "y"],
    )  # fmt: skip
    bound = Overshoot(**ONE).bind(loop_of(system, controls=["u"], measured=["y"]))
    expected = Overshoot(**ONE).bind(_alone(control.tf([top[0] / unit**4], bottom / unit ** np.arange(5.0))))
    reference = expected.exact(NOTHING).value
    assert 0.5 < reference < 3
    assert bound.evaluate(NOTHING).value == pytest.approx(reference, rel=1e-8)
    assert bound.exact(NOTHING).value == pytest.approx(reference, rel=1e-8)


@pytest.mark.parametrize("zeta", [0.5, 1e-2, 1e-4, 1e-8])
def test_the_work_for_an_overshoot_follows_the_modes_not_the_periods(zeta, monkeypatch):
    monkeypatch.setattr(goal_modes, "MOST", 5000)  # intervals: beyond them the bracket would stay wide
    slow_and_fast = 0.5 * _second(zeta, 1e3) + 0.5 * _second(zeta, math.sqrt(2))
    for system in (_second(zeta), slow_and_fast):
        found = largest(step_response(_system(system), None), 0.0, 1)
        assert found.upper <= found.value * (1 + 2e-10)
    assert largest(step_response(_system(_second(zeta)), None), 0.0, 1).value == pytest.approx(
        1 + _overshoot(zeta), rel=1e-10
    )


def test_twin_modes_that_beat_are_largest_where_they_meet():
    zeta, apart = 1e-5, 1e-4
    system = _second(zeta) - _second(zeta * (1 + apart), 1 + apart)
    found = largest(step_response(_system(system), None), 0.0, 0)
    # e^{−ζt} 2 sin(apart t/2) is largest where tan(apart t/2) = apart/2ζ; the carrier's phase is within its square
    t = math.atan(apart / 2 / zeta) * 2 / apart
    assert found.value == pytest.approx(2 * math.exp(-zeta * t) * math.sin(apart * t / 2), rel=2e-4)
    assert found.time == pytest.approx(t, rel=1e-3)


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_repeated_poles_without_enough_eigenvectors_are_followed(unit):
    system = _system(_second(0.02) * _second(0.02) * _second(0.02))
    found = largest(step_response(Realisation(system.A * unit, system.B * unit, system.C, system.D), None), 0.0, 1)
    t = np.linspace(0, 300, 30_001)
    step = expm(np.block([[system.A, system.B], [np.zeros((1, 7))]]) * t[1])
    state, y = np.r_[np.zeros(6), 1.0], []
    for _ in t:
        y.append((system.C @ state[:6])[0])
        state = step @ state
    assert found.value == pytest.approx(max(y), rel=2e-5)  # instants a hundredth of a radian apart
    assert found.value >= max(y) * (1 - 1e-6)  # triple poles are good to the cube root of rounding


def test_sampled_poles_at_zero_and_near_minus_one_are_followed():
    for zeros in ([0, 0, 0], [-0.99, 0.5], [0.9999 * np.exp(2.5j), 0.9999 * np.exp(-2.5j), -0.3]):
        bottom = np.poly(zeros).real
        P = control.ss(control.tf([bottom.sum()], bottom, 1.0))
        y = control.step_response(P, np.arange(4000.0))[1]
        response = step_response(Realisation(P.A, P.B, P.C, P.D), 1.0)
        for first in (0, 700):
            assert largest(response, first, 0).value == pytest.approx(np.abs(y[first:]).max(), rel=1e-9)
            assert largest(response, first, -1, level=-2.0).value == pytest.approx((-y[first:]).max(), rel=1e-9)


def test_a_long_chain_of_samples_of_dead_time_is_summed_to_its_end():
    samples, h = 150, 0.02
    P = control.c2d(control.ss(_second(0.3)), h)
    system = plant(
        P.A, np.hstack([P.B, P.B]), np.vstack([P.C, P.C]), inputs=["w", "u"], outputs=["z", "y"]
    )  # fmt: skip
    loop = loop_of(system, controls=["u"], measured=["y"], sample_time=h, input_delay={"u": samples * h})
    x, u, y = np.zeros(2), np.zeros(3000), []
    for k in range(3000):
        y.append(float((P.C @ x)[0]))
        u[k] = -0.3 * y[-1]
        x = P.A @ x + P.B[:, 0] * (1 + (u[k - samples] if k >= samples else 0))
    bound = Overshoot(**ONE, percent=10.0).bind(loop)
    K = Controller.static([[-0.3]])
    for found in (bound.evaluate(K), bound.exact(K)):
        assert found.value == pytest.approx((max(y) * 1.3 - 1) / 0.1, rel=1e-8)


def _integrator_with_dead_time(gain, dead_time, unit=1.0):
    """y' = gain (r − y)(t − T) under u = r − y."""
    system = plant([[0.0]], [[gain * unit]], [[1.0]], inputs=["u"], outputs=["y"])
    from workbench.control.structure.blocks import gain as block
    from workbench.control.structure.loop import Loop
    from workbench.control.structure.structure import Structure
    from workbench.lti.model import Model

    law = Structure([block(["r - y"], ["u"])], references=("r",))
    return Loop(Model("dead", system, input_delay={"u": dead_time / unit}), law), Controller.static([[1.0]])


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_the_overshoot_of_an_integrator_behind_a_dead_time_is_one_half(unit):
    # y = t − 1 on [1, 2], t − 1 − (t − 2)²/2 on [2, 3]: largest at 3, 3/2
    loop, K = _integrator_with_dead_time(1.0, 1.0, unit)
    found = Overshoot(inputs="r", outputs="y", percent=50.0).bind(loop).exact(K)
    assert found.value == pytest.approx(1.0, rel=1e-9)
    assert found.time == pytest.approx(3.0 / unit, rel=1e-9)
    assert found.upper <= 1 + 1e-8
    assert "dead times exact" in found.method


def test_energies_with_dead_time_are_those_of_the_frequency_response():
    gain, dead_time = 2.0, 1.1  # 2/(s + 1) behind 1.1 s; at 1.209 s it is unstable
    loop = Lined(
        np.array([[-1.0, 1.0], [-gain, 0.0]]), np.array([[0.0], [gain]]), np.array([[1.0, 0.0]]), np.zeros((1, 1)),
        np.array([0.0, dead_time]),
    )  # fmt: skip
    pieces = step_pieces(loop)
    omega = np.geomspace(1e-6, 1e5, 400_001)
    L = gain * np.exp(-1j * omega * dead_time) / (1j * omega + 1)
    T, end = L / (1 + L), gain / (1 + gain)
    lag = ((T - end) / (1j * omega))[0].real
    for order, E in enumerate((T, (T - end) / (1j * omega), (T - end - 1j * omega * lag) / (1j * omega) ** 2)):
        # the grid ends at 1e5 rad/s: 1e-5 of ∫ dω/ω² beyond
        assert pieces.energy(order) == pytest.approx(np.trapezoid(np.abs(E) ** 2, omega) / math.pi, rel=3e-5)


def test_two_dead_times_in_series_and_a_difference_are_those_of_shifted_responses():
    lag = Lined.of(Realisation(*(np.array([[x]]) for x in (-1.0, 1.0, 1.0, 0.0))))
    late = Lined(np.zeros((1, 1)), np.eye(1), np.eye(1), np.zeros((1, 1)), np.array([0.3]))
    later = Lined(np.zeros((1, 1)), np.eye(1), np.eye(1), np.zeros((1, 1)), np.array([math.sqrt(2)]))
    pieces = step_pieces(lined_difference(lined_series(later, lined_series(lag, late)), lag))
    t = np.linspace(0, 8, 81)
    shifted = np.where(t > 0.3 + math.sqrt(2), 1 - np.exp(-np.maximum(t - 0.3 - math.sqrt(2), 0)), 0.0)
    np.testing.assert_allclose(pieces.at(t)[:, 0, 0], shifted - (1 - np.exp(-t)), atol=1e-10)


def test_a_late_response_that_falls_too_slowly_is_given_up_early_and_said_to_be_unjudged(monkeypatch):
    # s² + 0.1s + 1 + 0.5e^(−sT) is stable for T < 0.202035; at 0.2 the slowest root leaves after 2e4 s
    from delay_cases import companion, late_loop

    from workbench.lti import march

    late = late_loop(companion([0.5], [1, 0.1, 1]), 1.0, 0.2)
    bound = Overshoot(inputs="u1", outputs="y1", percent=200.0).bind(late)
    pieces = []
    keep = march._March._keep
    monkeypatch.setattr(march._March, "_keep", lambda self, *given: (pieces.append(1), keep(self, *given))[1])
    value = bound.exact(late.structure.controller())
    assert value.upper == math.inf
    assert "does not rest" in value.reason
    assert len(pieces) < march.MOST_PIECES / 4

"""Pole goals against hand-made poles."""

import math

import numpy as np
import pytest
from goal_cases import loop_of, plant

from workbench.control.structure.block import Controller
from workbench.errors import InputError
from workbench.goals.poles import ControllerPoles, Poles, proved_stable


def _oscillator():
    """y'' + 2 y' + 25 y = u − k y: poles −1 ± j √(24 + k) under u = −k y."""
    system = plant([[0.0, 1.0], [-25.0, -2.0]], [[0.0], [1.0]], [[1.0, 0.0]], inputs=["u"], outputs=["y"])
    return loop_of(system, controls=["u"], measured=["y"])


def test_the_measures_are_those_of_a_known_pair():
    K = Controller.static([[-39.0]])  # poles −1 ± j √63: |p| = 8, damping 1/8
    loop = _oscillator()
    # closed formulas of the docstring; eigenvalues of a 2 × 2 matrix are good to 1e-14
    assert Poles(decay=2.0).bind(loop).evaluate(K).value == pytest.approx(1 + (2 - 1) / 2, rel=1e-12)
    assert Poles(decay=0.0).bind(loop).evaluate(K).value == pytest.approx(1 - 1, abs=1e-12)
    assert Poles(damping=0.5).bind(loop).evaluate(K).value == pytest.approx(2 - 0.125 / 0.5, rel=1e-12)
    found = Poles(frequency=4.0).bind(loop).evaluate(K)
    assert found.value == pytest.approx(2.0, rel=1e-12)
    assert found.frequency == pytest.approx(8.0, rel=1e-12)


def test_the_exact_value_comes_with_a_proof_just_above_it():
    K = Controller.static([[-39.0]])
    for goal in (Poles(decay=2.0), Poles(damping=0.5), Poles(frequency=4.0)):
        exact = goal.bind(_oscillator()).exact(K)
        assert "proved by Lyapunov" in exact.method
        assert exact.value < exact.upper <= exact.value + 1e-6  # the first slack, 1e-9, suffices for two states


def test_a_lyapunov_proof_exists_exactly_for_stable_matrices():
    random = np.random.default_rng(3)
    for _ in range(30):
        M = random.standard_normal((6, 6)) - 2.2 * np.eye(6)
        assert proved_stable(M) == (np.linalg.eigvals(M).real.max() < 0)


def test_poles_outside_the_focus_do_not_count():
    K = Controller.static([[-39.0]])
    assert Poles(decay=2.0, focus=(10.0, math.inf)).bind(_oscillator()).evaluate(K).value == 0.0


def test_a_pole_goal_guides_an_unstable_loop_too():
    value = Poles(decay=1.0).bind(_oscillator()).evaluate(Controller.static([[100.0]]))
    assert 1 < value.value < math.inf
    assert value.gradients


def test_an_opening_shows_the_plant_alone():
    loop = _oscillator()
    opened = Poles(decay=1.0, openings="u").bind(loop).evaluate(Controller.static([[-39.0]]))
    assert opened.frequency == pytest.approx(5.0, rel=1e-12)  # √25, whatever K


def test_controller_poles_are_those_of_the_controller():
    system = plant([[-1.0]], [[1.0]], [[1.0]], inputs=["u"], outputs=["y"])
    loop = loop_of(system, controls=["u"], measured=["y"], order=2)
    K = Controller(np.diag([-3.0, -0.5]), np.ones((2, 1)), np.zeros((1, 2)), np.zeros((1, 1)))
    assert ControllerPoles(decay=1.0).bind(loop).evaluate(K).value == pytest.approx(1.5, rel=1e-12)
    static = ControllerPoles(decay=1.0).bind(loop).evaluate(Controller.static([[1.0]]))
    assert static.value == 0.0
    assert static.reason


def test_sampled_poles_are_judged_by_their_logarithm():
    h, s = 0.1, complex(-1.0, 4.0)
    z = np.exp(s * h)
    A = [[2 * z.real, -(abs(z) ** 2)], [1.0, 0.0]]
    system = plant(A, [[1.0], [0.0]], [[0.0, 1.0]], inputs=["u"], outputs=["y"])
    loop = loop_of(system, controls=["u"], measured=["y"], sample_time=h)
    K = Controller.static([[0.0]])
    damping = Poles(damping=0.5).bind(loop).evaluate(K).value
    assert damping == pytest.approx(2 - (1 / math.sqrt(17)) / 0.5, rel=1e-10)  # rounding of the logarithm
    assert Poles(decay=2.0).bind(loop).exact(K).value == pytest.approx(1.5, rel=1e-10)


def test_a_goal_without_a_limit_is_refused():
    with pytest.raises(InputError, match="decay, damping or frequency; got none"):
        Poles()
    with pytest.raises(InputError, match="above 0; got 0"):
        Poles(damping=0)
    with pytest.raises(InputError, match="0 ≤ low < high"):
        Poles(decay=1.0, focus=(3.0, 1.0))


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_a_damping_of_one_is_met_by_real_poles_alone(unit):
    K = Controller.static([[0.0]])
    for poles, met in (([-1.0, -2.0], True), ([-1.0, -1.0], True), ([-1 + 1e-3j, -1 - 1e-3j], False)):
        bottom = np.poly(poles).real
        A = np.array([[-bottom[1], -bottom[2]], [1.0, 0.0]]) * unit
        system = plant(A, np.array([[unit], [0.0]]), np.array([[0.0, 1.0]]), inputs=["u"], outputs=["y"])
        found = Poles(damping=1.0).bind(loop_of(system, controls=["u"], measured=["y"])).exact(K)
        assert (found.upper <= 1) is met

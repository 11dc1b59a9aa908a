"""Every kind of goal: its gradient is the derivative of its value, and its two measures agree."""

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from goal_cases import EXAMPLES, loop_of, plant, random_controller, random_plant, slope_error
from scipy.linalg import expm

from workbench.control.structure.block import Controller
from workbench.goals.margin import Margins
from workbench.goals.poles import Poles

SAMPLE_TIME = 0.2


def _labels(goals):
    return [f"{type(goal).__name__}-{k}" for k, goal in enumerate(goals)]


@pytest.fixture(scope="module")
def continuous():
    system = random_plant(1, 8, 3, 3)
    loop = loop_of(system, controls=["u1", "u2"], measured=["y1", "y2"], order=3)
    return loop, random_controller(2, 3, 2, 2, size=0.3)


@pytest.fixture(scope="module")
def sampled():
    P, h = random_plant(1, 8, 3, 3), SAMPLE_TIME
    M = expm(np.block([[P.A, P.B], [np.zeros((3, 11))]]) * h)
    loop = loop_of(
        plant(M[:8, :8], M[:8, 8:], P.C, P.D), controls=["u1", "u2"], measured=["y1", "y2"], order=3, sample_time=h
    )
    K = random_controller(2, 3, 2, 2, size=0.3)
    return loop, Controller(expm(K.A * h), K.B * h, K.C, K.D)


@pytest.fixture(scope="module")
def delayed():
    loop = loop_of(
        random_plant(1, 8, 3, 3), controls=["u1", "u2"], measured=["y1", "y2"], order=3,
        input_delay={"u1": 0.3, "u2": 0.1},
    )  # fmt: skip
    return loop, random_controller(2, 3, 2, 2, size=0.25)


def _check(goal, case):
    loop, K = case
    bound = goal.bind(loop)
    value, exact = bound.evaluate(K), bound.exact(K)
    assert math.isfinite(value.value), value
    # two algorithms: 1e-6 for the peaks, integrals and Newton's extrema; the disk margin's bracket is 1e-3 wide; dead
    # times differ from their Padé fractions
    assert value.value == pytest.approx(exact.value, rel=1e-6 if not isinstance(goal, Margins) else 1e-3)
    assert exact.upper >= exact.value * (1 - 1e-9)
    assert exact.method
    if value.gradients:  # DelayMargin has none where |L| passes 1 nowhere
        # differences with a step of 1e-6 in a smooth function: rounding 1e-10, curvature 1e-12 times its size
        assert slope_error(bound, K) < 1e-5
    else:
        assert value.reason


@pytest.mark.parametrize("goal", EXAMPLES, ids=_labels(EXAMPLES))
def test_the_gradient_is_the_derivative_and_both_measures_agree(goal, continuous):
    _check(goal, continuous)


@pytest.mark.parametrize("goal", EXAMPLES, ids=_labels(EXAMPLES))
def test_the_same_holds_on_a_sampled_loop(goal, sampled):
    _check(goal, sampled)


@pytest.mark.slow
@pytest.mark.parametrize("goal", EXAMPLES, ids=_labels(EXAMPLES))
def test_the_same_holds_with_dead_times(goal, delayed):
    if isinstance(goal, Poles):
        goal = replace(goal, focus=(0.0, 20.0))  # of infinitely many
    _check(goal, delayed)


@pytest.mark.parametrize("goal", EXAMPLES, ids=_labels(EXAMPLES))
def test_goals_travel_between_processes(goal):
    again = pickle.loads(pickle.dumps(goal))
    assert (again.name, again.hard, again.focus) == (goal.name, goal.hard, goal.focus)


@pytest.mark.parametrize("goal", EXAMPLES[4:], ids=_labels(EXAMPLES[4:]))
def test_an_unstable_loop_has_no_value_and_says_why(goal):
    system = random_plant(1, 8, 3, 3)
    loop = loop_of(system, controls=["u1", "u2"], measured=["y1", "y2"], order=3)
    K = random_controller(2, 3, 2, 2, size=0.3).scaled(-1.0)  # the controller's own poles to the right
    assert np.linalg.eigvals(loop.channel((), ()).system(K).A).real.max() > 0
    for value in (goal.bind(loop).evaluate(K), goal.bind(loop).exact(K)):
        assert value.value == math.inf
        assert "unstable: pole" in value.reason
        assert not value.gradients

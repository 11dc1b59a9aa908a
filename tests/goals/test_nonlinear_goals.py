"""Goals on forces that bend: from data, steered with the gradients of differences, judged by another route, refused."""

import numpy as np
import pytest

from workbench.control import GAIN_NAMES
from workbench.design.brought import nominal
from workbench.design.steering import Programme
from workbench.errors import InputError
from workbench.files.goal import goal_of
from workbench.files.problem import load_problem
from workbench.goals.registry import data_of
from workbench.goals.ride.cost import RideCost
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.nonlinear import ContactsPerHour, NonlinearRideCost


@pytest.fixture(scope="module")
def bent():
    """The vehicle that rides by comfort alone, its bent ride made small and its contacts limited."""
    problem = load_problem("comfort_limit")
    hard = [goal for goal in problem.goals if goal.hard]
    return problem.with_goals([*hard, ContactsPerHour(0.1), NonlinearRideCost()])


@pytest.fixture(scope="module")
def points(bent):
    """The programme at the approved gains and on both sides of them along one direction; the step."""
    programme = Programme(bent, back_off=0.0)
    theta = np.array([getattr(bent.approved, name) for name in GAIN_NAMES])
    direction = np.random.default_rng(2).standard_normal(17) * np.maximum(np.abs(theta), 0.01)
    step = 1e-4
    return [programme.evaluated(theta + k * step * direction) for k in (0, 1, -1)], direction, step


def test_the_bent_cost_has_the_gradient_of_differences(points):
    (here, up, down), direction, step = points
    goal = NonlinearRideCost()
    difference = (goal.cost(up)[0] - goal.cost(down)[0]) / (2 * step)
    # the fixed point ends at 1e-7 of every mean square, over a step of 1e-4
    assert goal.cost(here)[1] @ direction == pytest.approx(difference, rel=2e-3)


@pytest.mark.slow
def test_contacts_have_the_gradient_of_differences(points):
    (here, up, down), direction, step = points
    goal = ContactsPerHour(0.1)
    (_, value, slope), (_, high, _), (_, low, _) = (goal.steer(point)[0] for point in (here, up, down))
    assert slope[0] @ direction == pytest.approx((high[0] - low[0]) / (2 * step), rel=1e-3)
    (verdict,) = goal.judge(Flown(here.setting, load_problem("comfort_limit").approved))
    # a grid of twice the period and half the step: 1e-3 of σ, times m²/σ² = 23
    assert np.exp(-value[0]) * 0.1 == pytest.approx(verdict.value, rel=0.05)
    assert verdict.where.startswith("floor, set ")


def test_drawn_guideways_judge_the_bent_cost(bent, points):
    cost, _ = NonlinearRideCost().cost(points[0][0])
    (verdict,) = NonlinearRideCost().judge(Flown(bent.setting, bent.approved))
    assert verdict.method.endswith("drawn guideways")
    # 0.6 % of chance and 3 % that the closure may miss where the vehicle flutters
    assert verdict.value == pytest.approx(cost, rel=0.04)


def test_a_search_begins_with_straight_forces(bent):
    first = nominal(bent)
    assert [type(goal) for goal in first.goals if not goal.hard] == [RideCost]
    assert not any(goal.beside for goal in first.goals)


def test_data_say_what_is_made_small_and_limited():
    goal = goal_of({"kind": "contacts per hour", "at_most": 0.01}, vehicle=True)
    assert goal == ContactsPerHour(0.01)
    assert data_of(goal) == {"kind": "contacts per hour", "at_most": 0.01}
    assert goal.hard


def test_one_group_of_motion_has_neither():
    problem = load_problem("heave_pitch")
    for goal in (NonlinearRideCost(), ContactsPerHour(1.0)):
        with pytest.raises(InputError, match="needs all groups of motion of a vehicle whose force law bends"):
            problem.with_goals([*problem.goals, goal])

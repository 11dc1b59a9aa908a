"""What limits cost: multipliers against designs with the limits moved, and against the first-order conditions."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.design.multipliers import multipliers
from workbench.design.solve import cost, finish
from workbench.design.steering import Programme
from workbench.files.problem import load_problem
from workbench.goals.registry import goal

BACK_OFF = 1e-3


@pytest.fixture(scope="module")
def problem():
    reserve = goal("dead time borne", {"points": ("currents:uniform",), "at_least_ms": 6.0})
    heave = load_problem("heave")
    return heave.with_requirements((*heave.requirements, reserve))


@pytest.fixture(scope="module")
def optimum(problem):
    programme = Programme(problem, back_off=BACK_OFF)
    return finish(programme, programme.x(problem.gains), (1.0,))


@pytest.fixture(scope="module")
def found(problem, optimum):
    outcome, programme = optimum
    return multipliers(Programme(problem, back_off=BACK_OFF), programme.gains(outcome.x), (BACK_OFF, 1e-2))


def test_at_an_optimum_the_limits_explain_the_gradient(found):
    assert found.unexplained < 1e-4
    assert len(found.each) >= 2
    assert [m.per_percent for m in found.each] == sorted((m.per_percent for m in found.each), reverse=True)
    assert all(m.per_unit == pytest.approx(100 * m.per_percent / m.limit) for m in found.each)


def test_a_multiplier_is_what_a_design_with_the_limit_moved_costs_more(problem, optimum, found):
    # central differences over ± 0.3 % of a limit; 3 %: their own curvature and where solutions end
    outcome, programme = optimum
    for m in found.each:
        costs = []
        for step in (-0.003, 0.003):
            moved = [replace(r, limit=r.asked_at(step)) if r.name == m.name else r for r in problem.requirements]
            ended, _ = finish(programme.with_requirements(moved), outcome.x, (1.0,))
            assert ended.feasible
            costs.append(cost(ended))
        assert (costs[1] - costs[0]) / 0.6 == pytest.approx(m.per_percent, rel=0.03, abs=1e-3 * cost(outcome) / 100)


def test_a_limit_that_does_not_bind_costs_nothing(problem, found):
    loose = {r.name for r in problem.requirements} - {m.name for m in found.each}
    assert "rms gap, rear" in loose


def test_away_from_an_optimum_they_say_how_much_they_leave_unexplained(problem):
    programme = Programme(problem, back_off=BACK_OFF)
    gains = problem.gains.with_values(K_zdot=0.8 * problem.gains.K_zdot)
    away = multipliers(programme, gains, (BACK_OFF,))
    assert away.unexplained > 0.1
    assert np.isfinite(away.unexplained)

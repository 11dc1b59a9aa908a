"""Every kind of goal on random loops, in any units: what is judged is what its definition says.

"Met" is never said where the independent value is above 1, and never denied where that holds by more than a rounding.
"""

import math

import pytest
from goal_truth import CASES
from random_loops import HARDER, KINDS, random_case

from workbench import goals
from workbench.goals import kinds
from workbench.goals.goal import Goal

ROUGH = {"Margins, of two": 2e-3}  # a bracket 1e-3 wide, and the truth's phases are half a degree apart
CLOSE = 1e-5  # of the truth's own refinements, integrals and small steps
DELAYED_STEP = (
    3e-4  # of the truth's step responses with dead time: five fractions; with ten and twenty they come nearer
)
NEVER_INFINITE = ("Poles", "Poles, decay", "ControllerPoles")


def _check(name: str, case) -> str:
    """Empty, or what is wrong."""
    goal, truth = CASES[name]
    loop, K = case.loop()
    found = goal(case).bind(loop).exact(K)
    value = truth(case) if case.stable() or name in NEVER_INFINITE else math.inf
    judged = f"{found.value:.8g} … {found.upper:.8g} ({found.method}; {found.reason})"
    said = f"{name} on {case.name}: judged {judged}, true {value:.8g}"
    if math.isinf(value):
        return "" if math.isinf(found.upper) else said
    if math.isinf(found.upper) and "not judged" in found.method:
        return ""  # an honest refusal is never met
    steps = DELAYED_STEP if case.dead_time and name in ("Overshoot", "StepRejection") else CLOSE
    room = ROUGH.get(name, steps) * max(abs(value), 0.1)
    wrong = abs(found.value - value) > room or not value - room <= found.upper <= value + room
    return said if wrong else ""


def test_every_kind_of_goal_has_a_truth():
    # the integrated error has a value only under integral action: tests/goals/test_integrated_error.py has its truths
    shipped = {name for name in kinds.__all__ if issubclass(getattr(goals, name), Goal)} - {"IntegratedError"}
    assert {name.split(",")[0] for name in CASES} == shipped - {"Goal"}


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_judged_is_true(kind):
    case = random_case(kind, 0)
    chosen = list(CASES)[KINDS.index(kind) % 3 :: 3]  # every goal on two or three kinds of loop; the slow test has all
    wrong = [said for name in chosen if (said := _check(name, case))]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("kind", ["plain", "delay", "sampled"])
def test_no_goal_is_met_by_an_unstable_loop(kind):
    case = random_case(kind, 1, stable=False)
    wrong = [said for name in CASES if (said := _check(name, case))]
    assert not wrong, "\n".join(wrong)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS + HARDER)
@pytest.mark.parametrize("seed", range(1, 13))
def test_what_is_judged_is_true_of_many_loops(kind, seed):
    case = random_case(kind, seed)
    wrong = [said for name in CASES if (said := _check(name, case))]
    assert not wrong, "\n".join(wrong)

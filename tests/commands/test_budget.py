"""A budget is a positive, finite number of seconds, and a deadline tells what is left of it."""

import math
import pickle

import pytest

from workbench.errors import BudgetEnded, InfeasibleError, InputError
from workbench.machine import budget
from workbench.machine.budget import Deadline, checked_budget


@pytest.mark.parametrize("value", [0, -0.0, -1, math.nan, math.inf, -math.inf, "soon", None, [1]])
def test_a_budget_that_cannot_be_kept_is_refused(value):
    with pytest.raises(InputError, match="--budget-seconds must be a positive, finite number of seconds; got"):
        checked_budget(value, "--budget-seconds")


def test_a_deadline_counts_down_and_is_over_at_its_end(monkeypatch):
    now = [1000.0]
    monkeypatch.setattr(budget, "monotonic", lambda: now[0])
    whole = Deadline.after(8)
    half = whole.share(0.5)
    assert (whole.budget, whole.remaining, half.remaining, half.budget) == (8.0, 8.0, 4.0, 8.0)
    now[0] = 1004.0
    assert half.expired
    assert (half.remaining, whole.remaining, whole.expired) == (0.0, 4.0, False)
    assert whole.share(0.5).remaining == 2.0
    whole.check("a design")
    now[0] = 1009.0
    assert whole.remaining == 0.0
    with pytest.raises(BudgetEnded, match=r"the budget of 8 s must suffice for a design; it ended before"):
        whole.check("a design")


def test_without_a_budget_the_time_never_ends():
    never = Deadline.after(None)
    assert not never.expired
    assert never.share(0.1).remaining == math.inf
    never.check("anything")


def test_a_deadline_travels_to_another_process_of_the_machine():
    whole = Deadline.after(60.0)
    assert pickle.loads(pickle.dumps(whole)) == whole


def test_an_ended_budget_says_that_nothing_is_known_to_be_met():
    assert issubclass(BudgetEnded, InfeasibleError)  # exit code 1

"""A design whose time ends, or that is interrupted, keeps the best that is verified by then, or says there is none."""

import itertools
import json
import os

import pytest

from workbench.cli import run
from workbench.design.design import design
from workbench.design.tradeoff import trade_off
from workbench.errors import BudgetEnded
from workbench.files.problem import load_problem
from workbench.machine import budget
from workbench.machine.budget import Deadline, current, heed, keeping


@pytest.fixture(scope="module")
def problem():
    return load_problem("heave")


@pytest.fixture
def ticking(monkeypatch):
    """A clock that goes on by a second each time it is looked at, so that a budget counts evaluations."""
    ticks = itertools.count()
    monkeypatch.setattr(budget, "monotonic", lambda: float(next(ticks)))


def test_an_inner_deadline_is_kept_and_an_outer_one_is_not_put_off(ticking):
    with keeping(Deadline.after(100)) as _:
        outer = current()
        with keeping(Deadline.after(1000)):
            assert current() == outer
        with keeping(Deadline.after(3)):
            heed("this")
            heed("this")
            with pytest.raises(BudgetEnded, match="the budget of 3 s must suffice for this; it ended before"):
                heed("this")
        assert current() == outer
    assert current() is budget.NEVER


@pytest.mark.parametrize("seconds", [1, 5, 60, 150, 1000])
def test_a_design_is_verified_or_refused_whenever_its_budget_ends(ticking, problem, seconds):
    try:
        with keeping(Deadline.after(seconds)):
            found = design(problem, starts=6, seed=0)
    except BudgetEnded:
        assert seconds < 1000
    else:
        assert seconds > 5  # steps of an optimiser
        assert all(v.met for v in found.requirements)
        assert 1 <= len(found.starts) <= 6


def test_more_time_is_more_starts_and_never_a_dearer_design(ticking, problem):
    found = []
    for seconds in (300, 1500, 10_000):
        with keeping(Deadline.after(seconds)):
            found.append(design(problem, starts=6, seed=0))
    starts = [len(d.starts) for d in found]
    assert starts == sorted(starts)
    assert starts[0] < 6 == starts[-1]
    assert found[-1].analysis.cost <= found[0].analysis.cost * (1 + 1e-6)
    assert [s.cost for s in found[0].starts] == [s.cost for s in found[-1].starts[: starts[0]]]


def interrupted_after(count: int):
    def on_start(start):
        if start.number + 1 == count:
            raise KeyboardInterrupt

    return on_start


def test_an_interrupt_keeps_the_starts_that_had_ended(problem):
    found = design(problem, starts=6, seed=0, on_start=interrupted_after(2))
    assert len(found.starts) == 2
    assert all(v.met for v in found.requirements)


def test_an_interrupt_before_any_start_ended_is_an_interrupt(problem, monkeypatch):
    monkeypatch.setattr("workbench.design.starts.relaxed", lambda *_, **__: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        design(problem, starts=2, seed=0)


def test_a_robust_design_keeps_its_budget(ticking, problem):
    with keeping(Deadline.after(100)), pytest.raises(BudgetEnded):
        design(problem, starts=2, models=[{"mass": 1.1}])


def test_a_trade_off_without_time_does_not_say_that_there_is_no_design(ticking, problem):
    gains = problem.approved
    with keeping(Deadline.after(20)), pytest.raises(BudgetEnded):
        trade_off(problem, "peak sensitivity", [2.0, 1.5], start=gains)


def test_the_command_leaves_with_1_and_nothing_written_where_its_budget_is_too_short(ticking, tmp_path, capsys):
    assert run(["design", "heave", "--budget-seconds", "30", "--starts", "2", "--out", str(tmp_path)]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert "the budget of 30 s must suffice for" in err
    assert err.count("\n") == 1
    assert os.listdir(tmp_path) == []


def test_the_command_says_how_far_it_came_and_what_it_left_out(ticking, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    arguments = ["--starts", "60", "--no-boxes", "--no-trade-off", "--out", str(tmp_path), "--json"]
    assert run(["design", "heave", "--budget-seconds", "800", *arguments]) == 0
    out, err = capsys.readouterr()
    assert all(r["met"] for r in json.loads(out)["requirements"])
    assert "the budget ended after" in err
    assert "of 60 starts" in err
    assert sorted(os.listdir(tmp_path)) == ["gains.json", "report.html"]

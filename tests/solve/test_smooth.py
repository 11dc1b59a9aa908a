"""Smooth programmes and exchanges whose solutions are known; certificates that another program computes."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from workbench.errors import BudgetEnded, InputError
from workbench.machine.budget import Deadline
from workbench.solve.exchange import Found, exchange
from workbench.solve.multistart import ends
from workbench.solve.smooth import Options, Point, least_violation, minimise, stationarity

SOLVERS = pytest.mark.parametrize("solver", ["slsqp", "ipopt"])


@dataclass(frozen=True)
class Quadratic:
    """Minimise |x − target|²/2 under rows·x ≥ least, within a box."""

    target: tuple[float, ...]
    rows: tuple[tuple[float, ...], ...]
    least: tuple[float, ...]
    box: float = 10.0

    def at(self, x):
        A = np.array(self.rows).reshape(-1, len(x))
        off = x - np.array(self.target)
        names = tuple(f"row {k}" for k in range(len(A)))
        return Point(float(off @ off / 2), off, A @ x - np.array(self.least), A, names)

    def bounds(self):
        return -self.box * np.ones(len(self.target)), self.box * np.ones(len(self.target))


@SOLVERS
def test_a_projection_has_the_multiplier_of_its_normal(solver):
    # the nearest point of x + y ≥ 2 to the origin is (1, 1); f' = (1, 1) = λ (1, 1)
    found = minimise(
        Quadratic((0.0, 0.0), ((1.0, 1.0), (1.0, -1.0)), (2.0, -5.0)), np.array([3.0, 4.0]), Options(solver)
    )
    np.testing.assert_allclose(found.x, [1.0, 1.0], atol=1e-5)
    assert found.feasible
    assert found.binding == ("row 0",)
    assert found.multipliers == {"row 0": pytest.approx(1.0, abs=1e-5)}
    assert found.residual < 1e-5
    assert "feasible" in found.sentence()


@SOLVERS
def test_bounds_carry_their_part_of_the_gradient(solver):
    found = minimise(Quadratic((9.0, 0.5), (), (), box=1.0), np.array([0.0, 0.0]), Options(solver))
    np.testing.assert_allclose(found.x, [1.0, 0.5], atol=1e-5)
    assert found.residual < 1e-5  # (−8, 0), which the bound of x holds


def test_a_point_that_is_not_stationary_has_what_is_left_of_its_gradient():
    programme = Quadratic((0.0, 0.0), ((1.0, 0.0),), (1.0,))
    point = programme.at(np.array([1.0, 0.5]))
    multipliers, residual = stationarity(point, np.array([1.0, 0.5]), *programme.bounds())
    assert multipliers == pytest.approx([1.0])
    assert residual == pytest.approx(0.5)
    away = programme.at(np.array([0.5, 0.0]) * -1)  # f' points out of the set: no multiplier may be negative
    assert stationarity(away, np.array([-0.5, 0.0]), *programme.bounds())[1] == pytest.approx(0.5)


def test_the_least_violation_of_two_that_exclude_each_other_is_in_the_middle():
    # x ≥ 1 and −x ≥ 1: at x = 0 both miss by 1
    found = least_violation(Quadratic((5.0,), ((1.0,), (-1.0,)), (1.0, 1.0)), np.array([0.7]))
    assert found.x[0] == pytest.approx(0.0, abs=1e-6)
    assert found.violation == pytest.approx(1.0, abs=1e-6)
    assert set(found.binding) == {"row 0", "row 1"}
    assert not found.feasible


@dataclass(frozen=True)
class Floored(Quadratic):
    """The same, whose first row no compromise takes below −0.2."""

    def at(self, x):
        return replace(super().at(x), floors=np.array([-0.2, -np.inf]))


def test_a_compromise_keeps_above_a_floor():
    # x ≥ 1 and −x ≥ 1 with x − 1 ≥ −0.2: the middle is forbidden, x = 0.8 misses the other by 1.8
    found = least_violation(Floored((5.0,), ((1.0,), (-1.0,)), (1.0, 1.0)), np.array([0.9]))
    assert found.x[0] == pytest.approx(0.8, abs=1e-6)
    assert found.violation == pytest.approx(1.8, abs=1e-6)


def test_an_unknown_solver_is_refused_when_it_is_named():
    with pytest.raises(InputError, match="unknown solver 'simplex'"):
        Options("simplex")


def test_an_exchange_adds_the_tangents_that_a_disk_needs():
    """The point of the unit disk that is furthest along (3, 4), through half planes found one at a time."""
    c = np.array([3.0, 4.0])

    def solve(held, last):
        rows = tuple((-np.cos(a), -np.sin(a)) for a in held)
        start = np.zeros(2) if last is None else last
        return minimise(Quadratic(tuple(10 * c), rows, (-1.0,) * len(held), box=3.0), start).x

    def search(_, x):
        size = np.hypot(*x)
        return Found(size <= 1 + 1e-9, (float(np.arctan2(x[1], x[0])),), f"at {size:.6f}")

    seen = []
    done = exchange((0.0,), solve, search, lambda held, _, new: (*held, *new), rounds=30, on_round=seen.append)
    assert done.settled
    np.testing.assert_allclose(done.answer, c / 5, atol=1e-4)  # tangents at an angle of δ leave δ²/2
    assert done.held == (0.0, *done.added[: len(done.held) - 1])
    assert [one.number for one in done.rounds] == list(range(1, len(done.rounds) + 1)) == [one.number for one in seen]
    assert done.rounds[0].words.startswith("at 3")


@pytest.mark.parametrize(
    ("found", "rounds", "expired", "outcome", "solved"),
    [
        (Found(False, (1,)), 3, False, "stopped after 3 rounds", 3),
        (Found(False, (1,)), 3, True, "the time was over", 1),
        (Found(False, (1,), stop="the loop is unstable"), 3, False, "the loop is unstable", 1),
        (Found(True), 3, False, "nothing is violated any more", 1),
        (Found(False), 2, False, "stopped after 2 rounds", 2),  # nothing to add, but solved again from where it stopped
    ],
)
def test_how_an_exchange_ends_is_told(found, rounds, expired, outcome, solved):
    count = []
    done = exchange(
        (), lambda held, last: count.append(held) or 1.0, lambda *_: found, lambda held, _, new: (*held, *new),
        rounds=rounds, expired=lambda: expired,
    )  # fmt: skip
    assert (done.outcome, done.settled, len(count)) == (outcome, found.settled, solved)


def doubled(shared):
    """What a process makes of `shared`."""
    return lambda job: shared * job


def test_starts_end_alike_in_turn_and_on_processes():
    jobs = [1, 2, 3]
    alone = list(ends(jobs, doubled, 10))
    assert alone == [(0, 10), (1, 20), (2, 30)]
    assert sorted(ends(jobs, doubled, 10, workers=2)) == alone
    assert list(ends(jobs, doubled, 10, here=lambda job: -job)) == [(0, -1), (1, -2), (2, -3)]


def waits(shared):
    import time

    return lambda job: time.sleep(60.0)


def test_whoever_waits_too_long_for_a_process_is_told_and_the_process_ends():
    with pytest.raises(BudgetEnded, match=r"must suffice for the starts"):
        list(ends([1, 2], waits, 0, workers=2, until=lambda: Deadline(1.0, 0.0), work="the starts"))

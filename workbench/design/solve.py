"""From one start to the wanted limits of a vehicle's programme.

stable random starts --> solver with limits relaxed --> the best few: homotopy to the wanted bound
                     --exchange: what exact measures see beyond the grid--> solver
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol, TypeVar

import numpy as np

from workbench.solve.exchange import Found, exchange
from workbench.solve.smooth import Options, Outcome, Programme, minimise

COARSE = 1e-6  # of log J, at which a start counts as ended; the best are then solved to 1e-8
ROUGH, FEW_ITERATIONS = 1e-4, 60  # of a start from whose end goals of other loops lead on
RELAXED = 2.0  # multiple of the limits that are relaxed at which starts are compared
HOMOTOPY = (1.4, 1.0)  # then these, in turn
EXCHANGES = (
    5  # solutions of an exchange at most; each but the first adds the exact peaks, two are enough on a dense grid
)

Self = TypeVar("Self", bound="Steered")


class Steered(Programme, Protocol):
    """A programme of a vehicle, or of many: what its grid does not see can be added, limits relaxed."""

    def growth(self, x: np.ndarray) -> float:
        """Largest real part of an eigenvalue [1/s]."""
        ...

    def with_relaxed(self: Self, factor: float) -> Self:
        """With limits a factor looser, of what a search begins so."""
        ...

    def unseen(self, x: np.ndarray) -> tuple:
        """What exact measures at x say is to be constrained and was not."""
        ...

    def with_added(self: Self, unseen: tuple) -> Self:
        """With that constrained."""
        ...


def cost(outcome: Outcome) -> float:
    """J at an outcome: programmes minimise its logarithm."""
    return float(np.exp(outcome.objective))


def stable_start(programme: Steered, centre: np.ndarray, generator: np.random.Generator, spread: float) -> np.ndarray:
    """A random point around `centre` with every pole in the left half-plane; the nearest to that where none is found.

    Deviations follow Student's t with two degrees of freedom: most stay near, some go far, since the best valleys of
    this problem lie several typical sizes away from textbook gains.
    """
    low, high = programme.bounds()
    best, least = centre, np.inf
    for _ in range(TRIES if spread > 0 else 1):
        x = np.clip(centre + spread * generator.standard_t(2, size=len(centre)), low, high)
        decay = programme.growth(x)
        if decay < STABLE_BY:
            return x
        if decay < least:
            best, least = x, decay
    return _stabilised(programme, best)


TRIES = 2000  # 0.3 ms each
STABLE_BY = -0.05  # [1/s] so that the first evaluations see finite responses


def _stabilised(programme: Steered, x: np.ndarray) -> np.ndarray:
    """Descends on the largest real part of an eigenvalue, which has kinks: Nelder–Mead, no gradient needed."""
    from scipy.optimize import minimize

    low, high = programme.bounds()
    result = minimize(
        lambda z: programme.growth(np.clip(z, low, high)), x, method="Nelder-Mead",
        options={"maxfev": 3000, "fatol": 1e-4},
    )  # fmt: skip
    return np.clip(result.x, low, high)


def relaxed(programme: Steered, x: np.ndarray, *, solver: str = "slsqp", rough: bool = False) -> Outcome:
    """One start with limits `RELAXED` times as loose as wanted, of what a search begins so.

    rough : ended where its valley is known, since other goals move it far from there anyway
    """
    options = (
        Options(solver, iterations=FEW_ITERATIONS, tolerance=ROUGH) if rough else Options(solver, tolerance=COARSE)
    )
    return minimise(programme.with_relaxed(RELAXED), x, options)


def finish(
    programme: Self,
    x: np.ndarray,
    factors: Sequence[float] = HOMOTOPY,
    *,
    solver: str = "slsqp",
    options: Options | None = None,
) -> tuple[Outcome, Self]:
    """From a relaxed solution to the wanted limits; what exact measures see and the grid does not is added until none.

    factors : multiples of the relaxed limits, solved in turn; the last is 1
    options : instead of the solver's usual ones
    """
    options, before = options or Options(solver), 0
    for factor in factors[:-1]:
        relaxed = programme.with_relaxed(factor)
        if relaxed is not programme:
            outcome = minimise(relaxed, x, options)
            x, before = outcome.x, before + outcome.evaluations

    def search(held: Self, outcome: Outcome) -> Found:
        if held.growth(outcome.x) >= 0:
            return Found(False, stop="the loop is unstable")
        unseen = held.unseen(outcome.x)
        return Found(not unseen, unseen)

    def solve(held: Self, last: Outcome | None) -> Outcome:
        nonlocal before
        outcome = minimise(held, x if last is None else last.x, options)
        before += outcome.evaluations
        return outcome

    done = exchange(programme, solve, search, lambda held, _, added: held.with_added(added), rounds=EXCHANGES)
    return replace(done.answer, evaluations=before), done.held

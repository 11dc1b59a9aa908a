"""The smallest soft value under hard ones: a sequence of maxima max(α f, g), from a feasible point on.

    theta stable --feasible--> g < 1 --alternate--> f smallest with g < 1

f is the largest soft goal, g the largest hard one over its target, just below 1. First the exact penalty f/f0 + ρ
max(0, g − 1), again a maximum of pieces, brings f near its constrained minimum wherever g has room. Then max(α f, g):
at the α where its minimum is 1 the minimiser solves the constrained problem. With α = 1/f at a feasible point the
minimum is at most 1 and its minimiser feasible; log of the minimum rises with log α, so a secant finds the rest.

Source: Apkarian, Gahinet & Buhr, Multi-model, multi-objective tuning of fixed-structure controllers, ECC 2014.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from workbench.design.tuner.pieces import GoalPieces, Smooth
from workbench.design.tuner.stabilise import parameter_scale
from workbench.solve.nonsmooth import Minimum, minimise

ALPHAS = 12  # values of α tried; three to six after the penalty's minimum
ENOUGH = 2e-3  # of the soft value: a penalty's minimum that gains less ends that phase
PENALTY, HARDER = 10.0, 5.0  # ρ, and its factor where hard goals give way
PENALTIES = 4  # minimisations with the penalty
CLOSE = 1e-6  # of log(minimum): the binding hard goal is then as far from its limit, the soft value about as near
GIVEN_WAY = 0.01  # relative excess of g at which a point is pulled in rather than the penalty raised
PULLS = 5  # points tried between a feasible point and one that is slightly not
COARSE, FINE = 1e-4, 1e-7  # tolerance of the solver while α moves, and at the end


@dataclass(frozen=True, slots=True)
class Descent:
    """Where one start ended, by the smooth measures; `minimum` is the solver's last certificate."""

    theta: np.ndarray
    soft: float
    hard: float
    minimum: Minimum | None

    @property
    def feasible(self) -> bool:
        """Whether every hard goal is below its target."""
        return self.hard < 1


def descend(
    programme: GoalPieces, theta: np.ndarray, *, until: float, seed: int = 0,
    on_step: Callable[[str, np.ndarray, float, float], bool | None] | None = None,
) -> Descent:  # fmt: skip
    """From stable parameters to the smallest soft value found under g < 1."""
    return _Descent(programme, until, seed, on_step).run(theta)


class _Descent:
    def __init__(self, programme: GoalPieces, until: float, seed: int, on_step) -> None:
        self._programme, self._until, self._seed = programme, until, seed
        self._on_step, self.ended = on_step, False
        self._scale = parameter_scale(programme.structure)
        self._last: tuple[bytes, Smooth | None] | None = None  # asked for several times in a step

    def run(self, theta: np.ndarray) -> Descent:
        here = self._at(theta)
        if here is None:
            return Descent(theta, math.inf, math.inf, None)
        if len(theta) == 0:
            return self._descent(theta, None)
        best, last = theta, None
        if here.hard and here.largest_hard >= 1:
            last = self._minimise(0.0, best, "hard goals", FINE, stop_below=1.0)
            best = last.x
        here = self._at(best)
        if here is None or (here.hard and here.largest_hard >= 1) or not here.soft:
            return self._descent(best, last)
        if not here.hard:
            last = self._minimise(1.0, best, "soft goals", FINE, hard=False)
            return self._descent(last.x, last)
        return self._alternate(self._penalised(best))

    def _at(self, theta: np.ndarray) -> Smooth | None:
        key = np.ascontiguousarray(theta).tobytes()
        if self._last is None or self._last[0] != key:
            self._last = (key, self._programme.at(theta))
        return self._last[1]

    def _descent(self, theta: np.ndarray, last: Minimum | None) -> Descent:
        here = self._at(theta)
        if here is None:
            return Descent(theta, math.inf, math.inf, last)
        return Descent(theta, here.largest_soft, here.largest_hard, last)

    def _penalised(self, theta: np.ndarray) -> Descent:
        """The best feasible point that minimising f/f0 + ρ max(0, g − 1) comes by."""
        best, rho = self._descent(theta, None), PENALTY
        for _ in range(PENALTIES):
            if self.ended or perf_counter() > self._until or not best.soft > 0:
                break
            found = self._minimise(1 / best.soft, best.theta, "soft under hard goals", COARSE, rho=rho)
            end = self._descent(found.x, found)
            before = best.soft
            if end.hard < 1 + GIVEN_WAY:
                best = end if end.hard < 1 and end.soft < best.soft else self._pulled_in(best, end)
                if best.soft > before * (1 - ENOUGH):
                    break
            else:
                rho *= HARDER
        return best

    def _pulled_in(self, inside: Descent, outside: Descent) -> Descent:
        """The point nearest to `outside` on the way from `inside` that is feasible and better than `inside`."""
        share = 1.0
        for _ in range(PULLS):
            share = 1 - (1 - share) * 3 if share < 1 else 1 - 1e-3
            end = self._descent(inside.theta + share * (outside.theta - inside.theta), outside.minimum)
            if end.hard < 1 and end.soft < inside.soft:
                return end
        return inside

    def _alternate(self, best: Descent) -> Descent:
        """The sequence of α."""
        if not best.soft > 0:
            return best
        alpha, tried = 1 / best.soft, []
        low, high = -math.inf, math.inf  # log α with a minimum below and above 1
        tolerance = COARSE
        for _ in range(ALPHAS):
            if self.ended or perf_counter() > self._until:
                break
            found = self._minimise(alpha, best.theta, "soft under hard goals", tolerance)
            end = self._descent(found.x, found)
            if end.hard < 1 and end.soft <= best.soft:
                best = end
            level, at = math.log(max(found.value, 1e-300)), math.log(alpha)
            tried.append((at, level))
            low, high = (max(low, at), high) if level < 0 else (low, min(high, at))
            idle = end.hard < 0.99 * found.value  # hard goals do not bind: nothing to trade
            if idle or -CLOSE < level <= 0 or high - low < CLOSE / 2:
                if tolerance == FINE:
                    break
                tolerance = FINE
            alpha = math.exp(self._next(tried, low, high, at, level))
        return best

    @staticmethod
    def _next(tried, low: float, high: float, at: float, level: float) -> float:
        """log α where the minimum is expected just below 1."""
        wanted = -CLOSE / 2
        if level <= 0 and len(tried) == 1:
            return at - level + wanted
        slope = 1.0
        if len(tried) > 1 and tried[-1][0] != tried[-2][0]:
            slope = (tried[-1][1] - tried[-2][1]) / (tried[-1][0] - tried[-2][0])
        step = (wanted - level) / min(max(slope, 0.1), 1.0)
        point = at + step
        if math.isfinite(low) and math.isfinite(high) and not low < point < high:
            point = (low + high) / 2
        return point

    def _minimise(
        self, alpha: float, theta: np.ndarray, words: str, tolerance: float, *, stop_below=-math.inf,
        hard: bool = True, rho: float = 0.0,
    ) -> Minimum:  # fmt: skip
        programme = self._programme

        def goals(x: np.ndarray):
            here = self._at(x)
            if here is None:
                return []
            soft = [(alpha * value, alpha * gradient) for value, gradient in here.soft] if alpha else []
            if rho:
                over = [(rho * (v - 1), rho * g) for v, g in here.hard] + [(0.0, 0.0)]
                return [(f + v, df + dv) for f, df in soft for v, dv in over]
            return soft + (here.hard if hard else [])

        size = max((value for value, _ in goals(theta)), default=1.0)
        size = size if size > 0 else 1.0

        def pieces(x: np.ndarray):
            """The goals, and the decay as a constraint that binds where it is that of the start's largest value."""
            here = self._at(x)
            return [] if here is None else goals(x) + [(size * v, size * g) for v, g in here.decay]

        def told(x: np.ndarray, value: float) -> bool:
            here = self._at(x)
            if self._on_step is not None and here is not None:
                self.ended = bool(self._on_step(words, x, here.largest_soft, here.largest_hard))
            return self.ended

        return minimise(
            pieces, theta, bounds=programme.structure.bounds, scale=self._scale, tolerance=tolerance, seed=self._seed,
            stop_below=stop_below, polish=tolerance == FINE, on_step=told, evaluations=4000,
            budget_seconds=max(self._until - perf_counter(), 1e-3),
        )  # fmt: skip

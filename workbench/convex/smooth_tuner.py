"""The same tuning problem by a smooth local solver: SLSQP with exact gradients on frequencies that are exchanged.

    gains --log σ_max of S, T, Q at chosen frequencies, gradients by singular vectors--> SLSQP --> gains
      --dense check: peaks that come near a limit are added--> again, until no frequency passes a limit

A singular value that stands alone has the gradient Re u*(dY − H dW) W⁻¹ v, H = Y W⁻¹. The objective is carried by a
variable t ≤ log σ_i(P(0)K_I) for every singular value i, so that its maximum may lie where they meet.
"""

import math
from collections.abc import Callable
from time import perf_counter

import numpy as np

from workbench.convex.delayed_loop import Sample, dense, local_peaks
from workbench.convex.pid_problem import PidProblem, PidTuning, verified
from workbench.convex.restriction import BACK_OFF
from workbench.errors import InputError

NEAR = 0.9  # peaks above this share of their limit are watched
ROUNDS = 25
SETTLED = 1e-6  # relative change of the objective between rounds that ends the search


def smooth_tuning(
    problem: PidProblem,
    *,
    start=None,
    seconds: float = 60.0,
    on_progress: Callable[[int, float], None] | None = None,
) -> PidTuning:
    """Gains by SLSQP with exact gradients on frequencies that are exchanged until the limits hold densely.

    Parameters, result and errors as of `restriction.restriction`, but the start may break the limits; a local optimum.
    The best point seen that is stable and within the limits on the dense frequencies is returned, the start if there is
    none (`stable` and `within_limits` tell).
    """
    begin = perf_counter()
    x = problem.start() if start is None else np.asarray(start, float)
    if x.shape != (len(problem.law.terms),) or not np.isfinite(x).all():
        raise InputError(f"start must hold {len(problem.law.terms)} finite gains; got {str(start)[:60]}.")
    programme = _Programme(problem, dense(problem.plant, problem.law))
    allowed = not programme.watch(x) and problem.unstable_poles(x) == 0
    best, history = x, [problem.objective(x) if allowed else math.inf]
    outcome, rounds, reach = f"stopped after {ROUNDS} rounds", 0, 1.0
    for _ in range(ROUNDS):
        if perf_counter() - begin > seconds:
            outcome = f"stopped after {seconds:g} s"
            break
        rounds += 1
        candidate = programme.solve(x, reach)
        missed = programme.watch(candidate)
        if problem.unstable_poles(candidate) != 0:
            reach /= 4  # the solver stepped across a region that its frequencies do not show
            x = best
            continue
        x = candidate
        if missed:
            continue
        value, before = problem.objective(x), history[-1]
        if value < before:
            best = x
            history.append(value)
            if on_progress is not None:
                on_progress(rounds, value)
        if value >= before * (1 - SETTLED):
            outcome = "settled"
            break
    return verified(problem, best, history=history, solves=rounds, frequencies=programme.count,
                    seconds=lambda: perf_counter() - begin, outcome=outcome)  # fmt: skip


class _Programme:
    """Watched frequencies per measure, and SLSQP over them in gains of size one."""

    def __init__(self, problem: PidProblem, everywhere: Sample) -> None:
        self.problem, self.everywhere = problem, everywhere
        self.limits = {name: limit * (1 - BACK_OFF) for name, limit in problem.limits.items()}
        spread = np.linspace(1, len(everywhere.omega) - 1, 16).astype(int)
        self.chosen = {name: set(spread.tolist()) for name in self.limits}
        self.integral = problem.plant.static_gain() @ problem.law.integral()

    @property
    def count(self) -> int:
        """Number of frequencies watched, over all measures."""
        return sum(map(len, self.chosen.values()))

    def watch(self, x: np.ndarray) -> bool:
        """Adds the peaks near a limit; whether one passes it."""
        missed = False
        for name, curve in self.everywhere.peaks(x).items():
            if name in self.limits:
                self.chosen[name] |= set(local_peaks(curve, NEAR * self.limits[name]).tolist())
                missed |= bool(curve.max() > self.limits[name] * (1 + BACK_OFF / 4))
        return missed

    def solve(self, start: np.ndarray, reach: float) -> np.ndarray:
        """One run over the watched frequencies, from `start` and within `reach` × size of it."""
        from scipy.optimize import minimize

        size = np.maximum(np.abs(start), 0.1 * np.abs(start).max())
        samples = {name: self.everywhere.take(sorted(chosen)) for name, chosen in self.chosen.items()}
        remembered: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

        def constraints(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            key = z.tobytes()
            if key not in remembered:
                remembered.clear()
                remembered[key] = self._constraints(z[:-1] * size, z[-1], size, samples)
            return remembered[key]

        first = np.r_[start / size, np.log(np.linalg.svd(np.tensordot(start, self.integral, 1))[1][-1])]
        span = 50.0 * reach
        bounds = [(v - span, v + span) for v in first[:-1]] + [(first[-1] - 5, first[-1] + 5 * reach)]
        down = np.r_[np.zeros(len(start)), -1.0]
        found = minimize(
            lambda z: -z[-1], first, jac=lambda z: down, method="SLSQP", bounds=bounds,
            constraints={"type": "ineq", "fun": lambda z: constraints(z)[0], "jac": lambda z: constraints(z)[1]},
            options={"maxiter": 60, "ftol": 1e-8},
        )  # fmt: skip
        return found.x[:-1] * size

    def _constraints(self, x, level: float, size, samples) -> tuple[np.ndarray, np.ndarray]:
        values, slopes = [], []
        for name, sample in samples.items():
            value, slope = log_peaks(sample, x, name)
            values.append(np.log(self.limits[name]) - value)
            slopes.append(np.hstack([-slope * size, np.zeros((len(value), 1))]))
        u, s, vh = np.linalg.svd(np.tensordot(x, self.integral, 1))
        rise = np.einsum("as,nab,sb->sn", u, self.integral, vh) / s[:, None]
        values.append(np.log(s) - level)
        slopes.append(np.hstack([rise * size, -np.ones((len(s), 1))]))
        return np.concatenate(values), np.vstack(slopes)


def log_peaks(sample: Sample, x: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray]:
    """log σ_max (k,) of S, T or Q at the sample's frequencies, and its gradient (k, gains)."""
    inverse = np.linalg.inv(sample.returned(x))
    H = sample.over(x)[name] @ inverse
    u, s, vh = np.linalg.svd(H)
    left, right = u[:, :, 0].conj(), np.einsum("kab,kb->ka", inverse, vh[:, 0].conj())
    slope = -np.einsum("ka,kab,kibc,kc->ki", left, H, sample.W, right, optimize=True)
    if name != "S":
        numerator = sample.W if name == "T" else sample.Q
        slope = slope + np.einsum("ka,kiab,kb->ki", left, numerator, right, optimize=True)
    return np.log(s[:, 0]), slope.real / s[:, :1]

"""What both tuners of a dead-time loop start from and what they end with: the problem, and the verified result.

minimise ‖(P(0) K_I)⁻¹‖ (the largest integrated error after a unit step of load at the plant's output, over directions)
subject to ‖S‖∞ ≤ S_max, ‖T‖∞ ≤ T_max, ‖Q‖∞ ≤ Q_max, over the gains of a law that is affine in them.

Source: Boyd, Hast & Åström, Int. J. Robust Nonlinear Control 26 (2016) 1718.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from workbench.convex.delayed import AffineLaw, DelayedPlant
from workbench.convex.delayed_loop import MEASURES, Sample, ceiling_holds, unstable_poles, worst_peaks
from workbench.errors import InputError
from workbench.result import Result, Row

START = 0.01  # integral gain of the start, times the inverse of P(0): slow enough for any plant of like time constants


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PidProblem(Result):
    """A plant, a law affine in its gains, and limits of S, T and Q.

    limits : some of "S", "T", "Q" to the largest singular value allowed at any frequency
    """

    name: str
    title: str
    plant: DelayedPlant
    law: AffineLaw
    limits: Mapping[str, float]
    sources: Mapping[str, str]

    def __post_init__(self) -> None:
        unknown = sorted(set(self.limits) - set(MEASURES))
        if unknown or not self.limits:
            raise InputError(f"limits must be of some of S, T, Q; got {', '.join(unknown) or 'none'}.")
        for name, limit in self.limits.items():
            if not 0 < limit < math.inf or (name == "S" and limit <= 1):
                raise InputError(
                    f"the limit of {name} must be positive and finite, and above 1 for S (S is 1 at high frequencies); "
                    f"got {limit!r}."
                )
        p, m = self.plant.shape
        if self.law.shape != (m, p):
            raise InputError(f"the law must have shape {(m, p)} for this plant; got {self.law.shape}.")
        smallest = float(np.linalg.svd(self.plant.static_gain(), compute_uv=False)[-1])
        if m < p or smallest < 1e-12:
            raise InputError(
                "integral action in every output needs at least as many inputs and P(0) of full row rank; "
                f"got {p} outputs, {m} inputs, smallest singular value {smallest:.2g}. Drop an output."
            )

        at_rest = {"T": 1.0, "Q": 1 / smallest}  # T(0) = I and P(0) Q(0) = I under integral action
        for name, least in at_rest.items():
            if self.limits.get(name, math.inf) <= least:
                raise InputError(
                    f"the limit of {name} must exceed {least:.4g}, which integral action asks for at rest; "
                    f"got {self.limits[name]:g}. Raise it."
                )

    def objective(self, x) -> float:
        """‖(P(0) K_I)⁻¹‖; infinity where P(0) K_I is singular."""
        M = self.plant.static_gain() @ np.tensordot(np.asarray(x, float), self.law.integral(), 1)
        smallest = float(np.linalg.svd(M, compute_uv=False)[-1])
        return 1 / smallest if smallest > 0 else math.inf

    def start(self) -> np.ndarray:
        """Gains of a small integral action along P(0)'s inverse, halved until the loop is stable and within its limits.

        With K = (ε/s) X and −P(0)X Hurwitz, every small enough ε > 0 is stable. Where the law lacks places, the
        least-squares fit of the inverse is taken.
        """
        P0, integral = self.plant.static_gain(), self.law.integral()
        columns = np.array([(P0 @ I).ravel() for I in integral]).T
        direction = np.linalg.lstsq(columns, np.eye(len(P0)).ravel(), rcond=None)[0]
        rates = np.linalg.eigvals(P0 @ np.tensordot(direction, integral, 1))
        if rates.real.min(initial=1.0) <= 1e-9:
            raise InputError(
                "integral action must be possible with the law's places: no gains were found for which every "
                "eigenvalue of P(0) K_I has a positive real part. Free more places of the integral gains."
            )
        x = START * direction
        for _ in range(20):
            if self.unstable_poles(x) == 0 and all(
                value < 0.99 * self.limits[name] for name, (value, _) in self.peaks(x).items() if name in self.limits
            ):
                return x
            x = x / 2
        raise InputError(
            f"the limits must leave room for slow integral action; got {dict(self.limits)}. Raise them, or free more "
            "places of the integral gains."
        )

    def peaks(self, x) -> dict[str, tuple[float, float]]:
        """Largest σ_max of S, T, Q and its frequency."""
        return worst_peaks(self.plant, self.law, np.asarray(x, float))

    def unstable_poles(self, x) -> int:
        """Number of closed-loop poles in the right half plane, dead times exact; −1 if undecided."""
        return unstable_poles(self.plant, self.law, np.asarray(x, float))

    def first_sample(self, count: int) -> Sample:
        """Frequencies for a tuner to start with."""
        rates = [abs(p) for t in self.law.terms for p in t.function.times_s().poles()]
        fastest = max([self.plant.fastest(), *rates])
        return Sample.of(self.plant, self.law, np.geomspace(self.plant.slowest() / 10, 10 * fastest, count))

    def rows(self) -> list[Row]:
        return [
            ("problem", self.name, ""), ("title", self.title, ""), *self.plant.rows(),
            ("gains", len(self.law.terms), ""),
            *((f"largest {name}", limit, "") for name, limit in self.limits.items()),
        ]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PidTuning(Result):
    """Gains, what they reach, and whether the limits were shown to hold at all frequencies."""

    gains: Mapping[str, float]
    objective: float
    peaks: Mapping[str, tuple[float, float]]  # value, frequency
    stable: bool  # by the count of turns with exact dead times
    within_limits: bool  # at every frequency, by bounds of the slopes between the points
    undecided: float | None  # where that could not be shown
    history: tuple[float, ...]  # objective after each step
    solves: int  # of convex problems, or rounds of the smooth solver
    frequencies: int  # used in the last
    seconds: float
    outcome: str

    def rows(self) -> list[Row]:
        return [
            ("objective", self.objective, ""),
            ("stable", self.stable, ""),
            ("within limits at all frequencies", self.within_limits, ""),
            *((f"largest {name}", value, "") for name, (value, _) in self.peaks.items()),
            ("steps", len(self.history) - 1, ""),
            ("seconds", self.seconds, "s"),
            *((name, value, "") for name, value in self.gains.items()),
        ]


def verified(problem: PidProblem, x: np.ndarray, *, history, solves: int, frequencies: int, seconds, outcome: str):
    """The result for gains, judged apart from whoever found them."""
    undecided = ceiling_holds(problem.plant, problem.law, x, dict(problem.limits))
    return PidTuning(
        gains=dict(zip(problem.law.names, map(float, x), strict=True)), objective=problem.objective(x),
        peaks=problem.peaks(x), stable=problem.unstable_poles(x) == 0, within_limits=undecided is None,
        undecided=undecided, history=tuple(history), solves=solves, frequencies=frequencies, seconds=seconds(),
        outcome=outcome,
    )  # fmt: skip

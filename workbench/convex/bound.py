"""What no linear controller can undercut: the Lagrangian dual of a design problem with mean-square limits.

    Problem --each group, currents free--> PreviewRegulator --maximised over multipliers λ ≥ 0--> LowerBound

For every λ ≥ 0 and every stabilising linear controller that keeps the limits, J ≥ J + Σ λ_i (g_i/limit_i − 1) ≥ the
least value of the right-hand side over all controllers, which the regulator knows. The controller may be of any order
and use every sensor of the law; its commands act without the current loop's lag. Limits that are not mean squares
(damping, margins, static errors) are left out, which lowers the bound. Gaps are those of the right-hand sets; for a
vehicle that is symmetric, controllers that are not gain nothing against limits on both sides.

With `noise`, sensor noise takes part on both sides: in the bound and in the cost it is compared with.

Source: Boyd & Barratt, Linear Controller Design (1991), ch. 14; guide, Definitions: Cost J.
"""

import contextlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, Protocol

import numpy as np

from workbench.analysis.analysis import COST_POINTS, COST_SCALE
from workbench.analysis.response import Driven, driven, random_loops, spectrum_of
from workbench.analysis.setting import Setting
from workbench.constants import GRAVITY
from workbench.control import Gains
from workbench.control.loop import Subject
from workbench.convex.preview import Cost, Measured, PreviewRegulator
from workbench.errors import InputError
from workbench.goals.ride.currents import MeanSquareCurrents
from workbench.goals.ride.requirement import Requirement
from workbench.lti import Plant
from workbench.lti.front import integrated
from workbench.lti.realisation import state_scale
from workbench.lti.signals import current_of
from workbench.lti.variance import stationary
from workbench.result import Result, Row

SMALLEST = 1e-10  # of a multiplier over the cost's size; below, a limit counts as inactive
ACTIVE = 1e-3  # a multiplier above this share of the bound makes its limit active


class MeanSquareProblem(Protocol):
    """What is read of a design problem: its surroundings, its limits (name and limit each), its approved gains."""

    @property
    def name(self) -> str: ...
    @property
    def setting(self) -> Setting: ...
    @property
    def requirements(self) -> tuple[Any, ...]: ...
    @property
    def gains(self) -> Gains | None: ...


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LowerBound(Result):
    """A cost that no linear controller within the mean-square limits can undercut.

    bound : of J;  cost : J of the problem's approved gains under the same noises, None without gains
    ratio : √(bound/cost), how near the gains are to the bound as an rms acceleration
    multipliers, usage : λ_i, and g_i/limit_i of the best controller at those λ (1 where a limit binds)
    achieved : g_i/limit_i of the approved gains under the same noises
    active : limits with a multiplier worth ACTIVE of the bound;  groups : each group's share of the Lagrangian
    """

    problem: str
    noise: bool
    bound: float
    cost: float | None
    ratio: float | None
    multipliers: Mapping[str, float]
    usage: Mapping[str, float]
    achieved: Mapping[str, float] | None
    active: tuple[str, ...]
    groups: Mapping[str, float]
    residual: float  # of the Riccati equations, relative
    evaluations: int
    seconds: float

    def rows(self) -> list[Row]:
        return [
            ("bound of J from below", self.bound, ""),
            ("J of the approved gains", self.cost, ""),
            ("√(bound/J)", self.ratio, ""),
            ("sensor noise", self.noise, ""),
            ("active limits", ", ".join(self.active) or "none", ""),
            *((f"multiplier of {name}", value, "") for name, value in self.multipliers.items()),
            *((f"usage of {name}", value, "") for name, value in self.usage.items()),
        ]


class Dual:
    """The Lagrangian's least value over all linear controllers, as a function of the multipliers."""

    def __init__(self, problem: MeanSquareProblem, *, noise: bool = True) -> None:
        setting = problem.setting
        if setting.motor is not None:
            raise InputError(
                f"a bound from below needs a vehicle controlled by its coils alone; {problem.name!r} has a motor, "
                "whose limit is not a mean square. Take it out of the control."
            )
        limited, self.limits = _limits(problem)
        self.names = tuple(r.name for r in limited)
        subjects = [s for s, _ in _open_loops(setting)]
        self.groups = tuple(s.name for s in subjects)
        self.regulators = [_regulator(setting, s, limited, noise) for s in subjects]

    def at(self, multipliers) -> tuple[float, np.ndarray, np.ndarray, float]:
        """Value, slopes by the multipliers, each group's part, and the worst Riccati residual."""
        weights = np.r_[1.0, np.asarray(multipliers, float) / self.limits]
        optima = [r.at(weights) for r in self.regulators]
        slopes = sum((o.slopes for o in optima), np.zeros(len(weights)))[1:] / self.limits - 1
        parts = np.array([o.value for o in optima])
        value = float(parts.sum() - np.sum(multipliers))
        return value, slopes, parts, max(o.residual for o in optima)


def lower_bound(problem: MeanSquareProblem, *, noise: bool = True, seconds: float = 60.0) -> LowerBound:
    """The best bound of J from below that duality gives, and how near the approved gains come to it.

    Parameters
    ----------
    problem : a design problem
        With a limit on the sum of mean square currents, without which control is free and the bound empty.
    noise : bool
        Whether the controller sees the sensors with their noise, or everything without.
    seconds : float
        Time after which the multipliers reached are taken; every multiplier gives a valid bound.

    Raises
    ------
    InputError
        If the problem has no current limit or a motor.
    """
    from scipy.optimize import minimize

    begin = perf_counter()
    dual = Dual(problem, noise=noise)
    cost, achieved = (None, None) if problem.gains is None else achieved_by(problem, problem.gains, noise=noise)
    size = 1.0 if cost is None else cost
    best: tuple[float, np.ndarray] = (-math.inf, np.full(len(dual.names), SMALLEST * size))
    count = 0

    def falling(theta: np.ndarray) -> tuple[float, np.ndarray]:
        nonlocal best, count
        multipliers = size * np.exp(theta)
        if perf_counter() - begin > seconds and count:
            raise TimeoutError
        value, slopes, _, _ = dual.at(multipliers)
        count += 1
        if value > best[0]:
            best = value, multipliers
        return -value / size, -slopes * multipliers / size

    bounds = [(math.log(SMALLEST), 10.0)] * len(dual.names)
    with contextlib.suppress(TimeoutError):  # the best multipliers so far are as valid as any
        minimize(falling, np.full(len(dual.names), -2.0), jac=True, method="L-BFGS-B", bounds=bounds,
                 options={"maxiter": 200, "ftol": 1e-10, "gtol": 1e-7})  # fmt: skip
    bound, multipliers = best
    _, slopes, parts, residual = dual.at(multipliers)
    return LowerBound(
        problem=problem.name, noise=noise, bound=bound, cost=cost,
        ratio=None if cost is None else math.sqrt(max(bound, 0.0) / cost),
        multipliers=dict(zip(dual.names, multipliers.tolist(), strict=True)),
        usage=dict(zip(dual.names, (slopes + 1).tolist(), strict=True)), achieved=achieved,
        active=tuple(n for n, m in zip(dual.names, multipliers, strict=True) if m > ACTIVE * abs(bound)),
        groups=dict(zip(dual.groups, parts.tolist(), strict=True)), residual=residual, evaluations=count,
        seconds=perf_counter() - begin,
    )  # fmt: skip


def achieved_by(problem: MeanSquareProblem, gains: Gains, *, noise: bool = True) -> tuple[float, dict[str, float]]:
    """J and every limited mean square over its limit, of given gains, with sensor noise if asked.

    Raises InputError if the gains do not stabilise.
    """
    setting = problem.setting
    limited, limits = _limits(problem)
    total = np.zeros(1 + len(limited))
    for subject, closed in random_loops(setting, gains):
        system = driven(setting, subject, closed)
        covariance = system.stationary().covariance.sum(axis=0)
        if noise:
            errors = closed.select(inputs=[f"error_{name}" for name in setting.law.sensors])
            if (errors.D[: len(subject.plant.outputs)]).any():
                raise InputError("white sensor noise needs a current-loop lag; without one the currents are infinite.")
            start = _filter_states(setting, system)
            B = np.zeros((len(system.A), errors.B.shape[1]))
            B[start : start + len(closed.A)] = errors.B * np.sqrt(_intensity(setting))
            covariance = covariance + stationary(system.A, B, correlation=np.eye(B.shape[1])).covariance[0]
        for k, rows in enumerate(_rows(setting, system, limited)):
            total[k] += float(np.einsum("qi,ij,qj->", rows, covariance, rows))
    return float(total[0]), dict(zip((r.name for r in limited), (total[1:] / limits).tolist(), strict=True))


def _limits(problem: MeanSquareProblem) -> tuple[tuple[Requirement, ...], np.ndarray]:
    """The requirements that a quadratic cost can express, and their mean-square limits."""
    found = [(r, r.mean_square(problem.setting)) for r in problem.requirements]
    kept = [(r, square[1]) for r, square in found if square is not None]
    if not any(isinstance(r, MeanSquareCurrents) for r, _ in kept):
        raise InputError(
            f"a bound from below needs a limit on the {MeanSquareCurrents.kind!r}, without which control costs "
            f"nothing; problem {problem.name!r} has none. Add it to the requirements."
        )
    return tuple(r for r, _ in kept), np.array([limit for _, limit in kept])


def _intensity(setting: Setting) -> np.ndarray:
    """Two-sided intensity of each sensor's noise: half the square of its one-sided density."""
    gap, acceleration = setting.sensor_noise
    return np.repeat([gap, gap, acceleration, acceleration], setting.law.count) ** 2 / 2


def _open_loops(setting: Setting) -> list[tuple[Subject, Plant]]:
    """The groups, or the whole vehicle where types are correlated, with their currents as states."""
    from workbench.control.loop import subject as subject_of

    subjects = setting.subjects
    if setting.guideway.correlation is not None and len(subjects) > 1:
        subjects = (subject_of(setting.plant, setting.law, "all"),)
    return [(s, _with_current_states(s)) for s in subjects]


def _current_states(subject: Subject) -> list[str]:
    """The plant's states that are currents, if its current loop has a lag."""
    alone = {current_of(name) for name in subject.commands} | set(subject.law.currents)
    return [name for name in subject.plant.states if name in alone]


def _with_current_states(subject: Subject) -> Plant:
    """The plant itself, or without a lag the plant with integrators before the commands: the currents are free then."""
    plant = subject.plant
    if _current_states(subject):
        return plant
    return integrated(plant, subject.commands, tuple(map(current_of, subject.commands)))


def _filter_states(setting: Setting, system: Driven) -> int:
    """How many states of the driven system belong to the guideway's filters, which come first."""
    kinds = setting.types if setting.guideway.correlation is not None else system.types
    filters = [np.atleast_2d(spectrum_of(setting, t).shaping_filter(setting.speed)[0]) for t in kinds]
    return len(system.arrivals) * sum(map(len, filters))


def _rows(setting: Setting, system: Driven, limited: Sequence[Requirement]) -> list[np.ndarray]:
    """Rows of each quadratic cost over the driven system's states: J first, then the limits'."""
    felt = [row for (_, point), row in system.weighted.items() if point in COST_POINTS]
    out = [np.array(felt).reshape(-1, len(system.A)) * math.sqrt(COST_SCALE) / GRAVITY]
    return out + [system.rows(square[0]) for r in limited if (square := r.mean_square(setting)) is not None]


def _regulator(setting: Setting, subject: Subject, limited: Sequence[Requirement], noise: bool) -> PreviewRegulator:
    """The group with its currents as the control: the lagged currents' states taken out and put in as inputs."""
    plant = _with_current_states(subject)
    system = driven(setting, subject, plant)
    start = _filter_states(setting, system)
    free = [start + i for i, name in enumerate(plant.states) if name in set(_current_states(subject)) or name not in
            subject.plant.states]  # fmt: skip
    rest = [i for i in range(len(system.A)) if i not in set(free)]
    costs = [Cost(rows[:, rest], rows[:, free]) for rows in _rows(setting, system, limited)]
    measured = None
    if noise:
        states = start + len(plant.states) - len(free)
        seen = system.rows(setting.law.sensors)[:, rest[:states]]
        reads = np.abs(seen).max(axis=1) > 0
        measured = Measured(states=states, C=seen[reads], intensity=_intensity(setting)[reads])
    (_, front), *later = system.arrivals
    if len(later) > 1:
        raise InputError(
            f"a bound takes coil sets at one or two stations along the vehicle; got {1 + len(later)}. "
            "Group them in two."
        )
    delay, rear = later[0] if later else (0.0, np.zeros_like(front))
    size = state_scale(system.A[np.ix_(rest, rest)])
    A = system.A[np.ix_(rest, rest)] / size[:, None] * size
    costs = [Cost(c.C * size, c.D) for c in costs]
    if measured is not None:
        measured = replace(measured, C=measured.C * size[: measured.states])
    return PreviewRegulator(
        A, system.A[np.ix_(rest, free)] / size[:, None], front[rest] / size[:, None],
        rear[rest] / size[:, None], delay, costs, measured,
    )  # fmt: skip

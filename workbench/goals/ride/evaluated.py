"""What the rows of all requirements share at one set of the seventeen parameters: each computed once, when asked for.

theta --> responses, mean squares (always) | poles, static errors, sensor noise (when a requirement asks)
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from workbench.analysis.loop_rows import ReserveAt
from workbench.analysis.nonlinear_ride import BentLoop
from workbench.analysis.reserve_loops import ReserveLoops
from workbench.analysis.setting import Setting
from workbench.control import GAIN_NAMES, Gains
from workbench.control.loop import Subject


@dataclass(frozen=True, slots=True)
class Values:
    """Values (k,) with their Jacobian (k, 17)."""

    value: np.ndarray
    gradient: np.ndarray


@dataclass(frozen=True, slots=True)
class Responses:
    """What the frequency responses of a group give at one theta.

    mean : mean squares of the classes;  peak : σ_max(S)² at every node
    densities : unweighted acceleration densities [(m/s²)²/Hz] at every node, by class
    """

    mean: Values
    peak: Values
    densities: Mapping[str, Values]


class Group(Protocol):
    """The smooth measures of one group of motion."""

    subject: Subject
    size: int  # states of the closed loop
    omega: np.ndarray  # [rad/s] nodes of the quadrature

    @property
    def nodes(self) -> np.ndarray:
        """Those, then the frequencies [rad/s] watched besides."""
        ...

    def eigenvalues(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]: ...

    def delayed_damping(self, theta: np.ndarray, dead_time: float, count: int) -> Values: ...

    def noise(self, theta: np.ndarray, outputs: Sequence[str]) -> Values: ...


@dataclass(frozen=True)
class Evaluated:
    """One point of a search.

    back_off : relative distance kept from every limit;  responses : of each group
    squares, slopes : mean squares over all groups by class, and their derivatives (17,)
    static_function : theta -> (gaps,), (gaps, 17), as of `design.measures.static_error_function`
    kept : what is made once for all points of a search
    """

    setting: Setting
    groups: Sequence[Group]
    theta: np.ndarray
    back_off: float
    responses: Sequence[Responses]
    squares: Mapping[str, float]
    slopes: Mapping[str, np.ndarray]
    static_function: Callable
    kept: dict[str, ReserveLoops] = field(default_factory=dict)

    @cached_property
    def reserve(self) -> ReserveAt:
        """The loops beside the nominal one, and the break points."""
        if not self.kept:
            self.kept["reserve"] = ReserveLoops(self.setting)
        return ReserveAt(self.kept["reserve"], self.theta)

    @cached_property
    def bent(self) -> BentLoop:
        """The ride with forces that bend."""
        return BentLoop(self.setting, Gains(**dict(zip(GAIN_NAMES, self.theta.tolist(), strict=True))))

    @cached_property
    def poles(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Upper eigenvalues of each group and their derivatives (k, 17)."""
        out = []
        for group in self.groups:
            values, slopes = group.eigenvalues(self.theta)
            upper = np.flatnonzero(values.imag >= 0)
            out.append((values[upper], slopes[upper]))
        return out

    @cached_property
    def static(self) -> dict[str, Values]:
        """Static change of each right-hand set's gap from accelerometer bias, by kind."""
        value, slope = (m.copy() for m in self.static_function(self.theta))
        kinds = gap_rows(self.setting)
        parts = [np.split(m, len(kinds)) for m in (value.ravel(), slope)]
        return {kind: Values(v, d) for kind, v, d in zip(kinds, *parts, strict=True)}

    def noise(self, kind: str) -> tuple[float, np.ndarray]:
        """Mean square of the worst set's gap under sensor noise, and its derivative (17,)."""
        parts = [group.noise(self.theta, gap_rows(self.setting)[kind]) for group in self.groups]
        value, slope = (np.sum([getattr(p, k) for p in parts], axis=0) for k in ("value", "gradient"))
        worst = int(np.argmax(value))
        return float(value[worst]), slope[worst]


SLOWEST = 4  # eigenvalues per group whose damping and decay are constrained: the others are far from the limits


def count(group: Group) -> int:
    """Eigenvalues of a group that get a row: there are at least so many upper ones, however many are real."""
    return min(SLOWEST, (group.size + 1) // 2)


def gap_rows(setting: Setting) -> dict[str, tuple[str, ...]]:
    """Outputs "gap_…" and "gap_lateral_…" of the right-hand sets; those on the left move as much."""
    right = [i + 1 for i, (_, y) in enumerate(setting.law.positions) if y > 0]
    return {kind: tuple(f"{kind}_{i}" for i in right) for kind in ("gap", "gap_lateral")}

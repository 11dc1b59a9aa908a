"""Where the poles may lie: decay, damping, natural frequency; of the closed loop or of the controller itself.

    A --eigenvalues--> λ --three measures, below 1 inside the region--> the largest, gradient by eigenvectors
      --Lyapunov-----> a level at which the region, a little widened, is proved to hold every pole

All three stay finite for an unstable loop, so they can lead into the region from anywhere. In discrete time they speak
of s = log(z)/h. The proof: A + αI, e^{jθ}A and A/R are stable exactly if the poles lie left of −α, inside the
sector, inside the circle; and a positive definite P with MᴴP + PM < 0 proves a matrix M stable.
"""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from workbench.control.structure.modes import Modes, eigenvalues
from workbench.errors import InputError
from workbench.goals.goal import FULL_BAND, Goal
from workbench.goals.key import HERTZ, Key
from workbench.goals.limit import checked_limit
from workbench.goals.measure import NEAR, Asked, Bound, Value, infinite, near
from workbench.goals.promise import Promise
from workbench.goals.registry import register
from workbench.goals.roots import COUNTED, check_focus, root_limits
from workbench.goals.verdict import Verdict
from workbench.lti.realisation import state_scale

if TYPE_CHECKING:
    from workbench.control.structure.block import Controller

FIRST_SLACK, LAST_SLACK = 1e-9, 1e-2  # of a region's level, between which a Lyapunov proof is tried
VANISHED = 1e-30  # |z| of a pole so fast that log z says nothing


@dataclass(frozen=True, slots=True, kw_only=True)
class _Limited(Goal):
    """Limits on poles, at least one of the three."""

    keys = (Key("decay_per_s", "decay"), Key("damping"), Key("frequency_hz", "frequency", HERTZ))

    decay: float | None = None
    damping: float | None = None
    frequency: float | None = None

    def __post_init__(self) -> None:
        Goal.__post_init__(self)
        if self.decay is None and self.damping is None and self.frequency is None:
            raise InputError(
                f"{self.name} must set decay, damping or frequency; got none of them. Give at least one limit."
            )
        if self.decay is not None and not 0 <= self.decay < math.inf:
            raise InputError(f"decay must be zero or more; got {self.decay!r} 1/s. A pole at −3 has the decay 3.")
        if self.damping is not None and not 0 < self.damping <= 1:
            raise InputError(
                f"damping must lie between 0 and 1, above 0; got {self.damping!r}. For stability set decay=0."
            )
        if self.frequency is not None and not 0 < self.frequency < math.inf:
            raise InputError(
                f"frequency must be positive and finite; got {self.frequency!r} rad/s. Leave it out for no limit."
            )

    @property
    def region(self) -> "Region":
        """Where the poles may lie."""
        return Region(self.decay, self.damping, self.frequency, self.focus)

    def asked(self) -> Asked:
        """The one limit in its own unit; several are normalised, since the largest of them counts."""
        decay, damping, frequency = self.decay, self.damping, self.frequency
        if sum(limit is not None for limit in (decay, damping, frequency)) > 1:
            return Asked()
        if decay is not None:
            return Asked(">=", decay, "1/s", lambda v: decay - (v - 1) * (decay or 1.0))
        if damping is not None:
            return Asked(">=", damping, "1", lambda v: damping * (2 - v))
        return Asked("<=", frequency or 1.0, "rad/s", lambda v: v * (frequency or 1.0))

    def with_limit(self, limit: float) -> Self:
        """Of the one that is set; raises InputError for several."""
        given = [key for key in ("decay", "damping", "frequency") if getattr(self, key) is not None]
        if len(given) > 1:
            raise InputError(
                f"{self.name!r} sets {' and '.join(given)} together; a sweep changes one limit. Make two goals of it."
            )
        return replace(self, **{given[0]: checked_limit(self.name, limit)})


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class Poles(_Limited):
    """Closed-loop poles decay fast enough, are damped well enough and are not too fast.

    Parameters
    ----------
    decay : float
        −Re λ at least this [1/s]; measure 1 + (decay + Re λ)/decay, with 1 1/s in the denominator for decay 0.
    damping : float
        −Re λ/|λ| at least this, 0 … 1; measure 2 − ζ/damping.
    frequency : float
        |λ| at most this [rad/s]; measure |λ|/frequency.
    focus : (low, high)
        Only poles whose |λ| lies in this band count.

    At least one of the three must be given.
    """

    kind = "poles"

    def promise(self, verdict: Verdict) -> tuple[Promise, ...]:
        """Every limit that is set, where they are met."""
        limits = (("decay rate", ">=", self.decay), ("damping ratio", ">=", self.damping),
                  ("pole frequency", "<=", self.frequency))  # fmt: skip
        return tuple(self.promised(word, sense, x) for word, sense, x in limits if x is not None and verdict.met)

    def bind(self, loop: Any) -> Bound:
        """The goal on the closed loop with `openings` open."""
        channel = loop.channel((), (), self.openings)
        if channel.delayed:
            start = loop.structure.controller()
            check_focus(self.region, channel.lined(start), channel.late(start))
        return Bound(self, PoleMeasure(self.region, channel))


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerPoles(_Limited):
    """The same three limits on the poles of the controller; a controller without states meets them."""

    kind = "controller_poles"

    def bind(self, loop: Any) -> Bound:
        """The goal on the controller alone; the loop gives the sample time."""
        return Bound(self, PoleMeasure(self.region, _Itself(loop.sample_time)))


@dataclass(frozen=True, slots=True)
class Region:
    """Limits on poles, in the s plane."""

    decay: float | None
    damping: float | None
    frequency: float | None
    focus: tuple[float, float]

    def measures(self, s: np.ndarray) -> list[tuple[str, np.ndarray, np.ndarray]]:
        """(what, measure (n,), ∂/∂Re s + j ∂/∂Im s (n,)) of every limit that is set."""
        found = []
        size = np.maximum(np.abs(s), VANISHED)
        if self.decay is not None:
            scale = self.decay or 1.0
            found.append(("decay", 1 + (self.decay + s.real) / scale, np.full(len(s), 1 / scale, complex)))
        if self.damping is not None:
            slope = (s.imag**2 - 1j * s.real * s.imag) / size**3
            found.append(("damping", 2 + s.real / size / self.damping, slope / self.damping))
        if self.frequency is not None:
            found.append(("frequency", size / self.frequency, s / size / self.frequency))
        return found


@dataclass(frozen=True, slots=True)
class _Itself:
    """A controller seen as the system whose poles are asked for."""

    sample_time: float | None
    delayed: bool = False

    def system(self, K: "Controller") -> tuple[np.ndarray, ...]:
        return K.A, K.B, K.C, K.D

    def modes(self, K: "Controller") -> Modes:
        rest = {name: np.zeros_like(getattr(K, name)) for name in "BCD"}
        return eigenvalues(K.A, lambda GA: replace(K, A=GA, **rest))


@dataclass(frozen=True, slots=True)
class PoleMeasure:
    """The largest measure of a region over the poles of a channel's system."""

    region: Region
    channel: Any

    def evaluate(self, K: "Controller") -> Value:
        """Eigenvalues, or located roots with dead time; the gradient of every one near the largest measure."""
        try:
            poles, pull = self.channel.modes(K)
        except InputError as error:  # an algebraic loop without solution
            return infinite(str(error))
        if not np.isfinite(poles).all():
            return infinite("the closed loop's matrices overflow.")
        s, dsdz = self._plane(poles)
        keep = np.flatnonzero(self._counted(s) & (poles.imag >= 0))
        if len(keep) == 0:
            return _no_poles()
        candidates = []
        for what, measure, slope in self.region.measures(s[keep]):
            candidates += [(float(measure[i]), what, int(k), slope[i]) for i, k in enumerate(keep)]
        top = max(candidates, key=lambda item: item[0])
        near_top = [item for item in candidates if item[0] >= top[0] - NEAR * max(abs(top[0]), NEAR)]
        pieces = [(value, pull(k, np.conj(slope) * dsdz[k])) for value, _, k, slope in near_top]
        return self._value(top[0], top[1], s[top[2]], gradients=near(pieces), method="eigenvalues")

    def exact(self, K: "Controller") -> Value:
        """Eigenvalues of the balanced matrix, then a Lyapunov proof of the region slightly widened; roots counted."""
        if self.channel.delayed:
            return self._late(K)
        try:
            A = self.channel.system(K)[0]
        except InputError as error:
            return infinite(str(error))
        if len(A) == 0:
            return _no_poles()
        if not np.isfinite(A).all():
            return infinite("the closed loop's matrices overflow.")
        scale = state_scale(A)
        A = A / scale[:, None] * scale
        s, _ = self._plane(np.linalg.eigvals(A))
        s = s[self._counted(s)]
        if len(s) == 0:
            return _no_poles()
        found = [(what, measure, s[int(np.argmax(measure))]) for what, measure, _ in self.region.measures(s)]
        uppers, proved = [], True
        for what, measure, _ in found:
            upper = self._proved_level(A, what, float(np.max(measure)))
            proved = proved and upper is not None
            uppers.append(float(np.max(measure)) if upper is None else upper)
        what, measure, pole = max(found, key=lambda item: float(np.max(item[1])))
        method = "eigenvalues in balanced units" + (", proved by Lyapunov matrices" if proved else ", not proved")
        return self._value(float(np.max(measure)), what, pole, method=method, upper=max(uppers))

    def _late(self, K: "Controller") -> Value:
        """Characteristic roots, located and counted (`goal_roots`)."""
        try:
            found = root_limits(self.region, self.channel.lined(K), self.channel.late(K))
        except InputError as error:
            return infinite(str(error), method=COUNTED)
        if not found:
            return replace(_no_poles(), method=COUNTED)
        worst = max(found, key=lambda limit: limit.value)
        upper = max(limit.upper for limit in found)
        return self._value(worst.value, worst.what, worst.pole, method=COUNTED, upper=upper)

    def _value(self, value: float, what: str, pole: complex, **rest) -> Value:
        where = f"{what} of pole {pole.real:.4g} ± {abs(pole.imag):.4g}j 1/s"
        return Value(value=value, frequency=float(abs(pole)), channel=where, **rest)

    def _plane(self, poles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The poles in the s plane, and ds/dz."""
        h = self.channel.sample_time
        if h is None:
            return poles, np.ones(len(poles), complex)
        z = np.where(np.abs(poles) < VANISHED, VANISHED, poles).astype(complex)
        return np.log(z) / h, 1 / (z * h)

    def _counted(self, s: np.ndarray) -> np.ndarray:
        low, high = self.region.focus
        return (np.abs(s) >= low) & (np.abs(s) <= high)

    def _proved_level(self, A: np.ndarray, what: str, value: float) -> float | None:
        """A level a little above `value` that a Lyapunov matrix proves, or None."""
        if self.region.focus != FULL_BAND:
            return None
        if what == "damping" and value <= 2 - 1 / (self.region.damping or 1.0):  # every pole real: no sector is wider
            matrix = self._stable_if_met(A, "decay", 1.0)
            return value if matrix is not None and proved_stable(matrix) else None
        slack = FIRST_SLACK
        while slack <= LAST_SLACK:
            level = value + slack * max(1.0, abs(value))
            matrix = self._stable_if_met(A, what, level)
            if matrix is not None and proved_stable(matrix):
                return level
            slack *= 10
        return None

    def _stable_if_met(self, A: np.ndarray, what: str, level: float) -> np.ndarray | None:
        """A matrix that is stable exactly if the limit's measure is below a level everywhere; None if there is none."""
        limit, h, eye = self.region, self.channel.sample_time, np.eye(len(A))
        if what == "decay":
            least = (1 - level) * (limit.decay or 1.0) + (limit.decay or 0.0)
            return A + least * eye if h is None else _cayley(A * math.exp(least * h))
        if h is not None:
            return None
        if what == "frequency":
            return _cayley(A / (level * (limit.frequency or 1.0)))
        zeta = (2 - level) * (limit.damping or 1.0)
        if not -1 < zeta < 1:
            return None
        return np.exp(1j * math.asin(zeta)) * A


def _no_poles() -> Value:
    return Value(value=0.0, reason="no pole lies in the focus region; the goal is met.", method="eigenvalues")


def _cayley(A: np.ndarray) -> np.ndarray | None:
    """A matrix stable in continuous time exactly if A is in discrete time: (A − I)(A + I)⁻¹."""
    closing = A + np.eye(len(A))
    if np.linalg.cond(closing) > 1e12:  # twelve of sixteen digits lost: a pole at −1, outside anyway
        return None
    return np.linalg.solve(closing.T, (A - np.eye(len(A))).T).T


def proved_stable(M: np.ndarray) -> bool:
    """Whether a Lyapunov matrix proves all eigenvalues of M in the open left half plane.

    P from MᴴP + PM = −I; accepted if its residual is below one half, so that MᴴP + PM ≤ −I/2, and P has a Cholesky
    factor. Floating point: proved up to the rounding of these two checks.
    """
    from scipy.linalg import solve_continuous_lyapunov

    try:
        P: np.ndarray = solve_continuous_lyapunov(M.conj().T, -np.eye(len(M), dtype=M.dtype))
        P = (P + P.conj().T) / 2
        residual = np.linalg.norm(M.conj().T @ P + P @ M + np.eye(len(M)))
        np.linalg.cholesky(P)
    except (np.linalg.LinAlgError, ValueError):
        return False
    return bool(residual < 0.5)

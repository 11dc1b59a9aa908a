"""What a feedback loop should do at its points: sensitivity, rejection of disturbances, loop gain and its shape.

    S = (I + L)⁻¹ at the points --GainShape--> Sensitivity  sup σ_max(S)/limit       Rejection  sup σ_max(S)·attenuation
                                --LoopGainShape--> MinLoopGain  sup profile/σ_min(L)   MaxLoopGain  sup σ_max(L)/profile

Everything is read from the stable S alone: L = S⁻¹ − I and L⁻¹ = (I − S)⁻¹ − I, so integrators and unstable plants are
no special case, and an unstable loop has no value. A minimum loop gain is asked for where its profile is above 1, a
maximum where it is below: near the crossover margins decide.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from workbench.errors import InputError
from workbench.goals.gain import GainShape
from workbench.goals.goal import positive
from workbench.goals.key import HERTZ, Key, magnitude
from workbench.goals.measure import NEAR, Asked, Largest, Measure, constant_limit
from workbench.goals.peak import Axis, PeakMeasure, Piece
from workbench.goals.promise import Promise, kept_limit
from workbench.goals.registry import register
from workbench.goals.signals import PointGoal
from workbench.goals.verdict import Verdict
from workbench.lti.end import first_terms, limit, size_at_end
from workbench.lti.peak_ceiling import Ceiling, enclosure, loop_ceiling
from workbench.lti.realisation import Realisation
from workbench.lti.weight import Profile, ProfileLike, profile_of


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class Sensitivity(PointGoal):
    """The sensitivity at points stays below a limit: sup σ_max(S)/|limit|.

    points : names; limit : number above 0, scalar transfer function or breakpoints {ω: magnitude}.
    """

    kind, proof = "sensitivity", "peak sensitivity"
    keys = magnitude("limit")

    limit: ProfileLike = 2.0

    def check_fields(self) -> None:
        profile_of("limit", self.limit)

    def asked(self) -> Asked:
        return constant_limit(self.limit)

    def measure(self, channel: Any) -> Measure:
        return PeakMeasure(channel, GainShape.of(channel, profile=profile_of("limit", self.limit)), self.focus)


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class Rejection(PointGoal):
    """Disturbances at points are attenuated by at least a factor: sup σ_max(S)·|attenuation|.

    points : names; attenuation : number, scalar transfer function or breakpoints {ω: factor}. A number asks for it at
    every frequency, where no loop can be above 1 for ever: give a focus band or a profile.
    """

    kind = "rejection"
    keys = magnitude("attenuation")
    scales = (("attenuation", -1),)

    attenuation: ProfileLike

    def check_fields(self) -> None:
        profile_of("attenuation", self.attenuation)

    def measure(self, channel: Any) -> Measure:
        shape = GainShape.of(channel, profile=profile_of("attenuation", self.attenuation), power=1)
        return PeakMeasure(channel, shape, self.focus)

    def promise(self, verdict: Verdict) -> Promise | None:
        """Of a constant attenuation the peak sensitivity in the band."""
        factor, reached = profile_of("attenuation", self.attenuation).constant, verdict.upper or verdict.value
        if not factor or reached is None:
            return None
        limit = kept_limit(1 / factor, reached / factor, "<=")
        return None if limit is None else self.promised(Sensitivity.proof, "<=", limit)


@dataclass(frozen=True, slots=True, kw_only=True)
class _LoopGain(PointGoal):
    """A loop gain against a profile, from the side that `power` says."""

    keys = magnitude("profile")
    power: ClassVar[int]

    profile: ProfileLike

    def check_fields(self) -> None:
        profile_of("profile", self.profile)

    def measure(self, channel: Any) -> Measure:
        shape = LoopGainShape(profile_of("profile", self.profile), self.power, 1.0, self.points)
        return PeakMeasure(channel, shape, self.focus)


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class MinLoopGain(_LoopGain):
    """σ_min(L) is at least a profile wherever the profile is above 1: sup |profile|/σ_min(L)."""

    kind, power, scales = "min_loop_gain", 1, (("profile", -1),)


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class MaxLoopGain(_LoopGain):
    """σ_max(L) is at most a profile wherever the profile is below 1: sup σ_max(L)/|profile|."""

    kind, power, scales = "max_loop_gain", -1, (("profile", 1),)


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class LoopShape(PointGoal):
    """The loop gain follows a target: at least target/δ where that is above 1, at most target·δ where that is below 1.

    Parameters
    ----------
    points : names
    target : scalar transfer function or breakpoints, optional
    crossover : float, optional
        [rad/s]; instead of a target: ω_c/s.
    tolerance_db : float
        20 log10 δ.

    Between the two, around the crossover, the gain is free; the value says how far outside it is, as a factor.
    """

    kind = "loop_shape"
    keys = (*magnitude("target"), Key("crossover_hz", "crossover", HERTZ), Key("tolerance_db"))
    sizes = (("tolerance_db", "dB"),)

    target: ProfileLike = None
    crossover: float | None = None
    tolerance_db: float = 6.0

    def check_fields(self) -> None:
        if (self.target is None) == (self.crossover is None):
            raise InputError(
                f"LoopShape needs a target or a crossover, not both; got {self.target!r}, {self.crossover!r}."
            )
        self._wanted()

    def measure(self, channel: Any) -> Measure:
        delta, target = 10 ** (self.tolerance_db / 20), self._wanted()
        shapes = [LoopGainShape(target, power, delta ** float(-power), self.points) for power in (1, -1)]
        return Largest(tuple(PeakMeasure(channel, shape, self.focus) for shape in shapes))

    def _wanted(self) -> Profile:
        if self.crossover is None:
            return profile_of("target", self.target)
        return profile_of("target", ([positive("crossover", self.crossover, "rad/s")], [1.0, 0.0]))


@dataclass(frozen=True, slots=True, eq=False)
class LoopGainShape:
    """p/σ_min(L) where p > 1 (power +1), σ_max(L)/p where p < 1 (power −1), p = scale·profile; 0 elsewhere."""

    profile: Profile
    power: int
    scale: float
    names: tuple[str, ...]

    def size(self, axis: Axis, T: np.ndarray) -> np.ndarray:
        """(k,); T is the sensitivity."""
        factor = self._factor(axis)
        asked = np.flatnonzero(factor != 0)
        sizes = np.zeros(len(T))
        sizes[asked] = [self._size_one(S) for S in T[asked]] if T.shape[1] > 1 else self._scalar(T[asked, 0, 0])
        with np.errstate(invalid="ignore"):
            return np.where(factor == 0, 0.0, sizes * factor)

    def pieces(self, axis: Axis, T: np.ndarray) -> list[Piece]:
        """Singular values of L⁻¹ or L near the largest; ∂(I − S)⁻¹ = (I − S)⁻¹ ∂S (I − S)⁻¹, ∂S⁻¹ = −S⁻¹ ∂S S⁻¹."""
        S, factor = T[0], float(self._factor(axis)[0])
        X = self._loop(S)
        if X is None or not factor > 0:
            return []
        outer = (X + np.eye(len(S))).conj().T  # ((I − S)⁻¹)ᴴ or (S⁻¹)ᴴ
        u, sizes, v = np.linalg.svd(X)
        found = []
        for k, size in enumerate(sizes):
            if size < sizes[0] * (1 - NEAR):
                break
            W = self.power * factor * outer @ np.outer(u[:, k], v[k]) @ outer
            found.append((float(size) * factor, W, self.names[int(np.argmax(np.abs(v[k])))]))
        return found

    def system(self, T: Realisation, sampled: bool) -> Realisation | None:
        """None: the inverse of S or I − S is improper."""
        return None

    def ends(self, T: Realisation, sampled: bool) -> tuple[float, float]:
        """Limits at ω = 0 and ∞ where the profile asks for infinitely much or for nothing at all.

        With V = S or I − S it is V (I − V)⁻¹ that is measured, so where V vanishes its own first term.
        """
        found = [math.nan, math.nan]
        V = T if self.power > 0 else Realisation(T.A, T.B, -T.C, np.eye(len(T.D)) - T.D)
        for k, far in enumerate((False, True)):
            power, size = self.profile.end(far=far)
            asked = (power > 0) == far if self.power > 0 else (power > 0) != far
            if power and asked and not (far and sampled):
                weight = (size * self.scale) ** float(self.power)
                found[k] = size_at_end(limit(*first_terms(V, far=far), power * self.power, weight, far=far))
        if math.isnan(found[0]) and len(T.D) == 1 and self._wanted(np.zeros(1))[0]:
            rest = Realisation(V.A, V.B, -V.C, np.eye(1) - V.D)  # I − V: where it vanishes V (I − V)⁻¹ is infinite
            powers, _ = first_terms(rest, far=False)
            found[0] = math.inf if powers[0, 0] > 0 else math.nan
        return found[0], found[1]

    def ceiling(self, T: Realisation, late: np.ndarray, end: float | None) -> Ceiling:
        """Bounds on intervals."""
        return loop_ceiling(enclosure(T, late), self.profile, self.power, self.scale, end)

    def corners(self) -> np.ndarray:
        """Of the profile, and where it passes 1."""
        corners = self.profile.corners()
        corners = corners[(corners > 0) & np.isfinite(corners)]
        middle = corners if len(corners) else np.ones(1)
        grid = np.geomspace(middle.min() / 1e4, middle.max() * 1e4, 801)
        above = self.profile.magnitude(grid) * self.scale > 1
        ends = np.flatnonzero(above[1:] != above[:-1])
        return np.concatenate([corners, *([self._passing(grid[i], grid[i + 1])] for i in ends)])

    def refusal(self, T: Realisation) -> str:
        """A stable loop always has a gain."""
        return ""

    def _passing(self, low: float, high: float) -> float:
        """The frequency on the asked-for side where scale·profile passes 1."""
        asked = self._wanted(np.array([low]))[0]
        for _ in range(60):
            middle = math.sqrt(low * high)
            if self._wanted(np.array([middle]))[0] == asked:
                low = middle
            else:
                high = middle
        return low if asked else high

    def _wanted(self, omega: np.ndarray) -> np.ndarray:
        size = self.profile.magnitude(omega) * self.scale
        return size > 1 if self.power > 0 else size < 1

    def _factor(self, axis: Axis) -> np.ndarray:
        """Zero where nothing is asked, not a number where infinitely much is: there `ends` has the limit."""
        size = self.profile.magnitude(axis.omega) * self.scale
        with np.errstate(divide="ignore"):
            factor = size ** float(self.power)
        return np.where(self._wanted(axis.omega), np.where(np.isfinite(factor), factor, math.nan), 0.0)

    def _scalar(self, S: np.ndarray) -> np.ndarray:
        """|L⁻¹| or |L| (k,) of a single point."""
        with np.errstate(divide="ignore", invalid="ignore"):
            sizes = np.abs(S / (1 - S) if self.power > 0 else (1 - S) / S)
        return np.where(np.isnan(sizes), math.inf, sizes)

    def _size_one(self, S: np.ndarray) -> float:
        X = self._loop(S)
        return math.inf if X is None else float(np.linalg.norm(X, 2))

    def _loop(self, S: np.ndarray) -> np.ndarray | None:
        """L⁻¹ or L; None where it is infinite."""
        eye = np.eye(len(S))
        try:
            X = np.linalg.inv(eye - S if self.power > 0 else S) - eye
        except np.linalg.LinAlgError:
            return None
        return X if np.isfinite(X).all() else None

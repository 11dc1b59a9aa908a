"""Limits on the gain of a channel over frequency: the H∞ norm, weighted, against a profile, or of a tracking error.

    σ_max( L(jω) (T(jω) − R(jω)) W(jω) ) / |limit(jω)|  below 1 at every frequency of the focus band

`GainShape` is that expression for any filters L and W, reference R and profile; most goals about frequency use it.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.errors import InputError
from workbench.goals.key import Key, magnitude, weight
from workbench.goals.measure import NEAR, Asked, Measure, constant_limit
from workbench.goals.peak import Axis, PeakMeasure, Piece
from workbench.goals.registry import register
from workbench.goals.signals import ChannelGoal, check_scale, check_weights
from workbench.lti.end import first_terms, limit, over_steep, size_at_end
from workbench.lti.join import difference, series
from workbench.lti.peak_ceiling import Ceiling, enclosure, gain_ceiling
from workbench.lti.realisation import Realisation, spectral
from workbench.lti.weight import Filter, Profile, ProfileLike, WeightLike, filter_of, profile_of


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class Gain(ChannelGoal):
    """The largest gain from inputs to outputs stays below a limit: value = sup σ_max(T)/|limit|.

    Parameters
    ----------
    inputs, outputs : names
    limit : float, scalar transfer function or breakpoints {ω: magnitude}
        In units of the outputs per unit of the inputs.
    """

    kind, proof = "gain", "peak gain"
    keys = magnitude("limit")

    limit: ProfileLike = 1.0

    def check_fields(self) -> None:
        profile_of("limit", self.limit)

    def asked(self) -> Asked:
        return constant_limit(self.limit)

    def measure(self, channel: Any) -> Measure:
        return PeakMeasure(channel, GainShape.of(channel, profile=profile_of("limit", self.limit)), self.focus)


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class WeightedGain(ChannelGoal):
    """sup σ_max(L T W) with filters L after the outputs (`left`) and W before the inputs (`right`).

    Parameters
    ----------
    inputs, outputs : names
    left, right : number, matrix, Plant, python-control system or (numerator, denominator)
        Stable; scalar ones apply to every signal.
    """

    kind = "weighted_gain"
    keys = (*weight("left"), *weight("right"))
    scales = (("left", -1),)

    left: WeightLike = 1.0
    right: WeightLike = 1.0

    def check_fields(self) -> None:
        check_weights(self)

    def measure(self, channel: Any) -> Measure:
        return PeakMeasure(channel, GainShape.of(channel, left=self.left, right=self.right), self.focus)


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class Tracking(ChannelGoal):
    """The tracking error T − I stays below a profile: sup σ_max(T − I)/|e(jω)|, e = (peak s + dc ω_c)/(s + ω_c).

    Parameters
    ----------
    inputs : names of the references
    outputs : names of what should follow them, in the same order
    response_time : float
        [s]; ω_c = 2/response_time.
    dc_error : float
        Relative error at low frequency, above 0.
    peak_error : float
        Relative error at high frequency, above dc_error.
    scale : (k,), optional
        Sizes of the references (units); 1 if left out.
    """

    kind = "tracking"
    keys = (Key("response_time_s", "response_time"), Key("dc_error"), Key("peak_error"), Key("scale"))
    sizes, in_pairs = (("response_time", "s"), ("dc_error", ""), ("peak_error", "")), True
    scales = (("dc_error", 1), ("peak_error", 1))

    response_time: float
    dc_error: float = 1e-3
    peak_error: float = 1.0
    scale: tuple[float, ...] | None = None

    def check_fields(self) -> None:
        if not self.dc_error < self.peak_error:
            raise InputError(
                f"dc_error must be below peak_error; got {self.dc_error} and {self.peak_error}. "
                "Errors grow with frequency."
            )
        check_scale(self)

    def measure(self, channel: Any) -> Measure:
        corner = 2 / self.response_time
        error = profile_of("error", ([self.peak_error, self.dc_error * corner], [1.0, corner]))
        scale = np.ones(len(self.inputs)) if self.scale is None else np.asarray(self.scale, float)
        minus = Realisation(*_empty(len(scale)), np.eye(len(scale)))
        shape = GainShape.of(channel, left=np.diag(1 / scale), right=np.diag(scale), minus=minus, profile=error)
        return PeakMeasure(channel, shape, self.focus)


def _empty(size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return np.zeros((0, 0)), np.zeros((0, size)), np.zeros((size, 0))


@dataclass(frozen=True, slots=True, eq=False)
class GainShape:
    """σ_max(L (T − R) W) · |profile|^power."""

    left: Filter | None  # None: nothing
    right: Filter | None
    profile: Profile
    power: int  # −1: the profile limits; +1: it multiplies
    minus: Realisation | None
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    @classmethod
    def of(
        cls, channel: Any, *, left: WeightLike = 1.0, right: WeightLike = 1.0, profile: Profile | float = 1.0,
        power: int = -1, minus: Realisation | None = None,
    ) -> "GainShape":  # fmt: skip
        """The shape for a channel's signals."""
        before, after = (
            filter_of("left", left, len(channel.outputs), side="left"),
            filter_of("right", right, len(channel.inputs), side="right"),
        )
        return cls(
            None if before.identity else before, None if after.identity else after,
            profile_of("limit", profile), power, minus, tuple(channel.inputs), tuple(channel.outputs),
        )  # fmt: skip

    def size(self, axis: Axis, T: np.ndarray) -> np.ndarray:
        """(k,)"""
        return spectral(self._weighted(axis, T)) * self._factor(axis)

    def pieces(self, axis: Axis, T: np.ndarray) -> list[Piece]:
        """One for each singular value near the largest: W = Lᴴ u vᴴ Wᴴ."""
        u, sizes, v = np.linalg.svd(self._weighted(axis, T)[0])
        factor = float(self._factor(axis)[0])
        found = []
        for k, size in enumerate(sizes):
            if size < sizes[0] * (1 - NEAR) and k:
                break
            out, into = u[:, k], v[k].conj()
            if self.left is not None:
                out = self.left.response(axis.filters)[0].conj().T @ out
            if self.right is not None:
                into = self.right.response(axis.filters)[0] @ into
            found.append((size * factor, factor * np.outer(out, into.conj()), self._label(out, into)))
        return found

    def system(self, T: Realisation, sampled: bool) -> Realisation | None:
        """L (T − R) W p^power where the profile is rational."""
        if sampled and (self.profile.constant is None or (self.minus is not None and len(self.minus.A))):
            return None
        profile = self.profile.system(self.power)
        if profile is not None:
            return self._joined(T, profile)
        steep = None if sampled or self.power > 0 else self.profile.steep()
        return None if steep is None else over_steep(self._joined(T, None), *steep)

    def ends(self, T: Realisation, sampled: bool) -> tuple[float, float]:
        """Limits at ω = 0 and ∞ where the profile is 0 or ∞ there."""
        found = [math.nan, math.nan]
        for k, far in enumerate((False, True)):
            power, size = self.profile.end(far=far)
            if power and not (far and sampled):
                terms = first_terms(self._joined(T, None), far=far)
                found[k] = size_at_end(limit(*terms, power * self.power, size ** float(self.power), far=far))
        return found[0], found[1]

    def _joined(self, T: Realisation, profile: Realisation | None) -> Realisation:
        T = T if self.minus is None else difference(T, self.minus)
        if profile is not None and len(profile.A):
            T = series(Realisation(*(np.kron(np.eye(len(T.D)), block) for block in profile)), T)
        elif profile is not None:
            factor = float(profile.D[0, 0])
            T = Realisation(T.A, T.B, T.C * factor, T.D * factor)
        T = T if self.right is None else series(T, self.right.system)
        return T if self.left is None else series(self.left.system, T)

    def ceiling(self, T: Realisation, late: np.ndarray, end: float | None) -> Ceiling:
        """Bounds on intervals."""
        return gain_ceiling(enclosure(T, late, self.minus), self.left, self.right, self.profile, self.power, end)

    def corners(self) -> np.ndarray:
        """Of the profile, the filters and the reference."""
        parts = [np.abs(part.poles()) for part in (self.left, self.right) if part is not None]
        if self.minus is not None:
            parts.append(np.abs(np.linalg.eigvals(self.minus.A)))
        return np.concatenate([self.profile.corners(), *parts])

    def refusal(self, T: Realisation) -> str:
        """A stable channel always has a gain."""
        return ""

    def _weighted(self, axis: Axis, T: np.ndarray) -> np.ndarray:
        if self.minus is not None:
            T = T - Filter(self.minus).response(axis.filters)
        T = T if self.left is None else self.left.response(axis.filters) @ T
        return T if self.right is None else T @ self.right.response(axis.filters)

    def _factor(self, axis: Axis) -> np.ndarray:
        if self.profile.constant is not None:
            return np.full(len(axis.omega), self.profile.constant ** float(self.power))
        with np.errstate(divide="ignore"):
            factor = self.profile.magnitude(axis.omega) ** float(self.power)
        at_end = (axis.omega == 0) | np.isinf(axis.omega)
        return np.where(at_end & ~(np.isfinite(factor) & (factor > 0)), np.nan, factor)  # there `ends` has the limit

    def _label(self, out: np.ndarray, into: np.ndarray) -> str:
        return f"{self.inputs[int(np.argmax(np.abs(into)))]} → {self.outputs[int(np.argmax(np.abs(out)))]}"

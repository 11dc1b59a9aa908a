"""Bounds of what goals measure over frequency, on intervals and beyond the last one.

    a shape (gain, density, μ, loop gain, sector) and a channel's system --> Ceiling
        above(panels)   at least the shape's size anywhere on each interval, close to it on narrow ones
        beyond(start)   at least its size at every higher frequency; infinite where nothing is known

Intervals are in the frequency that filters see; magnitudes of profiles are taken at the true one, which `end`s at the
Nyquist frequency of a sampled channel (None: nowhere).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.lti.cycle import perron
from workbench.lti.join import difference
from workbench.lti.peak_jet import Enclosure, Jet
from workbench.lti.peak_profile import factor, rise, top, top_beyond
from workbench.lti.realisation import Realisation, spectral
from workbench.lti.weight import Filter, Profile

VANISHES = 1e-10  # of its largest size: a response at rest this small is rounding
PASSES = 1 + 1e-9  # a profile up to here does not pass 1


@dataclass(frozen=True, slots=True)
class Panels:
    """Intervals: ends (k,) as filters see them, and the true ones [rad/s]."""

    low: np.ndarray
    high: np.ndarray
    true_low: np.ndarray
    true_high: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        return (self.low + self.high) / 2

    @property
    def radius(self) -> np.ndarray:
        return (self.high - self.low) / 2


@dataclass(frozen=True, slots=True)
class Ceiling:
    """Bounds of a shape for one controller."""

    above: Callable[[Panels], np.ndarray]
    beyond: Callable[[float, float], float]  # by the last interval's ends, as filters see it and true


def enclosure(T: Realisation, late: np.ndarray, minus: Realisation | None = None) -> Enclosure:
    """The response of a system less that of another without dead times."""
    if minus is None:
        return Enclosure.of(*T, late)
    return Enclosure.of(*difference(T, minus), np.r_[late, np.zeros(len(minus.A))])


def gain_ceiling(
    T: Enclosure, left: Filter | None, right: Filter | None, profile: Profile, power: int, end: float | None
) -> Ceiling:
    """σ_max(L T W) |p|^power."""
    before = None if left is None else Enclosure.of(*left.system)
    after = None if right is None else Enclosure.of(*right.system)
    largest = Largest()

    def product(at: np.ndarray, radius: np.ndarray) -> Jet:
        jet = T.jet(at, radius)
        jet = jet if before is None else before.jet(at, radius) @ jet
        return jet if after is None else jet @ after.jet(at, radius)

    def above(panels: Panels) -> np.ndarray:
        jet, ends = product(panels.middle, panels.radius), (panels.true_low, panels.true_high)
        shaped = jet.times(factor(profile, power, *ends, end))
        bound = shaped.largest(spectral)
        at_rest = _at_rest(panels, shaped, end)
        if len(at_rest):
            steep = top(profile, power, *(part[at_rest] for part in ends), times_omega=True)
            bound[at_rest] = largest.by_slope(jet, product(np.zeros(1), np.zeros(1)), at_rest, steep)
        return bound

    def beyond(start: float, true: float) -> float:
        parts = [part.beyond(start) for part in (before, T, after) if part is not None]
        return _tail(parts, rise(profile, power, end)) * top_beyond(profile, power, true, end)

    return Ceiling(above, beyond)


def density_ceiling(
    T: Enclosure, densities: Sequence[Profile], mask: Profile, unit: float, end: float | None
) -> Ceiling:
    """The largest over the outputs of √(Σ_j |T_ij|² S_j/mask)."""
    largest = Largest()

    def above(panels: Panels) -> np.ndarray:
        ends = panels.true_low, panels.true_high
        shared = factor(mask, -1, *ends, end, 1 / unit)
        columns = [factor(density, 1, *ends, end) for density in densities]
        weights = Jet(
            np.concatenate([column.value for column in columns], axis=2),
            np.concatenate([column.slope for column in columns], axis=2),
            np.max([column.bend for column in columns], axis=0), panels.radius,
        )  # fmt: skip
        jet = T.jet(panels.middle, panels.radius)
        shaped = jet.times(weights).times(shared)
        bound = shaped.largest(_longest_row)
        at_rest = _at_rest(panels, shaped, end)
        if len(at_rest):
            steep = _steep(densities, mask, *(part[at_rest] for part in ends)) / unit
            bound[at_rest] = largest.by_slope(jet, T.jet(np.zeros(1), np.zeros(1)), at_rest, steep)
        return bound

    def beyond(start: float, true: float) -> float:
        growth = max(rise(density, 1, end) for density in densities) + rise(mask, -1, end)
        weight = np.linalg.norm([top_beyond(density, 1, true, end) for density in densities])
        return _tail([T.beyond(start)], growth) * float(weight) * top_beyond(mask, -1, true, end) / unit

    return Ceiling(above, beyond)


def mu_ceiling(T: Enclosure, alpha: float, scalings: Callable[[np.ndarray], np.ndarray]) -> Ceiling:
    """α σ_max(D T D⁻¹) ≥ α μ(T), D (k, m) chosen in the middle of each interval."""

    def above(panels: Panels) -> np.ndarray:
        jet = T.jet(panels.middle, panels.radius)
        return alpha * jet.scaled(scalings(jet.value)).largest(spectral)

    def beyond(start: float, true: float) -> float:
        stays, falls = T.entries_beyond(start)  # μ is at most the spectral radius of the entries' sizes
        whole = stays + sum(falls)
        return alpha * float(perron(whole[None])[0]) if np.isfinite(whole).all() else math.inf

    return Ceiling(above, beyond)


def loop_ceiling(S: Enclosure, profile: Profile, power: int, scale: float, end: float | None) -> Ceiling:
    """σ_max(L⁻¹) p or σ_max(L)/p, p = scale |profile|, where p asks for it; L⁻¹ = (I − S)⁻¹ − I, L = S⁻¹ − I."""
    eye, largest = np.eye(len(S.D)), Largest()

    def loop(at: np.ndarray, radius: np.ndarray) -> Jet:
        jet = S.jet(at, radius)
        return (jet.between(-eye, eye).plus(eye) if power > 0 else jet).inverse().plus(-eye)

    def above(panels: Panels) -> np.ndarray:
        ends = panels.true_low, panels.true_high
        asked = top(profile, power, *ends) * scale ** float(power) > PASSES
        jet = loop(panels.middle, panels.radius)
        shaped = jet.times(factor(profile, power, *ends, end, scale ** float(power)))
        bound = np.where(asked, shaped.largest(spectral), 0.0)
        at_rest = _at_rest(panels, shaped, end)
        at_rest = at_rest[asked[at_rest]]
        if len(at_rest):
            steep = top(profile, power, *(part[at_rest] for part in ends), times_omega=True) * scale ** float(power)
            bound[at_rest] = largest.by_slope(jet, loop(np.zeros(1), np.zeros(1)), at_rest, steep)
        return bound

    def beyond(start: float, true: float) -> float:
        growth, size = rise(profile, power, end), top_beyond(profile, power, true, end) * scale ** float(power)
        if growth <= 0 and size <= PASSES:
            return 0.0
        stays, falls = Enclosure(S.A, S.B, S.C, S.D - eye, S.dead_times).beyond(start)
        if power > 0 or not stays + falls < 1:
            return math.inf
        return _tail([(stays, falls)], growth) / (1 - stays - falls) * size  # |S⁻¹ − I| ≤ |S − I|/(1 − |S − I|)

    return Ceiling(above, beyond)


def sector_ceiling(
    T: Enclosure, left: Filter | None, right: Filter | None, above_half: np.ndarray, below_half: np.ndarray,
    outputs: int,
) -> Ceiling:  # fmt: skip
    """σ_max(F G⁻¹), F and G the halves of a sector met with [H; I], H = L T W."""
    before = None if left is None else Enclosure.of(*left.system)
    after = None if right is None else Enclosure.of(*right.system)
    inputs = above_half.shape[1] - outputs

    def above(panels: Panels) -> np.ndarray:
        at, radius = panels.middle, panels.radius
        jet = T.jet(at, radius)
        jet = jet if before is None else before.jet(at, radius) @ jet
        jet = jet if after is None else jet @ after.jet(at, radius)
        F, G = (
            jet.between(half[:, :outputs], np.eye(inputs)).plus(half[:, outputs:]) for half in (above_half, below_half)
        )
        return (F @ G.inverse()).largest(spectral)

    def beyond(start: float, true: float) -> float:
        parts = [part.beyond(start) for part in (before, T, after) if part is not None]
        size = _tail(parts, 0)
        F, G = (np.linalg.norm(half[:, :outputs], 2) * size for half in (above_half, below_half))
        direct = below_half[:, outputs:]
        if direct.shape[0] != direct.shape[1] or not math.isfinite(size):
            return math.inf
        least = float(np.linalg.svd(direct, compute_uv=False)[-1])
        if not least > G:
            return math.inf
        ratio = np.linalg.norm(above_half[:, outputs:] @ np.linalg.inv(direct), 2)
        return float((ratio + F / least) / (1 - G / least))

    return Ceiling(above, beyond)


def _longest_row(M: np.ndarray) -> np.ndarray:
    """The largest Euclidean length (k,) of a row."""
    return np.sqrt(np.sum(np.abs(M) ** 2, axis=2)).max(axis=1)


def _at_rest(panels: Panels, jet: Jet, end: float | None) -> np.ndarray:
    """The intervals that begin at rest and have no bound; at most one."""
    return np.flatnonzero((panels.low == 0) & np.isinf(jet.bend)) if end is None else np.zeros(0, int)


class Largest:
    """The largest value a response has been seen to take, beside which rounding at rest counts as zero."""

    def __init__(self) -> None:
        self.size = 0.0

    def by_slope(self, jet: Jet, rest: Jet, at: np.ndarray, steep: np.ndarray) -> np.ndarray:
        """A bound where a factor has its pole at rest and the response vanishes: its slope times that of ω·factor."""
        self.size = max(self.size, float(spectral(jet.value).max()))
        vanishes = spectral(rest.value)[0] <= VANISHES * self.size
        return _times(jet.rate()[at], steep) if vanishes else np.full(len(at), math.inf)


def _steep(densities: Sequence[Profile], mask: Profile, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """A bound of ω √(Σ S_j/mask) where one of the two has its pole at rest."""
    if np.isfinite(top(mask, -1, low, high)).all():
        rows = [top(density, 1, low, high, times_omega=True) for density in densities]
        return np.linalg.norm(rows, axis=0) * top(mask, -1, low, high)
    rows = [top(density, 1, low, high) for density in densities]
    return np.linalg.norm(rows, axis=0) * top(mask, -1, low, high, times_omega=True)


def _times(bound: np.ndarray, factor: np.ndarray) -> np.ndarray:
    """The product of bounds; 0 times ∞ is ∞."""
    with np.errstate(invalid="ignore"):
        product = bound * factor
    return np.where(np.isnan(product), math.inf, product)


def _tail(parts: Sequence[tuple[float, float]], growth: int) -> float:
    """A bound of Π (stays + falls u) u^(−growth) for 0 < u ≤ 1."""
    coefficients = np.ones(1)
    for stays, falls in parts:
        coefficients = np.convolve(coefficients, [stays, falls])
    if coefficients[: max(growth, 0)].any():
        return math.inf
    return float(coefficients.sum())

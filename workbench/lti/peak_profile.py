"""A profile's magnitude enclosed on intervals of frequency, and bounded beyond the last one.

factor    a scalar with that magnitude, as a jet: what it multiplies is then bounded by the product's own slope
top       an upper bound alone
"""

import math

import numpy as np

from workbench.lti.peak_jet import Enclosure, Jet
from workbench.lti.weight import Profile


def factor(
    profile: Profile, power: int, low: np.ndarray, high: np.ndarray, end: float | None, scale: float = 1.0
) -> Jet:
    """scale · p^power up to a phase, a jet (k, 1, 1) on intervals (k,); its top alone if sampled or at a corner."""
    middle, radius = (low + high) / 2, (high - low) / 2
    if end is None and profile.constant is None and not profile.states:
        one = np.full((len(low), 1, 1), scale + 0j)
        by = _roots if profile.breakpoints is None else _power
        return by(profile, power, low, high, Jet(one, np.zeros_like(one), np.zeros(len(low)), radius))
    if end is None and profile.states and power > 0 and profile.forward is not None:
        jet = Enclosure.of(*profile.forward).jet(middle, radius)
        return Jet(scale * jet.value, scale * jet.slope, scale * jet.bend, radius)
    size = scale * top(profile, power, low, high)
    sound = np.isfinite(size)
    value = np.where(sound, size, 0.0)[:, None, None].astype(complex)
    return Jet(value, np.zeros_like(value), np.where(sound, 0.0, math.inf), radius)


def _power(profile: Profile, power: int, low: np.ndarray, high: np.ndarray, start: Jet) -> Jet:
    """Between breakpoints, c ω^a each; the top on an interval with one inside."""
    at, size = np.log(np.asarray(profile.breakpoints)).T
    slopes = np.r_[0.0, np.diff(size) / np.diff(at), 0.0]
    middle = (low + high) / 2
    a = power * slopes[np.searchsorted(np.exp(at), middle)]
    corner = ((np.exp(at) > low[:, None] * (1 + 1e-12)) & (np.exp(at) < high[:, None] * (1 - 1e-12))).any(axis=1)
    a = np.where(corner, 0.0, a)
    largest = top(profile, power, low, high)
    value = np.where(corner, largest, profile.magnitude(middle) ** float(power)).astype(complex)[:, None, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        bend = np.where(a == 0, 0.0, np.abs(a * (a - 1)) * largest / low**2)
    return start.times(Jet(value, value * (a / middle)[:, None, None], bend, start.radius))


def _roots(profile: Profile, power: int, low: np.ndarray, high: np.ndarray, start: Jet) -> Jet:
    """A fraction, root by root: jω − z as it is, 1/(jω − p) by its distance to the interval."""
    zeros, poles = profile.roots()
    above, below = (zeros, poles) if power > 0 else (poles, zeros)
    found = start.between(np.eye(1) * abs(profile.factor) ** float(power), np.eye(1))
    s, flat, endless = 1j * (low + high) / 2, np.zeros(len(low)), np.full(len(low), math.inf)
    for root in above:
        value = (s - root)[:, None, None]
        found = found.times(Jet(value, np.full_like(value, 1j), flat, start.radius))
    for root in below:
        nearest = np.abs(1j * np.clip(root.imag, low, high) - root)
        sound = nearest > 0
        value = (1 / np.where(sound, s - root, 1.0))[:, None, None]
        bend = np.where(sound, 2 / np.where(sound, nearest, 1.0) ** 3, endless)
        found = found.times(Jet(value, -1j * value**2, bend, start.radius))
    return found


def top(profile: Profile, power: int, low: np.ndarray, high: np.ndarray, *, times_omega: bool = False) -> np.ndarray:
    """A bound (k,) of |p(jω)|^power on intervals (k,), close on narrow ones; `times_omega`: of that times ω."""
    if profile.constant is not None:
        return profile.constant ** float(power) * (high if times_omega else np.ones(len(low)))
    if profile.breakpoints is not None:
        ends = [profile.magnitude(low) ** float(power), profile.magnitude(high) ** float(power)]
        at, size = profile.breakpoints.T
        inside = (at > low[:, None]) & (at < high[:, None])
        ends.append(np.where(inside, size ** float(power), 0.0).max(axis=1))
        return np.max(ends, axis=0) * (high if times_omega else 1.0)
    if profile.states:
        return _of_states(profile, power, low, high) * (high if times_omega else 1.0)
    return _of_roots(profile, power, low, high, times_omega)


def rise(profile: Profile, power: int, end: float | None) -> int:
    """k of |p|^power ~ ω^k at high frequencies; none up to the Nyquist frequency `end` of a sampled channel."""
    return power * profile.end(far=True)[0] if end is None else 0


def top_beyond(profile: Profile, power: int, start: float, end: float | None) -> float:
    """A bound of |p(jω)|^power (start/ω)^k, k = `rise`, for ω ≥ start, up to `end` if there is one."""
    if end is not None:
        return float(top(profile, power, np.array([min(start, end)]), np.array([end]))[0])
    if profile.constant is not None:
        return profile.constant ** float(power)
    if profile.breakpoints is not None:
        later = profile.breakpoints[profile.breakpoints[:, 0] > start, 1]
        return float(np.max(np.r_[profile.magnitude(np.array([start])), later] ** float(power)))
    zeros, poles = profile.roots()
    if profile.states and power > 0 and profile.forward is not None:
        return sum(Enclosure.of(*profile.forward).beyond(start)) if rise(profile, power, end) == 0 else math.inf
    if profile.states:
        return math.inf
    above, below = (np.abs(roots) / start for roots in ((zeros, poles) if power > 0 else (poles, zeros)))
    if below.max(initial=0.0) >= 1:
        return math.inf
    size = abs(profile.factor) ** float(power) * start ** float(rise(profile, power, end))
    return float(size * np.prod(1 + above) / np.prod(1 - below))


def _of_roots(profile: Profile, power: int, low: np.ndarray, high: np.ndarray, times_omega: bool) -> np.ndarray:
    """From the distances of the roots to the interval."""
    zeros, poles = profile.roots()
    above, below = (zeros, poles) if power > 0 else (poles, zeros)
    dropped = np.flatnonzero(below == 0)[:1] if times_omega else np.zeros(0, int)
    size = np.full(len(low), math.log(abs(profile.factor)) * power)
    with np.errstate(divide="ignore"):
        for root in above:
            size += np.log(np.maximum(np.abs(1j * low - root), np.abs(1j * high - root)))
        for root in np.delete(below, dropped):
            size -= np.log(np.abs(1j * np.clip(root.imag, low, high) - root))
        if times_omega and not len(dropped):
            size += np.log(high)
        return np.exp(size)


def _of_states(profile: Profile, power: int, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """From the enclosed response of its state space."""
    if profile.forward is None:
        return np.full(len(low), math.inf)
    jet = Enclosure.of(*profile.forward).jet((low + high) / 2, (high - low) / 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        if power > 0:
            found = jet.size()
        else:
            least = np.abs(jet.value[:, 0, 0]) - jet.radius * jet.rate()
            found = np.where(least > 0, 1 / least, math.inf)
    return np.where(np.isnan(found), math.inf, found)

"""Disk margin: how far the gain and phase of all channels may change at the same time, each in its own way.

    S --> M = S − I/2 = (S − T)/2, channels in balanced units
                                  --> μ(M(jω)) from below: a perturbation that destabilises  --> α = 1 / sup μ
                                      and above: scalings, one per band of frequencies

Every channel i is multiplied by its own f_i = (1 + δ_i/2)/(1 − δ_i/2) with a stable, otherwise arbitrary δ_i, |δ_i| <
α. The loop stays stable for all of them up to α = 1/sup_ω μ(M(jω)), μ the structured singular value for diagonal
complex δ. "Balanced" (σ = 0): raising and lowering the gain count alike.
"""

import math
from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.lti.norm import intervals_above, peak_gain
from workbench.lti.realisation import Realisation, checked, responder, stable_poles
from workbench.lti.structured import balancing, scaling_below, worst_turn
from workbench.result import Result, Row

MOST_BANDS = 400  # examined; a loop of twenty states needs one to twenty


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """An interval of frequency and the scaling D that proves σ_max(D M(jω) D⁻¹) ≤ 1/lower on it."""

    low: float  # [rad/s]
    high: float  # [rad/s]
    scaling: np.ndarray  # (m,) positive


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DiskMargin(Result):
    """The multiloop, balanced disk margin between two bounds, and what the lower one guarantees.

    `lower` is proved by the bands, which together cover all frequencies; at `upper` the known `perturbation` puts a
    pole on the imaginary axis. The truth lies between them.
    """

    lower: float
    upper: float
    frequency: float  # [rad/s] of the perturbation; infinity where the loop's feedthrough decides
    perturbation: np.ndarray  # (m,) complex f_i that destabilise at `frequency`; infinite where δ_i = 2
    bands: tuple[Band, ...]

    @property
    def gain_down(self) -> float:
        """Each gain may at the same time fall to this factor; 0 if it may vanish."""
        return (2 - self.lower) / (2 + self.lower) if self.lower < 2 else 0.0

    @property
    def gain_up(self) -> float:
        """Each gain may at the same time rise to this factor; infinity if without limit."""
        return (2 + self.lower) / (2 - self.lower) if self.lower < 2 else math.inf

    @property
    def phase(self) -> float:
        """Each phase may at the same time turn by this angle either way [rad]."""
        return 2 * math.atan(self.lower / 2)

    def rows(self) -> list[Row]:
        """The bracket and the guaranteed ranges."""
        return [
            ("disk margin, guaranteed", self.lower, ""),
            ("disk margin, exceeded by a known perturbation at", self.upper, ""),
            ("gain down to", self.gain_down, ""),
            ("gain up to", self.gain_up, ""),
            ("phase", self.phase, "rad"),
            ("frequency", self.frequency, "rad/s"),
        ]


def disk_margin(A, B, C, D, *, tolerance: float = 1e-3, band: tuple[float, float] = (0.0, math.inf)) -> DiskMargin:
    """The multiloop balanced disk margin of a closed loop given by its sensitivity.

    Parameters
    ----------
    A, B, C, D : (n, n), (n, m), (m, n), (m, m)
        Realisation of S = (I + L)⁻¹, as `margin.sensitivity` returns it.
    tolerance : float
        Relative width of the bracket aimed at, 1e-4 … 0.1.
    band : (low, high)
        Frequencies that count [rad/s]; all of them if left out.

    Raises
    ------
    InputError
        If the closed loop is not stable, S is not square or the tolerance is out of range.

    From below, max over diagonal unitary Q of ρ(Q M(jω)), at the frequencies that prove hardest. From above, a band of
    frequencies at a time: a constant diagonal D with σ_max(D M D⁻¹) below the level at sampled frequencies of the band;
    the eigenvalue problem of that level then says on which part of the band it holds without gaps; the rest is divided.
    Guaranteed: `lower`, up to the rounding that `norm.intervals_above` states. Not guaranteed: that the two meet to the
    tolerance. For more than three channels even the best D can stay above μ; then `lower` is the one to trust.

    Source: Seiler, Packard & Gahinet, IEEE Control Systems 40 (2020) no. 5, 78; Packard & Doyle, Automatica 29 (1993)
    71.

    Examples
    --------
    >>> from workbench.lti.margin import sensitivity
    >>> loop = [[-1.0, 0.0], [1.0, 0.0]], [[1.0], [0.0]], [[0.0, 2.0]], [[0.0]]  # 2/(s (s + 1))
    >>> round(disk_margin(*sensitivity(*loop)).lower, 2)  # 2/3
    0.67
    """
    if not 1e-4 <= tolerance <= 0.1:
        raise InputError(f"tolerance must lie between 1e-4 and 0.1; got {tolerance!r}. Leave it out for 1e-3.")
    A, B, C, D = checked(A, B, C, D)
    count = len(D)
    if D.shape != (count, count):
        raise InputError(f"the sensitivity must be square; got D of shape {D.shape}. Close one loop per channel.")
    if not 0 <= band[0] < band[1]:
        raise InputError(f"band must be (low, high) with 0 ≤ low < high; got {band!r}. Swap the ends.")
    poles = stable_poles(A, "the closed loop", "Margins of an unstable loop mean nothing; stabilise it first.")
    M = Realisation(A, B, C, D - np.eye(count) / 2)
    cover = _Cover(M, np.unique(np.abs(poles)), tolerance, band)
    cover.run()
    size, frequency, turn = cover.worst
    if size == 0:
        delta, upper = np.full(count, math.inf), math.inf
    else:  # diag(turn) M has the eigenvalue `size`, so I − M diag(turn/size), and with it I + L diag(f), is singular
        delta, upper = turn / size, 1 / size
    with np.errstate(invalid="ignore", divide="ignore"):
        perturbation = (1 + delta / 2) / (1 - delta / 2)
    return DiskMargin(
        lower=1 / cover.level if cover.level > 0 else math.inf,
        upper=upper,
        frequency=frequency,
        perturbation=perturbation,
        bands=tuple(sorted(cover.bands, key=lambda band: band.low)),
    )


def _scaled(M: Realisation, d: np.ndarray) -> Realisation:
    """diag(d) M diag(d)⁻¹."""
    A, B, C, D = M
    return Realisation(A, B / d, d[:, None] * C, d[:, None] * D / d)


class _Cover:
    """The work of `disk_margin`: bands that cover the frequencies at a level, which rises only as far as it must."""

    def __init__(self, M: Realisation, poles: np.ndarray, tolerance: float, band: tuple[float, float]) -> None:
        self.poles, self.tolerance, self.band = poles, tolerance, band
        # μ does not see the channels' units, and nothing after this does
        self.units = np.exp(balancing(responder(*M)(self._samples(*band))))
        self.M = _scaled(M, self.units)
        self.response = responder(*self.M)
        self.worst = (0.0, 0.0, np.ones(len(M.D), dtype=complex))  # largest ρ(Q M), its frequency, Q
        self.level = 0.0
        self.bands: list[Band] = []

    def run(self) -> None:
        """Examines bands until none is left."""
        x = np.zeros(len(self.M.D))
        samples = self._samples(*self.band)
        values = self.response(samples)
        if not values.any():
            self.bands.append(Band(low=self.band[0], high=self.band[1], scaling=self.units))
            return
        self._look_for_worse(samples, values, x)
        waiting = [self.band]
        for _ in range(MOST_BANDS):
            if not waiting:
                return
            low, high = waiting.pop()
            samples = self._samples(low, high)
            values = self.response(samples)
            x, size, hardest = scaling_below(values, self._goal(), x)
            one = slice(hardest, hardest + 1)
            self._look_for_worse(samples[one], values[one], x)
            if size > self.level:
                alone, least, _ = scaling_below(values[one], self._goal(), x)
                if least <= self.level:  # each frequency has its scaling, the band has not
                    middle = self._middle(low, high)
                    waiting += [(low, middle), (middle, high)]
                    continue
                self.level = least * (1 + self.tolerance)  # a gap between the best D and μ, which no division closes
                x = alone
            waiting += self._cover(low, high, x)
        if waiting:  # many narrow bands left: one scaling for all of them, at whatever level that takes
            d = np.exp(x)
            self.level = max(self.level, peak_gain(*_scaled(self.M, d)).upper)
            self.bands += [Band(low=low, high=high, scaling=d * self.units) for low, high in waiting]

    def _inside(self, omega: np.ndarray) -> np.ndarray:
        """The response, beyond the band that at its nearer end."""
        return self.response(np.clip(omega, *self.band))

    def _goal(self) -> float:
        """What a scaling should reach at the samples, a little under the level so that it holds between them too."""
        return self.level / (1 + self.tolerance / 4)

    def _look_for_worse(self, samples: np.ndarray, values: np.ndarray, x: np.ndarray) -> None:
        """Raises the lower bound of sup μ where the scaled gain is largest, and with it the level."""
        d = np.exp(x)
        sizes = np.linalg.svd(d[:, None] * values / d, compute_uv=False)[:, 0]
        for k in np.argsort(sizes)[-2:]:
            if sizes[k] > self.worst[0]:
                size, omega, turn = worst_turn(self._inside, float(samples[k]), x)
                if size > self.worst[0]:
                    self.worst = size, float(np.clip(omega, *self.band)), turn
        self.level = max(self.level, self.worst[0] * (1 + self.tolerance))

    def _cover(self, low: float, high: float, x: np.ndarray) -> list[tuple[float, float]]:
        """Notes the parts of a band where the scaling x holds, and returns the others."""
        d = np.exp(x)
        scaling, left_over, reached = d * self.units, [], low
        for start, end in intervals_above(*_scaled(self.M, d), self.level):
            start, end = max(start, low), min(end, high)
            if start >= end:
                continue
            if start > reached:
                self.bands.append(Band(low=reached, high=start, scaling=scaling))
            left_over.append((start, end))
            reached = end
        if reached < high:
            self.bands.append(Band(low=reached, high=high, scaling=scaling))
        return left_over

    def _samples(self, low: float, high: float) -> np.ndarray:
        """The ends of a band, the natural frequencies inside it, and three points between."""
        inside = self.poles[(self.poles > low) & (self.poles < high)]
        middle = self._middle(low, high)
        between = [self._middle(low, middle), middle, self._middle(middle, high)]
        return np.unique(np.r_[low, inside, between, high])

    def _middle(self, low: float, high: float) -> float:
        """A frequency between two others: half way in ω/(ω + ω_0), so that infinity is an end like any other."""
        scale = float(np.exp(np.mean(np.log(self.poles)))) if len(self.poles) else 1.0
        half = (low / (low + scale) + (high / (high + scale) if high < math.inf else 1.0)) / 2
        return scale * half / (1 - half) if half < 1 else math.inf

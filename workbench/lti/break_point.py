"""What a loop bears at one point: a factor, a rotation, a dead time on one signal, or on several signals alike.

    S at the point (m, m) --m = 1--> exact crossings of T = 1 − S, certified peak of S − ½
                          --m > 1--> characteristic loci of T over frequency, followed and refined

All m signals get one common complex factor. A factor f puts a pole on the axis at jω exactly if
det(I + (f − 1) T(jω)) = 0, so that f = 1 − 1/λ of an eigenvalue λ of T(jω): real for a gain, of size one for a rotation
or a dead time. The disk margin is α = 1/sup ρ(S − ½I), balanced (σ = 0).
Source: guide, Definitions: Margins at break points.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from workbench.errors import InputError
from workbench.lti.bracket import largest_between, zeros_between
from workbench.lti.grid import NEIGHBOURS
from workbench.lti.margin import UNSTABLE, ChannelMargin, channel_margin
from workbench.lti.modal import modal_responder
from workbench.lti.norm import peak_gain
from workbench.lti.realisation import Realisation, checked, stable_poles
from workbench.result import Result, Row

PER_DECADE = 40  # points of the grid on which loci are followed, between the resonances
BESIDE = NEIGHBOURS["normal"][0]  # points at a resonance, in widths |Re p|
DECADES = 3  # beyond the slowest and the fastest pole, where loci are straight
LARGEST = 6  # signals that share a factor; loci are matched by trying every order
NOISE = 1e-10  # of a locus: what turns by less is rounding
LARGEST_FACTOR = 1e6  # beyond it, and below its inverse, no gain margin limits anybody: reported as none
RELATIVE = 1e-13  # width of a crossing's last bracket
NARROW = 1e-7  # of a maximum's frequency: the value there is flat to the square of it
NEAR_BEST = 0.9  # of the largest value on the grid: maxima below it cannot overtake it between two points


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class BreakPoint(Result):
    """Margins at one break point, all other loops closed.

    gain_up, gain_down : smallest factor above 1 and largest below 1 that destabilises; infinite and 0 where none does
    phase : smallest rotation [rad];  delay : smallest dead time [s];  disk : balanced disk margin α [1]
    model : whose loop it is, where a problem has several
    """

    point: str
    gain_up: float
    gain_down: float
    phase: float
    delay: float
    disk: float
    model: str = ""

    def to_dict(self) -> dict[str, float | str | None]:
        """In the units of the command line's JSON; None where nothing limits. Of several signals at once no delay."""

        def finite(value: float) -> float | None:
            return value if math.isfinite(value) else None

        late = {} if math.isnan(self.delay) else {"delay_ms": finite(1e3 * self.delay)}
        return {
            "point": self.point, "gain_up": finite(self.gain_up), "gain_down": self.gain_down,
            "phase_deg": finite(math.degrees(self.phase)), **late, "disk": self.disk,
            **({"model": self.model} if self.model else {}),
        }  # fmt: skip

    def rows(self) -> list[Row]:
        return [
            ("point", self.point, ""),
            ("gain up", self.gain_up, ""),
            ("gain down", self.gain_down, ""),
            ("phase", math.degrees(self.phase), "°"),
            ("delay", 1e3 * self.delay, "ms"),
            ("disk margin", self.disk, ""),
        ]


def joint_point(point: str, disk: float, *, model: str = "") -> BreakPoint:
    """Several signals at once, each with a factor of its own: what their disk margin guarantees; no common delay."""
    up = (2 + disk) / (2 - disk) if disk < 2 else math.inf
    phase = 2 * math.atan(disk / 2)
    return BreakPoint(
        point=point, gain_up=up, gain_down=1 / up, phase=phase, delay=math.nan, disk=disk, model=model
    )  # fmt: skip


def break_point(A, B, C, D, *, point: str) -> BreakPoint:
    """Margins of a stable loop at a point, given by the sensitivity there.

    Parameters
    ----------
    A, B, C, D : (n, n), (n, m), (m, n), (m, m)
        Realisation of S from what is added to the point's m signals to these signals.
    point : name

    Raises
    ------
    InputError
        If the loop is not stable, S is not square, or more than `LARGEST` signals share the factor.
    """
    A, B, C, D = checked(A, B, C, D)
    m = len(D)
    if D.shape != (m, m) or not 1 <= m <= LARGEST:
        raise InputError(f"a break point must have 1 … {LARGEST} signals; {point!r} got D of shape {D.shape}.")
    if m == 1:
        one = channel_margin(A, B, C, D, channel=0, name=point)
        disk = 1 / peak_gain(A, B, C, D - 0.5).upper
    else:
        poles = stable_poles(A, "the closed loop", UNSTABLE)
        loci = _Loci(Realisation(A, B, -C, np.eye(m) - D), _grid(poles))
        far = np.linalg.eigvals(np.eye(m) - D)
        strong = bool((np.abs(far) >= np.abs(1 - far)).any())  # |L(∞)| ≥ 1: any dead time turns it
        one = ChannelMargin.of(point, loci.factors(), loci.lags(), strong=strong, largest=LARGEST_FACTOR)
        disk = 1 / loci.largest(lambda z: np.abs(0.5 - z))
    return BreakPoint(
        point=point, gain_up=one.gain_up if one.gain_up <= LARGEST_FACTOR else math.inf,
        gain_down=one.gain_down if one.gain_down >= 1 / LARGEST_FACTOR else 0.0,
        phase=one.phase, delay=one.delay, disk=disk,
    )  # fmt: skip


def _grid(poles: np.ndarray) -> np.ndarray:
    """Frequencies [rad/s], ascending, without 0: logarithmic, and denser at every resonance."""
    sizes = np.abs(poles)
    sizes = sizes[sizes > 0]
    low, high = sizes.min() / 10**DECADES, sizes.max() * 10**DECADES
    even = np.geomspace(low, high, int(PER_DECADE * math.log10(high / low)))
    waves = poles[poles.imag > 0]
    close = (waves.imag[:, None] + BESIDE * -waves.real[:, None]).ravel()
    return np.unique(np.r_[even, close[(close > low) & (close < high)]])


class _Loci:
    """The eigenvalues of T(jω), each followed along a grid."""

    def __init__(self, T: Realisation, omega: np.ndarray) -> None:
        self._D, self.omega = T.D, omega
        self.response, _ = modal_responder(T)  # (k, m, m) T(jω)
        self.values = self._followed(self.of(omega))

    def of(self, omega: np.ndarray) -> np.ndarray:
        """(k, m) eigenvalues of T(jω), in no order."""
        return np.linalg.eigvals(self.response(omega))

    def _followed(self, values: np.ndarray) -> np.ndarray:
        """The same, each column one locus: of all orders the one that moves least from a frequency to the next."""
        orders = np.array(list(permutations(range(values.shape[1]))))
        out = values.copy()
        for k in range(1, len(values)):
            guess = out[k - 1] if k == 1 else out[k - 1] + (out[k - 1] - out[k - 2]) * self._ratio(k)
            distance = np.abs(values[k][orders] - guess).sum(axis=1)
            out[k] = values[k][orders[int(distance.argmin())]]
        return out

    def _ratio(self, k: int) -> float:
        return min((self.omega[k] - self.omega[k - 1]) / (self.omega[k - 1] - self.omega[k - 2]), 2.0)

    def _at(self, omega: np.ndarray, k: np.ndarray, locus: np.ndarray) -> np.ndarray:
        """The loci between grid points k and k + 1, one a frequency: the eigenvalues nearest to the straight lines."""
        part = (omega - self.omega[k]) / (self.omega[k + 1] - self.omega[k])
        guess = self.values[k, locus] + part * (self.values[k + 1, locus] - self.values[k, locus])
        found = self.of(omega)
        return found[np.arange(len(omega)), np.abs(found - guess[:, None]).argmin(axis=1)]

    def _roots(self, measure: Callable) -> list[tuple[float, complex]]:
        """(ω, λ) where a real measure of a locus changes sign."""
        sizes, moduli = measure(self.values), np.abs(self.values)
        turns = sizes[:-1] * sizes[1:] < 0
        turns &= np.maximum(*(np.abs(s) for s in (sizes[:-1], sizes[1:]))) > NOISE * moduli[:-1]
        turns &= np.maximum(moduli[:-1], moduli[1:]) > 1 / LARGEST_FACTOR
        k, locus = np.nonzero(turns)
        if not len(k):
            return []
        low, high = (measure(self._at(self.omega[at], k, locus)) for at in (k, k + 1))
        k, locus = k[low * high < 0], locus[low * high < 0]
        w = zeros_between(lambda at: measure(self._at(at, k, locus)), self.omega[k], self.omega[k + 1], RELATIVE)
        return list(zip(w.tolist(), self._at(w, k, locus).tolist(), strict=True))

    def factors(self) -> list[tuple[float, float]]:
        """1 − 1/λ where a locus crosses the real axis, and where it starts and ends on it, with the frequencies."""
        found = self._roots(np.imag)
        for omega, T in ((0.0, self.response(np.zeros(1))[0].real), (math.inf, self._D)):
            found += [(omega, complex(v)) for v in np.linalg.eigvals(T) if abs(v.imag) <= 1e-9 * abs(v)]
        return [(1 - 1 / value.real, omega) for omega, value in found if value.real != 0]

    def lags(self) -> list[tuple[float, float]]:
        """(rotation in (0, 2π), ω) where |L| = 1, that is Re λ = ½."""
        out = []
        for w, value in self._roots(lambda z: np.real(z) - 0.5):
            out.append((float(np.angle(-value / (1 - value))) % (2 * math.pi), w))
        return out

    def largest(self, measure: Callable) -> float:
        """The largest of a measure over all loci and frequencies, ends included."""
        size = measure(self.values).max(axis=1)
        best = float(
            max(size.max(), *(measure(np.linalg.eigvals(T)).max() for T in (self.response(np.zeros(1))[0], self._D)))
        )
        for k in np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:])) + 1:
            if size[k] > NEAR_BEST * best:
                within = (float(self.omega[k - 1]), float(self.omega[k + 1]))
                found = largest_between(lambda w: measure(self.of(w)).max(axis=1), *within, NARROW * self.omega[k])
                best = max(best, found)
        return best

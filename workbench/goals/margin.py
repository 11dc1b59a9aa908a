"""Stability margins at the points of a loop: gain and phase of all of them together, dead time of each.

    S --M = S − I/2--> α · sup μ(M(jω))     Margins: the multiloop balanced (σ = 0) disk margin is at least α
    S_ii --|L_i| = 1--> limit / delay       DelayMargin: each channel bears a dead time, the others closed

A gain margin of g (as a factor up and down) and a phase margin of φ ask for α = max(2 (g − 1)/(g + 1), 2 tan(φ/2)).
An unstable loop has no margins: its value is infinite.
"""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from workbench.errors import InputError
from workbench.goals.gain import GainShape
from workbench.goals.key import Key
from workbench.goals.limit import checked_limit
from workbench.goals.measure import NEAR, Asked, Bound, Largest, Measure, Value, infinite, near
from workbench.goals.peak import Axis, PeakMeasure, Piece, Sampled, sampled
from workbench.goals.promise import Promise, kept_limit
from workbench.goals.registry import register
from workbench.goals.signals import PointGoal
from workbench.goals.verdict import Verdict
from workbench.lti.bilinear import unwarped
from workbench.lti.disk import disk_margin
from workbench.lti.grid import seeds
from workbench.lti.mu import gradient, lower, scalings
from workbench.lti.peak_bound import CLOSE
from workbench.lti.peak_ceiling import Ceiling, enclosure, mu_ceiling
from workbench.lti.peak_crossing import crossings, pursued
from workbench.lti.peak_search import local_peaks
from workbench.lti.realisation import Realisation

if TYPE_CHECKING:
    from workbench.control.structure.block import Controller

MU_CLOSE = 2e-3  # relative: as near as turns and scalings of three and more channels come to each other
FINEST = 1e-4  # tolerance of the disk margin where a limit lies inside its bracket
ROUNDED = 1e-13  # of ½: S(∞) this near to it leaves open which side of 1 the loop gain is on
MOST_DB = 1000.0  # of a gain margin asked for: a factor of 1e50
PURSUED = 1e-9  # relative: what rounding leaves of a crossing's place and lag
MOST_SAMPLES = 200  # of whole samples of dead time tried one by one
EVERY = "every crossing of the loop gain through 1"
NO_SAMPLE = "the loop gain is 1 or more up to the Nyquist frequency and one more sample of dead time is not borne."
NO_ROLL_OFF = "the loop gain is 1 or more at all high frequencies; any dead time is too long."


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class Margins(PointGoal):
    """Gain and phase at all points may change at the same time, independently, by a margin.

    Parameters
    ----------
    points : names
    gain_db : float
        Each gain up and down by this much [dB].
    phase_deg : float
        Each phase by this much either way [degrees].

    The stricter of the two counts. value = α sup μ(S − I/2) = α over the disk margin.
    """

    kind = "margins"
    keys = (Key("gain_db"), Key("phase_deg"))

    gain_db: float = 0.0
    phase_deg: float = 0.0
    hard: bool = True

    def check_fields(self) -> None:
        if not (0 <= self.gain_db <= MOST_DB and 0 <= self.phase_deg < 180) or self.gain_db == self.phase_deg == 0:
            raise InputError(
                f"Margins needs gain_db from 0 to {MOST_DB:g} and phase_deg from 0 to below 180, not both zero; "
                f"got {self.gain_db!r} dB and {self.phase_deg!r}°. Typical: 6 dB and 40°."
            )

    @property
    def alpha(self) -> float:
        """The disk margin asked for."""
        return disk(self.gain_db, self.phase_deg)

    def asked(self) -> Asked:
        """The stricter of the two, in its own unit."""
        if reached_phase(self.alpha) <= self.phase_deg * (1 + 1e-12):
            return Asked(">=", self.phase_deg, "deg", lambda v: reached_phase(self.alpha / v if v else math.inf))
        return Asked(">=", self.gain_db, "dB", lambda v: reached_gain(self.alpha / v if v else math.inf))

    def with_limit(self, limit: float) -> Self:
        """In the unit of the stricter of the two, which stands for both: they are one disk margin."""
        number, unit = checked_limit(self.name, limit), self.asked().unit
        return replace(self, gain_db=number if unit == "dB" else 0.0, phase_deg=0.0 if unit == "dB" else number)

    def promise(self, verdict: Verdict) -> Promise | None:
        """The disk margin: what is asked, else what is reached."""
        reached = verdict.value if verdict.upper is None else verdict.upper
        if verdict.met or reached is None:
            return self.promised("disk margin", ">=", self.alpha) if verdict.met else None
        own = (reached, 0.0) if verdict.unit == "dB" else (0.0, reached)
        limit = kept_limit(self.alpha, disk(*own), ">=") if max(own) > 0 else None
        return None if limit is None else self.promised("disk margin", ">=", limit)

    def measure(self, channel: Any) -> Measure:
        count = len(self.points)
        half = Realisation(np.zeros((0, 0)), np.zeros((0, count)), np.zeros((count, 0)), np.eye(count) / 2)
        if count == 1:
            return PeakMeasure(channel, GainShape.of(channel, minus=half, profile=1 / self.alpha), self.focus)
        close = CLOSE if count == 2 else MU_CLOSE
        return DiskMeasure(PeakMeasure(channel, MuShape(self.alpha, self.points), self.focus, close))


def disk(gain_db: float, phase_deg: float) -> float:
    """The disk margin that allows a gain up and down and a phase either way."""
    factor = 10 ** (gain_db / 20)
    return max(2 * (factor - 1) / (factor + 1), 2 * math.tan(math.radians(phase_deg) / 2))


def reached_phase(alpha: float) -> float:
    """Phase [degrees] either way that a disk margin allows."""
    return math.degrees(2 * math.atan(alpha / 2))


def reached_gain(alpha: float) -> float:
    """Gain up and down [dB] that a disk margin allows; infinite from 2 on."""
    return 20 * math.log10((2 + alpha) / (2 - alpha)) if alpha < 2 else math.inf


@dataclass(frozen=True, slots=True, eq=False)
class MuShape:
    """α μ(S − I/2)."""

    alpha: float
    names: tuple[str, ...]

    def size(self, axis: Axis, T: np.ndarray) -> np.ndarray:
        """(k,), from below."""
        return self.alpha * lower(T - np.eye(T.shape[1]) / 2)

    def pieces(self, axis: Axis, T: np.ndarray) -> list[Piece]:
        """The spectral radius at the best turn."""
        value, W, share = gradient(T[0] - np.eye(T.shape[1]) / 2)
        return [(self.alpha * value, self.alpha * W, self.names[int(np.argmax(share))])]

    def system(self, T: Realisation, sampled: bool) -> Realisation | None:
        """None: μ is no singular value."""
        return None

    def ends(self, T: Realisation, sampled: bool) -> tuple[float, float]:
        """It has a value at every frequency."""
        return math.nan, math.nan

    def ceiling(self, T: Realisation, late: np.ndarray, end: float | None) -> Ceiling:
        """Bounds on intervals, of α σ_max(D (S − I/2) D⁻¹)."""
        return mu_ceiling(enclosure(T._replace(D=T.D - np.eye(len(T.D)) / 2), late), self.alpha, scalings)

    def corners(self) -> np.ndarray:
        """None."""
        return np.zeros(0)

    def refusal(self, T: Realisation) -> str:
        """A stable loop has margins."""
        return ""


@dataclass(frozen=True, slots=True)
class DiskMeasure:
    """A multiloop disk margin; exact by `disk_margin`, a bracket proved band by band."""

    peak: PeakMeasure

    def evaluate(self, K: "Controller") -> Value:
        """From below, on a grid made from the poles."""
        return self.peak.evaluate(K)

    def exact(self, K: "Controller") -> Value:
        """The bracket of `disk_margin` in the band; with dead times branch and bound."""
        if self.peak.channel.delayed:
            return self.peak.exact(K)
        state = sampled(self.peak.channel, K)
        if state.reason:
            return infinite(state.reason)
        alpha, h = self.peak.shape.alpha, self.peak.channel.sample_time  # pyright: ignore[reportAttributeAccessIssue]
        low, high = (float(end) for end in Axis.of(np.array(self.peak.band), h).filters)
        disk = disk_margin(*state.system, band=(low, high))
        if disk.lower < alpha <= disk.upper:  # a bracket that leaves the question open is narrowed
            disk = disk_margin(*state.system, band=(low, high), tolerance=FINEST)
        omega = disk.frequency if h is None else float(unwarped(disk.frequency, h))
        return Value(
            value=alpha / disk.upper, upper=alpha / disk.lower, frequency=omega,
            channel=", ".join(self.peak.channel.inputs), method="bracket of the disk margin, proved band by band",
        )  # fmt: skip


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class DelayMargin(PointGoal):
    """Each point bears a further dead time while the others stay closed: value = delay/(smallest that destabilises).

    points : names; delay : float [s]

    The measure jumps where a further crossing of |L_i| = 1 appears.
    """

    kind, proof = "delay_margin", "delay margin"
    keys = (Key("delay_s", "delay"),)
    sizes, all_frequencies = (("delay", "s"),), True
    scales = (("delay", 1),)

    delay: float
    hard: bool = True

    def asked(self) -> Asked:
        return Asked(">=", self.delay, "s", lambda v: self.delay / v if v else math.inf)

    def bind(self, loop: Any) -> Bound:
        """The goal on one loop."""
        each = (DelayMeasure(loop.sensitivity((p,), self.openings), self.delay, p) for p in self.points)
        return Bound(self, Largest(tuple(each)))


def whole_samples(S: Realisation, h: float, delay: float) -> tuple[float, float]:
    """delay over the dead time that destabilises, between two whole numbers of samples: from below and above.

    S is sampled. With d samples more 1 + (1 − S)(z^−d − 1) vanishes at the loop's poles.
    """
    A, B, C, D = S
    n, most = len(A), math.ceil(delay / h)
    if most > MOST_SAMPLES or D[0, 0] == 0:
        return 0.0, math.inf
    push = -C / D[0, 0]  # what the chain adds to the point, by x; by the chain's end 1/D
    for d in range(1, most + 1):
        late = np.zeros((n + d, n + d))
        late[:n, :n], late[:n, -1:] = A + B @ push, B / D[0, 0]
        late[n, :n], late[n, -1] = (C + (D[0, 0] - 1) * push)[0], (D[0, 0] - 1) / D[0, 0]
        late[n + 1 :, n:-1] += np.eye(d - 1)
        if np.abs(np.linalg.eigvals(late)).max() >= 1:
            return delay / (d * h), delay / ((d - 1) * h) if d > 1 else math.inf
    return delay / ((most + 1) * h), delay / (most * h)


@dataclass(frozen=True, slots=True)
class DelayMeasure:
    """delay/min over |L(jω)| = 1 of (arg L(jω) + π mod 2π)/ω, L = 1/S − 1 at one point."""

    channel: Any
    delay: float
    point: str

    def evaluate(self, K: "Controller") -> Value:
        """Crossings bracketed on a grid made from the poles, then bisected."""
        return self._value(K, "normal")

    def exact(self, K: "Controller") -> Value:
        """Every crossing; of a sampled loop that is strong up to its Nyquist frequency, whole samples too."""
        state = sampled(self.channel, K, judged=True)
        if state.reason:
            return infinite(state.reason)
        h, steered = self.channel.sample_time, self._value(K, "normal")
        T, late = state.system, np.zeros(len(state.system.A))
        if self.channel.delayed:
            T, late = self.channel.lined_system(K), self.channel.late(K)
        strong = float(T.D[0, 0]) <= 0.5 * (1 + ROUNDED)  # |L| ≥ 1 at the end of the axis
        if strong and h is None:
            return infinite(NO_ROLL_OFF, method=EVERY)
        grid = seeds(state.poles, np.zeros(0), (0.0, math.inf))
        found = crossings(enclosure(T, late), grid[np.isfinite(grid)])
        if found.reason:
            return replace(steered, gradients=(), upper=math.inf, reason=found.reason, method="not judged")
        value, upper, where = self._largest(state, found.intervals)
        if strong:
            low, high = whole_samples(self.channel.system(K), float(h or 0.0), self.delay)
            value, upper = max(value, low), max(upper, high)
            if high == math.inf:
                reason = NO_SAMPLE
                return Value(value=value, upper=upper, frequency=where, channel=self.point, reason=reason, method=EVERY)
        reason = "" if value else "the loop gain passes 1 nowhere; any dead time is borne."
        return Value(value=value, upper=upper, frequency=where, channel=self.point, reason=reason, method=EVERY)

    def _largest(self, state: Sampled, intervals: np.ndarray) -> tuple[float, float, float | None]:
        """The value, an upper bound and the frequency of the crossing that binds."""
        if len(intervals) == 0:
            return 0.0, 0.0, None
        h = self.channel.sample_time
        true = intervals if h is None else unwarped(intervals, h)
        omega = pursued(lambda at: self._excess(state, at), true)
        lag = np.angle(-self._loop(state, omega)) % (2 * math.pi)
        values = self.delay * omega / np.where(lag == 0, 2 * math.pi, lag)
        worst = int(np.argmax(values))
        return float(values[worst]), float(values[worst]) * (1 + PURSUED), float(omega[worst])

    def _value(self, K: "Controller", density: str) -> Value:
        state = sampled(self.channel, K)
        if state.reason:
            return infinite(state.reason)
        h = self.channel.sample_time
        top = math.inf if h is None else math.pi / h
        poles = state.poles if h is None else state.poles.real + 1j * unwarped(state.poles.imag, h)
        grid = seeds(poles, np.zeros(0), (0.0, top), density)
        finite = grid[np.isfinite(grid) & (grid > 0)]
        if abs(self._loop(state, finite[-1:])[0]) >= 1:
            if h is None:
                return infinite(NO_ROLL_OFF)
            if whole_samples(self.channel.system(K), h, self.delay)[1] == math.inf:
                return infinite(NO_SAMPLE)
        for sign in (1, -1):  # where |L| comes close to 1 from either side between two frequencies
            extrema = local_peaks(lambda omega, sign=sign: np.minimum(sign * self._excess(state, omega), 0.0), finite)
            finite = np.unique(np.r_[finite, [omega for omega, _ in extrema]])
        gain = self._excess(state, finite)
        ends = np.flatnonzero((gain[1:] > 0) != (gain[:-1] > 0))
        if len(ends) == 0:
            return Value(
                value=0.0, channel=self.point, reason="the loop gain passes 1 nowhere; any dead time is borne."
            )
        between = np.stack([finite[ends], finite[ends + 1]], axis=1)
        omega = pursued(lambda at: self._excess(state, at), between)
        lag = np.angle(-self._loop(state, omega)) % (2 * math.pi)
        lag = np.where(lag == 0, 2 * math.pi, lag)
        values = self.delay * omega / lag
        worst = int(np.argmax(values))
        pieces = [
            (
                float(v),
                self.channel.response_pullback(K, np.array([w]), self._weight(state, float(w), float(a), float(v))),
            )
            for v, w, a in zip(values, omega, lag, strict=True)
            if v >= values[worst] * (1 - NEAR)
        ]
        return Value(
            value=float(values[worst]), gradients=near(pieces), frequency=float(omega[worst]), channel=self.point,
            method="crossings on a pole-based grid",
        )  # fmt: skip

    def _loop(self, state: Sampled, omega: np.ndarray) -> np.ndarray:
        S = state.response(Axis.of(omega, self.channel.sample_time))[:, 0, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            return (1 - S) / S

    def _excess(self, state: Sampled, omega: np.ndarray) -> np.ndarray:
        """Positive where |L| > 1: 1/2 − Re S, finite everywhere."""
        S = state.response(Axis.of(omega, self.channel.sample_time))[:, 0, 0]
        return 0.5 - S.real

    def _weight(self, state: Sampled, omega: float, lag: float, value: float) -> np.ndarray:
        """W of value = delay·ω/lag, with ω and lag following L: ∂ω = −Re(∂L/L)/Re(L'/L), ∂lag = Im(∂L/L + L'/L ∂ω).

        L'/L is ∂ log L/∂ω along the axis, from four values (error of the fourth order in a step of 1e-3 ω).
        """
        L = self._loop(state, np.array([omega]))[0]
        step = 1e-3 * omega * min(1.0, self._distance(state, omega))
        around = np.log(self._loop(state, omega + step * np.array([-2.0, -1.0, 1.0, 2.0])) / L)
        slope = (8 * (around[2] - around[1]) - (around[3] - around[0])) / (12 * step)
        S = 1 / (1 + L)
        relative = -1 / (S**2 * L)  # ∂L/L = relative · ∂S
        # value = delay ω/lag: ∂value = value (∂ω/ω − ∂lag/lag), ∂ω = −Re(relative ∂S)/Re(slope)
        by_omega = value * (1 / omega - slope.imag / lag)
        coefficient = by_omega * (-relative / slope.real) + value / lag * 1j * relative
        return np.array([[[np.conj(coefficient)]]])

    def _distance(self, state: Sampled, omega: float) -> float:
        """Of jω to the nearest pole, over ω."""
        return float(np.abs(1j * omega - state.poles).min(initial=omega) / omega)

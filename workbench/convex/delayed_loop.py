"""A plant with dead times under a law affine in its gains: peaks of S, T and Q, proved at all frequencies; stability.

DelayedPlant, AffineLaw, gains --dense frequencies, refined at the peaks--> largest σ_max of S, T, Q and where
                               --intervals with bounds of the slopes------> a ceiling that holds between them too
                               --turns of det(sI + P·sK), each step proved-> poles in the right half plane
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from workbench.convex.delayed import AffineLaw, DelayedPlant
from workbench.errors import InputError

MEASURES = ("S", "T", "Q")
MOST_INTERVALS = 400_000  # of one proof; a margin of 1e-5 needs some thousands


@dataclass(frozen=True, slots=True)
class Sample:
    """Plant and law at frequencies: W = jωI + P Σ x_i Φ_i and what is divided by it, affine in the gains.

    omega : (k,);  W : (k, n, p, p) per gain;  Y : S (jωI, no gain), T (k, n, p, p), Q (k, n, m, p)
    """

    omega: np.ndarray
    W: np.ndarray
    Q: np.ndarray

    @classmethod
    def of(cls, plant: DelayedPlant, law: AffineLaw, omega) -> "Sample":
        """At angular frequencies (k,)."""
        if plant.shape != law.shape[::-1]:
            raise InputError(
                f"the law must have as many inputs as the plant has outputs and the reverse; got plant {plant.shape}, "
                f"law {law.shape}. Make them agree."
            )
        omega = np.asarray(omega, float)
        basis = law.basis(omega)
        return cls(omega, plant.response(omega)[:, None] @ basis, basis)

    def take(self, chosen) -> "Sample":
        """Some of the frequencies."""
        return Sample(self.omega[chosen], self.W[chosen], self.Q[chosen])

    def joined(self, other: "Sample") -> "Sample":
        """Both, in order of frequency."""
        order = np.argsort(np.r_[self.omega, other.omega], kind="stable")
        pairs = ((self.omega, other.omega), (self.W, other.W), (self.Q, other.Q))
        return Sample(*(np.concatenate(pair)[order] for pair in pairs))

    def returned(self, x: np.ndarray) -> np.ndarray:
        """W (k, p, p)."""
        p = self.W.shape[-1]
        return 1j * self.omega[:, None, None] * np.eye(p) + np.einsum("i,kiab->kab", x, self.W)

    def over(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Numerators of S, T, Q: (k, p, p), (k, p, p), (k, m, p)."""
        p = self.W.shape[-1]
        return {
            "S": 1j * self.omega[:, None, None] * np.eye(p),
            "T": np.einsum("i,kiab->kab", x, self.W),
            "Q": np.einsum("i,kiab->kab", x, self.Q),
        }

    def peaks(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """σ_max of S, T, Q at each frequency, (k,)."""
        inverse = np.linalg.inv(self.returned(x))
        return {name: np.linalg.svd(Y @ inverse, compute_uv=False)[:, 0] for name, Y in self.over(x).items()}


@lru_cache(maxsize=8)
def dense(plant: DelayedPlant, law: AffineLaw, count: int = 3000) -> Sample:
    """Zero, and frequencies from three decades below the slowest rate of plant and law to two above the fastest."""
    rates = [abs(p) for t in law.terms for p in t.function.times_s().poles()]
    fastest = max([plant.fastest(), *rates])
    return Sample.of(plant, law, np.r_[0.0, np.geomspace(plant.slowest() / 1e3, fastest * 1e2, count)])


def worst_peaks(plant: DelayedPlant, law: AffineLaw, x: np.ndarray) -> dict[str, tuple[float, float]]:
    """Largest σ_max of S, T, Q and its frequency: dense frequencies, then each local peak refined thrice."""
    sample = dense(plant, law)
    values = sample.peaks(x)
    found = {}
    for name, curve in values.items():
        best = int(np.argmax(curve))
        top = (float(curve[best]), float(sample.omega[best]))
        for centre in local_peaks(curve, 0.98 * top[0]):
            low, high = sample.omega[max(centre - 1, 0)], sample.omega[min(centre + 1, len(curve) - 1)]
            for _ in range(3):
                fine = Sample.of(plant, law, np.linspace(low, high, 33))
                level = fine.peaks(x)[name]
                k = int(np.argmax(level))
                top = max(top, (float(level[k]), float(fine.omega[k])))
                low, high = fine.omega[max(k - 1, 0)], fine.omega[min(k + 1, 32)]
        found[name] = top
    return found


def local_peaks(curve: np.ndarray, above: float) -> np.ndarray:
    """Indices of the local maxima, ends included, that exceed a level."""
    padded = np.r_[-math.inf, curve, -math.inf]
    return np.flatnonzero((curve >= padded[:-2]) & (curve > padded[2:]) & (curve > above))


def unstable_poles(plant: DelayedPlant, law: AffineLaw, x: np.ndarray) -> int:
    """How many closed-loop poles lie in the closed right half plane, with exact dead times; −1 if undecided.

    For a stable plant and a law stable but for integrators, det(sI + P·sK)/sᵖ is analytic there but at 0 and tends to 1
    for a strictly proper plant, so the zeros of W = sI + P·sK are counted by its turns along the imaginary axis. A step
    about m is accepted where ‖W⁻¹‖ ‖ΔW‖ ≤ ρ < 1 on all of it: det W has no zero there, and its turn differs from
    Im tr W⁻¹ΔW by no more than p (−log(1 − ρ) − ρ), so that the nearer multiple of 2π is known.
    """
    if any(len(e.numerator) == len(e.denominator) and e.numerator[0] for row in plant.entries for e in row):
        raise InputError("the count of turns needs a strictly proper plant; got an entry with feedthrough.")
    omega, p = dense(plant, law).omega, plant.shape[0]
    far = omega[-1]
    for _ in range(40):  # on to where the loop gain is small for good: |P K| falls at least as 1/ω there
        gain = np.linalg.norm(Sample.of(plant, law, np.array([far])).over(x)["T"][0]) / far
        if gain < 0.1:
            break
        far *= 4
    omega = np.r_[omega, np.geomspace(omega[-1], far, 200)[1:]] if far > omega[-1] else omega
    if not np.isfinite(x).all() or np.linalg.slogdet(Sample.of(plant, law, omega[:1]).returned(x))[0][0] == 0:
        return -1  # a pole at rest
    low, high, total, tested = omega[:-1], omega[1:], 0.0, 0
    while len(low):
        tested += len(low)
        if tested > MOST_INTERVALS:
            return -1
        sound, turned = _turns(plant, law, x, low, high)
        total += float(turned[sound].sum())
        low, high = low[~sound], high[~sound]
        if len(low) and (high - low <= 1e-12 * np.maximum(high, omega[1])).any():
            return -1  # a pole on the axis, or nearer to it than rounding tells
        middle = (low + high) / 2
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    # beyond, det W/sᵖ goes to 1 within a disc of radius < 1 that does not hold 0; W is real at rest
    last = np.linalg.slogdet(Sample.of(plant, law, omega[-1:]).returned(x) / (1j * omega[-1]))[0][0]
    zeros = p / 2 - (total - np.angle(last)) / math.pi
    return round(float(zeros)) if abs(zeros - round(float(zeros))) < 0.1 else -1


def _turns(plant, law, x, low, high) -> tuple[np.ndarray, np.ndarray]:
    """Which intervals are accepted, and the turn of det W over each."""
    middle, half, p = (low + high) / 2, (high - low) / 2, plant.shape[0]
    W, at_low, at_high = (Sample.of(plant, law, at).returned(x) for at in (middle, low, high))
    try:
        inverse = np.linalg.inv(W)
    except np.linalg.LinAlgError:
        return np.zeros(len(low), bool), np.zeros(len(low))
    moved = half * (1 + _loop_slope(plant, law, x, low, high, middle))
    size = np.linalg.norm(inverse, 2, axis=(1, 2)) * moved
    with np.errstate(divide="ignore", invalid="ignore"):
        sound = (size < 1) & (p * (-np.log1p(-np.minimum(size, 1.0)) - size) < math.pi / 2)
    start, turned = np.linalg.slogdet(W)[0], np.zeros(len(low))
    for sign, other in ((-1, at_low), (1, at_high)):
        predicted = np.einsum("kij,kji->k", inverse, other - W).imag
        with np.errstate(invalid="ignore", divide="ignore"):
            found = np.angle(np.linalg.slogdet(other)[0] / start)
        turned += sign * (found + 2 * math.pi * np.round((predicted - found) / (2 * math.pi)))
    return sound, turned


def _loop_slope(plant, law, x, low, high, middle) -> np.ndarray:
    """Bounds (k,) of ‖d(P·sK)/dω‖ on intervals."""
    half, sample = (high - low) / 2, Sample.of(plant, law, middle)
    plant_slope = plant.slope_bound(low, high)
    largest_plant = np.linalg.norm(plant.response(middle), axis=(1, 2)) + half * plant_slope
    largest_law = np.linalg.norm(sample.over(x)["Q"], axis=(1, 2))
    return largest_plant * law.slope_bound(x, low, high) + plant_slope * largest_law


def ceiling_holds(plant: DelayedPlant, law: AffineLaw, x: np.ndarray, limits: dict[str, float]) -> float | None:
    """None if S, T and Q stay below their limits at every frequency from 0 to ∞; else one where that is false or open.

    On an interval of half width r about m, ‖ΔW‖ ≤ r_W and ‖ΔY‖ ≤ r_Y from bounds of the slopes, so
    ‖Y W⁻¹‖ ≤ (‖Y W⁻¹‖_m + ‖W⁻¹‖_m r_Y)/(1 − ‖W⁻¹‖_m r_W). Intervals that this leaves undecided are halved. Beyond the
    last one, ‖P K‖ bounded by its tail decides. Floating point, not outward-rounded.
    """
    end = dense(plant, law).omega[-1]
    for _ in range(60):
        if _tail_holds(plant, law, x, limits, end):
            break
        end *= 2
    else:
        return math.inf
    edges = np.r_[0.0, np.geomspace(dense(plant, law).omega[1], end, 400)]
    low, high, tested = edges[:-1], edges[1:], 0
    while len(low):
        tested += len(low)
        if tested > MOST_INTERVALS:
            return float((low[0] + high[0]) / 2)
        holds, passed = _interval_holds(plant, law, x, limits, low, high)
        middle = (low + high) / 2
        if passed.any():
            return float(middle[np.argmax(passed)])
        low, high, middle = low[~holds], high[~holds], middle[~holds]
        if len(middle) and (high - low < 1e-12 * high).any():
            return float(middle[np.argmin((high - low) / high)])
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    return None


def _interval_holds(plant, law, x, limits, low, high) -> tuple[np.ndarray, np.ndarray]:
    """Where the limits hold on the whole interval, and where one is passed in its middle."""
    middle, half = (low + high) / 2, (high - low) / 2
    sample = Sample.of(plant, law, middle)
    inverse = np.linalg.inv(sample.returned(x))
    size = np.linalg.norm(inverse, 2, axis=(1, 2))
    over = sample.over(x)
    law_slope = law.slope_bound(x, low, high)
    loop_slope = _loop_slope(plant, law, x, low, high, middle)
    room = 1 - size * half * (1 + loop_slope)
    good, passed = room > 0, np.zeros(len(low), bool)
    for name, slope in (("S", np.ones_like(half)), ("T", loop_slope), ("Q", law_slope)):
        if name in limits:
            here = np.linalg.norm(over[name] @ inverse, 2, axis=(1, 2))
            good &= here + size * half * slope <= limits[name] * room
            passed |= here > limits[name]
    return good, passed


def _tail_holds(plant, law, x, limits, start: float) -> bool:
    """Whether the limits hold for all ω ≥ start because ‖P‖ ‖K‖ is small there.

    Beyond every corner |c/(jω − p)| ≤ c/√(ω² + Re² p − …) falls; each entry is bounded by its value at |s| − |root|.
    """

    def bound(f) -> float:
        top = np.trim_zeros(f.numerator, "f")
        if not top:
            return 0.0
        zeros, poles = np.roots(top), f.poles()
        if start <= 4 * max([0.0, *np.abs(zeros), *np.abs(poles)]):
            return math.inf
        rise = np.prod([1 + abs(z) / start for z in zeros])
        fall = np.prod([1 - abs(p) / start for p in poles])
        return float(abs(top[0] / f.denominator[0]) * start ** (len(zeros) - len(poles)) * rise / fall)

    gain_p = math.sqrt(sum(bound(e) ** 2 for row in plant.entries for e in row))
    places = np.zeros(law.shape)
    rest = np.zeros(law.shape)  # what is left of K beyond its value at infinity
    infinite = np.zeros(law.shape)
    for value, t in zip(x, law.terms, strict=True):
        f = t.function
        places[t.row, t.column] += abs(value) * bound(f)
        last = f.numerator[0] / f.denominator[0] if len(f.numerator) == len(f.denominator) else 0.0
        infinite[t.row, t.column] += value * last
        lower = np.polysub(f.numerator, last * np.array(f.denominator))
        remainder = type(f)(numerator=tuple(np.atleast_1d(lower)[-max(len(f.denominator) - 1, 1):]),
                            denominator=f.denominator) if len(f.denominator) > 1 else None  # fmt: skip
        rest[t.row, t.column] += abs(value) * (bound(remainder) if remainder else 0.0)
    loop = gain_p * float(np.linalg.norm(places))
    if not loop < 1:
        return False
    law_gain = float(np.linalg.norm(infinite, 2) + np.linalg.norm(rest))
    ceilings = {"S": 1 / (1 - loop), "T": loop / (1 - loop), "Q": law_gain / (1 - loop)}
    return all(ceilings[name] <= limit for name, limit in limits.items())

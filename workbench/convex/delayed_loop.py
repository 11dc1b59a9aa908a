"""A plant with dead times under a law affine in its gains: peaks of S, T and Q, proved at all frequencies; stability.

DelayedPlant, AffineLaw, gains --dense frequencies, refined at the peaks--> largest σ_max of S, T, Q and where
                               --intervals with bounds of the slopes------> a ceiling that holds between them too
                               --as a model with delay lines--------------> poles in the right half plane, counted
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from workbench.convex.delayed import AffineLaw, DelayedPlant
from workbench.errors import InputError
from workbench.lti.connect import connect
from workbench.lti.count import TooManySteps
from workbench.lti.make import tf
from workbench.lti.model import Model
from workbench.lti.peak_search import local_peaks as refined

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
    """Largest σ_max of S, T, Q and its frequency: dense frequencies, then the local peaks refined."""
    found = {}
    for name in MEASURES:
        omega, value = refined(lambda at, name=name: Sample.of(plant, law, at).peaks(x)[name], dense(plant, law).omega)[
            0
        ]
        found[name] = value, omega
    return found


def local_peaks(curve: np.ndarray, above: float) -> np.ndarray:
    """Indices of the local maxima, ends included, that exceed a level."""
    padded = np.r_[-math.inf, curve, -math.inf]
    return np.flatnonzero((curve >= padded[:-2]) & (curve > padded[2:]) & (curve > above))


def closed(plant: DelayedPlant, law: AffineLaw, x: np.ndarray) -> Model:
    """The loop at rest as a model with its dead times; every kind of function in the law is a system of its own."""
    p, m = plant.shape
    u, y = [f"u{k + 1}" for k in range(m)], [f"y{k + 1}" for k in range(p)]
    systems = [_table([[e.numerator for e in row] for row in plant.entries], plant.entries, u, y)]
    kinds = list(dict.fromkeys(t.function for t in law.terms))
    for n, kind in enumerate(kinds):
        gains = np.zeros(law.shape)
        for value, term in zip(x, law.terms, strict=True):
            gains[term.row, term.column] += value * (term.function == kind)
        numerators = [[tuple(g * c for c in kind.numerator) for g in row] for row in gains]
        systems.append(_table(numerators, [[kind] * p] * m, [f"-{name}" for name in y], [f"{n} of {a}" for a in u]))
    links = {name: " + ".join(f"{n} of {name}" for n in range(len(kinds))) for name in u}
    return connect(systems, inputs=(), outputs=(), links=links)


def _table(numerators, entries, inputs, outputs) -> Model:
    return tf(
        numerators, [[e.denominator for e in row] for row in entries], input=inputs, output=outputs,
        dead_time=[[e.delay for e in row] for row in entries],
    )  # fmt: skip


def unstable_poles(plant: DelayedPlant, law: AffineLaw, x: np.ndarray) -> int:
    """How many closed-loop poles lie in the closed right half plane, with exact dead times; −1 if undecided."""
    try:
        return closed(plant, law, x).unstable_poles() if np.isfinite(x).all() else -1
    except TooManySteps:
        return -1


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

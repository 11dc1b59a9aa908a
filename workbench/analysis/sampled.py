"""The closed loop as a digital controller closes it: exact between the samples, with the time the computer needs.

    sensors at t = kT --DiscreteLaw--> commands, held from kT + delay on --Plant--> sensors at (k+1)T

The plant is advanced by the matrix exponential, so nothing is approximated: poles are those of the map from one sample
to the next. Poles z are shown as s = ln(z)/T, the continuous modes that pass through the same samples.
"""

from dataclasses import dataclass

import numpy as np

from workbench.control.discrete import DiscreteLaw
from workbench.errors import InputError
from workbench.lti import Plant
from workbench.lti.hold import LARGEST, held
from workbench.lti.join import beside, wired
from workbench.lti.measure import sampled_peak
from workbench.lti.model import Model
from workbench.lti.norm import Peak
from workbench.lti.realisation import Realisation
from workbench.result import Result, Row

MOST_DELAY = 50  # samples; beyond, the delay line is longer than any loop here bears
PASSED = 1e-9  # |z| of a pole that is a delay gone by (guide, Definitions: Sampled loop)
BISECTIONS = 30  # of a delay: to 1e-9 of the interval


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class SampledLoop(Result):
    """A sampled closed loop at one sample time and one computing delay.

    poles : (n,) eigenvalues of the map from one sample to the next [1]
    damping, decay : smallest damping ratio [1] and decay rate [1/s] of ln(poles)/T; None if unstable
    peak_sensitivity : of (I + L)⁻¹ at the commands, seen at the samples; None if unstable
    delay_reserve : how much longer the computing delay may become before the loop loses stability [s]; 0 if unstable
    """

    sample_time: float
    computing_delay: float
    stable: bool
    poles: np.ndarray
    damping: float | None
    decay: float | None
    peak_sensitivity: Peak | None
    delay_reserve: float

    def rows(self) -> list[Row]:
        peak = self.peak_sensitivity
        return [
            ("sample time", 1e3 * self.sample_time, "ms"),
            ("computing delay", 1e3 * self.computing_delay, "ms"),
            ("stable", self.stable, ""),
            ("smallest damping ratio", self.damping, ""),
            ("slowest decay", self.decay, "1/s"),
            ("peak sensitivity", None if peak is None else peak.upper, ""),
            ("delay reserve", 1e3 * self.delay_reserve, "ms"),
        ]


def sampled_loop(
    plant: Plant, law: DiscreteLaw, commands, sensors, *, computing_delay: float = 0.0, reserve: bool = True
) -> SampledLoop:
    """The exact sampled-data loop of a plant and a sampled law.

    Parameters
    ----------
    commands, sensors : names of the plant's inputs and outputs in the order the law takes them
    computing_delay : time from sampling the sensors to the new commands [s], 0 or more
    reserve : whether to search the delay at which stability is lost

    Raises
    ------
    InputError
        If the delay is negative or longer than `MOST_DELAY` samples, or names are not the plant's.

    Source: Åström & Wittenmark, Computer-Controlled Systems, sampling a system with a time delay.
    """
    T = law.sample_time
    if not 0 <= computing_delay <= MOST_DELAY * T:
        raise InputError(
            f"the computing delay must lie between 0 and {MOST_DELAY} samples, {1e3 * MOST_DELAY * T:g} ms; "
            f"got {1e3 * computing_delay:g} ms. Sample more slowly, or compute faster."
        )
    seen = plant.select(inputs=commands, outputs=sensors)
    A, B, C, D = _closed(between_samples(seen, T, computing_delay), moving(law))
    closed = Realisation(A, B, C[len(sensors) :], D[len(sensors) :])
    for matrix in closed:
        _check_range(matrix)
    poles = np.linalg.eigvals(closed[0])
    if not np.abs(poles).max() < 1:
        return SampledLoop(
            sample_time=T, computing_delay=computing_delay, stable=False, poles=poles,
            damping=None, decay=None, peak_sensitivity=None, delay_reserve=0.0,
        )  # fmt: skip
    # a pole at z = 0 is a delay that has passed: it decays at once and has no damping ratio
    lasting = poles[np.abs(poles) > PASSED]
    s = np.log(lasting) / T
    return SampledLoop(
        sample_time=T, computing_delay=computing_delay, stable=True, poles=poles,
        damping=float(np.min(-s.real / np.abs(s))), decay=float(np.min(-s.real)),
        peak_sensitivity=sampled_peak(*closed, T),
        delay_reserve=_reserve(seen, law, computing_delay) if reserve else 0.0,
    )  # fmt: skip


def moving(law: DiscreteLaw) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(A, B, C, D) of a sampled law without the filters that are not needed, whose states would never move."""
    A, B, C, D = law.state_space()
    kept = np.flatnonzero(law.advance)
    return A[np.ix_(kept, kept)], B[kept], C[:, kept], D


def closed_map(plant: Plant, law: DiscreteLaw, commands, sensors, computing_delay: float = 0.0):
    """(A, B, C, D) from sample to sample of the closed loop, from command errors to the sensors the law reads."""
    A, B, C = between_samples(plant.select(inputs=commands, outputs=sensors), law.sample_time, computing_delay)
    A, B, C, D = _closed((A, B, C), moving(law))
    return A, B, C[: len(sensors)], D[: len(sensors)]


def between_samples(plant: Plant, T: float, delay: float):
    """(A, B, C) from new commands to sensors, from sample to sample; see `lti.hold`."""
    between = held(Model("plant", plant), T, delay).plant
    return between.A, between.B, between.C


def _check_range(matrix: np.ndarray) -> None:
    """Refuses numbers whose squares double precision does not hold, as those of a plant in unfit units are."""
    if not np.abs(matrix).max(initial=0.0) < LARGEST:
        raise InputError(
            f"the sampled loop must have entries below {LARGEST:g}, so that it can be computed; it has larger ones. "
            "Check the plant's numbers and units, and the sample time."
        )


def _closed(plant, law) -> Realisation:
    """The loop from command errors to sensors and commands. States: the plant's, then the law's."""
    A, B, C = plant
    p, m = len(C), B.shape[1]
    whole = beside(Realisation(A, B, C, np.zeros((p, m))), Realisation(*law))
    back, into = np.zeros((m + p, p + m)), np.eye(m + p, m)
    back[:m, p:], back[m:, :p] = np.eye(m), np.eye(p)
    return wired(whole, back, into, np.eye(p + m), np.eye(p + m, m, -p))


def _reserve(plant: Plant, law: DiscreteLaw, delay: float) -> float:
    """From a stable delay to the nearest one, on a grid of half samples and then by bisection, that is not."""

    def stable(value: float) -> bool:
        A, *_ = _closed(between_samples(plant, law.sample_time, value), moving(law))
        return bool(np.abs(np.linalg.eigvals(A)).max() < 1)

    low = high = delay
    while stable(high):
        low, high = high, high + law.sample_time / 2
        if high > MOST_DELAY * law.sample_time:
            return low - delay
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low - delay

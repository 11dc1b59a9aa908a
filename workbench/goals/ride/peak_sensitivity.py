"""How far a disturbance at the current commands is amplified at the worst frequency, in each group of motion."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.analysis.sampled import SampledLoop
from workbench.goals.goal import Rows
from workbench.goals.key import Key
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Found, MarginRequirement, Screened, of_stable
from workbench.lti.norm import peak_gain

SENSED_HZ = (0.02, 60.0)  # grid nodes at which the sensitivity is constrained; it tends to 1 outside
PEAK_TOLERANCE = 1e-6  # relative width of the bracket of a peak where many models are looked at


@dataclass(frozen=True, slots=True, kw_only=True)
class PeakSensitivity(MarginRequirement):
    """σ_max(S) at the commands of each group stays below this at every frequency.

    Source: guide, Definitions: Sensitivity.
    """

    kind, sense, unit = "peak sensitivity", "<=", "1"
    keys = (Key("peak_sensitivity_at_most", "limit"),)
    in_analysis = True
    relaxed_first = boxed = by_group = True

    def steer(self, point: Evaluated) -> Rows:
        limit = self.asked_at(point.back_off) ** 2
        out = []
        for group, found in zip(point.groups, point.responses, strict=True):
            hertz = group.nodes / (2 * np.pi)
            kept = (hertz >= SENSED_HZ[0]) & (hertz <= SENSED_HZ[1])
            kept[len(group.omega) :] = True  # what is watched was seen to matter
            row = 1 - found.peak.value[kept] / limit, -found.peak.gradient[kept] / limit
            out.append((f"{self.name} of {group.subject.name}", *row))
        return out

    def missed(self, loop: Flown, most: float) -> Iterable[float]:
        return [omega for _, omega, value in exact_peaks(loop) if value > most]

    def sampled(self, loop: SampledLoop) -> float | None:
        return loop.peak_sensitivity and loop.peak_sensitivity.upper

    def found(self, loop: Flown) -> Found:
        peaks = [(group, peak) for group, peak in loop.analysis.peak_sensitivity.items() if peak is not None]
        return [(peak.upper, f"{group}, {peak.frequency / (2 * np.pi):.3g} Hz") for group, peak in peaks]

    def least(self, loop: Flown) -> tuple[float, str]:
        peaks = [(peak_gain(*s.sensitivity(closed), tolerance=PEAK_TOLERANCE), s.name) for s, closed in loop.closed]
        peak, group = max(peaks, key=lambda found: found[0].upper)
        return peak.upper, f"{group}, {peak.frequency / (2 * np.pi):.3g} Hz"

    def screened(self, many: Screened) -> np.ndarray:
        own = [c.only(many.stable).peak() for c in many.closed] if len(many.stable) else [np.zeros(0)]
        return of_stable(many, np.max(own, axis=0))

    def quantities(self, groups: Sequence[str]) -> tuple[str, ...]:
        return tuple(f"peak_sensitivity.{'heave_pitch' if name == 'heave' else name}" for name in groups)


def exact_peaks(loop: Flown) -> list[tuple[int, float, float]]:
    """(group number, frequency [rad/s], σ_max(S)) at the exact peak of each group; nothing for an unstable one."""
    out = []
    for number, ((subject, closed), poles) in enumerate(zip(loop.closed, loop.poles, strict=True)):
        if poles.real.max() < 0:
            peak = peak_gain(*subject.sensitivity(closed))
            if np.isfinite(peak.frequency):
                out.append((number, peak.frequency, peak.upper))
    return out

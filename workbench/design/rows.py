"""Rows of a nonlinear programme: each requirement as smooth numbers >= 0 where it is met, with their derivatives.

    Evaluated (one theta: responses, mean squares, eigenvalues, rest) --ROWS[requirement]--> [(name, values, gradient)]

Rows are relative to the limit: 0.01 is one per cent. Every quantity that may be required has its entry in `ROWS`; what
it steers by is what `verdict` judges, up to the frequency grid, whose error `exchange` closes.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workbench.analysis.comfort_summary import mask_for
from workbench.analysis.motor import current_at_3_sigma, slope_at_3_sigma
from workbench.analysis.setting import Setting
from workbench.design.delayed import damping_slope
from workbench.design.measures import MOTOR_SQUARES, GroupMeasures, Responses, Values, gap_rows
from workbench.design.requirement import MOTOR_CURRENT, RIDE_MASKS, STABLE_DECAY

SLOWEST = 4  # eigenvalues per group whose damping and decay are constrained: the others are far from the limits
SENSED_HZ = (0.02, 60.0)  # grid nodes at which the sensitivity is constrained; it tends to 1 outside
PEAK_SIGMAS = 3.0
AXES = {"vertical": "acceleration z", "lateral": "acceleration y"}  # classes of measures by direction of a mask
KINDS = {"gap": "gap", "lateral gap": "gap_lateral"}  # word in a requirement to kind of output

Rows = list[tuple[str, np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Evaluated:
    """What the rows of all requirements share at one theta; what only some need is computed when asked for.

    back_off : relative distance kept from every limit;  responses : of each group
    squares, slopes : mean squares over all groups by class, and their derivatives (17,)
    static : theta -> (gaps,), (gaps, 17), as of `measures.static_error_function`
    """

    setting: Setting
    groups: Sequence[GroupMeasures]
    theta: np.ndarray
    back_off: float
    responses: Sequence[Responses]
    squares: Mapping[str, float]
    slopes: Mapping[str, np.ndarray]
    static_function: Callable

    @cached_property
    def poles(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Upper eigenvalues of each group and their derivatives (k, 17)."""
        out = []
        for group in self.groups:
            values, slopes = group.eigenvalues(self.theta)
            upper = np.flatnonzero(values.imag >= 0)
            out.append((values[upper], slopes[upper]))
        return out

    @cached_property
    def static(self) -> dict[str, Values]:
        """Static change of each right-hand set's gap from accelerometer bias, by kind."""
        value, slope = (m.copy() for m in self.static_function(self.theta))
        kinds = gap_rows(self.setting)
        parts = [np.split(m, len(kinds)) for m in (value.ravel(), slope)]
        return {kind: Values(v, d) for kind, v, d in zip(kinds, *parts, strict=True)}

    def noise(self, kind: str) -> tuple[float, np.ndarray]:
        """Mean square of the worst set's gap under sensor noise, and its derivative (17,)."""
        parts = [group.noise(self.theta, gap_rows(self.setting)[kind]) for group in self.groups]
        value, slope = sum(p.value for p in parts), sum(p.gradient for p in parts)
        worst = int(np.argmax(value))
        return float(value[worst]), slope[worst]


def count(group: GroupMeasures) -> int:
    """Eigenvalues of a group that get a row: there are at least so many upper ones, however many are real."""
    return min(SLOWEST, (group.size + 1) // 2)


def decay_rate(at: Evaluated, name: str, limit: float) -> Rows:
    decay = max(limit * (1 + at.back_off), STABLE_DECAY)
    out = []
    for group, (values, slopes) in zip(at.groups, at.poles, strict=True):
        slow = np.argsort(-values.real)[: count(group)]
        out.append((f"{name} of {group.subject.name}", -values.real[slow] / decay - 1, -slopes.real[slow] / decay))
    return out


def damping_ratio(at: Evaluated, name: str, limit: float) -> Rows:
    asked = limit * (1 + at.back_off)
    out = []
    for group, (values, slopes) in zip(at.groups, at.poles, strict=True):
        ratio = -values.real / np.abs(values)
        worst = np.argsort(ratio)[: count(group)]
        slope = damping_slope(values[worst], slopes[worst])
        out.append((f"{name} of {group.subject.name}", ratio[worst] / asked - 1, slope / asked))
    return out


def peak_sensitivity(at: Evaluated, name: str, limit: float) -> Rows:
    limit = (limit * (1 - at.back_off)) ** 2
    out = []
    for group, found in zip(at.groups, at.responses, strict=True):
        hertz = group.nodes / (2 * np.pi)
        kept = (hertz >= SENSED_HZ[0]) & (hertz <= SENSED_HZ[1])
        kept[len(group.omega) :] = True  # what is watched was seen to matter
        peak = found.peak
        row = 1 - peak.value[kept] / limit, -peak.gradient[kept] / limit
        out.append((f"{name} of {group.subject.name}", *row))
    return out


def delay_margin(at: Evaluated, name: str, limit: float) -> Rows:
    """Damping ratios of the loop with the dead time asked for, in each pattern's command in turn."""
    out = []
    for group in at.groups:
        found = group.delayed_damping(at.theta, limit * (1 + at.back_off), count(group))
        out.append((f"{name} of {group.subject.name}", found.value, found.gradient))
    return out


def rms_gap(at: Evaluated, name: str, limit: float) -> Rows:
    limit = (limit * (1 - at.back_off)) ** 2
    place = name.removeprefix("rms ")
    return [(name, np.array([1 - at.squares[place] / limit]), -at.slopes[place] / limit)]


def currents(at: Evaluated, name: str, limit: float) -> Rows:
    limit *= 1 - at.back_off
    return [(name, np.array([1 - at.squares["currents"] / limit]), -at.slopes["currents"] / limit)]


def motor_current(at: Evaluated, name: str, limit: float) -> Rows:
    limit *= 1 - at.back_off
    point, both = at.setting.motor, [at.squares[n] for n in MOTOR_SQUARES]
    slope = sum(d * at.slopes[n] for d, n in zip(slope_at_3_sigma(point, *both), MOTOR_SQUARES, strict=True))
    return [(name, np.array([1 - current_at_3_sigma(point, *both) / limit]), -slope / limit)]


def static_error(at: Evaluated, name: str, limit: float) -> Rows:
    limit *= 1 - at.back_off
    static = at.static[KINDS[name.removeprefix("static ").removesuffix(" error from bias")]]
    return [(name, 1 - static.value / limit, -static.gradient / limit)]


def peak_change(at: Evaluated, name: str, limit: float) -> Rows:
    """Static error of each set and 3σ of guideway, at each end, and of the worst set's sensor noise together."""
    limit *= 1 - at.back_off
    word = name.removeprefix("peak ").removesuffix(" change")
    static, (noise, noise_slope) = at.static[KINDS[word]], at.noise(KINDS[word])
    values, slopes = [], []
    for end in ("front", "rear"):
        sigma = np.sqrt(at.squares[f"{word}, {end}"] + noise)
        values.append(static.value + PEAK_SIGMAS * sigma)
        slopes.append(static.gradient + PEAK_SIGMAS * (at.slopes[f"{word}, {end}"] + noise_slope) / (2 * sigma))
    return [(name, 1 - np.concatenate(values) / limit, -np.concatenate(slopes) / limit)]


def ride_mask(at: Evaluated, name: str, limit: float) -> Rows:
    """Acceleration densities over the ride mask, at the nodes that the mask covers; those of all groups add up."""
    mask, axis = mask_for(RIDE_MASKS[name]), AXES[RIDE_MASKS[name]]
    hertz = at.groups[0].nodes / (2 * np.pi)
    ends = mask.frequency_hz[0], mask.frequency_hz[-1]
    inside = (hertz >= ends[0] * (1 - 1e-12)) & (hertz <= ends[1] * (1 + 1e-12))  # an end that is watched is inside
    allowed = mask.psd(np.clip(hertz[inside], *ends)) * limit * (1 - at.back_off)
    total: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    for found in at.responses:
        for place, density in found.densities.items():
            if place.startswith(axis):
                value, slope = total.get(place, (0.0, 0.0))
                total[place] = value + density.value[inside], slope + density.gradient[inside]
    return [(f"{name} at {place}", 1 - v / allowed, -d / allowed[:, None]) for place, (v, d) in total.items()]


ROWS: dict[str, Callable[[Evaluated, str, float], Rows]] = {
    "damping ratio": damping_ratio,
    "decay rate": decay_rate,
    "peak sensitivity": peak_sensitivity,
    "delay margin": delay_margin,
    "rms gap, front": rms_gap,
    "rms gap, rear": rms_gap,
    "rms lateral gap, front": rms_gap,
    "rms lateral gap, rear": rms_gap,
    "sum of mean square currents": currents,
    "static gap error from bias": static_error,
    "static lateral gap error from bias": static_error,
    "peak gap change": peak_change,
    "peak lateral gap change": peak_change,
    "vertical ride mask ratio": ride_mask,
    "lateral ride mask ratio": ride_mask,
    MOTOR_CURRENT: motor_current,
}

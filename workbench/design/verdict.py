"""Requirements held against an analysis: every value from the exact measures, with the place where it is tightest.

    Requirement, Analysis --JUDGES[name]--> (value or none, where) --> Verdict

A requirement never vanishes: where there is no value, an unstable loop or an unfiltered rate, it is not met and says
so. Every quantity that may be required has its entry in `JUDGES`, as it has one in `rows.ROWS`.
"""

from collections.abc import Callable

import numpy as np

from workbench.analysis.analysis import Analysis, unfiltered
from workbench.analysis.comfort_summary import comfort_summary
from workbench.analysis.mode import REAL
from workbench.control import Gains
from workbench.design.problem import Problem
from workbench.design.requirement import MOTOR_CURRENT, RIDE_MASKS, judge
from workbench.errors import InputError
from workbench.goals.verdict import Verdict
from workbench.lti.margin import channel_margin
from workbench.lti.norm import peak_gain

PEAK_TOLERANCE = 1e-6  # relative width of the bracket of a peak where many models are looked at
NO_RESPONSE = "an unfiltered rate has roots and no responses"

Found = list[tuple[float | None, str]]


def verdicts(problem: Problem, analysis: Analysis) -> tuple[Verdict, ...]:
    """One verdict per requirement; the peak sensitivity gets one per group of motion."""
    out: list[Verdict] = []
    for r in problem.requirements:
        if r.name not in JUDGES:
            raise InputError(f"{r.name!r} is not judged; add it to design.verdict.JUDGES.")
        out += [judge(r, *found) for found in _found(r.name, problem, analysis)]
    return tuple(out)


def _found(name: str, problem: Problem, analysis: Analysis) -> Found:
    """(value, where) of a quantity, at least one; no value, and why, where there is none."""
    if name not in ROOTS and not analysis.stable:
        return [(None, "unstable loop")]
    if name not in ROOTS and unfiltered(analysis.gains):
        return [(None, NO_RESPONSE)]
    return JUDGES[name](name, problem, analysis)


def margin_verdicts(problem: Problem, gains: Gains) -> tuple[Verdict, ...]:
    """Verdicts on requirements of `model.STABILITY` alone, without the random response: the worst group of each."""
    loops = [(s, s.close(gains)) for s in problem.subjects]
    poles = [(closed.poles(), s.name) for s, closed in loops]
    stable = all(p.real.max() < 0 for p, _ in poles)
    out: list[Verdict] = []
    for r in problem.requirements:
        if r.name == "decay rate":
            found = [(float(-p.real.max()), group) for p, group in poles]
            out.append(judge(r, *min(found)))
        elif r.name == "damping ratio":
            out.append(judge(r, *min((_damping(p), group) for p, group in poles)))
        elif not stable:
            out.append(judge(r, None, "unstable loop"))
        elif r.name == "peak sensitivity":
            peaks = [(peak_gain(*s.sensitivity(closed), tolerance=PEAK_TOLERANCE), s.name) for s, closed in loops]
            peak, group = max(peaks, key=lambda found: found[0].upper)
            out.append(judge(r, peak.upper, f"{group}, {peak.frequency / (2 * np.pi):.3g} Hz"))
        elif r.name == "delay margin":
            out.append(judge(r, *_smallest_delay(loops)))
        else:
            raise InputError(f"{r.name!r} needs the random response; ask `verdicts` for it.")
    return tuple(out)


def _damping(poles: np.ndarray) -> float:
    """Smallest −Re p/|p| of oscillatory roots, −1 where a real root is unstable; 1 if there is neither."""
    size = np.abs(poles)
    moving = np.abs(poles.imag) > REAL * size
    ratios = -poles.real[moving] / size[moving]
    return float(min(ratios.min(initial=1.0), -1.0 if (poles.real[~moving] > 0).any() else 1.0))


def _smallest_delay(loops) -> tuple[float, str]:
    """The smallest dead time that one current pattern bears, the others closed, and which."""
    return min(
        (channel_margin(*s.sensitivity(closed), channel=i).delay, f"{s.name}, pattern {i + 1}")
        for s, closed in loops
        for i in range(len(s.commands))
    )


# ---- one judge per quantity: (name, problem, analysis) -> [(value, where)]


def _judge_damping(name: str, problem: Problem, a: Analysis) -> Found:
    grown = max((m for m in a.modes if not m.oscillates and m.pole.real > 0), key=lambda m: m.pole.real, default=None)
    if grown is not None:
        return [(-1.0, f"{grown.name}, a real root at {grown.pole.real:.3g} 1/s")]
    worst = min((m for m in a.modes if m.oscillates), key=lambda m: m.damping, default=None)
    return [(a.damping, "no oscillatory root" if worst is None else f"{worst.name}, {worst.frequency_hz:.3g} Hz")]


def _judge_decay(name: str, problem: Problem, a: Analysis) -> Found:
    slowest = max(a.modes, key=lambda m: m.pole.real)
    return [(a.decay, f"{slowest.name}, {slowest.frequency_hz:.3g} Hz")]


def _judge_sensitivity(name: str, problem: Problem, a: Analysis) -> Found:
    peaks = [(group, peak) for group, peak in a.peak_sensitivity.items() if peak is not None]
    return [(peak.upper, f"{group}, {peak.frequency / (2 * np.pi):.3g} Hz") for group, peak in peaks]


def _judge_delay(name: str, problem: Problem, a: Analysis) -> Found:
    return [_smallest_delay([(s, s.close(a.gains)) for s in problem.subjects])]


def _judge_mask(name: str, problem: Problem, a: Analysis) -> Found:
    """From spectra finer than the optimiser's grid."""
    return [comfort_summary(problem.setting, a.gains).worst_ratio(RIDE_MASKS[name])]


def _judge_rms(name: str, problem: Problem, a: Analysis) -> Found:
    end = name.rsplit(", ", 1)[1]
    return [(a.rms[_kind(name)][end], f"{end} coil sets")]


def _judge_currents(name: str, problem: Problem, a: Analysis) -> Found:
    return [(a.sum_alpha_squared, "all coil sets")]


def _judge_motor(name: str, problem: Problem, a: Analysis) -> Found:
    return [(None, "no motor") if a.motor is None else (a.motor.current_at_3_sigma, "worse side, guideway")]


def _judge_static(name: str, problem: Problem, a: Analysis) -> Found:
    return [(a.static_error[_kind(name)], "worst coil set and signs of bias")]


def _judge_peak_change(name: str, problem: Problem, a: Analysis) -> Found:
    return [(a.peak_gap_change[_kind(name)], "worse end, static + 3σ")]


def _kind(name: str) -> str:
    return "gap_lateral" if "lateral" in name else "gap"


ROOTS = ("damping ratio", "decay rate")  # what an unstable loop and an unfiltered rate have too
JUDGES: dict[str, Callable[[str, Problem, Analysis], Found]] = {
    "damping ratio": _judge_damping,
    "decay rate": _judge_decay,
    "peak sensitivity": _judge_sensitivity,
    "delay margin": _judge_delay,
    "rms gap, front": _judge_rms,
    "rms gap, rear": _judge_rms,
    "rms lateral gap, front": _judge_rms,
    "rms lateral gap, rear": _judge_rms,
    "sum of mean square currents": _judge_currents,
    "static gap error from bias": _judge_static,
    "static lateral gap error from bias": _judge_static,
    "peak gap change": _judge_peak_change,
    "peak lateral gap change": _judge_peak_change,
    "vertical ride mask ratio": _judge_mask,
    "lateral ride mask ratio": _judge_mask,
    MOTOR_CURRENT: _judge_motor,
}

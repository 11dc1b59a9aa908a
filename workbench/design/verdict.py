"""Requirements held against an analysis: every value from the exact measures, with the place where it is tightest."""

import numpy as np

from workbench.analysis.analysis import Analysis
from workbench.analysis.comfort_summary import comfort_summary
from workbench.analysis.margin import channel_margin
from workbench.analysis.mode import REAL
from workbench.analysis.norm import peak_gain
from workbench.control import Gains
from workbench.design.problem import Problem
from workbench.design.requirement import MOTOR_CURRENT, RIDE_MASKS, Requirement, Verdict, judge
from workbench.errors import InputError

PEAK_TOLERANCE = 1e-6  # relative width of the bracket of a peak where many models are looked at


def verdicts(problem: Problem, analysis: Analysis) -> tuple[Verdict, ...]:
    """One verdict per requirement; the peak sensitivity gets one per group of motion."""
    out: list[Verdict] = []
    for r in problem.requirements:
        if r.name in RIDE_MASKS:
            out += _judge_mask(r, problem, analysis)
        else:
            out += _judge_delay(r, problem, analysis) if r.name == "delay margin" else _judge(r, analysis)
    return tuple(out)


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
            moving = [(p[np.abs(p.imag) > REAL * np.abs(p)], group) for p, group in poles]
            found = [(float((-p.real / np.abs(p)).min()), group) for p, group in moving if len(p)]
            out.append(judge(r, *min(found, default=(1.0, "no oscillatory root"))))
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


def _smallest_delay(loops) -> tuple[float, str]:
    """The smallest dead time that one current pattern bears, the others closed, and which."""
    return min(
        (channel_margin(*s.sensitivity(closed), channel=i).delay, f"{s.name}, pattern {i + 1}")
        for s, closed in loops
        for i in range(len(s.commands))
    )


def _judge_mask(requirement: Requirement, problem: Problem, a: Analysis) -> list[Verdict]:
    """A ride mask, from spectra finer than the optimiser's grid."""
    if not a.stable:
        return [judge(requirement, None, "unstable loop")]
    value, where = comfort_summary(problem.setting, a.gains).worst_ratio(RIDE_MASKS[requirement.name])
    return [judge(requirement, value, where)]


def _judge_delay(requirement: Requirement, problem: Problem, a: Analysis) -> list[Verdict]:
    """The smallest dead time that one current pattern bears, the others closed; over all frequencies."""
    if not a.stable or a.cost is None:
        return [judge(requirement, None, "unstable loop")]
    loops = [(s, s.close(a.gains)) for s in problem.subjects]
    return [judge(requirement, *_smallest_delay(loops))]


def _judge(requirement: Requirement, a: Analysis) -> list[Verdict]:
    name = requirement.name
    if not a.stable and name not in ("damping ratio", "decay rate"):
        return [judge(requirement, None, "unstable loop")]
    if name == "damping ratio":
        worst = min((m for m in a.modes if m.oscillates), key=lambda m: m.damping, default=None)
        where = "no oscillatory root" if worst is None else f"{worst.name}, {worst.frequency_hz:.3g} Hz"
        return [judge(requirement, a.damping, where)]
    if name == "decay rate":
        slowest = max(a.modes, key=lambda m: m.pole.real)
        return [judge(requirement, a.decay, f"{slowest.name}, {slowest.frequency_hz:.3g} Hz")]
    if name == "peak sensitivity":
        return [
            judge(requirement, peak.upper, f"{group}, {peak.frequency / (2 * np.pi):.3g} Hz")
            for group, peak in a.peak_sensitivity.items()
            if peak is not None
        ]
    value, where = _value(name, a)
    return [judge(requirement, value, where)]


def _value(name: str, a: Analysis) -> tuple[float | None, str]:
    """Value and place of a requirement that is one number of the analysis."""
    if name.startswith("rms "):
        end = name.rsplit(", ", 1)[1]
        return a.rms["gap_lateral" if "lateral" in name else "gap"][end], f"{end} coil sets"
    if name == "sum of mean square currents":
        return a.sum_alpha_squared, "all coil sets"
    if name == MOTOR_CURRENT:
        return (None, "no motor") if a.motor is None else (a.motor.current_at_3_sigma, "worse side, guideway")
    kind = "gap_lateral" if "lateral" in name else "gap"
    if name.startswith("static"):
        return a.static_error[kind], "worst coil set and signs of bias"
    return a.peak_gap_change[kind], "worse end, static + 3σ"

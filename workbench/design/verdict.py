"""Requirements held against an analysis: every value from the exact measures, with the place where it is tightest."""

import numpy as np

from workbench.analysis.analysis import Analysis
from workbench.analysis.comfort_summary import comfort_summary
from workbench.analysis.margin import channel_margin
from workbench.design.problem import Problem
from workbench.design.requirement import MOTOR_CURRENT, RIDE_MASKS, Requirement, Verdict, judge


def verdicts(problem: Problem, analysis: Analysis) -> tuple[Verdict, ...]:
    """One verdict per requirement; the peak sensitivity gets one per group of motion."""
    out: list[Verdict] = []
    for r in problem.requirements:
        if r.name in RIDE_MASKS:
            out += _judge_mask(r, problem, analysis)
        else:
            out += _judge_delay(r, problem, analysis) if r.name == "delay margin" else _judge(r, analysis)
    return tuple(out)


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
    margins = [
        (margin.delay, f"{s.name}, pattern {i + 1}")
        for s in problem.subjects
        for i in range(len(s.commands))
        for margin in [channel_margin(*s.sensitivity(s.close(a.gains)), channel=i)]
    ]
    return [judge(requirement, *min(margins))]


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

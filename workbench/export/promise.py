"""What a gain table promises: each requirement with an interval that holds its value, and how that was found.

    mean squares     Lyapunov equation: value ± its error bound            --> rms, currents
    peak sensitivity Hamiltonian eigenvalues: attained value … level never reached
    other figures    the value alone, as [value, value]

Floating point throughout, for the nominal plant: the word stands in every method. Proofs in ball arithmetic and over
boxes of plants take the same places.
"""

from typing import Any

import numpy as np

from workbench.analysis.response import driven, random_loops
from workbench.design.requirement import Verdict
from workbench.lti.signals import numbered

ENDS = ("front", "rear")
PEAK_SIGMAS = 3.0
LYAPUNOV = "floating point: Lyapunov equation with its error bound"
HAMILTONIAN = "floating point: Hamiltonian eigenvalues, bracket"
EIGENVALUES = "floating point: eigenvalues"
GAINS = "floating point: static gains"
ANALYSIS = "floating point: figure of the analysis"


def promises(design) -> list[dict[str, Any]]:
    """One promise per verdict with a value: {name, sense, limit, enclosure, method, box}."""
    squares = _mean_squares(design) if design.analysis.stable else {}
    out = []
    for v in design.requirements:
        if v.value is not None:
            name, enclosure, method = _enclosed(v, v.value, design.analysis, squares)
            promise = {"name": name, "sense": v.sense, "limit": v.limit, "enclosure": list(enclosure)}
            out.append({**promise, "method": method, "box": {}})
    return out


def _enclosed(v: Verdict, value: float, analysis, squares) -> tuple[str, tuple[float, float], str]:
    """Name, interval and method of one verdict's promise; the peak sensitivity's name carries its group."""
    if v.name == "peak sensitivity":
        group = v.where.split(",")[0]
        peak = analysis.peak_sensitivity[group]
        return f"{v.name}, {group}", (peak.lower, peak.upper), HAMILTONIAN
    if v.name in squares:
        mean, bound = squares[v.name]
        if not v.name.startswith("rms "):
            return v.name, (mean - bound, mean + bound), LYAPUNOV
        return v.name, (float(np.sqrt(max(mean - bound, 0.0))), float(np.sqrt(mean + bound))), LYAPUNOV
    if v.name.startswith("peak ") and v.name.endswith("gap change"):
        return v.name, _peak(v.name, value, squares), f"{GAINS}; {LYAPUNOV}"
    methods = {
        "damping": EIGENVALUES,
        "decay": EIGENVALUES,
        "static": GAINS,
        "motor": "floating point: Lyapunov equation",
    }
    return v.name, (value, value), methods.get(v.name.split()[0], ANALYSIS)


def _peak(name: str, value: float, squares) -> tuple[float, float]:
    """Value ± 3 × the error bound of σ: static error + 3 √(σ² + noise²) changes by no more than 3 × what σ does."""
    names = [f"rms {'lateral ' if 'lateral' in name else ''}gap, {end}" for end in ENDS]
    widths = [
        np.sqrt(mean + bound) - np.sqrt(max(mean - bound, 0.0)) for mean, bound in map(squares.__getitem__, names)
    ]
    off = PEAK_SIGMAS * float(max(widths))
    return value - off, value + off


def _mean_squares(design) -> dict[str, tuple[float, float]]:
    """Requirement name to mean square and error bound, over all groups and the uncorrelated types."""
    setting = design.problem.setting
    out: dict[str, tuple[float, float]] = {}
    for subject, closed in random_loops(setting, design.gains):
        system = driven(setting, subject, closed)
        state = system.stationary()
        rows = {
            f"rms {word}, {end}": [f"{kind}_{i + 1}"]
            for end, i in zip(ENDS, setting.ends, strict=True)
            for kind, word in (("gap", "gap"), ("gap_lateral", "lateral gap"))
        }
        rows["sum of mean square currents"] = numbered("current", setting.law.count)
        for name, outputs in rows.items():
            C = system.rows(outputs)
            mean, bound = out.get(name, (0.0, 0.0))
            out[name] = mean + float(state.mean_squares(C).sum()), bound + float(state.mean_square_bounds(C).sum())
    return out

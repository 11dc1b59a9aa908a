"""Quantities of a study: scalars of an analysis by dotted path in its JSON, and the limits a problem sets on them.

"peak_sensitivity.heave_pitch", "rms.gap.front", "margins.disk.lower", "margins.current.0.phase", "damping", "decay"
"""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from workbench.analysis.analysis import Analysis
from workbench.control.gains import GAIN_NAMES
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.study.definition import Limit

FULL = ("margins", "comfort")  # parts of the JSON that only the full analysis has
# requirement: quantities it limits
OF_REQUIREMENT = {
    "damping ratio": ("damping",),
    "decay rate": ("decay",),
    "peak sensitivity": ("peak_sensitivity.heave_pitch", "peak_sensitivity.sway_roll_yaw"),
    "rms gap, front": ("rms.gap.front",),
    "rms gap, rear": ("rms.gap.rear",),
    "rms lateral gap, front": ("rms.gap_lateral.front",),
    "rms lateral gap, rear": ("rms.gap_lateral.rear",),
    "sum of mean square currents": ("sum_alpha_squared",),
    "static gap error from bias": ("static_error.gap",),
    "static lateral gap error from bias": ("static_error.gap_lateral",),
    "peak gap change": ("peak_gap_change.gap",),
    "peak lateral gap change": ("peak_gap_change.gap_lateral",),
}


def document_of(analysis: Analysis, whole: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """The JSON of an analysis (or of what contains it), with damping and decay beside it."""
    return {**(whole or analysis.to_dict()), "damping": analysis.damping, "decay": analysis.decay}


def value_at(document: Any, path: str) -> float | bool | None:
    """The scalar at a dotted path; None where the path ends at nothing on the way."""
    at = document
    for step in path.split("."):
        if at is None:
            return None
        if isinstance(at, Mapping) and step in at:
            at = at[step]
        elif (
            isinstance(at, Sequence) and not isinstance(at, str) and step.isdigit() and (not at or int(step) < len(at))
        ):
            at = at[int(step)] if at else None  # an unstable loop has no margins, whatever their number
        else:
            raise _unknown(document, path)
    if at is not None and not isinstance(at, bool | int | float):
        raise _unknown(document, path)
    return at


def needs_margins(quantities: Sequence[str]) -> bool:
    """Whether a quantity is in the full analysis alone."""
    return any(q.partition(".")[0] in FULL for q in quantities)


def usual(problem: Problem, task: str) -> tuple[str, ...]:
    """What a study records unless told otherwise: stability, margins, cost, strokes, currents; a design's gains too."""
    setting = problem.setting
    groups = ["heave_pitch" if name == "heave" else name for name in setting.groups if name != "all"]
    lateral = "sway_roll_yaw" in groups or "all" in setting.groups
    kinds = ("gap", "gap_lateral") if lateral else ("gap",)
    figures = (
        "damping", "decay", *(f"peak_sensitivity.{g}" for g in groups or ("heave_pitch", "sway_roll_yaw")), "cost",
        *(f"rms.{kind}.{end}" for kind in kinds for end in ("front", "rear")), "sum_alpha_squared",
        *(f"static_error.{kind}" for kind in kinds),
    )  # fmt: skip
    return ("stable", *figures) if task == "analyse" else (*figures, *(f"gains.{name}" for name in GAIN_NAMES))


def limits_of(problem: Problem, quantities: Sequence[str]) -> tuple[Limit, ...]:
    """The problem's requirements on quantities that are recorded."""
    return tuple(
        Limit(quantity=name, sense=r.sense, value=r.limit)
        for r in problem.requirements
        for name in OF_REQUIREMENT.get(r.name, ())
        if name in quantities
    )


def scalars(document: Any, path: str = "") -> list[str]:
    """Every dotted path to a scalar."""
    if isinstance(document, Mapping):
        pairs = list(document.items())
    elif isinstance(document, list | tuple):
        pairs = list(enumerate(document))
    else:
        return [path] if document is None or isinstance(document, bool | int | float) else []
    return [name for key, item in pairs for name in scalars(item, f"{path}.{key}" if path else str(key))]


def _unknown(document: Any, path: str) -> InputError:
    near = get_close_matches(path, scalars(document), n=3, cutoff=0.4)
    hint = f"did you mean {' or '.join(map(repr, near))}? " if near else ""
    return InputError(
        f"unknown quantity {path[:80]!r}; {hint}A quantity is the dotted path of a number in "
        "'workbench analyse --json', or damping, or decay."
    )

"""Quantities of a study: scalars of an analysis by dotted path in its JSON, and the limits a problem sets on them.

"peak_sensitivity.heave_pitch", "rms.gap.front", "margins.disk.lower", "margins.current.0.phase", "damping", "decay"

What a requirement limits and no analysis holds (delay margin, ride masks) is asked of the judge of designs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from difflib import get_close_matches
from typing import Any

from workbench.analysis.analysis import analyse
from workbench.analysis.full import full_analysis
from workbench.control import Gains
from workbench.control.gains import GAIN_NAMES
from workbench.design.problem import Problem
from workbench.design.requirement import MOTOR_CURRENT, Requirement
from workbench.design.verdict import verdicts
from workbench.errors import InputError
from workbench.lti.margin import ChannelMargin
from workbench.study.batch import DELAY
from workbench.study.definition import Limit

FULL = ("margins", "comfort")  # parts of the JSON that only the full analysis has
# quantity: requirement whose judge measures it
JUDGED = {
    DELAY: "delay margin",
    "ride_mask_ratio.vertical": "vertical ride mask ratio",
    "ride_mask_ratio.lateral": "lateral ride mask ratio",
}
# requirement: quantities it limits; the peak sensitivity has one for each group of motion
OF_REQUIREMENT = {
    "damping ratio": ("damping",),
    "decay rate": ("decay",),
    **{name: (quantity,) for quantity, name in JUDGED.items()},
    "rms gap, front": ("rms.gap.front",),
    "rms gap, rear": ("rms.gap.rear",),
    "rms lateral gap, front": ("rms.gap_lateral.front",),
    "rms lateral gap, rear": ("rms.gap_lateral.rear",),
    "sum of mean square currents": ("sum_alpha_squared",),
    "static gap error from bias": ("static_error.gap",),
    "static lateral gap error from bias": ("static_error.gap_lateral",),
    "peak gap change": ("peak_gap_change.gap",),
    "peak lateral gap change": ("peak_gap_change.gap_lateral",),
    MOTOR_CURRENT: ("motor.current_at_3_sigma",),
}


def document_of(
    problem: Problem, gains: Gains, quantities: Sequence[str], more: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """The JSON of an analysis, full where it must be, with damping, decay and the judged quantities beside it.

    quantities : those wanted; no more is computed than they need;  more : what else is known, by the same names
    A margin that nothing limits stays infinite, which JSON could not say.
    """
    document = dict(more or {})
    if needs_margins(quantities):
        whole = full_analysis(problem.setting, gains, problem.name)
        analysis = whole.analysis
        document |= whole.to_dict()
        channels = {"current": whole.current_margins, "modal": whole.modal_margins}
        document["margins"] |= {kind: [_fields(m) for m in own] for kind, own in channels.items()}
    else:
        analysis = analyse(problem.setting, gains, problem.name)
        document |= analysis.to_dict()
    document |= {"damping": analysis.damping, "decay": analysis.decay}
    for quantity in JUDGED.keys() & set(quantities):
        asked = problem.with_requirements([Requirement(JUDGED[quantity], 1.0)])
        value = verdicts(asked, analysis)[0].value
        name, _, part = quantity.partition(".")
        document[name] = {**document.get(name, {}), part: value} if part else value
    return document


def _fields(margin: ChannelMargin) -> dict[str, Any]:
    return {f.name: getattr(margin, f.name) for f in fields(margin)}


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
    lateral = "gap_lateral" in _kinds(problem)
    figures = (
        "damping", "decay", *_peaks(problem), "cost",
        *(f"rms.{kind}.{end}" for kind in _kinds(problem) for end in ("front", "rear")), "sum_alpha_squared",
        "static_error.gap", *(("static_error.gap_lateral",) if lateral else ()),
    )  # fmt: skip
    figures = (*figures, *(q for q in required(problem) if q not in figures))
    return ("stable", *figures) if task == "analyse" else (*figures, *(f"gains.{name}" for name in GAIN_NAMES))


def required(problem: Problem) -> tuple[str, ...]:
    """The quantities that the problem's requirements limit, in their order."""
    return tuple(name for r in problem.requirements for name in limited(problem, r.name))


def limits_of(problem: Problem) -> tuple[Limit, ...]:
    """The problem's requirements, every one of them."""
    return tuple(
        Limit(quantity=name, sense=r.sense, value=r.limit)
        for r in problem.requirements
        for name in limited(problem, r.name)
    )


def limited(problem: Problem, requirement: str) -> tuple[str, ...]:
    """The quantities that a requirement of that name limits."""
    return _peaks(problem) if requirement == "peak sensitivity" else OF_REQUIREMENT[requirement]


def _peaks(problem: Problem) -> tuple[str, ...]:
    """The peaks of the groups that the problem looks at."""
    groups = problem.setting.groups
    return tuple(f"peak_sensitivity.{'heave_pitch' if name == 'heave' else name}" for name in groups)


def _kinds(problem: Problem) -> tuple[str, ...]:
    return ("gap", "gap_lateral") if {"sway_roll_yaw", "all"} & set(problem.setting.groups) else ("gap",)


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
    near = get_close_matches(path, [*scalars(document), *JUDGED], n=3, cutoff=0.4)
    hint = f"did you mean {' or '.join(map(repr, near))}? " if near else ""
    return InputError(
        f"unknown quantity {path[:80]!r}; {hint}A quantity is the dotted path of a number in "
        f"'workbench analyse --json', or damping, decay, {', '.join(JUDGED)}."
    )

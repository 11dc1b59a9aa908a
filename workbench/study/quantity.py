"""Quantities of a study: scalars of an analysis by dotted path in its JSON, and the limits a problem sets on them.

"peak_sensitivity.heave_pitch", "rms.gap.front", "margins.disk.lower", "margins.current.0.phase", "damping", "decay"

What a requirement limits and no analysis holds (delay margin, ride masks) is asked of the judge of designs.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from difflib import get_close_matches
from typing import Any

import numpy as np

from workbench.analysis.analysis import analyse
from workbench.analysis.full import full_analysis
from workbench.control import Gains
from workbench.control.gains import GAIN_NAMES
from workbench.design.problem import Problem
from workbench.errors import BudgetEnded, InfeasibleError, InputError
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.peak_sensitivity import PeakSensitivity
from workbench.goals.ride.requirement import required_kinds, requirement
from workbench.lti.margin import ChannelMargin
from workbench.study.definition import Limit

GROUPS = ("heave_pitch", "sway_roll_yaw")
Value = float | bool | None
Values = list[Value | str]  # quantities in order, then why there are none ("" if there are)
FULL = ("margins", "comfort")  # parts of the JSON that only the full analysis has


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
        channels = {"current": whole.current_margins, "modal": whole.modal_margins, "sensor": whole.sensor_margins}
        document["margins"] |= {kind: [_fields(m) for m in own] for kind, own in channels.items()}
    else:
        analysis = analyse(problem.setting, gains, problem.name)
        document |= analysis.to_dict()
    document |= {"damping": analysis.damping, "decay": analysis.decay}
    for quantity, kind in judged().items():
        if quantity not in quantities:
            continue
        asked = requirement(kind, 1.0)
        asked.check(problem.name, problem.setting)
        value = asked.judge(Flown(problem.setting, gains, analysis))[0].value
        name, _, part = quantity.partition(".")
        document[name] = {**document.get(name, {}), part: value} if part else value
    return document


def row_of(document: Callable[[], Mapping[str, Any]], quantities: Sequence[str]) -> Values:
    """The quantities of one row's JSON, or why it has none."""
    try:
        found = document()
        return [*(number(value_at(found, q)) for q in quantities), ""]
    except BudgetEnded:  # of the whole study, not of this row
        raise
    except (InputError, InfeasibleError, np.linalg.LinAlgError) as error:
        return [*(None for _ in quantities), " ".join(str(error).split())]


def row_found(document: Mapping[str, Any] | None, quantities: Sequence[str], reason: str) -> Values:
    """The quantities of a design's JSON, or none of them and the reason why there is no design."""
    return [*(None if document is None else value_at(document, q) for q in quantities), reason]


def number(value: Value) -> Value:
    """A quantity as a study keeps it: none where it is not a number."""
    if value is None or isinstance(value, bool):
        return value
    return None if np.isnan(value) else float(value)


def judged() -> dict[str, str]:
    """Quantity to the requirement whose judge measures it, of those that no analysis holds."""
    each = [requirement(kind, 1.0) for kind in required_kinds()]
    return {quantity: r.name for r in each if not r.in_analysis for quantity in r.quantities(())}


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
    return tuple(name for r in problem.requirements if r.by_key for name in limited(problem, r.name))


def limits_of(problem: Problem) -> tuple[Limit, ...]:
    """The problem's requirements, every one of them."""
    return tuple(
        Limit(quantity=name, sense=r.sense, value=r.limit)
        for r in problem.requirements
        if r.by_key  # reserves are no scalars of an analysis
        for name in limited(problem, r.name)
    )


def limited(problem: Problem, name: str) -> tuple[str, ...]:
    """The quantities that a requirement of that name limits."""
    return of_requirement(name, problem.setting.groups)


def of_requirement(name: str, groups: Sequence[str] = GROUPS) -> tuple[str, ...]:
    """The same where the problem looks at these groups."""
    return requirement(name, 1.0).quantities(groups)


def _peaks(problem: Problem) -> tuple[str, ...]:
    """The peaks of the groups that the problem looks at."""
    return limited(problem, PeakSensitivity.kind)


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
    near = get_close_matches(path, [*scalars(document), *judged()], n=3, cutoff=0.4)
    hint = f"did you mean {' or '.join(map(repr, near))}? " if near else ""
    return InputError(
        f"unknown quantity {path[:80]!r}; {hint}A quantity is the dotted path of a number in "
        f"'workbench analyse --json', or damping, decay, {', '.join(judged())}."
    )

"""A goal with another limit: what a sweep changes, whatever the fields are called that hold it.

    goal, limit in the unit of `asked()` --scaled--> the goal whose fields stand for that limit

A goal whose measure is normalised (against a profile, a reference, several limits together) is asked for 1; a limit
of 2 asks for half as much of it.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from workbench.errors import InputError
from workbench.lti.weight import ProfileLike

if TYPE_CHECKING:
    from workbench.goals.goal import Goal

G = TypeVar("G", bound="Goal")
Scales = tuple[tuple[str, int], ...]  # fields that a limit scales, each with the power of it


def checked_limit(name: str, limit: float) -> float:
    """A limit that a sweep may set: positive and finite."""
    number = math.nan if isinstance(limit, bool) or not isinstance(limit, int | float | np.number) else float(limit)
    if not 0 < number < math.inf:
        raise InputError(f"a limit of {name!r} must be a positive, finite number; got {limit!r}. Give one.")
    return number


def scaled(goal: G, limit: float) -> G:
    """The goal with the fields of its `scales` in proportion to the limit."""
    number, before = checked_limit(goal.name, limit), goal.asked().limit
    scales = goal.scales or ((("limit", 1),) if hasattr(goal, "limit") else ())
    if not scales or not before > 0:
        raise InputError(f"{goal.name!r} has no limit of one size, so it cannot be given another. Sweep another goal.")
    changed = {}
    for field, power in scales:
        value = getattr(goal, field)
        held = power == 1 and isinstance(value, int | float) and value == before
        changed[field] = number if held else _times(goal.name, value, (number / before) ** power)
    return replace(goal, **changed)


def _times(name: str, value: ProfileLike, factor: float) -> ProfileLike:
    """A number, matrix, fraction or breakpoints times a factor."""
    if isinstance(value, Mapping):
        return {at: factor * float(size) for at, size in value.items()}
    if isinstance(value, tuple) and len(value) == 2 and all(np.ndim(part) == 1 for part in value):
        return factor * np.asarray(value[0], float), value[1]
    if isinstance(value, int | float | np.number | np.ndarray | list):
        return factor * (np.asarray(value, float) if isinstance(value, list) else value)
    raise InputError(
        f"the limit of {name!r} is a system, which cannot be given another size; state it as a fraction or as points."
    )

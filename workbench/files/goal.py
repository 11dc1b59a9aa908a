"""Goals of a data file: the keys of whatever kind is registered, values checked by the types of the goal's fields.

[[goal]] kind, keys with units in their names --goals.registry--> Goal --tried on every loop--> it can be measured
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any

from workbench.errors import InputError, unknown_name
from workbench.files.table import LARGEST, MOST, si_keys
from workbench.goals.goal import Goal
from workbench.goals.registry import GOALS, goal, keys_of
from workbench.goals.registry import known as kinds
from workbench.goals.ride.reserve import Reserve
from workbench.machine.reading import shown

MOST_POINTS = 10_000  # numbers in one value
WORDS: Mapping[Any, str] = {
    float: "a finite number", float | None: "a finite number", bool: "true or false", str: "a text",
    tuple[str, ...]: "a name or a list of names", tuple[str, ...] | None: "a name or a list of names",
}  # fmt: skip


def goal_of(keys: Mapping[str, Any], *, vehicle: bool = False) -> Goal:
    """The goal of a table; raises InputError for what the kind does not know or cannot use.

    vehicle : whether it is asked of a vehicle, whose goals are those of `goals.ride.reserve`
    """
    kind = keys.get("kind")
    if not isinstance(kind, str):
        raise InputError(f"a goal must have a kind, such as 'margins'; got {shown(kind)}.")
    cls = GOALS.get(kind) or kinds().get(kind)  # a vehicle's kinds are there without loading all others
    if cls is None or not _is_for(cls, vehicle):
        ours = [word for word, other in kinds().items() if _is_for(other, vehicle)]
        if cls is None:
            raise unknown_name("kind of goal", kind, ours)
        whose = "a vehicle" if vehicle else "a plant of its own"
        raise InputError(
            f"a goal of kind {kind!r} cannot be stated so here; {whose} can have {', '.join(sorted(ours))}."
        )
    known = {key.name: key for key in keys_of(kind)}
    try:
        given = si_keys({key: value for key, value in keys.items() if key != "kind"}, tuple(known))
    except ValueError as error:
        raise InputError(f"a goal of kind {kind!r}: {error}.") from error
    types = {field.name: field.type for field in fields(cls)}
    for name, value in given.items():
        wanted = None if known[name].read is not None else types[known[name].target]
        if not _fits(value, wanted):
            raise InputError(f"{name} of a goal must be {WORDS.get(wanted, 'finite numbers')}; got {_given(value)}.")
    said = {known[name].target for name in given}
    for field in fields(cls):
        needed = field.init and field.default is MISSING and field.default_factory is MISSING
        if needed and field.name not in said:
            words = [name for name, key in known.items() if key.target == field.name]
            raise InputError(
                f"a goal of kind {kind!r} must say {' or '.join(words) or field.name}; it does not. Add it."
            )
    try:
        return goal(kind, given)
    except OverflowError as error:
        raise InputError(f"a goal of kind {kind!r} must have limits that a number can hold; they do not.") from error


def _given(value: Any) -> str:
    """A value as a refusal quotes it, a text in its quotation marks."""
    return f"the text {value[:60]!r}" if isinstance(value, str) else shown(value)


def _is_for(cls: type[Goal], vehicle: bool) -> bool:
    """Whether goals of a class are stated in blocks [[goal]] of such a plant."""
    return issubclass(cls, Reserve) if vehicle else cls.bind is not Goal.bind


def _fits(value: Any, wanted: Any) -> bool:
    """Whether a value is of the type; of a type without a word, whether its numbers are finite and not too many."""
    if wanted in (float, float | None):
        return not isinstance(value, bool) and isinstance(value, int | float) and abs(value) <= LARGEST
    if wanted in (bool, str):
        return isinstance(value, wanted) and len(str(value)) <= 200
    if wanted in (tuple[str, ...], tuple[str, ...] | None):
        listed = value if isinstance(value, list) else [value]
        return len(listed) <= MOST and all(isinstance(name, str) and 0 < len(name) <= 200 for name in listed)
    return 0 < _count(value) <= MOST_POINTS


def _count(value: Any) -> float:
    """Numbers in a value; infinite where it holds anything else but lists and mappings."""
    match value:
        case bool():
            return math.inf
        case int() | float():
            return 1 if abs(value) <= LARGEST or value == math.inf else math.inf
        case Mapping():
            return sum(map(_count, value.values()))
        case Sequence() if not isinstance(value, str):
            return sum(map(_count, value))
    return math.inf

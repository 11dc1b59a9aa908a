"""Which kinds of goal there are: the one list, found by the word that data files use.

    @register class --> GOALS: kind to class --goal(kind, keys of a data file)--> a goal

`register` takes classes from anywhere: what is registered is steered, judged, read from data files and promised like
the kinds that come with the workbench.
"""

from collections.abc import Mapping
from typing import Any, TypeVar

from workbench.errors import InputError, unknown_name
from workbench.goals.goal import Goal
from workbench.goals.key import Key

GOALS: dict[str, type[Goal]] = {}
G = TypeVar("G", bound=type[Goal])


def register(cls: G) -> G:
    """Makes a class of goals known under its kind, or under each of its kinds; returns the class.

    Raises InputError for a kind or a key of [requirements] that is another's, and for a class that does not say how to
    steer or to judge: nothing is asked for that would not be looked at.
    """
    cls.check_class()
    kinds = cls.all_kinds()
    if not all(kinds):
        raise InputError(f"{cls.__name__} must name its kind; got none. Set the class attribute `kind`.")
    for kind in kinds:
        owner = GOALS.get(kind, cls)
        if (owner.__module__, owner.__qualname__) != (cls.__module__, cls.__qualname__):
            raise InputError(f"goals must have distinct kinds; {kind!r} is that of {owner.__name__}. Choose another.")
        GOALS[kind] = cls
    return cls


def goal(kind: str, given: Mapping[str, Any] | None = None, /, **keys: Any) -> Goal:
    """A goal of a kind, from the keys of a data file.

    Parameters
    ----------
    kind : a word of `known()`
    given, keys : the keys with their values, units as in the keys' names; `keys_of(kind)` lists them

    Raises
    ------
    InputError
        For an unknown kind or key, a key twice, or values that the goal refuses.
    """
    cls, known = class_of(kind), {key.name: key for key in keys_of(kind)}
    fields: dict[str, Any] = {}
    for name, value in {**(given or {}), **keys}.items():
        if name not in known:
            raise unknown_name(f"key of a goal {kind!r}", name, known)
        key = known[name]
        if key.target in fields:
            raise InputError(f"a goal {kind!r} must say {key.target} once; got {name} beside another key for it.")
        fields[key.target] = key.value(value)
    try:
        return cls.of_kind(kind, fields)
    except TypeError as error:
        raise InputError(f"a goal {kind!r} lacks a key ({error}). It has {', '.join(known)}.") from error


def data_of(goal: Goal) -> dict[str, Any]:
    """The keys of a data file that give a goal, `kind` first; what stands at its default is left out.

    Raises InputError where a field has no form in a data file (a system given as an object).
    """
    found: dict[str, Any] = {"kind": goal.word}
    for field, value in goal.stated().items():
        for key in keys_of(goal.word):
            said = key.data(value) if key.target == field else None
            if said is not None:
                found[key.name] = said
                break
        else:
            raise InputError(
                f"{field} of goal {goal.name!r} must be a number, points or a fraction to stand in a data file; "
                f"got {str(value)[:60]}. Give it as one."
            )
    return found


def known() -> Mapping[str, type[Goal]]:
    """Every kind that comes with the workbench or was registered, and its class."""
    from workbench.goals import kinds  # noqa: F401 (each class there registers itself)

    return GOALS


def class_of(kind: str) -> type[Goal]:
    """The class of a kind."""
    if kind not in GOALS and kind not in known():
        raise unknown_name("kind of goal", kind, GOALS)
    return GOALS[kind]


def keys_of(kind: str) -> tuple[Key, ...]:
    """Every key that a data file may give for a kind."""
    return class_of(kind).all_keys(kind)

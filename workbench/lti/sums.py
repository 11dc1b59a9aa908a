"""Signals by name, and signed sums of them: "y", "-y", "r - y", "r - y_front - y_rear".

A sign stands between spaces (a leading minus needs none), so a name may itself hold a minus.
"""

import re
from collections.abc import Iterable, Sequence

from workbench.errors import InputError, unknown_name

BEFORE = "before "  # what reaches a point, in front of the disturbance that enters there


def terms(text: str) -> dict[str, float]:
    """Signal names of a signed sum with their factors ±1; one that appears twice is refused."""
    if not isinstance(text, str) or not text.strip():
        raise InputError(f"a signal must be a name or a signed sum such as 'r - y'; got {text!r}.")
    pieces = re.split(r"\s+([+-])\s+", text.strip())
    first = pieces[0]
    pieces = [*((first[0], first[1:].strip()) if first[0] in "+-" else ("+", first)), *pieces[1:]]
    found: dict[str, float] = {}
    for sign, name in zip(pieces[::2], pieces[1::2], strict=True):
        if not name or name in found:
            raise InputError(f"a signed sum must name each signal once; got {text!r}. Write for instance 'r - y'.")
        found[name] = -1.0 if sign == "-" else 1.0
    return found


def written(text: str) -> str:
    """The sum in the one way it is written here: "r - y" for " r  -  y"."""
    signed = [("-" if factor < 0 else "+", name) for name, factor in terms(text).items()]
    head = signed[0][1] if signed[0][0] == "+" else f"-{signed[0][1]}"
    return " ".join([head, *(f"{sign} {name}" for sign, name in signed[1:])])


def known_terms(text: str, known: Iterable[str], listed: Sequence[str]) -> dict[str, float]:
    """The terms of a sum, every name one of `known`; a name that is not is refused with the nearest of `listed`."""
    names = set(known)
    if text in names:  # a name that looks like a sum
        return {text: 1.0}
    found = terms(text)
    for name in found:
        if name not in names:
            bare = name.removeprefix(BEFORE)
            raise unknown_name("signal", name if bare in listed else bare, listed)
    return found


def refuse_ambiguous(points: Sequence[str]) -> None:
    """Refuse a point whose name can be read as what is before another, or as a signed sum of others."""
    for name in points:
        others = set(points) - {name}
        try:
            read = {term.removeprefix(BEFORE) for term in terms(name)}
        except InputError:
            continue
        if read <= others:
            raise InputError(
                f"every point of a loop must have a name of its own; {name!r} also reads as made of "
                f"{', '.join(sorted(read))}. Rename it."
            )

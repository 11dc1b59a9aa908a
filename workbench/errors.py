"""What the library raises: one sentence that says what must hold, what was given and what to do."""

from collections.abc import Iterable
from difflib import get_close_matches

LISTED = 40  # names of a list in a sentence


class InputError(ValueError):
    """Input that cannot be used as given; the message says how to mend it. The command line exits with 2."""


class InfeasibleError(RuntimeError):
    """A requirement that cannot be met; the message names what binds, where and by how much. Exit code 1."""


class BudgetEnded(InfeasibleError):
    """The time given was over before there was an answer. Exit code 1: nothing is known to be met."""


def unknown_name(kind: str, given: str, known: Iterable[str]) -> InputError:
    """The refusal of a name that is not one of `known`, with the nearest one that is.

    Examples
    --------
    >>> print(unknown_name("gain", "K_hh", ["K_h", "K_hp", "tau_h"]))
    unknown gain 'K_hh'; did you mean 'K_h'? Known: K_h, K_hp, tau_h.
    """
    return InputError(f"unknown {kind} {str(given)[:80]!r}; {nearest(str(given), known)}.")


def nearest(given: str, known: Iterable[str]) -> str:
    """Which of the known words a given one may have meant, and the words, without the full stop."""
    names = sorted(known)
    folded = {name.rpartition(".")[2].casefold(): name for name in reversed(names)}  # the last part of a dotted name
    folded |= {name.casefold(): name for name in reversed(names)}
    near = get_close_matches(given.casefold(), folded, n=1, cutoff=0.5)
    hint = f"did you mean {folded[near[0]]!r}? " if near else ""
    return f"{hint}Known: {', '.join(names[:LISTED])}{', …' if len(names) > LISTED else ''}"

"""Limits on what a law keeps in reserve: what all of them have in common.

[[goal]] kind, at_least or at_most, what it looks at --> rows by `analysis.loop_rows`, verdicts by the exact measures

They name what they look at, so that a problem may ask for several of a kind: the name of a goal says what.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from workbench.analysis.setting import Setting
from workbench.errors import InputError, unknown_name
from workbench.goals.goal import COMMON, Goal
from workbench.goals.key import Key
from workbench.goals.ride.requirement import Requirement

OWN = tuple(key for key in COMMON if key.name in ("name", "hard"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Reserve(Requirement):
    """One limit on a reserve of the law; several of a kind differ in their names."""

    by_key = False
    beside = True

    def __post_init__(self) -> None:
        if not 0 < self.limit < float("inf"):
            raise InputError(f"the limit of {self._usual_name()!r} must be positive and finite; got {self.limit!r}.")
        Goal.__post_init__(self)

    def _usual_name(self) -> str:
        return f"{self.kind}, {self.looked_at()}"

    def looked_at(self) -> str:
        """What the limit is on, in a few words."""
        raise TypeError(f"{type(self).__name__} must define looked_at()")  # a defect of ours, not of the input

    @classmethod
    def all_keys(cls, kind: str) -> tuple[Key, ...]:
        return (*cls.keys, *OWN)

    @classmethod
    def of_kind(cls, kind: str, values) -> "Reserve":
        return cls(**values)

    def quantities(self, groups: Sequence[str]) -> tuple[str, ...]:
        return ()


def chosen(
    asked: Iterable[str], known: Sequence[str], families: dict[str, Sequence[str]], what: str
) -> tuple[str, ...]:
    """Names in the order known: those asked for by name, by family, or by `kind:*`; an unknown one is refused."""
    found: set[str] = set()
    for word in asked:
        if word in families:
            found |= set(families[word])
        elif word.endswith(":*") and any(name.startswith(word[:-1]) for name in known):
            found |= {name for name in known if name.startswith(word[:-1])}
        elif word in known:
            found.add(word)
        else:
            raise unknown_name(what, word, [*families, *known])
    return tuple(name for name in known if name in found)


def right_hand(setting: Setting, name: str) -> bool:
    """Whether a signal of a coil set need steer: of two that mirror each other the right-hand one does."""
    number = name.rpartition("_")[2]
    law = setting.law
    mirrored = set(setting.groups) == {"heave_pitch", "sway_roll_yaw"}
    return not (mirrored and number.isdigit() and law.side[int(number) - 1] < 0)

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

    @property
    def word(self) -> str:
        return self.kind

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


def told_apart_by_sides(setting: Setting, names: Sequence[str]) -> list[str]:
    """Names whose rows differ: of two signals of sets that mirror each other, the right-hand one where both are.

    A vehicle looked at in its groups of motion is the same right and left.
    """
    if set(setting.groups) != {"heave_pitch", "sway_roll_yaw"}:
        return list(names)
    places = setting.law.positions
    left = {i + 1: places.index((x, -y)) + 1 for i, (x, y) in enumerate(places) if y < 0 and (x, -y) in places}

    def mirrored(name: str) -> bool:
        head, number = name[: name.rindex(":") + 1], name[name.rindex(":") + 1 :]
        word, _, digits = number.rpartition("_")
        other = left.get(int(digits)) if digits.isdigit() else None
        return other is not None and f"{head}{word}{'_' if word else ''}{other}" in names

    return [name for name in names if not mirrored(name)]

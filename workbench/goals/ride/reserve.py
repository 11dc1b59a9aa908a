"""Limits on what a law keeps in reserve: what all of them have in common.

[[goal]] kind, at_least or at_most, what it looks at --> rows by `analysis.loop_rows`, verdicts by the exact measures

They name what they look at, so that a problem may ask for several of a kind: the name of a goal says what.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, TypeVar

from workbench.analysis.break_points import Break
from workbench.analysis.change import Change
from workbench.analysis.setting import Setting
from workbench.errors import InputError, unknown_name
from workbench.goals.goal import COMMON, FULL_BAND, Closed, Goal, Rows, Steered
from workbench.goals.key import Key
from workbench.goals.measure import Asked
from workbench.goals.promise import Promise, Subject, kept_limit
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Requirement
from workbench.goals.verdict import Verdict

R = TypeVar("R", Break, Change)
OWN = tuple(key for key in COMMON if key.name in ("name", "hard", "models", "focus_hz"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Reserve(Requirement):
    """One limit on a reserve of the law; several of a kind differ in their names."""

    by_key = False
    beside = True
    all_frequencies: ClassVar[bool] = False  # no focus band

    def __post_init__(self) -> None:
        if not 0 < self.limit < float("inf"):
            raise InputError(f"the limit of {self._usual_name()!r} must be positive and finite; got {self.limit!r}.")
        if self.all_frequencies and tuple(self.focus) != FULL_BAND:
            raise InputError(f"a {self.kind} looks at all frequencies; got focus {self.focus}. Leave it out.")
        Goal.__post_init__(self)

    def check(self, problem: str, setting: Setting) -> None:
        if self.models is not None or self.focus != FULL_BAND:
            raise InputError(
                f"{self.name!r} of problem {problem!r} must leave out models and focus_hz: a vehicle is one model, "
                "looked at at all frequencies."
            )

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

    def promises_of(self, kind: str, verdict: Verdict, subjects: Iterable[Subject]) -> tuple[Promise, ...]:
        """A promise of a kind that the checker proves for each subject: the limit asked for, else the one reached."""
        reached = verdict.value if verdict.upper is None else verdict.upper
        limit = None if reached is None else kept_limit(self.limit, reached, self.sense)
        if limit is None:
            return ()
        return tuple(
            Promise(kind, self.sense, limit, replace(s, models=self.models or (), band=self.focus)) for s in subjects
        )

    # ---- asked of a vehicle by smooth rows, of any plant by `bind`

    def steer(self, point: Evaluated | Steered) -> Rows:
        return Goal.steer(self, point) if isinstance(point, Steered) else self.rows_of(point)

    def rows_of(self, point: Evaluated) -> Rows:
        """Rows of a vehicle."""
        raise TypeError(f"{type(self).__name__} must define rows_of()")  # a defect of ours, not of the input

    def judge(self, loop: Flown | Closed) -> tuple[Verdict, ...]:
        return Goal.judge(self, loop) if isinstance(loop, Closed) else Requirement.judge(self, loop)

    def asked(self) -> Asked:
        """What a measure of a loop, 1 at the limit, says in the goal's own unit; of a lower limit its inverse."""
        if self.sense == "<=":
            return Asked("<=", self.limit, self.unit, lambda v: self.limit * v)
        return Asked(">=", self.limit, self.unit, lambda v: self.limit / v if v else math.inf)


def chosen(
    asked: Iterable[str], known: Sequence[str], families: Mapping[str, Sequence[str]], what: str
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


def told_apart_by_sides(setting: Setting, records: Sequence[R]) -> list[R]:
    """Those whose rows differ: of two signals of sets that mirror each other, the right-hand one where both are."""
    twins, given = mirrored(setting), set(records)
    return [r for r in records if r.target not in twins or replace(r, target=twins[r.target]) not in given]


def mirrored(setting: Setting) -> dict[str, str]:
    """Name of a left-hand sensor or command to that of its mirror image.

    A vehicle looked at in its groups of motion is the same right and left.
    """
    if set(setting.groups) != {"heave_pitch", "sway_roll_yaw"}:
        return {}
    law = setting.law
    places, n = law.positions, law.count
    pairs = [(k, places.index((x, -y))) for k, (x, y) in enumerate(places) if y < 0 and (x, -y) in places]
    found = {
        law.sensors[first + k]: law.sensors[first + i] for first in range(0, len(law.sensors), n) for k, i in pairs
    }
    return found | {names(law.commands[k]): names(law.commands[i]) for k, i in pairs}


def names(command: str) -> str:
    """A command as changes and break points name it."""
    return command.removeprefix("command_")

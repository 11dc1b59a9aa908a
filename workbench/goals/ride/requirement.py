"""A limit on one quantity of a vehicle: what every kind of requirement has in common.

    Requirement --steer(Evaluated)--> [(label, values >= 0 where met, gradients (k, 17))], relative to the limit
                --judge(Flown)--> Verdicts by other algorithms;  a requirement never vanishes: where there is no value,
                                  an unstable loop or an unfiltered rate, it is not met and says so
                --margin(Flown), screened(Screened)--> the same of margins, without the random response

A kind that is the same quantity at several places has one class with a name for each (`places`).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Protocol

import numpy as np

from workbench.analysis.analysis import Analysis, unfiltered
from workbench.analysis.batch.closing import Closed
from workbench.analysis.sampled import SampledLoop
from workbench.analysis.setting import Setting
from workbench.errors import InputError, unknown_name
from workbench.goals.goal import Goal, Rows
from workbench.goals.key import Key
from workbench.goals.registry import GOALS, class_of
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.flown import Flown
from workbench.goals.verdict import CLOSE_ENOUGH, Verdict, shortfall

NO_RESPONSE = "an unfiltered rate has roots and no responses"
Found = Sequence[tuple[float | None, str]]  # value and where, at least one


class Screened(Protocol):
    """Many vehicles under the same gains at a time, (b,) of them.

    poles : (b, n) of all groups;  closed : each group's loops;  stable : numbers of those that are
    """

    poles: np.ndarray
    closed: Sequence[Closed]
    stable: np.ndarray


@dataclass(frozen=True, slots=True)
class Place:
    """One of several places at which a kind of quantity is limited.

    key : of data files;  kind, end, direction : as far as the quantity has them
    """

    key: Key
    kind: str = ""  # "gap" or "gap_lateral"
    end: str = ""  # "front" or "rear"
    direction: str = ""  # "vertical" or "lateral"

    @property
    def word(self) -> str:
        """The kind of gap as results say it."""
        return {"gap": "gap", "gap_lateral": "lateral gap"}[self.kind]

    @property
    def lateral(self) -> bool:
        """Whether it is one of the vehicle's motion sideways."""
        return "lateral" in (self.kind.rpartition("_")[2], self.direction)


@dataclass(frozen=True, slots=True, kw_only=True)
class Requirement(Goal):
    """One limit: the quantity must be >= or <= limit (SI units).

    margin_alone : whether the random response is not needed, so that `margin` and `screened` tell it
    of_roots : whether an unstable loop and an unfiltered rate have it too
    relaxed_first : whether a search begins with a looser limit
    rests_on_squares : whether its rows rest on mean squares, whose exact values `squares` knows
    in_analysis : whether the JSON of an analysis holds the value, at `quantities`
    boxed : whether the checker of gain tables can prove it over boxes of factors and ranges of speed
    by_group : whether there is a verdict and a promise for each group of motion
    by_key : whether one key of [requirements] states it; else a block [[goal]]
    """

    corners = False
    places: ClassVar[Mapping[str, Place]] = {}
    margin_alone: ClassVar[bool] = False
    of_roots: ClassVar[bool] = False
    relaxed_first: ClassVar[bool] = False
    rests_on_squares: ClassVar[bool] = False
    in_analysis: ClassVar[bool] = False
    boxed: ClassVar[bool] = False
    by_group: ClassVar[bool] = False
    by_key: ClassVar[bool] = True

    limit: float = field(kw_only=False)
    hard: bool = True

    def __post_init__(self) -> None:
        if not 0 < self.limit < float("inf"):
            raise InputError(f"the limit of {self._usual_name()!r} must be positive and finite; got {self.limit!r}.")
        Goal.__post_init__(self)
        if self.name not in self.all_kinds():
            raise unknown_name("requirement", self.name, self.all_kinds())

    def _usual_name(self) -> str:
        return self.name or self.all_kinds()[0]

    @classmethod
    def all_kinds(cls) -> tuple[str, ...]:
        return tuple(cls.places) or (cls.kind,)

    @classmethod
    def all_keys(cls, kind: str) -> tuple[Key, ...]:
        """The one key of [requirements], which names the kind too."""
        return (cls.places[kind].key,) if cls.places else cls.keys

    @classmethod
    def check_class(cls) -> None:
        lacks = [] if cls.steer is not Requirement.steer else ["steer()"]
        lacks += ["found()"] if cls.found is Requirement.found and cls.judge is Requirement.judge else []
        keys = [cls.all_keys(kind) for kind in cls.all_kinds()] if cls.by_key else []
        lacks += ["one key of data files for each of its kinds"] if any(len(own) != 1 for own in keys) else []
        if lacks:
            raise InputError(f"{cls.__name__} must define {', '.join(lacks)}; it does not. Add what is missing.")
        others = limit_keys(k for k in required_kinds() if k not in cls.all_kinds())
        for name in (own[0].name for own in keys):
            if name in others:
                raise InputError(
                    f"requirements must have distinct keys; {name!r} of {cls.__name__} is that of {others[name]!r}. "
                    "Choose another."
                )

    @classmethod
    def of_kind(cls, kind: str, values: Mapping[str, Any]) -> "Requirement":
        return cls(**values, name=kind)

    @property
    def word(self) -> str:
        return self.name

    @property
    def place(self) -> Place:
        """Where the quantity is taken, of a kind with several places."""
        return self.places[self.name]

    def shortfall(self, value: float) -> float:
        """By which fraction of the limit a value misses it; negative or zero where it is met."""
        return shortfall(self.sense, self.limit, value)

    def asked_at(self, back_off: float) -> float:
        """The limit, that much stricter."""
        return self.limit * (1 + (back_off if self.sense == ">=" else -back_off))

    def floor(self, back_off: float) -> float:
        """What no compromise takes a row of `steer` below: −inf, unless the loop must stay stable by it."""
        return float("-inf")

    def relaxed(self, factor: float) -> "Requirement":
        """With a limit that many times as loose."""
        return replace(self, limit=self.limit * (factor if self.sense == "<=" else 1 / factor))

    def check(self, problem: str, setting: Setting) -> None:
        """Refuses what the vehicle or its groups do not have: it could only be met by not looking."""
        if self.places and self.place.lateral and not moves_sideways(setting):
            raise InputError(
                f"{self.name!r} can be required only where the vehicle moves sideways; problem {problem!r} looks at "
                f"{', '.join(setting.groups)}. Add the group sway_roll_yaw, or drop the requirement."
            )

    # ---- to steer

    def steer(self, point: Evaluated) -> Rows:
        """Rows >= 0 where met, relative to the limit."""
        raise TypeError(f"{type(self).__name__} must define steer()")  # a defect of ours, not of the input

    def missed(self, loop: Flown, most: float) -> Iterable[float]:
        """Frequencies [rad/s] at which the exact quantity is above `most`, for rows that look at frequencies."""
        return ()

    def squares(self, analysis: Analysis) -> Mapping[str, float | None]:
        """Exact mean squares that the rows rest on, by class of `Evaluated.squares`."""
        return {}

    # ---- to judge

    def judge(self, loop: Flown) -> tuple[Verdict, ...]:
        """Verdicts by the exact measures of an analysis; one unless the kind has one for each group of motion."""
        if not self.of_roots and not loop.analysis.stable:
            return (self.said(None, "unstable loop"),)
        if not self.of_roots and unfiltered(loop.gains):
            return (self.said(None, NO_RESPONSE),)
        return tuple(self.said(value, where) for value, where in self.found(loop))

    def found(self, loop: Flown) -> Found:
        """(value, where) by the exact measures; asked of stable loops that have responses, unless `of_roots`."""
        raise TypeError(f"{type(self).__name__} must define found() or judge()")  # a defect of ours

    def sampled(self, loop: SampledLoop) -> float | None:
        """The quantity in the loop of a computer, seen at the samples; None where it has none."""
        return None

    def said(self, value: float | None, where: str) -> Verdict:
        """The verdict on one value; None (an unstable loop, an unfiltered rate) is never met, and `where` says why."""
        met = value is not None and self.shortfall(value) <= CLOSE_ENOUGH
        return Verdict(
            name=self.name, sense=self.sense, limit=self.limit, value=value, unit=self.unit, met=met, where=where
        )  # fmt: skip

    def mean_square(self, setting: Setting) -> tuple[Sequence[str], float] | None:
        """Outputs of the plant whose mean squares add up to what is limited, and the limit of the sum, if it is so."""
        return None

    def quantities(self, groups: Sequence[str]) -> tuple[str, ...]:
        """Dotted paths in the JSON of an analysis; a name of its own where no analysis holds the value.

        groups : of motion that the problem looks at
        """
        return (self.name.replace(", ", "_").replace(" ", "_"),)

    def promised_name(self, verdict: Verdict) -> str:
        """The name of the promise in a vehicle's table: that of the kind, and of the group where there is one each."""
        return f"{self.name}, {verdict.where.split(',')[0]}" if self.by_group else self.name


@dataclass(frozen=True, slots=True, kw_only=True)
class MarginRequirement(Requirement):
    """A requirement on roots and margins, which many vehicles can be asked for at a time."""

    margin_alone = True

    def margin(self, loop: Flown) -> Verdict:
        """The worst group's value, without a random response."""
        if not self.of_roots and not loop.stable:
            return self.said(None, "unstable loop")
        return self.said(*self.least(loop))

    def least(self, loop: Flown) -> tuple[float, str]:
        """The worst group's value, and which group."""
        raise TypeError(f"{type(self).__name__} must define least()")  # a defect of ours, not of the input

    def screened(self, many: Screened) -> np.ndarray:
        """(b,) values, good to some digits; NaN where an unstable loop has none."""
        raise TypeError(f"{type(self).__name__} must define screened()")  # a defect of ours, not of the input


def of_stable(many: Screened, values: np.ndarray) -> np.ndarray:
    """(b,) values of the stable ones, NaN for the others."""
    out = np.full(len(many.poles), np.nan)
    out[many.stable] = values
    return out


def moves_sideways(setting: Setting) -> bool:
    """Whether a group of the setting sways."""
    return bool({"sway_roll_yaw", "all"} & set(setting.groups))


def requirement(name: str, limit: float) -> Requirement:
    """The requirement of a name, limit in SI units."""
    return requirement_class(name)(limit, name=name)


def requirement_class(name: str) -> type[Requirement]:
    """The class of a requirement's name; raises InputError with the nearest one for an unknown name."""
    if name not in GOALS or not issubclass(GOALS[name], Requirement):
        raise unknown_name("requirement", name, required_kinds())
    found = class_of(name)
    assert issubclass(found, Requirement)
    return found


def required_kinds() -> tuple[str, ...]:
    """Names of all requirements that a key of [requirements] states, in the order in which they were registered."""
    return tuple(kind for kind, cls in GOALS.items() if issubclass(cls, Requirement) and cls.by_key)


def margin_kinds() -> tuple[str, ...]:
    """Names of those that need no random response: asked of every model and every speed unless told otherwise."""
    return tuple(kind for kind in required_kinds() if GOALS[kind].margin_alone)


def boxed(promised: str) -> bool:
    """Whether the checker can prove a promise of a vehicle's table over boxes; promised : its name, of any group."""
    cls = GOALS.get(promised) or GOALS.get(promised.rpartition(", ")[0])
    return cls is not None and issubclass(cls, Requirement) and cls.boxed


def limit_keys(kinds: Iterable[str] | None = None) -> dict[str, str]:
    """Key of [requirements] in data files to the name of the requirement, of all kinds or some."""
    return {GOALS[k].all_keys(k)[0].name: k for k in (required_kinds() if kinds is None else kinds)}


def requirement_of(key: str, limit: float) -> Requirement:
    """The requirement that a key of [requirements] asks for, its limit in the key's unit."""
    kind = limit_keys()[key]
    return requirement(kind, GOALS[kind].all_keys(kind)[0].value(limit))


def strictest(requirements: Iterable[Requirement]) -> dict[str, Requirement]:
    """Name to requirement: of several on one quantity the one that implies the others."""
    out: dict[str, Requirement] = {}
    for r in requirements:
        known = out.get(r.name, r)
        out[r.name] = (min if r.sense == "<=" else max)(known, r, key=lambda one: one.limit)
    return out

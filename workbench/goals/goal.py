"""Goals: what a tuned loop must do, each as a number that is at most 1 when the goal is met.

    Goal (name, hard, models, openings, focus, limits) --bind(loop)--> Bound --evaluate(K)--> Value with gradients
                                                                             --exact(K)-----> Value, another algorithm

A goal says what is wanted; bound to one loop it measures a controller K (numeric A, B, C, D). `evaluate` steers an
optimiser: fast, with the exact gradient of every piece near the largest (a peak, a pole, an instant), since the largest
of several is not smooth. `exact` decides: another algorithm, a certified bracket where there is one, and `method` says
which. A value that does not exist (an unstable loop) is infinite and carries its sentence in `reason`.

    Goal --steer(point)--> rows >= 0 where met, with gradients --judge(loop)--> Verdicts --promise(verdict)--> Promise

is what every kind answers, a vehicle's requirements (`goals.ride`) too; `goals.registry` finds a kind by its word.

The rooms: poles (decay, damping, radius), gain (H∞ of a channel), loop_shape (sensitivity, rejection, loop gain),
margin (disk and delay margins), sector (passivity, conic sectors), variance (H2, rms), spectrum (PSD mask), time
(overshoot, step rejection), tracking (against a reference model).
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import MISSING, dataclass, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from workbench.errors import InputError
from workbench.goals.key import HERTZ, Key
from workbench.goals.limit import Scales, scaled
from workbench.goals.measure import Asked, Bound, Value
from workbench.goals.promise import Promise, Sense, Subject, kept_limit
from workbench.goals.verdict import Verdict

if TYPE_CHECKING:
    from workbench.control.structure.block import Controller
    from workbench.control.structure.loop import Loop
    from workbench.control.structure.structure import Structure

Rows = list[tuple[str, np.ndarray, np.ndarray]]  # label, values (k,) >= 0 where met, gradients (k, parameters)
FULL_BAND = (0.0, math.inf)


@dataclass(frozen=True, slots=True)
class Closed:
    """Loops of one structure, one per model, closed by one controller: what a control goal is judged on."""

    loops: tuple["Loop", ...]
    controller: "Controller"


@dataclass(frozen=True, slots=True)
class Steered:
    """The same at parameters theta (n,), which the gradients of the rows are by: what a control goal is steered on."""

    loops: tuple["Loop", ...]
    structure: "Structure"
    theta: np.ndarray


COMMON = (Key("name"), Key("hard"), Key("models"), Key("openings"), Key(
    "focus_hz", "focus", read=lambda band: tuple(HERTZ * float(f) for f in band),
    written=lambda band: [w / HERTZ for w in band],
))  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """What all goals have in common.

    kind, keys : the word of the kind in data files, and the keys of its own there
    sense, unit : of the limit, where they are the same for all goals of a kind

    Parameters
    ----------
    name : str
        Shown in results; the kind and its signals if left out.
    hard : bool
        A hard goal must be at most 1; the largest soft one is minimised.
    models : names, optional
        The models it holds for; all if left out.
    openings : names of points
        Loops open while this goal is measured.
    focus : (low, high) [rad/s]
        The band it looks at; everything if left out.
    """

    kind: ClassVar[str] = ""
    proof: ClassVar[str] = ""  # kind of promise; the goal's own kind if left out
    keys: ClassVar[tuple[Key, ...]] = ()
    sense: ClassVar[str] = "<="
    unit: ClassVar[str] = "1"

    name: str = ""
    hard: bool = False
    models: tuple[str, ...] | None = None
    openings: tuple[str, ...] = ()
    focus: tuple[float, float] = FULL_BAND
    beside: ClassVar[bool] = False  # it looks at loops beside the nominal one; brought in after a first solution
    scales: ClassVar[Scales] = ()  # fields that the limit scales; `limit` if none is named
    corners: ClassVar[bool] = True  # it steers by few pieces, the largest of which has corners

    def __post_init__(self) -> None:
        for key in ("models", "openings"):
            value = getattr(self, key)
            if value is not None:
                object.__setattr__(self, key, names(key, value))
        band = tuple(float(end) for end in self.focus)
        if len(band) != 2 or not 0 <= band[0] < band[1]:
            raise InputError(
                f"focus must be (low, high) in rad/s with 0 ≤ low < high; got {self.focus!r}. Swap the ends."
            )
        object.__setattr__(self, "focus", band)
        if not self.name:
            object.__setattr__(self, "name", self._usual_name())

    def _usual_name(self) -> str:
        return " ".join([type(self).__name__, *self._signals()])

    def _signals(self) -> list[str]:
        """Names that tell this goal from another of its kind."""
        found = []
        for key in ("inputs", "outputs", "points"):
            value = getattr(self, key, ())
            if value:
                found.append(", ".join(value))
        return [" → ".join(found)] if found else []

    def holds_for(self, model: str) -> bool:
        """Whether a model is among those this goal speaks of."""
        return self.models is None or model in self.models

    # ---- in data files

    @property
    def word(self) -> str:
        """The kind of this goal, as data files say it."""
        return self.kind

    @classmethod
    def all_kinds(cls) -> tuple[str, ...]:
        """The kinds of this class: one, unless it measures one quantity at several places."""
        return (cls.kind,)

    @classmethod
    def all_keys(cls, kind: str) -> tuple[Key, ...]:
        """Every key of a data file for one of its kinds."""
        own = {f.name for f in fields(cls)}
        return (*(Key(name) for name in ("inputs", "outputs", "points") if name in own), *cls.keys, *COMMON)

    @classmethod
    def check_class(cls) -> None:
        """Refuses a class that could not be steered or judged."""
        if cls.bind is Goal.bind and (cls.steer is Goal.steer or cls.judge is Goal.judge):
            raise InputError(f"{cls.__name__} must define bind(), or steer() and judge(). Add them.")

    @classmethod
    def of_kind(cls, kind: str, values: dict[str, Any]) -> "Goal":
        """The goal with given fields."""
        return cls(**values)

    def stated(self) -> dict[str, Any]:
        """Fields that do not stand at their default, with their values."""
        found = {f.name: getattr(self, f.name) for f in fields(self)}
        usual = {f.name: self._usual_name() if f.name == "name" else f.default for f in fields(self)}
        return {n: v for n, v in found.items() if usual[n] is MISSING or not np.array_equal(v, usual[n])}

    def check(self, problem: str, setting: Any) -> None:
        """Refuses a goal on what the plant of a problem does not have; loops refuse names that they do not know."""

    # ---- to steer, to judge, to promise

    def bind(self, loop: "Loop") -> "Bound":
        """The goal measured on one loop; every kind of control goal defines it, one of a vehicle's ride has none."""
        raise InputError(
            f"{self.name!r} is asked of a vehicle's ride and steers by smooth rows; it can stand neither beside goals "
            "of loops, such as Poles or Margins, nor on a plant of one's own. Ask for those of one sort."
        )

    def asked(self) -> Asked:
        """The limit in the goal's own unit; a number that is at most 1 where it has none."""
        return Asked()

    def with_limit(self, limit: float) -> Self:
        """The same goal with another limit, in the unit of `asked()`; raises InputError where it has none to change."""
        return scaled(self, limit)

    def steer(self, point: Any) -> Rows:
        """The near-active pieces as rows 1 − value with gradients by theta, model by model.

        point : `Steered`; a model on which the goal has no value gives no row
        """
        rows, K = [], point.structure.controller(point.theta)
        for loop in point.loops:
            found = self.bind(loop).evaluate(K) if self.holds_for(loop.name) else None
            if found is not None and found.gradients:
                values = np.array([1 - value for value, _ in found.gradients])
                slopes = np.array([-point.structure.pullback(point.theta, G) for _, G in found.gradients])
                rows.append((f"{self.name} of {loop.name}", values, slopes))
        return rows

    def judge(self, loop: Any) -> tuple[Verdict, ...]:
        """The verdict on the model where the exact value is largest; loop : `Closed`."""
        found = [(self.bind(one).exact(loop.controller), one.name) for one in loop.loops if self.holds_for(one.name)]
        if not found:
            raise InputError(f"goal {self.name!r} must hold for a model that is given. Mend its models.")
        value, model = max(found, key=lambda pair: (pair[0].upper, pair[0].value))
        return (self.verdict(value, model),)

    def verdict(self, value: "Value", model: str) -> Verdict:
        """An exact value in the goal's own unit."""
        asked = self.asked()
        own = asked.value(value.value) if math.isfinite(value.value) else None
        upper = asked.value(value.upper) if math.isfinite(value.upper) else None
        return Verdict(
            name=self.name, sense=asked.sense, limit=asked.limit, value=own, unit=asked.unit, met=value.upper <= 1,
            where=value.where(), model=model, method=value.method, upper=upper,
        )  # fmt: skip

    def promise(self, verdict: Verdict) -> Promise | tuple[Promise, ...] | None:
        """What a table promises of a verdict: the limit asked for, else what was reached; None where nothing is.

        The kind's own word has a proof in `verify/promises` or none; then `verify` says that it is not proved. A limit
        that varies over frequency is no limit of the kind that is proved.
        """
        if self.proof and self.asked() == Asked():
            return None
        reached = verdict.value if verdict.upper is None else verdict.upper
        limit = None if reached is None else kept_limit(verdict.limit, reached, verdict.sense)
        return None if limit is None else self.promised(self.proof or self.word, verdict.sense, limit)

    def promises_on(self, loop: "Loop", verdict: Verdict) -> tuple[Promise, ...]:
        """The same as several promises, each of what the checker looks at by itself; loop : one of those judged."""
        found = self.promise(verdict)
        return () if found is None else (found,) if isinstance(found, Promise) else tuple(found)

    def promised(self, kind: str, sense: Sense, limit: float) -> Promise:
        """A promise of what this goal looks at."""
        subject = Subject(
            inputs=getattr(self, "inputs", ()), outputs=getattr(self, "outputs", ()), openings=self.openings,
            points=getattr(self, "points", ()), models=self.models or (), band=self.focus,
        )  # fmt: skip
        return Promise(kind, sense, limit, subject)


def names(what: str, value: Iterable[str] | str) -> tuple[str, ...]:
    """A tuple of names from a name or several."""
    found = (value,) if isinstance(value, str) else tuple(value)
    if not all(isinstance(name, str) and name for name in found):
        raise InputError(f"{what} must be names of signals; got {value!r}. Give a name or a tuple of names.")
    return found


def some_names(what: str, value: Iterable[str] | str) -> tuple[str, ...]:
    """At least one name."""
    found = names(what, value)
    if not found:
        raise InputError(f"{what} must name at least one signal; got none. Name the signals the goal looks at.")
    return found


def positive(what: str, value: float, unit: str = "") -> float:
    """A positive finite number."""
    number = float(value)
    if not (math.isfinite(number) and number > 0):
        raise InputError(f"{what} must be positive and finite; got {value!r} {unit}".rstrip() + ". Give a size.")
    return number


def stability_reason(poles: np.ndarray, sample_time: float | None, *, in_w_plane: bool = False) -> str:
    """Empty for a stable loop, else the sentence that names the pole furthest out.

    Sampled poles are given in z, or in w = (2/h)(z − 1)/(z + 1).
    """
    if len(poles) == 0:
        return ""
    if not np.isfinite(poles).all():
        return "the closed loop has no finite poles; its matrices overflow."
    left_half = sample_time is None or in_w_plane
    out = poles.real if left_half else np.abs(poles) - 1
    worst = int(np.argmax(out))
    if out[worst] < 0:
        return ""
    pole, plane = complex(poles[worst]), "1/s"
    if sample_time is not None:
        plane = "in the z plane"
        half = pole * sample_time / 2
        pole = (1 + half) / (1 - half) if in_w_plane and half != 1 else pole
    where = f"{pole.real:.4g} ± {abs(pole.imag):.4g}j {plane}"
    return f"the closed loop is unstable: pole {where}; its measure does not exist."


def told_apart(goals: Sequence[Goal]) -> tuple[Goal, ...]:
    """The goals, those whose name was left out and is another's too numbered: "Gain r → y", "Gain r → y (2)", ….

    Raises InputError for two of one given name.
    """
    taken: set[str] = set()
    found = []
    for goal in goals:
        name, count = goal.name, 1
        while name in taken:
            if goal.name != replace(goal, name="").name:
                raise InputError(f"goals must have distinct names; two are called {name!r}. Rename one of them.")
            count += 1
            name = f"{goal.name} ({count})"
        taken.add(name)
        found.append(goal if name == goal.name else replace(goal, name=name))
    return tuple(found)

"""Promises: what a gain table says of a loop that someone else can prove.

    Goal.promise(verdict) --> Promise(kind, sense, limit, subject) --gain table--> verify/promises/<kind>.py

A promise is a limit on one quantity of the closed loop that the table prints; its kind says which, its subject where.
A kind without a proof may be promised all the same: `verify` lists it as not proved.
"""

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from workbench.errors import InputError

Sense = Literal["<=", ">="]
DIGITS = 3  # of a limit that a soft goal reached, rounded to the side on which it holds


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """Which part of which loops a promise speaks of.

    inputs, outputs : points between which a channel is taken; an output may be a signed sum ("r - y")
    openings : points that are open
    points : where the loop is broken or pushed, for sensitivities and margins
    models : names of the models; none for all of the table
    band : (low, high) [rad/s] of the frequencies (or sizes of poles) that count; None for all
    scaled : inputs and outputs of the models with factors on them, 0 for a lost one: the loops of plants so changed
    """

    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    openings: tuple[str, ...] = ()
    points: tuple[str, ...] = ()
    models: tuple[str, ...] = ()
    band: tuple[float, float] | None = None
    scaled: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "scaled", tuple((str(name), float(factor)) for name, factor in self.scaled))
        for key in ("inputs", "outputs", "openings", "points", "models"):
            object.__setattr__(self, key, _names(key, getattr(self, key)))
        if self.band is not None:
            low, high = (float(end) for end in self.band)
            everything = low <= 0 and high == math.inf
            object.__setattr__(self, "band", None if everything else (low, high))

    def words(self) -> str:
        """The subject in a phrase, empty for the whole loop of every model."""
        parts = []
        if self.inputs or self.outputs:
            parts.append(f"{', '.join(self.inputs)} → {', '.join(self.outputs)}")
        parts += [f"at {', '.join(self.points)}"] if self.points else []
        parts += [f"with {', '.join(self.openings)} open"] if self.openings else []
        parts += [f"with {name} times {factor:g}" for name, factor in self.scaled]
        parts += ["from {:g} to {:g} rad/s".format(*self.band)] if self.band else []
        parts += [f"of {', '.join(self.models)}"] if self.models else []
        return " ".join(parts)


@dataclass(frozen=True, slots=True)
class Promise:
    """A quantity of a kind keeps a limit.

    Parameters
    ----------
    kind : str
        "stability", "decay rate" [1/s], "damping ratio" [1], "pole frequency" [rad/s], "peak gain" (largest singular
        value of a channel over all frequencies), "peak sensitivity" (the same of S at the points), "disk margin" (at
        all points together), "delay margin" (of each point) [s], "variance" (rms of the outputs under white noise of
        unit density at the inputs, 1/√s), "integrated error" (of outputs after unit steps at inputs) [s], or any other
        word.
    sense : "<=" or ">="
    limit : float
        In the quantity's own unit; of "stability" 0, the decay that every pole exceeds.
    """

    kind: str
    sense: Sense
    limit: float
    subject: Subject = field(default_factory=Subject)

    def __post_init__(self) -> None:
        if self.sense not in ("<=", ">="):
            raise InputError(f"a promise's sense must be '<=' or '>='; got {self.sense!r}. Write one of them.")
        number = float(self.limit)
        if not math.isfinite(number):
            raise InputError(f"a promise's limit must be finite; got {self.limit!r}. Promise nothing where none holds.")
        object.__setattr__(self, "limit", number)

    @property
    def name(self) -> str:
        """Kind and subject in words."""
        return " ".join(part for part in (self.kind, self.subject.words()) if part)

    def to_dict(self) -> dict[str, Any]:
        """The record of a gain table, in JSON's types."""
        return {"kind": self.kind, "sense": self.sense, "limit": self.limit, "subject": _plain(asdict(self.subject))}


def kept_limit(limit: float, reached: float, sense: Sense) -> float | None:
    """The limit to promise: the one asked for where it is kept, else the value itself rounded to its safe side.

    None where there is neither, because the value is infinite or no number.
    """
    met = reached <= limit if sense == "<=" else reached >= limit
    if met:
        return limit
    if not math.isfinite(reached):
        return None
    return _rounded(reached, up=sense == "<=")


def _rounded(value: float, *, up: bool) -> float:
    """Three digits, away from what the value excludes."""
    if value == 0:
        return 0.0
    step = 10.0 ** (math.floor(math.log10(abs(value))) - DIGITS + 1)
    steps = math.ceil(value / step + 1e-6) if up else math.floor(value / step - 1e-6)
    return float(f"{steps * step:.{DIGITS}g}")


def _names(key: str, value: str | Iterable[str]) -> tuple[str, ...]:
    found = (value,) if isinstance(value, str) else tuple(value)
    if not all(isinstance(name, str) and name for name in found):
        raise InputError(f"{key} of a promise must be names of signals or models; got {value!r}. Name them.")
    return found


def _plain(subject: dict[str, Any]) -> dict[str, Any]:
    """Lists for tuples, and of the keys those that say something."""
    given: dict[str, Any] = {key: list(value) for key, value in subject.items() if value}
    if "scaled" in given:
        given["scaled"] = dict(given["scaled"])
    if "band" in given:
        given["band"] = [given["band"][0], None if math.isinf(given["band"][1]) else given["band"][1]]
    return given

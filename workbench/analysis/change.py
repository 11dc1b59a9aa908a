"""One thing that is not as designed: what a sensor reads, what a command does, what vehicle it is.

    "scale:gap:0.9" --named--> Change(kind, target, amount) --.name--> "scale:gap:0.9"

    scale:<kind or sensor>:<factor>   sensors read that many times what they should    weak:<command>:<factor>
    dead:, stuck:, drift:<sensor>     reads zero, a constant, ever more beside the truth   lost:<command>   does nothing
    mass:, force:, stiffness:, inertia_roll:<factor> …, cg_forward:, cg_height:<m>, speed:<m/s>   another vehicle

A sensor that is stuck is, for every root and response, one that is dead: what it reads depends on nothing. One that
drifts leaves them as they are. What either does at rest is in proportion to what it reads: `variations`.
Source: guide, Definitions: Variations and losses.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from workbench.errors import InputError, unknown_name

SENSOR, COMMAND, VEHICLE = "sensor", "command", "vehicle"


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of change.

    on : what it changes;  amounts : those that an analysis lists
    factor : on sensors or commands, where the kind itself says it;  value : name in `Setting.elsewhere`
    positive : whether the amount is a factor or a speed, not a way
    """

    on: str
    amounts: tuple[float, ...] = ()
    factor: float | None = None
    value: str = ""
    positive: bool = True


KINDS: Mapping[str, Kind] = {
    "scale": Kind(SENSOR, (0.9, 1.1)),
    "mass": Kind(VEHICLE, (0.85, 1.15), value="mass"),
    "force": Kind(VEHICLE, (0.9, 1.1), value="current_force"),
    "lost": Kind(COMMAND, factor=0.0),
    "dead": Kind(SENSOR, factor=0.0),
    "stuck": Kind(SENSOR, factor=0.0),
    "drift": Kind(SENSOR, factor=1.0),
    "weak": Kind(COMMAND, (0.8,)),
    "stiffness": Kind(VEHICLE, (0.92, 1.08), value="gap_force"),
    "inertia_roll": Kind(VEHICLE, (0.9, 1.1), value="roll_inertia"),
    "inertia_pitch": Kind(VEHICLE, (0.9, 1.1), value="pitch_inertia"),
    "inertia_yaw": Kind(VEHICLE, (0.9, 1.1), value="yaw_inertia"),
    "cg_forward": Kind(VEHICLE, (-0.1, 0.1), value="cg_forward_m", positive=False),
    "cg_height": Kind(VEHICLE, (-0.1, 0.1), value="cg_height_m", positive=False),
    "speed": Kind(VEHICLE, value="speed_m_s"),
}


@dataclass(frozen=True, slots=True)
class Change:
    """One change.

    kind : of `KINDS`;  target : a sensor, a kind of sensors or a command, where the kind has one
    amount : factor [1], way [m] or speed [m/s], where the kind has one
    """

    kind: str
    target: str = ""
    amount: float | None = None

    @property
    def name(self) -> str:
        """As files and results say it."""
        amount = None if self.amount is None else f"{self.amount:g}"
        return ":".join(part for part in (self.kind, self.target, amount) if part)

    @property
    def on(self) -> str:
        """What it changes."""
        return KINDS[self.kind].on

    @property
    def factor(self) -> float:
        """What multiplies the signal of the sensors or the command."""
        known = KINDS[self.kind].factor
        return known if known is not None else float(self.amount or 0.0)

    @property
    def alike(self) -> "Change":
        """The change with the same roots and responses: a stuck sensor is a dead one, a drifting one a sound one."""
        if self.kind == "stuck":
            return Change("dead", self.target)
        return Change("scale", self.target, 1.0) if self.kind == "drift" else self

    @property
    def values(self) -> dict[str, float]:
        """Of `Setting.elsewhere`."""
        return {KINDS[self.kind].value: float(self.amount or 0.0)}

    @classmethod
    def named(cls, name: str) -> "Change":
        """The change of a name; refuses one that says none."""
        kind, _, rest = name.partition(":")
        if kind not in KINDS:
            raise unknown_name("variation", name, [*KINDS, *(f"{k}:*" for k in KINDS)])
        known = KINDS[kind]
        target, amount, sound = rest, None, True
        if known.factor is None:  # a signal's own name may hold a colon: the number is what follows the last one
            target, _, number = rest.rpartition(":")
            amount = _number(number)
            sound = amount is not None and (amount > 0 or not known.positive)
        if not sound or bool(target) != (known.on != VEHICLE):
            wanted = ([] if known.on == VEHICLE else [f"<{known.on}>"]) + (["<number>"] if known.factor is None else [])
            size = "a positive number" if known.positive else "a number"
            raise InputError(
                f"a variation {kind!r} is written {':'.join([kind, *wanted])}"
                f"{f', with {size}' if known.factor is None else ''}; got {name!r}."
            )
        return cls(kind, target, amount)


def _number(text: str) -> float | None:
    """A finite number; None where the text is none."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def chosen_changes(
    asked: Sequence[str], listed: Sequence[Change], check: Callable[[Change], None]
) -> tuple[Change, ...]:
    """The changes that names ask for, each once: `kind:*` for those listed of a kind, any other by its own name.

    check : refuses a change that means nothing here
    """
    found: dict[str, Change] = {}
    for name in asked:
        own = [c for c in listed if name == f"{c.kind}:*"]
        for change in own or [Change.named(name)]:
            check(change)
            found[change.name] = change
    return tuple(found.values())

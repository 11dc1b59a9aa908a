"""What a gain table can promise: each kind of quantity with its sense and unit, and the groups of motion it speaks of.

name of a promise --kind_of--> Kind and group; None where no such quantity is known
"""

from collections.abc import Sequence
from dataclasses import dataclass

PEAK = "peak sensitivity"
MOTOR_CURRENT = "motor current at mean + 3σ"
CURRENTS = "sum of mean square currents"
UNIFORM = "delay margin, uniform"
GRAVITY = "9.80665"  # m/s²


@dataclass(frozen=True, slots=True)
class Kind:
    """One quantity: the sense a limit on it has, its unit, and whether it can be promised over boxes."""

    name: str
    sense: str
    unit: str
    boxed: bool = False


KINDS = {
    kind.name: kind
    for kind in (
        Kind("damping ratio", ">=", "1", boxed=True),
        Kind("decay rate", ">=", "1/s", boxed=True),
        Kind(PEAK, "<=", "1", boxed=True),
        Kind("delay margin", ">=", "s"),
        Kind(UNIFORM, ">=", "s"),
        Kind("rms gap, front", "<=", "m"),
        Kind("rms gap, rear", "<=", "m"),
        Kind("rms lateral gap, front", "<=", "m"),
        Kind("rms lateral gap, rear", "<=", "m"),
        Kind(CURRENTS, "<=", "1"),
        Kind("static gap error from bias", "<=", "m"),
        Kind("static lateral gap error from bias", "<=", "m"),
        Kind("peak gap change", "<=", "m"),
        Kind("peak lateral gap change", "<=", "m"),
        Kind("vertical ride mask ratio", "<=", "1"),
        Kind("lateral ride mask ratio", "<=", "1"),
        Kind(MOTOR_CURRENT, "<=", "A"),
    )
}
# groups of a table: no motion may belong to two
TOGETHER = (
    {"heave_pitch"}, {"sway_roll_yaw"}, {"heave"}, {"all"}, {"heave_pitch", "sway_roll_yaw"},
    {"heave", "sway_roll_yaw"},
)  # fmt: skip


def kind_of(name: str) -> Kind | None:
    """The kind of a promise or requirement; the peak sensitivity of a group is of the kind "peak sensitivity"."""
    return KINDS.get(PEAK if name.startswith(f"{PEAK}, ") else name)


def called(group: str) -> str:
    """The name a group goes by in promises and figures: heave with pitch held goes by that of its group."""
    return "heave_pitch" if group == "heave" else group


def promised_names(requirement: str, groups: Sequence[str]) -> list[str]:
    """Names of the promises that a requirement asks for: the peak sensitivity one for each group."""
    if requirement != PEAK:
        return [requirement]
    return [f"{PEAK}, {called(group)}" for group in groups]

"""Whether a vehicle is the same right and left, exactly: then heave and pitch never meet sway, roll and yaw.

    names of signals, places of coil sets --mirror--> for each signal its partner and a sign
    plant --asymmetry--> the first entry that is not its partner's, or None

Right and left change places: heave and pitch stay, sway, roll and yaw turn round; what belongs to a coil set, outward
or upward, goes to the set opposite. A plant that keeps this in every digit has no path between the two groups, neither
through motions nor through currents, inputs or outputs: proofs of the groups are proofs of the vehicle.
"""

from collections.abc import Sequence
from typing import Any

from flint import fmpq

from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.system import System

TURNED = {"Y", "Phi", "Psi", "force_y", "moment_roll", "moment_yaw"}
KEPT = {"Z", "Theta", "force_z", "moment_pitch"}
OF_A_COMMAND = ("command", "current", "gap", "gap_lateral", "acceleration_z", "acceleration_y")
OF_A_SET = {"zeta": 1, "eta": 1, "bank": -1, "zeta_rate": 1, "eta_rate": 1}
BLOCKS = (("A", "states", "states"), ("B", "states", "inputs"), ("C", "outputs", "states"), ("D", "outputs", "inputs"))


def opposite(positions: Sequence[tuple[Any, Any]]) -> list[int]:
    """For each coil set the one at the same place on the other side."""
    places = list(positions)
    if len(set(places)) < len(places) or any((x, -y) not in places for x, y in places):
        raise NotProved("coil sets do not come in right-left pairs at the same place, so that the motions do not part")
    return [places.index((x, -y)) for x, y in places]


def mirror(
    names: Sequence[str], positions: Sequence[tuple[Any, Any]], sets: Sequence[tuple[Any, Any]] = ()
) -> list[tuple[int, int]]:
    """(position of the partner, sign) of each signal.

    positions : (x, y) of commands and sensors;  sets : of the coil sets, where several share a command
    """
    partner, at = opposite(positions), {name: i for i, name in enumerate(names)}
    below = opposite(sets) if sets else partner
    out = []
    for name in names:
        other, sign = _partner(name, partner, below)
        if other not in at:
            raise NotProved(f"the plant's signal {name[:40]!r} has no partner on the other side")
        out.append((at[other], sign))
    return out


def _partner(name: str, partner: Sequence[int], below: Sequence[int]) -> tuple[str, int]:
    bare = name.removesuffix("_rate").removesuffix("_acceleration")
    if bare in TURNED or bare in KEPT:
        return name, -1 if bare in TURNED else 1
    kind, _, which = name.rpartition("_")
    places = below if kind in OF_A_SET else partner
    if (kind in OF_A_SET or kind in OF_A_COMMAND) and which.isdecimal() and 0 < int(which) <= len(places):
        return f"{kind}_{places[int(which) - 1] + 1}", OF_A_SET.get(kind, 1)
    if which in ("right", "left") and kind.startswith(("command_", "current_")):
        return f"{kind}_{'left' if which == 'right' else 'right'}", 1
    raise NotProved(f"the plant's signal {name[:40]!r} is none that the checker can turn right to left")


def asymmetry(plant: System, positions: Sequence[tuple[fmpq, fmpq]], sets=()) -> tuple[str, fmpq] | None:
    """The entry that differs most from its partner, and by how much of its matrix' largest; None if none does."""
    turned = {kind: mirror(getattr(plant, kind), positions, sets) for kind in ("states", "inputs", "outputs")}
    worst: tuple[str, fmpq] | None = None
    for letter, row_kind, column_kind in BLOCKS:
        M = getattr(plant, letter)
        size = max((abs(e) for e in M.entries()), default=fmpq(0))
        for i, (mi, si) in enumerate(turned[row_kind]):
            for j, (mj, sj) in enumerate(turned[column_kind]):
                off = abs(M[i, j] - si * sj * M[mi, mj])
                if off and (worst is None or off / size > worst[1]):
                    worst = f"{letter}({getattr(plant, row_kind)[i]}, {getattr(plant, column_kind)[j]})", off / size
    return worst

"""The closed loop of each group of motion in exact rationals, at the printed plant and at plants varied by factors.

    plant as printed, or of the vehicle beside it with factors --hold other coordinates, currents along patterns-->
      group's plant --law--> closed loop: inputs as of the plant, `error_<sensor>`, `pattern_k`; outputs, `pattern_k`

Patterns are ±1 and 0, not of unit length, so that all stays rational. With d_k their squared lengths, a sensitivity M
between pattern commands has the entries M_ij √(d_i/d_j) between orthonormal patterns: |·|² takes d_i/d_j.

What a group leaves out is its coupling with the rest (rounding of a vehicle that is symmetric right to left); more than
1e-9 of the largest entry is refused, and the part left out is reported.

Factors of a box, 1 = as printed: "mass"; "inertia" (all three at once) and "roll_inertia", "pitch_inertia",
"yaw_inertia"; "current_force" on what a current does; "gap_force" on what gap changes and roll of a set do;
"vertical_sensors", "lateral_sensors" on what all sensors of a direction read. The pose
and the forces at rest stay, as in `workbench.physics.vehicle.varied`; these plants are rebuilt from the vehicle's
numbers.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from flint import fmpq, fmpq_mat

from workbench.verify.exact.failure import NotProved, TableError
from workbench.verify.exact.system import System, identity, matrix, part, stacked, zeros
from workbench.verify.vehicle.law import GROUPS
from workbench.verify.vehicle.table import Table

COORDINATES = ("Z", "Theta", "Y", "Phi", "Psi")
SCALED = {  # by all sensors of one direction reading too much: the same as their gains being as much too large
    "vertical_sensors": ("K_h", "K_hdot", "K_zddot", "K_zdot"),
    "lateral_sensors": ("K_hp", "K_hpdot", "K_yddot", "K_ydot"),
}
FACTORS = (
    "mass", "inertia", "current_force", "gap_force", "roll_inertia", "pitch_inertia", "yaw_inertia", *SCALED,
)  # fmt: skip
DIVIDING = tuple(name for name in FACTORS if name == "mass" or name.endswith("inertia"))
COUPLING_ALLOWED = fmpq(1, 10**9)
PRINTED: Mapping[str, fmpq] = {}


@dataclass(frozen=True, slots=True)
class GroupLoop:
    """The closed loop of a group.

    system : inputs of the plant other than commands, `error_<sensor>`, `pattern_k` (command errors); outputs of the
        plant and `pattern_k` (the commands)
    lengths : squared length of each pattern
    """

    group: str
    system: System
    patterns: tuple[str, ...]
    lengths: tuple[fmpq, ...]

    @property
    def A(self) -> fmpq_mat:
        """State matrix."""
        return self.system.A

    @property
    def sensitivity(self) -> System:
        """From command errors to commands, along the patterns: (I + L)⁻¹."""
        return self.system.select(self.patterns, self.patterns)


def closed_loop(
    table: Table, group: str, theta: Mapping[str, fmpq] = PRINTED, *, kept: Collection[str] = ()
) -> GroupLoop:
    """The closed loop of "heave_pitch", "sway_roll_yaw", "heave" (pitch held) or "all", as printed or at factors theta.

    Raises
    ------
    NotProved
        If the groups are coupled, patterns do not exist or the loop has no state space.
    """
    if group not in GROUPS:
        raise TableError(f"a group must be one of {', '.join(GROUPS)}; got {group[:60]!r}. Name one of them.")
    factor = factors(theta)
    # by name, not by value: 1 is a member of a box like any other, and all are of the rebuilt plant
    plant = varied(table, factor) if set(theta) - set(SCALED) else table.plant
    law = table.law
    if group != "all" and coupling(plant) > COUPLING_ALLOWED:
        raise NotProved(f"heave and pitch are coupled with sway, roll and yaw ({float(coupling(plant)):.2g})")
    patterns, lengths = law.patterns(group)
    names = tuple(f"pattern_{k + 1}" for k in range(len(lengths)))
    alone = _held(_along(plant, law.commands, law.currents, patterns, lengths, names), GROUPS[group].coordinates)
    gains = dict(table.gains)
    for name, scaled in SCALED.items():
        gains |= {gain: factor[name] * gains[gain] for gain in scaled}
    Ac, Bc, Cc, Dc = law.controller(gains, GROUPS[group].channels, kept)
    onto = _projection(patterns, lengths)
    return GroupLoop(
        group, _interconnected(alone, (Ac, Bc, onto * Cc, onto * Dc), names, law.sensors), names, tuple(lengths)
    )


def factors(theta: Mapping[str, fmpq]) -> dict[str, fmpq]:
    """All factors by name, 1 where nothing is said."""
    unknown = [name for name in theta if name not in FACTORS]
    if unknown:
        raise NotProved(f"a box over {unknown[0][:60]!r} is not known to the checker")
    out = {name: fmpq(1) for name in FACTORS} | dict(theta)
    for name in ("roll_inertia", "pitch_inertia", "yaw_inertia"):
        out[name] *= out["inertia"]
    return out


def varied(table: Table, factor: Mapping[str, fmpq]) -> System:
    """The plant of the vehicle in the certificate with factors on its inertias and forces."""
    if min(factor[name] for name in ("mass", *(k for k in factor if k.endswith("inertia")))) <= 0:
        raise NotProved("a box must keep mass and inertias positive")
    physics = table.certificate.physics if table.certificate else None
    if physics is None:
        raise NotProved("a box of factors needs the vehicle behind the plant, and the certificate holds none")
    return physics.varied(factor).plant()


def coupling(plant: System) -> fmpq:
    """Largest entry of A between (Z, Θ) and (Y, Φ, Ψ), relative to the largest of all."""
    groups = [
        plant.index("states", [*names, *(f"{c}_rate" for c in names)]) for names in (COORDINATES[:2], COORDINATES[2:])
    ]
    both = groups[0] + groups[1]
    size = max(abs(e) for e in part(plant.A, both, both).entries())
    across = max(abs(e) for a, b in (groups, groups[::-1]) for e in part(plant.A, a, b).entries())
    return across / size if size else fmpq(0)


def left_out(table: Table, group: str) -> fmpq:
    """What a group's plant leaves out: the largest entry by which held coordinates and other patterns would move it.

    Relative to the largest entry of A; zero for the whole vehicle. For a pitch that is held on purpose, of the
    antisymmetric motions only.
    """
    if group == "all":
        return fmpq(0)
    plant, law = table.plant, table.law
    mine = GROUPS[group].coordinates
    symmetric = mine[0] in COORDINATES[:2]
    other = COORDINATES[2:] if symmetric else COORDINATES[:2]
    rows = plant.index("states", [f"{c}_rate" for c in mine])
    columns = plant.index("states", [*other, *(f"{c}_rate" for c in other)])
    size = max(abs(e) for e in plant.A.entries())
    worst = max((abs(e) for e in part(plant.A, rows, columns).entries()), default=fmpq(0))
    # the other parity of currents, which its own patterns would have to carry
    driven = [c for c in law.currents if c in plant.states]
    source = part(plant.A, rows, plant.index("states", driven)) if driven else None
    if source is None:
        source = part(plant.B, rows, plant.index("inputs", law.commands))
    against, _ = law.patterns("sway_roll_yaw" if symmetric else "heave_pitch")
    return max(worst, max((abs(e) for e in (source * against).entries()), default=fmpq(0))) / size


def _projection(patterns: fmpq_mat, lengths: Sequence[fmpq]) -> fmpq_mat:
    """(k, commands): coordinates along the patterns."""
    return matrix([[e / d for e in row] for row, d in zip(patterns.transpose().tolist(), lengths, strict=True)])


def _along(plant: System, commands, currents, patterns, lengths, names) -> System:
    """The plant with commands, and the currents that are states, along the patterns only."""
    u = plant.index("inputs", commands)
    others = [i for i in range(len(plant.inputs)) if i not in set(u)]
    n, k = len(plant.states), len(names)
    driven = set(currents) & set(plant.states)
    keep = [i for i, s in enumerate(plant.states) if s not in driven]
    into = part(identity(n), range(n), keep)
    back = into.transpose()
    states = tuple(plant.states[i] for i in keep)
    if driven:
        at = plant.index("states", currents)
        spread = zeros(n, k)
        for row, entries in zip(at, patterns.tolist(), strict=True):
            for column, entry in enumerate(entries):
                spread[row, column] = entry
        onto = _projection(spread, lengths)
        into, back = stacked([[into, spread]]), stacked([[back], [onto]])
        states += tuple(f"current of {name}" for name in names)
    rows = range(n)
    B = stacked([[part(plant.B, rows, u) * patterns, part(plant.B, rows, others)]])
    y = range(len(plant.outputs))
    return System(
        back * plant.A * into, back * B, plant.C * into,
        stacked([[part(plant.D, y, u) * patterns, part(plant.D, y, others)]]),
        states, names + tuple(plant.inputs[i] for i in others), plant.outputs,
    )  # fmt: skip


def _held(plant: System, moving: Sequence[str]) -> System:
    """The plant with every coordinate but the moving ones held at zero."""
    held = {c for c in COORDINATES if c not in moving}
    keep = [i for i, s in enumerate(plant.states) if s not in held and s.removesuffix("_rate") not in held]
    C, D = plant.C.tolist(), plant.D.tolist()
    for i, name in enumerate(plant.outputs):
        if name.removesuffix("_acceleration") in held:
            C[i], D[i] = [fmpq(0)] * len(C[i]), [fmpq(0)] * len(D[i])
    C, D = matrix(C), matrix(D)
    return System(
        part(plant.A, keep, keep), part(plant.B, keep, range(len(plant.inputs))),
        part(C, range(len(plant.outputs)), keep), D,
        tuple(plant.states[i] for i in keep), plant.inputs, plant.outputs,
    )  # fmt: skip


def _interconnected(plant: System, controller: tuple[fmpq_mat, ...], commands, sensors) -> System:
    """Plant and law with errors added to the sensors and to the commands."""
    Ac, Bc, Cc, Dc = controller
    open_inputs = tuple(name for name in plant.inputs if name not in commands)
    u, w, y = plant.index("inputs", commands), plant.index("inputs", open_inputs), plant.index("outputs", sensors)
    x, z = range(len(plant.states)), range(len(plant.outputs))
    Bu, Bw, Cy = part(plant.B, x, u), part(plant.B, x, w), part(plant.C, y, x)
    Dyu, Dyw = part(plant.D, y, u), part(plant.D, y, w)
    closing = identity(len(u)) - Dc * Dyu
    if closing.det() == 0:
        raise NotProved("the direct acceleration gain closes an algebraic loop without solution")
    E, nc, ny = closing.inv(), Ac.nrows(), len(sensors)
    by_state = stacked([[E * Dc * Cy, E * Cc]])
    by_input = stacked([[E * Dc * Dyw, E * Dc, E]])
    seen_state = stacked([[Cy, zeros(ny, nc)]]) + Dyu * by_state
    seen_input = stacked([[Dyw, identity(ny), zeros(ny, len(u))]]) + Dyu * by_input
    k = ny + len(u)
    top = stacked([[plant.A, zeros(len(plant.states), nc)]]) + Bu * by_state
    bottom = Bc * seen_state + stacked([[zeros(nc, len(plant.states)), Ac]])
    top_in = stacked([[Bw, zeros(len(plant.states), k)]]) + Bu * by_input
    Dzu, Dzw = part(plant.D, z, u), part(plant.D, z, w)
    out_state = stacked([[plant.C, zeros(len(plant.outputs), nc)]]) + Dzu * by_state
    out_input = stacked([[Dzw, zeros(len(plant.outputs), k)]]) + Dzu * by_input
    return System(
        stacked([[top], [bottom]]), stacked([[top_in], [Bc * seen_input]]),
        stacked([[out_state], [by_state]]), stacked([[out_input], [by_input]]),
        plant.states + tuple(f"filter {i + 1}" for i in range(nc)),
        (*open_inputs, *(f"error_{name}" for name in sensors), *commands),
        (*plant.outputs, *commands),
    )  # fmt: skip

"""Numbers of a table held against each other: none on which a figure depends may be what it likes.

    plant's outputs       against the law's places of coil sets and gravity (a gap is that of a body at those places)
    plant                 against its mirror image: the groups are proved apart, so nothing may pass between them
    vehicle's coil forces against its weight: what does not carry it is no flight
    schedule              against gains and coil forces at the table's own speed
    requirements          against what is proved of them
    motor                 against the plant's currents

Each tie answers with sentences, one for each thing that does not hold.
"""

from collections.abc import Iterator, Sequence
from typing import Any

from flint import fmpq

from workbench.verify.exact.failure import NotProved
from workbench.verify.reading import decimal
from workbench.verify.vehicle.kind import GRAVITY
from workbench.verify.vehicle.mirror import asymmetry
from workbench.verify.vehicle.physics import ROUNDING, SAME, Physics
from workbench.verify.vehicle.scheduled import FORCES, polynomials_of
from workbench.verify.vehicle.table import Table

CARRIED = fmpq(1, 1000)  # of the weight: printed force laws have four digits
PRINTED = fmpq(1, 10**9)  # relative: gains of a schedule are computed in doubles from its printed coefficients
BALANCED = fmpq(1, 10)  # of weight × length, of weight × track for roll: the most that ballast and thrust line balance
KINDS = ("a force down", "a pitch moment", "a force to the right", "a roll moment", "a yaw moment")
UNITS = ("N", "N m", "N", "N m", "N m")
COORDINATES = ("Z", "Theta", "Y", "Phi", "Psi")


def faults_of(table: Table) -> list[str]:
    """Everything in which the table's numbers contradict each other."""
    faults = [*_kinematics(table), *_symmetry(table), *_schedule(table)]
    physics = table.certificate.physics if table.certificate else None
    return faults + (_carried(physics) if physics else []) + _motor(table)


def _motor(table: Table) -> list[str]:
    """A motor's currents are those of a plant that has one."""
    if table.certificate is None or table.certificate.motor is None:
        return []
    due = [f"current_motor_{axis}_{side}" for axis in "dq" for side in ("right", "left")]
    missing = [name for name in due if name not in table.plant.outputs]
    return [f"a motor's currents are stated, and the plant has no {missing[0]!r}"] if missing else []


def _sets(table: Table) -> tuple[Sequence[tuple[fmpq, fmpq]], Sequence[Sequence[int]]]:
    """Places of the coil sets, and those of each command."""
    physics = table.certificate.physics if table.certificate else None
    places = table.law.positions if physics is None else physics.positions
    alone = [(i,) for i in range(len(places))]
    return places, (physics.joined if physics else ()) or alone


def _kinematics(table: Table) -> list[str]:
    """The plant's outputs are those of sensors at the law's places."""
    wrong = [fault for fault in _outputs(table) if fault]
    more = f" ({len(wrong)} entries in all)" if len(wrong) > 1 else ""
    return [f"{wrong[0]}{more}: the plant's sensors stand elsewhere than the law's"] if wrong else []


def _outputs(table: Table) -> Iterator[str]:
    plant, law = table.plant, table.law
    states = [*COORDINATES, *(f"{c}_rate" for c in COORDINATES)]
    at = plant.index("states", states)
    rates = at[5:]
    gravity = decimal(GRAVITY, "")
    columns = {"C": len(plant.states), "D": len(plant.inputs)}

    def row(letter: str, parts: dict[str, dict[int, fmpq]], accelerations: dict[int, fmpq]) -> list[fmpq]:
        """What a row must be: direct entries, and multiples of the rows that the accelerations have in A or B."""
        source = plant.A if letter == "C" else plant.B
        out = [fmpq(0)] * columns[letter]
        for column, value in parts.get(letter, {}).items():
            out[column] += value
        for k, share in accelerations.items():
            for j in range(columns[letter]):
                out[j] += share * source[rates[k], j]
        return out

    one = fmpq(1)
    expected: dict[str, list[tuple[dict[str, dict[int, fmpq]], dict[int, fmpq]]]] = {}
    for k, name in enumerate(states):
        expected[name] = [({"C": {at[k]: one}}, {})]
    for k, name in enumerate(COORDINATES):
        expected[f"{name}_acceleration"] = [({}, {k: one})]
    _, groups = _sets(table)
    if len(groups) != law.count:
        yield f"the vehicle must have the law's {law.count} commands; its coil sets make {len(groups)}"
        return
    for i, ((x, y), s) in enumerate(zip(law.positions, law.sides, strict=True)):
        n, share = i + 1, fmpq(-1, len(groups[i]))  # sensors of a command read the mean over its coil sets
        zeta, eta = (plant.index("inputs", [f"{kind}_{k + 1}" for k in groups[i]]) for kind in ("zeta", "eta"))
        vertical = {at[0]: -one, at[1]: x, at[3]: -y}
        expected[f"gap_{n}"] = [({"C": vertical, "D": dict.fromkeys(zeta, share)}, {})]
        lateral = {at[2]: one * s, at[4]: x * s, at[3]: -law.depth * s}
        expected[f"gap_lateral_{n}"] = [({"C": lateral, "D": dict.fromkeys(eta, share)}, {})]
        expected[f"acceleration_z_{n}"] = [({}, {0: -one, 1: x, 3: -y})]
        felt = {2: one * s, 4: x * s, 3: -law.depth * s}
        expected[f"acceleration_y_{n}"] = [({}, felt), ({"C": {at[3]: -gravity * s}}, felt)]
    for command, current in zip(law.commands, law.currents, strict=True):
        where = ("C", plant.index("states", [current])) if current in plant.states else (
            "D", plant.index("inputs", [command])
        )  # fmt: skip
        expected[current] = [({where[0]: {where[1][0]: one}}, {})]
    for i, name in enumerate(plant.outputs):
        if name not in expected:
            yield f"the plant's output {name[:40]!r} must be one of a vehicle on coil sets; it is none"
            continue
        printed = {letter: [getattr(plant, letter)[i, j] for j in range(columns[letter])] for letter in "CD"}
        if not any(
            all(_same(printed[letter], row(letter, parts, felt)) for letter in "CD") for parts, felt in expected[name]
        ):
            yield f"the plant's output {name[:40]!r} must follow from its motions and the law's places to 1e-9"


def _same(printed: list[fmpq], due: list[fmpq]) -> bool:
    size = max((abs(v) for v in (*printed, *due)), default=fmpq(0))
    return all(
        abs(a - b) <= SAME * max(abs(a), abs(b)) + ROUNDING * size for a, b in zip(printed, due, strict=True)
    )  # fmt: skip


def _symmetry(table: Table) -> list[str]:
    """Groups are proved apart only where nothing passes between them."""
    groups = table.certificate.groups if table.certificate else ()
    if groups == ("all",):
        return []
    try:
        worst = asymmetry(table.plant, table.law.positions, _sets(table)[0])
    except NotProved as error:
        return [f"the groups must not be coupled, and {error}"]
    if worst is None:
        return []
    return [
        f"the groups must not be coupled, so the plant must be the same right and left in every digit; {worst[0]} "
        f"differs from its mirror image by {float(worst[1]):.2g} of the largest entry. Write the table anew with "
        "'workbench design', or prove the whole: groups = ['all']"
    ]


def _carried(physics: Physics) -> list[str]:
    """The coil forces at rest carry the weight and leave no moment but one that ballast can balance."""
    weight = physics.inertia[0] * decimal(GRAVITY, "")
    lift, lateral, turn = (physics.forces[k, 0] for k in range(3))
    residual = [fmpq(0)] * 5
    for x, y in physics.positions:
        side = 1 if y > 0 else -1
        force = (-physics.drag_ratio * (lift + lateral), side * lateral, -lift)
        moment = (
            -y * lift - physics.depth * force[1] - side * turn,
            physics.depth * force[0] + x * lift,
            x * force[1] - y * force[0],
        )
        here = (-lift, moment[1], force[1], moment[0], moment[2])
        residual = [a + b for a, b in zip(residual, here, strict=True)]
    residual[0] += weight
    length, track = (max(at) - min(at) for at in zip(*physics.positions, strict=True))
    base = [fmpq(1), BALANCED * length, fmpq(1), BALANCED * track, BALANCED * length]
    allowed = [(CARRIED if k in (0, 2) else 1) * weight * b for k, b in enumerate(base)]
    return [
        f"the coil sets' forces at rest must carry the weight of {float(weight):.6g} N but for what ballast balances; "
        f"they leave {kind} of {float(left):.4g} {unit}, and {float(most):.3g} {unit} may be"
        for kind, unit, left, most in zip(KINDS, UNITS, residual, allowed, strict=True)
        if abs(left) > most
    ]


def _schedule(table: Table) -> list[str]:
    """A schedule is of these gains and of this vehicle at the table's own speed."""
    if table.schedule is None:
        return []
    certificate = table.certificate
    gains, forces = polynomials_of(table.schedule)
    speed = certificate.guideway.speed if certificate and certificate.guideway else None
    if speed is None or not gains.lower <= speed <= gains.upper:
        return ["a schedule must reach the speed of its table, which the guideway states; it does not"]
    at = gains.at(speed)
    # of the gain itself: the coefficients may be made as large as one likes by another centre and scale
    odd = [name for name, value in at.items() if abs(value - table.gains[name]) > PRINTED * abs(table.gains[name])]
    faults = []
    if odd:
        faults.append(
            f"the schedule's gains at {float(speed):g} m/s must be the table's; {odd[0]} is {float(at[odd[0]]):.9g} "
            f"there, {float(table.gains[odd[0]]):.9g} in the table"
        )
    physics = certificate.physics if certificate else None
    if forces is None or physics is None:
        return faults
    there = forces.polynomials.at(speed)
    due: dict[str, Any] = {f"{kind},{k}": physics.forces[row, k] for row, kind in enumerate(FORCES) for k in range(5)}
    due["lift_to_drag"] = 1 / physics.drag_ratio if physics.drag_ratio else fmpq(0)
    odd = [name for name, value in there.items() if abs(value - due[name]) > forces.error(name) + SAME * abs(due[name])]
    if odd:
        faults.append(
            f"the schedule's coil forces at {float(speed):g} m/s must be the vehicle's as far as their stated error; "
            f"{odd[0]} is {float(there[odd[0]]):.9g}, the vehicle's {float(due[odd[0]]):.9g}"
        )
    return faults

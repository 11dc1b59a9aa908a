"""The vehicle behind a plant: masses, coil places and forces of one coil set, and the plant that follows from them.

    pose, currents, guideway --kinematics--> gaps, roll of each set --slopes--> forces --sums about the cg--> I q̈
      --> plant of the coil sets --sets of one command joined--> plant --> compared with the printed one, by name

Derived a second time, linear from the start, in exact rationals: a rigid body on coil sets at rest in its nominal pose.
Forces of the sets hold their directions in the guideway, so the moments of those at rest turn with the body:
δ(R'F) = δF − (Φ, Θ, Ψ) × F. So a plant that is not that of the vehicle named beside it is noticed from the file alone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from flint import fmpq, fmpq_mat

from workbench.verify.exact.failure import TableError
from workbench.verify.exact.system import System, diagonal, identity, matrix, part, stacked, zeros
from workbench.verify.reading import decimal, entries_of, keyed, matrix_of
from workbench.verify.vehicle.kind import GRAVITY

COORDINATES = ("Z", "Theta", "Y", "Phi", "Psi")
LOADS = ("force_z", "moment_pitch", "force_y", "moment_roll", "moment_yaw")
PER_SET = ("gap", "gap_lateral", "acceleration_z", "acceleration_y")
FROM_SET = ("command", "current", *PER_SET)
KEYS = (
    "mass_kg", "roll_inertia_kg_m2", "pitch_inertia_kg_m2", "yaw_inertia_kg_m2", "positions_m", "depth_m", "joined",
    "lift", "lateral", "moment", "drag_ratio", "gravity_m_s2", "gravity_term", "current_lag_s", "coil_length_m",
    "thrust_n", "lift_damping_n_s_m", "lateral_damping_n_s_m", "bank_reading",
)  # fmt: skip
SAME = fmpq(1, 10**9)  # relative: the plant was computed in doubles, which leaves 1e-14
ROUNDING = fmpq(1, 10**12)  # of a row's largest entry: what that leaves where a zero belongs


@dataclass(frozen=True, slots=True)
class Physics:
    """A vehicle at rest in its nominal pose; SI units.

    forces : (3, 5) lift, lateral force and roll moment of one coil set: value at rest, slopes by gap, lateral gap,
        roll and current ratio;  joined : sets that share a command, counted from 0
    """

    inertia: tuple[fmpq, ...]  # m, B, m, A, C, in the order of COORDINATES
    positions: tuple[tuple[fmpq, fmpq], ...]
    depth: fmpq
    joined: tuple[tuple[int, ...], ...]
    forces: fmpq_mat
    drag_ratio: fmpq
    gravity: fmpq  # that lateral accelerometers feel; 0 if they do not
    lag: fmpq
    coil_length: fmpq
    thrust: fmpq
    damping: tuple[fmpq, fmpq]  # of gap and lateral gap
    section: bool  # whether a bank turns the forces with the section

    @classmethod
    def read(cls, value: Any) -> "Physics":
        """From the table's mapping; a TableError names what is not usable."""
        at = "certificate.physics"
        p = keyed(value, at, KEYS)

        def one(key: str) -> fmpq:
            return decimal(p.get(key), f"{at}.{key}")

        inertia = {k: one(f"{k}_kg_m2") for k in ("roll_inertia", "pitch_inertia", "yaw_inertia")}
        mass = one("mass_kg")
        if min(mass, *inertia.values()) <= 0:
            raise TableError(f"{at} must hold a positive mass and inertias; it does not. Get the table again.")
        places = matrix_of(
            p.get("positions_m"), f"{at}.positions_m", len(entries_of(p.get("positions_m"), at, 100, 1)), 2
        )
        count = places.nrows()
        joined = [
            tuple(entries_of(group, f"{at}.joined", 100, 1))
            for group in entries_of(p.get("joined"), f"{at}.joined", 100)
        ]
        members = [i for group in joined for i in group]
        if any(type(i) is not int for i in members) or (joined and sorted(members) != list(range(count))):
            raise TableError(f"{at}.joined must name each coil set once, from 0; it does not. Get the table again.")
        switches = {"gravity_term": (True, False), "bank_reading": ("twist", "section")}
        for key, allowed in switches.items():
            if p.get(key) not in allowed or (key == "gravity_term" and type(p[key]) is not bool):
                raise TableError(f"{at}.{key} must be one of {allowed}; got {str(p.get(key))[:40]!r}. Mend it.")
        laws = [matrix_of([p.get(k)], f"{at}.{k}", 1, 5).tolist()[0] for k in ("lift", "lateral", "moment")]
        lag, gravity = one("current_lag_s"), one("gravity_m_s2")
        if lag < 0:
            raise TableError(f"{at}.current_lag_s must not be negative; it is. Get the table again from its source.")
        if gravity != decimal(GRAVITY, at):
            raise TableError(f"{at}.gravity_m_s2 must be {GRAVITY}; got {p['gravity_m_s2'][:40]!r}. Mend it there.")
        return cls(
            inertia=(mass, inertia["pitch_inertia"], mass, inertia["roll_inertia"], inertia["yaw_inertia"]),
            positions=tuple((x, y) for x, y in places.tolist()), depth=one("depth_m"), joined=tuple(joined),
            forces=matrix(laws), drag_ratio=one("drag_ratio"),
            gravity=gravity * (1 if p["gravity_term"] else 0), lag=lag,
            coil_length=one("coil_length_m"), thrust=one("thrust_n"),
            damping=(one("lift_damping_n_s_m"), one("lateral_damping_n_s_m")), section=p["bank_reading"] == "section",
        )  # fmt: skip

    def varied(self, factor: Mapping[str, fmpq]) -> "Physics":
        """The vehicle with factors on mass and inertias, on what a current does, and on what gaps and roll do.

        factor : of every name in `loop.FACTORS` but "inertia"; the pose, and the forces at rest, stay
        """
        inertia = ("mass", "pitch_inertia", "mass", "roll_inertia", "yaw_inertia")
        by_column = (fmpq(1), *[factor["gap_force"]] * 3, factor["current_force"])
        return replace(
            self,
            inertia=tuple(factor[name] * value for name, value in zip(inertia, self.inertia, strict=True)),
            forces=matrix([[k * f for k, f in zip(by_column, row, strict=True)] for row in self.forces.tolist()]),
        )

    @property
    def damped(self) -> bool:
        """Whether magnetic damping acts, which feels the guideway's rates."""
        return any(d != 0 for d in self.damping)

    def plant(self) -> System:
        """The plant that follows, with the workbench's names of signals."""
        alone = self._sets()
        return _joined(alone, self.joined, len(self.positions)) if self.joined else alone

    def _sets(self) -> System:
        """The plant with every coil set on its own."""
        n = len(self.positions)
        side = [1 if y > 0 else -1 for _, y in self.positions]
        width = 10 + 4 * n + 5 + (2 * n if self.damped else 0)  # pose, rates, α, ζ, η, bank, loads, rates of ζ and η
        unit = [matrix([[fmpq(int(i == k)) for i in range(width)]]) for k in range(width)]
        Z, Theta, Y, Phi, Psi = unit[:5]
        alpha, zeta, eta, bank = (unit[10 + k * n : 10 + (k + 1) * n] for k in range(4))
        lift, lateral, moment = self.forces.tolist()
        c, K = self.depth, self.drag_ratio
        nothing = zeros(1, width)
        total = [unit[10 + 4 * n + k] for k in range(5)]  # generalised forces on Z, Θ, Y, Φ, Ψ
        gaps, gaps_lateral = [], []
        for i, ((x, y), s) in enumerate(zip(self.positions, side, strict=True)):
            gap, gap_lateral = Theta * x - Z - Phi * y, (Y + Psi * x - Phi * c) * fmpq(s)
            rates = [_rate(g, unit) for g in (gap, gap_lateral)]
            if self.damped:
                rates = [r - unit[10 + 4 * n + 5 + k * n + i] for k, r in enumerate(rates)]
            gap, gap_lateral = gap - zeta[i], gap_lateral - eta[i]
            gaps.append(gap)
            gaps_lateral.append(gap_lateral)
            moved = (gap, gap_lateral, (bank[i] - Phi) * fmpq(s), alpha[i])
            up, out, turn = (
                sum((d * k for d, k in zip(moved, law[1:], strict=True)), nothing) for law in (lift, lateral, moment)
            )
            up, out = up - rates[0] * self.damping[0], out - rates[1] * self.damping[1]
            rest = (-K * (lift[0] + lateral[0]), s * lateral[0], -lift[0])
            force = [(up + out) * -K, out * fmpq(s), -up]
            if self.section:
                force[1], force[2] = force[1] - bank[i] * rest[2], force[2] + bank[i] * rest[1]
            total[0], total[2] = total[0] + force[2], total[2] + force[1]
            turned = (Theta * rest[2] - Psi * rest[1], Psi * rest[0] - Phi * rest[2], Phi * rest[1] - Theta * rest[0])
            fx, fy, fz = (f - t for f, t in zip(force, turned, strict=True))
            own = -s * moment[0]  # at rest about the guideway's axis: seen from the body it turns with Ψ and Θ
            share = self.coil_length**2 / 12
            total[3] = total[3] + fz * y - fy * c - turn * fmpq(s)
            total[1] = total[1] + fx * c - fz * x - Psi * own + Theta * (share * lift[1])
            total[4] = total[4] + fy * x - fx * y + Theta * own + Psi * (share * lateral[2])
        total[0], total[2] = total[0] - Theta * self.thrust, total[2] + Psi * self.thrust
        acceleration = [t * (1 / m) for t, m in zip(total, self.inertia, strict=True)]
        felt_z = [acceleration[1] * x - acceleration[0] - acceleration[3] * y for x, y in self.positions]
        felt_y = [
            (acceleration[2] + acceleration[4] * x - acceleration[3] * c - Phi * self.gravity) * fmpq(s)
            for s, (x, _) in zip(side, self.positions, strict=True)
        ]
        rate_rows = [*unit[5:10], *acceleration]
        output_rows = [*unit[:10], *acceleration, *gaps, *gaps_lateral, *felt_z, *felt_y]
        return _with_lag(stacked([[r] for r in rate_rows]), stacked([[r] for r in output_rows]), n, self.lag)


def differences(printed: System, physics: Physics) -> list[tuple[str, str, str, float]]:
    """Entries of a plant that are not those of the physics: (matrix, row, column, relative difference); worst first."""
    rebuilt = physics.plant()
    found: list[tuple[str, str, str, float]] = []
    for kind in ("states", "inputs", "outputs"):
        if set(getattr(printed, kind)) != set(getattr(rebuilt, kind)):
            odd = sorted(set(getattr(printed, kind)) ^ set(getattr(rebuilt, kind)))
            return [(kind, odd[0], "", float("inf"))]
    for letter, row_kind, column_kind in (
        ("A", "states", "states"), ("B", "states", "inputs"), ("C", "outputs", "states"), ("D", "outputs", "inputs"),
    ):  # fmt: skip
        rows, columns = getattr(printed, row_kind), getattr(printed, column_kind)
        ours = part(getattr(rebuilt, letter), rebuilt.index(row_kind, rows), rebuilt.index(column_kind, columns))
        for name, one, other in zip(rows, getattr(printed, letter).tolist(), ours.tolist(), strict=True):
            size = max((abs(v) for v in (*one, *other)), default=fmpq(0))
            for column, a, b in zip(columns, one, other, strict=True):
                if abs(a - b) > SAME * max(abs(a), abs(b)) + ROUNDING * size:
                    found.append((letter, name, column, float(abs(a - b) / max(abs(a), abs(b)))))
    return sorted(found, key=lambda f: -f[3])


def _rate(row: fmpq_mat, unit: Sequence[fmpq_mat]) -> fmpq_mat:
    """The rate of a displacement of the body."""
    entries = row.tolist()[0]
    return sum((unit[5 + k] * entries[k] for k in range(5)), row * fmpq(0))


def _with_lag(rates: fmpq_mat, outputs: fmpq_mat, n: int, lag: fmpq) -> System:
    """Rows over (pose, rates, α, ζ, η, bank, loads, rates of ζ and η where they act) as a plant.

    Each current is behind 1/(1 + lag s).
    """
    motion = (*COORDINATES, *(f"{c}_rate" for c in COORDINATES))
    sets = [str(i + 1) for i in range(n)]
    currents, commands = tuple(f"current_{i}" for i in sets), tuple(f"command_{i}" for i in sets)
    exogenous = (*(f"{kind}_{i}" for kind in ("zeta", "eta", "bank") for i in sets), *LOADS)
    if rates.ncols() > 10 + n + len(exogenous):
        exogenous += tuple(f"{kind}_rate_{i}" for kind in ("zeta", "eta") for i in sets)
    seen = (*motion, *(f"{c}_acceleration" for c in COORDINATES), *(f"{kind}_{i}" for kind in PER_SET for i in sets))
    x, u, w = range(10), range(10, 10 + n), range(10 + n, rates.ncols())
    r, y = range(10), range(outputs.nrows())
    if lag == 0:
        both = [*u, *w]
        return System(
            part(rates, r, x), part(rates, r, both), stacked([[part(outputs, y, x)], [zeros(n, 10)]]),
            stacked([[part(outputs, y, both)], [stacked([[identity(n), zeros(n, len(w))]])]]),
            motion, (*commands, *exogenous), (*seen, *currents),
        )  # fmt: skip
    slow = diagonal([1 / lag] * n)
    return System(
        stacked([[part(rates, r, x), part(rates, r, u)], [zeros(n, 10), -slow]]),
        stacked([[zeros(10, n), part(rates, r, w)], [slow, zeros(n, len(w))]]),
        stacked([[part(outputs, y, x), part(outputs, y, u)], [zeros(n, 10), identity(n)]]),
        stacked([[zeros(len(y), n), part(outputs, y, w)], [zeros(n, n + len(w))]]),
        (*motion, *currents), (*commands, *exogenous), (*seen, *currents),
    )  # fmt: skip


def _joined(plant: System, groups: Sequence[Sequence[int]], n: int) -> System:
    """One command for the sets of each group, sensors that read their mean."""
    spread = matrix([[fmpq(int(i in group)) for group in groups] for i in range(n)])
    mean = matrix([[fmpq(int(i in group), len(group)) for i in range(n)] for group in groups])

    def regrouped(names: Sequence[str], block: fmpq_mat) -> tuple[tuple[str, ...], fmpq_mat]:
        rows, out, done = [], [], set()
        for at, name in enumerate(names):
            kind, _, digits = name.rpartition("_")
            if kind not in FROM_SET or not digits.isdigit():
                rows.append([fmpq(int(k == at)) for k in range(len(names))])
                out.append(name)
            elif kind not in done:
                done.add(kind)
                places = [names.index(f"{kind}_{i + 1}") for i in range(n)]
                for g, entries in enumerate(block.tolist()):
                    row = [fmpq(0)] * len(names)
                    for place, entry in zip(places, entries, strict=True):
                        row[place] = entry
                    rows.append(row)
                    out.append(f"{kind}_{g + 1}")
        return tuple(out), matrix(rows)

    states, into = regrouped(plant.states, spread.transpose())
    _, out_of = regrouped(plant.states, mean)
    inputs, sources = regrouped(plant.inputs, spread.transpose())
    outputs, seen = regrouped(plant.outputs, mean)
    into, sources = into.transpose(), sources.transpose()
    return System(
        out_of * plant.A * into, out_of * plant.B * sources, seen * plant.C * into, seen * plant.D * sources,
        states, inputs, outputs,
    )  # fmt: skip

"""A shipped vehicle's closed loop over a box of factors: rational matrices from the decimals of its gain table."""

import json
from fractions import Fraction
from pathlib import Path

from flint import fmpq, fmpq_mat

from workbench.verify.family.polynomial import ParameterBox, multiaffine
from workbench.verify.vehicle.loop import closed_loop
from workbench.verify.vehicle.table import table_of

APPROVED = Path(__file__).resolve().parents[2] / "problems" / "comfort_limit" / "approved.json"
# ± of each factor: mass 15 %, inertias 10 %, force per current 10 %, force per displacement 8 %
WIDTH = {
    "mass": 15,
    "inertia": 10,
    "roll_inertia": 10,
    "yaw_inertia": 10,
    "current_force": 10,
    "gap_force": 8,
    "lag": 20,
}
DEGREE = {
    "heave_pitch": {"mass": 1, "inertia": 1, "current_force": 2, "gap_force": 2, "lag": 2},
    "sway_roll_yaw": {
        "mass": 1, "inertia": 2, "roll_inertia": 1, "yaw_inertia": 1, "current_force": 2, "gap_force": 3, "lag": 2,
    },
}  # fmt: skip
DIVIDES = ("mass", "inertia", "roll_inertia", "yaw_inertia", "lag")


class VehicleLoop:
    """One group of the approved design over a box of named factors; `scale` shrinks the box about its centre."""

    def __init__(self, group: str, names: tuple[str, ...], scale: str = "1") -> None:
        self.table = table_of(json.loads(APPROVED.read_text(encoding="utf-8")))
        self.group, self.names = group, names
        width = [fmpq(WIDTH[n], 100) * fmpq(*Fraction(scale).as_integer_ratio()) for n in names]
        self.box = ParameterBox(names, tuple(1 - w for w in width), tuple(1 + w for w in width))
        self.degrees = tuple(DEGREE[group][name] for name in names)
        self.inverse = tuple(name for name in names if name in DIVIDES)
        nominal = closed_loop(self.table, group)
        self.lengths = nominal.lengths
        self.size = nominal.A.nrows()
        self.currents = [i for i, name in enumerate(nominal.system.states) if name.startswith("current of")]
        self._bordered = multiaffine(self._exact, self.box, self.inverse)

    def _exact(self, theta) -> fmpq_mat:
        """[[A, B], [C, 0]] of the sensitivity at a point, the current loops slowed by the factor `lag`."""
        factors = dict(zip(self.names, theta, strict=True))
        lag = factors.pop("lag", fmpq(1))
        seen = closed_loop(self.table, self.group, factors).sensitivity
        rows = [a + b for a, b in zip(seen.A.tolist(), seen.B.tolist(), strict=True)]
        for k in self.currents:
            rows[k] = [entry / lag for entry in rows[k]]
        return fmpq_mat(rows + [row + [fmpq(0)] * len(self.lengths) for row in seen.C.tolist()])

    def state_matrix(self, theta) -> fmpq_mat:
        return self.loop(theta)[0]

    def loop(self, theta) -> tuple[fmpq_mat, fmpq_mat, fmpq_mat]:
        n, rows = self.size, self._bordered(theta).tolist()
        parts = [r[:n] for r in rows[:n]], [r[n:] for r in rows[:n]], [r[:n] for r in rows[n:]]
        A, B, C = (fmpq_mat(part) for part in parts)
        return A, B, C

    def multiplier(self, theta) -> fmpq:
        out = fmpq(1)
        for name, value in zip(self.names, theta, strict=True):
            if name in DIVIDES:
                out *= value ** DEGREE[self.group][name]
        return out

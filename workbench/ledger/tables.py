"""The report's formulas for the vehicle and its reduced models beside ours, with the errata that separate them.

    tables.toml --evaluate at a vehicle and gains--> corrected formula, formula as found, our own number

Our numbers come from the linearisation of the nonlinear equations and from `loop.reduced`, never from these formulas.
Source: report, Tables B-1 and B-2, Appendix B.5.
"""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import casadi as ca
import numpy as np

from workbench.constants import GRAVITY
from workbench.control import Gains, ModalLaw
from workbench.control.gains import TIME_CONSTANTS
from workbench.control.loop.polynomial import LoopPolynomial, named_parameters
from workbench.control.loop.reduced import reduced_model
from workbench.errors import InputError
from workbench.ledger.formula import value
from workbench.physics.vehicle import Extras, Linearisation, Vehicle, linearise
from workbench.result import Result, Row

COEFFICIENTS = ("0", "h", "hp", "phi", "alpha")  # of a force law: value, then derivatives
AGREEMENT = 1e-9  # relative; both routes are exact to rounding, which the sums over coil sets raise to about 1e-13


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """One formula of the report.

    table, symbol : where it stands and what it defines;  formula : corrected
    as_found : what the scan shows, if it differs and can be evaluated;  erratum, kind : what went wrong, "" if nothing
    ours : where our own number comes from, "" for an auxiliary symbol
    """

    table: str
    symbol: str
    formula: str
    as_found: str = ""
    ours: str = ""
    erratum: str = ""
    kind: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Erratum:
    """A slip in text, an equation or a definition that has no formula of its own here."""

    place: str
    as_found: str
    correct: str
    kind: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckedEntry:
    """An entry at a vehicle: the corrected formula's value, the printed one's (None if not evaluable), ours."""

    entry: Entry
    corrected: float
    as_found: float | None
    ours: float | None

    @property
    def agrees(self) -> bool:
        """Whether the corrected formula and our own number are one; true where there is no number of ours."""
        return self.ours is None or abs(self.ours - self.corrected) <= AGREEMENT * max(
            abs(self.ours), abs(self.corrected), 1e-300
        )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CheckedEntries(Result):
    """All entries at one vehicle under one set of gains."""

    comparisons: tuple[CheckedEntry, ...]

    def of(self, table: str) -> tuple[CheckedEntry, ...]:
        """The entries of one table."""
        return tuple(c for c in self.comparisons if c.entry.table == table)

    def rows(self) -> list[Row]:
        return [(f"{c.entry.table} {c.entry.symbol}", c.corrected, "") for c in self.comparisons]


@cache
def entries() -> tuple[Entry, ...]:
    """Every formula, in the report's order; a formula may use the symbols before it."""
    return tuple(Entry(**item) for item in _document()["entry"])


@cache
def errata() -> tuple[Erratum, ...]:
    """Slips outside the formulas."""
    return tuple(Erratum(**item) for item in _document()["erratum"])


def compare(vehicle: Vehicle, law: ModalLaw, gains: Gains) -> CheckedEntries:
    """The report's formulas evaluated at a vehicle with four coil sets, beside our own numbers.

    The reduced models have no current-loop lag, so it is left out; the sway/roll model is compared only if all four
    time constants are equal. The formulas know no other physics beyond the report's than the gravity term and the
    twist reading of a bank.
    """
    if vehicle.count != 4:
        raise InputError(
            f"the report's tables are for four coil sets; got {vehicle.count}. Compare a vehicle with four."
        )
    plain = vehicle.with_values(extras=Extras(gravity_term=vehicle.extras.gravity_term))
    linear = linearise(plain)
    models = {name: reduced_model(linear.plant, law, name, gains) for name in ("heave", "pitch", "yaw")}
    if gains.tau_h == gains.tau_hp == gains.tau_z == gains.tau_y:
        models["sway/roll"] = reduced_model(linear.plant, law, "sway_roll", gains)
    symbols = _symbols(plain, gains)
    out = []
    for entry in entries():
        _, _, model = entry.table.partition(" ")
        if model and model not in models:
            continue
        local = symbols | _named_time_constants(gains)
        corrected = float(value(entry.formula, local))
        printed = float(value(entry.as_found, local)) if entry.as_found else None
        if not model:
            symbols[entry.symbol] = corrected
        ours = _ours(entry.ours, linear, models[model] if model else None)
        out.append(CheckedEntry(entry=entry, corrected=corrected, as_found=printed, ours=ours))
    return CheckedEntries(comparisons=tuple(out))


def _document() -> dict:
    return tomllib.loads((files("workbench.ledger") / "tables.toml").read_text(encoding="utf-8"))


def _symbols(vehicle: Vehicle, gains: Gains) -> dict[str, float]:
    at = ca.SX.sym("at", 4)
    outputs = ca.vertcat(*vehicle.force_law.forces(at[0], at[1], at[2], at[3]))
    numbers = ca.Function("coefficients", [at], [ca.horzcat(outputs, ca.jacobian(outputs, at))])(np.zeros(4)).full()
    names = [f"{head}{c}" for head in ("F_L", "F_G", "L_") for c in COEFFICIENTS]
    coefficients = dict(zip(names, numbers.ravel().tolist(), strict=True))
    x, y = zip(*vehicle.positions, strict=True)
    return coefficients | gains.as_dict() | {
        "a_F": max(x), "a_R": -min(x), "b": max(y), "c": vehicle.depth, "K_1": vehicle.force_law.drag_ratio,
        "m": vehicle.mass, "A": vehicle.roll_inertia, "B": vehicle.pitch_inertia, "C": vehicle.yaw_inertia,
        "g": GRAVITY, "gravity": GRAVITY * vehicle.extras.gravity_term,
    }  # fmt: skip


def _named_time_constants(gains: Gains) -> dict[str, float]:
    """τ common to all filters; and, as everywhere, zero for a filter without rate gain outside the sway/roll model."""
    return {name: named_parameters(gains)[name] for name in TIME_CONSTANTS} | {"tau": gains.tau_h}


def _ours(where: str, linear: Linearisation, model: LoopPolynomial | None) -> float | None:
    if not where:
        return None
    kind, *place = where.split()
    index = tuple(int(p) for p in place)
    if model is not None:
        held = model.matrix.coefficients if kind == "matrix" else model.load
        return float(held[index[0]][index[1:]])
    held = linear.trim.residual if kind == "residual" else getattr(linear, kind)
    return float(held[index])

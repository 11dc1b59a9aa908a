"""One vehicle under one set of gains written out: matrices, characteristic polynomials, transfer functions, and the
report's formulas with their errata.

    vehicle, law, gains --> Sheet --> tables on a terminal, JSON, LaTeX
"""

from dataclasses import dataclass

import numpy as np

from workbench.control import Gains, ModalLaw
from workbench.control.gains import GAIN_NAMES
from workbench.control.loop.polynomial import loop_polynomial
from workbench.ledger.formula import latex, latex_name
from workbench.ledger.tables import CheckedEntry, Erratum, compare, entries, errata
from workbench.lti import Plant
from workbench.lti.signals import ANTISYMMETRIC, COORDINATES, SYMMETRIC
from workbench.physics.vehicle import Linearisation, Vehicle, linearise
from workbench.physics.vehicle.operating import joined
from workbench.result import Result, Row

MATRICES = ("stiffness", "damping", "current", "zeta", "eta", "bank")
ROUNDING = 1e-13  # relative; entries carry 1e-16, products of four of them and sums over the sets a hundred times that
GROUP_COORDINATES = {"heave_pitch": SYMMETRIC, "sway_roll_yaw": ANTISYMMETRIC}


@dataclass(frozen=True, slots=True, kw_only=True)
class Matrix:
    """One matrix of a group: name, rows (coordinates) and entries (len(rows), columns)."""

    name: str
    group: str
    rows: tuple[str, ...]
    entries: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class Polynomial:
    """Characteristic polynomial of a part: coefficients a_0 … (lowest power first) and roots [rad/s]."""

    part: str
    coefficients: tuple[float, ...]
    roots: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class Transfer:
    """output/input of a part with the other coordinates held; coefficients lowest power first."""

    part: str
    output: str
    input: str
    numerator: tuple[float, ...]
    denominator: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Sheet(Result):
    """Everything `workbench model` shows.

    inertia : m, B, m, A, C as COORDINATES
    comparisons, errata : the report's formulas at this vehicle; empty unless it has four coil sets
    """

    name: str
    gains: Gains
    inertia: np.ndarray
    matrices: tuple[Matrix, ...]
    polynomials: tuple[Polynomial, ...]
    transfers: tuple[Transfer, ...]
    comparisons: tuple[CheckedEntry, ...]
    errata: tuple[Erratum, ...]

    def rows(self) -> list[Row]:
        out: list[Row] = [("problem", self.name, "")]
        for p in self.polynomials:
            out.append((f"order of {p.part}", len(p.coefficients) - 1, ""))
            out.append((f"largest real part of {p.part}", float(np.max(p.roots.real)), "1/s"))
        return [*out, ("formulas of the report", len(self.comparisons), ""), ("errata", self.slips, "")]

    @property
    def slips(self) -> int:
        """Errata among the formulas and outside them."""
        return sum(bool(c.entry.erratum) for c in self.comparisons) + len(self.errata)

    def latex(self) -> str:
        """The matrices in numbers, the heave model in symbols, the characteristic polynomials in numbers."""
        parts = [_latex_matrix(m) for m in self.matrices]
        parts += ["% heave alone, without current-loop lag (report, B.5, mended)", _latex_heave()]
        parts += [f"% {p.part}\n\\[ {_latex_polynomial(p.coefficients)} = 0 \\]" for p in self.polynomials]
        parts += [
            f"% {t.part}\n\\[ \\frac{{{_latex_signal(t.output)}}}{{{_latex_signal(t.input)}}} = "
            f"\\frac{{{_latex_polynomial(t.numerator)}}}{{{_latex_polynomial(t.denominator)}}} \\]"
            for t in self.transfers
        ]
        return "\n".join(parts)


def model_sheet(
    vehicle: Vehicle, law: ModalLaw, gains: Gains | None, name: str = "", plant: Plant | None = None
) -> Sheet:
    """The model of a vehicle under a law; without gains, of the vehicle without control.

    plant : the vehicle's plant with whatever else the law drives; linearised from the vehicle if left out. Beside a law
        that drives motors the report prints nothing, so its formulas and transfer functions are left out.

    Raises
    ------
    InputError
        For a vehicle whose groups of motion are coupled.
    """
    gains = Gains.from_mapping(dict.fromkeys(GAIN_NAMES, 0.0)) if gains is None else gains
    linear = linearise(vehicle)
    polynomials = []
    for part in GROUP_COORDINATES:
        loop = loop_polynomial(plant or joined(linear.plant, vehicle), law, part, gains)
        polynomials.append(Polynomial(part=part, coefficients=tuple(loop.characteristic()), roots=loop.roots()))
    report = vehicle.count == 4 and not law.split
    return Sheet(
        name=name, gains=gains, inertia=linear.inertia,
        matrices=tuple(_matrices(linear)), polynomials=tuple(polynomials),
        transfers=() if law.split else tuple(_transfers(joined(linear.plant, vehicle), vehicle, law, gains)),
        comparisons=compare(vehicle, law, gains).comparisons if report else (), errata=errata() if report else (),
    )  # fmt: skip


def _matrices(linear: Linearisation):
    for group, names in GROUP_COORDINATES.items():
        q = [COORDINATES.index(n) for n in names]
        for kind in MATRICES:
            whole = getattr(linear, kind)
            held = whole[np.ix_(q, q)] if kind in ("stiffness", "damping") else whole[q]
            if held.any():
                yield Matrix(name=kind, group=group, rows=names, entries=held)


def _transfers(plant: Plant, vehicle: Vehicle, law: ModalLaw, gains: Gains):
    x, y = np.array(vehicle.positions, float).T
    one, side = np.ones(vehicle.count), np.array(vehicle.sides)
    moves = {  # how the guideway moves under the sets for each of the report's inputs
        ("heave", "Z_g"): {"zeta": one},
        ("pitch", "theta_g"): {"zeta": x},
        ("yaw", "psi_g"): {"eta": side * x},
        ("sway_roll", "y_g"): {"eta": side},
        ("sway_roll", "phi_g"): {"zeta": -y, "eta": -side * law.depth, "bank": one},
    }
    for (part, given), kinds in moves.items():
        loop = loop_polynomial(plant, law, part, gains)
        weights = {f"{kind}_{i + 1}": float(w) for kind, pattern in kinds.items() for i, w in enumerate(pattern)}
        under = tuple(loop.characteristic())
        for output in loop.unknowns:
            if output in COORDINATES:
                over = _without_rounding(loop.numerator(output, weights), under)
                yield Transfer(part=part, output=output, input=given, numerator=over, denominator=under)


def _without_rounding(numerator: list[float], denominator: tuple[float, ...]) -> tuple[float, ...]:
    """The numerator with zeros where entries of the matrices cancel up to rounding: below 1e-13 of the denominator's
    largest term, terms taken at the geometric mean of the roots."""
    scale = abs(denominator[0] / denominator[-1]) ** (1 / (len(denominator) - 1)) if denominator[0] else 1.0
    largest = max(abs(c) * scale**k for k, c in enumerate(denominator))
    return tuple(c if abs(c) * scale**k > ROUNDING * largest else 0.0 for k, c in enumerate(numerator))


def _latex_number(value: float) -> str:
    mantissa, _, exponent = f"{value:.5g}".partition("e")
    return rf"{mantissa} \cdot 10^{{{int(exponent)}}}" if exponent else mantissa


def _latex_matrix(matrix: Matrix) -> str:
    body = r" \\ ".join(" & ".join(_latex_number(v) for v in row) for row in matrix.entries)
    return f"% {matrix.name}, {matrix.group}\n\\[ \\begin{{bmatrix}} {body} \\end{{bmatrix}} \\]"


def _latex_polynomial(coefficients: tuple[float, ...]) -> str:
    powers = ("", "s", *(f"s^{{{k}}}" for k in range(2, len(coefficients))))
    terms = [f"{_latex_number(c)} \\, {powers[k]}".rstrip(" \\,") for k, c in enumerate(coefficients) if c != 0]
    return " + ".join(reversed(terms)).replace("+ -", "- ") or "0"


def _latex_signal(name: str) -> str:
    greek = {"Theta": r"\Theta", "Phi": r"\Phi", "Psi": r"\Psi"}
    return greek.get(name, latex_name(name))


def _latex_heave() -> str:
    formulas = {e.symbol: e.formula for e in entries() if e.table == "B.5 heave"}
    over = " + ".join(f"b_{k} s^{2 - k}" if k < 2 else "b_2" for k in range(3)).replace("s^1", "s")
    under = " + ".join(f"a_{k} s^{4 - k}" if k < 4 else "a_4" for k in range(5)).replace("s^1", "s")
    lines = [rf"\frac{{Z}}{{Z_g}} &= \frac{{{over}}}{{{under}}} \\"]
    lines += [rf"{symbol} &= {latex(formula)} \\" for symbol, formula in formulas.items()]
    return "\\begin{align*}\n" + "\n".join(lines) + "\n\\end{align*}"

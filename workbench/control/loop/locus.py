"""Root loci and parameter studies: how the roots of a group move with one gain, or with two.

    vary one:  values (k,)           --> roots (k, order), each column one continuous branch
    vary two:  values (k,), (l,)     --> roots (k, l, order), frequencies and damping of the oscillating ones

Several names tied together share the value, as the report does with K_ḣ = K_ż. Figures C-1 and C-2 are `figure_c1`
and `figure_c2`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.control.gains import GAIN_NAMES, Gains
from workbench.control.law import ModalLaw
from workbench.control.loop.polynomial import loop_polynomial, named_parameters
from workbench.errors import InputError, unknown_name
from workbench.lti import Plant
from workbench.lti.polynomial import companion
from workbench.result import Result, Row

Names = str | Sequence[str]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Locus(Result):
    """names : the gains that share the value;  values : (k,);  roots : (k, order) [rad/s], branches in columns."""

    part: str
    names: tuple[str, ...]
    values: np.ndarray
    roots: np.ndarray

    @property
    def least_damping(self) -> np.ndarray:
        """Smallest −Re p/|p| at each value, (k,)."""
        return (-self.roots.real / np.abs(self.roots)).min(axis=1)

    @property
    def stable(self) -> np.ndarray:
        """Where all real parts are negative, (k,)."""
        return (self.roots.real < 0).all(axis=1)

    def rows(self) -> list[Row]:
        best = int(np.argmax(self.least_damping))
        return [
            ("varied", " = ".join(self.names), ""),
            ("values", len(self.values), ""),
            ("stable values", int(self.stable.sum()), ""),
            ("value of the largest least damping", float(self.values[best]), ""),
            ("largest least damping", float(self.least_damping[best]), ""),
        ]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ParameterStudy(Result):
    """Oscillating roots over a grid of two gains.

    first, second : (k,), (l,) values;  roots : (k, l, order) complex [rad/s], by growing imaginary part
    """

    part: str
    first_names: tuple[str, ...]
    second_names: tuple[str, ...]
    first: np.ndarray
    second: np.ndarray
    roots: np.ndarray

    def modes(self, i: int, j: int) -> np.ndarray:
        """(m, 2): frequency [Hz] and damping ratio of the oscillating roots at grid point (i, j), by frequency."""
        p = self.roots[i, j]
        p = p[p.imag > 1e-6 * np.abs(p)]  # double real roots split by rounding lie far below
        p = p[np.argsort(np.abs(p))]
        return np.column_stack([np.abs(p) / (2 * np.pi), -p.real / np.abs(p)])

    @property
    def least_damping(self) -> np.ndarray:
        """Smallest −Re p/|p| at each grid point, (k, l)."""
        return (-self.roots.real / np.abs(self.roots)).min(axis=2)

    def rows(self) -> list[Row]:
        best = np.unravel_index(int(np.argmax(self.least_damping)), self.least_damping.shape)
        return [
            ("points", self.least_damping.size, ""),
            (" = ".join(self.first_names) + " of the largest least damping", float(self.first[best[0]]), ""),
            (" = ".join(self.second_names) + " of the largest least damping", float(self.second[best[1]]), ""),
            ("largest least damping", float(self.least_damping[best]), ""),
        ]


def root_locus(plant: Plant, law: ModalLaw, part: str, gains: Gains, vary: Names, values) -> Locus:
    """The roots of a part of the vehicle as some gains take one run of values.

    Parameters
    ----------
    vary : name, or names that share the value
    values : (k,) array_like; the order of the polynomial must not change along it
    """
    names, values = _tied(vary), _values(values)
    roots = _roots(plant, law, part, gains, (names,), values[:, None])
    return Locus(part=part, names=names, values=values, roots=_branches(roots))


def parameter_study(
    plant: Plant,
    law: ModalLaw,
    part: str,
    gains: Gains,
    first: tuple[Names, Sequence[float]],
    second: tuple[Names, Sequence[float]],
) -> ParameterStudy:
    """The roots of a part over a grid of two gains, each given as (name or names, values)."""
    (names_1, values_1), (names_2, values_2) = ((_tied(n), _values(v)) for n, v in (first, second))
    both = sorted(set(names_1) & set(names_2))
    if both:
        raise InputError(
            f"the two directions of a study must not share a gain; both have {', '.join(both)}. Name it once."
        )
    grid = np.array([(a, b) for a in values_1 for b in values_2])
    roots = _roots(plant, law, part, gains, (names_1, names_2), grid)
    roots = np.take_along_axis(roots, np.argsort(roots.imag, axis=1), axis=1)
    return ParameterStudy(
        part=part, first_names=names_1, second_names=names_2, first=values_1, second=values_2,
        roots=roots.reshape(len(values_1), len(values_2), -1),
    )  # fmt: skip


def figure_c1(plant: Plant, law: ModalLaw, gains: Gains, rates=None, pitch_gains=None) -> ParameterStudy:
    """Figure C-1: heave/pitch roots without signal filtering, over the damping gain (the report's K_ż) and K_θ."""
    free = gains.with_values(tau_h=0.0, tau_z=0.0, K_zddot=0.0)
    rates = np.linspace(0.05, 0.30, 26) if rates is None else rates
    pitch_gains = np.array([0.8, 0.9, 1.0, 1.1, 1.2]) if pitch_gains is None else pitch_gains
    return parameter_study(plant, law, "heave_pitch", free, ("K_hdot", rates), ("K_pitch", pitch_gains))


def figure_c2(plant: Plant, law: ModalLaw, gains: Gains, sway_gains=None, rates=None) -> ParameterStudy:
    """Figure C-2: sway/roll/yaw roots with signal filtering, over K_Y and the lateral damping gain K_ḣ' = K_ẏ."""
    sway_gains = np.linspace(0.40, 0.65, 26) if sway_gains is None else sway_gains
    rates = np.array([0.25, 0.27, 0.294, 0.32, 0.34]) if rates is None else rates
    return parameter_study(plant, law, "sway_roll_yaw", gains, ("K_sway", sway_gains), (("K_hpdot", "K_ydot"), rates))


def _tied(names: Names) -> tuple[str, ...]:
    tied = (names,) if isinstance(names, str) else tuple(names)
    for name in tied:
        if name not in GAIN_NAMES:
            raise unknown_name("gain", name, GAIN_NAMES)
    return tied


def _values(values) -> np.ndarray:
    array = np.asarray(values, float)
    if array.ndim != 1 or array.size == 0 or not np.all(np.isfinite(array)):
        raise InputError(
            f"values of a gain must be a non-empty, finite row of numbers; got shape {array.shape}. Give a list."
        )
    return array


def _roots(plant, law, part, gains: Gains, groups, points: np.ndarray) -> np.ndarray:
    """(k, order): the coefficient matrices are built once with symbols for what varies and evaluated together."""
    parameters = gains.as_dict() | {name: ca.SX.sym(name) for names in groups for name in names}
    constant = named_parameters(gains)
    parameters = {
        name: value if isinstance(value, ca.SX) else _kept(name, parameters, constant)
        for name, value in parameters.items()
    }
    symbols = ca.vertcat(*(parameters[name] for names in groups for name in names))
    coefficients = loop_polynomial(plant, law, part, parameters).matrix.coefficients
    evaluate = ca.Function("coefficients", [symbols], [ca.densify(c) for c in coefficients])
    spread = np.repeat(points, [len(names) for names in groups], axis=1)
    n = coefficients[0].shape[0]
    stacks = [np.array(stack).reshape(n, len(points), n) for stack in evaluate.map(len(points))(spread.T)]
    out = []
    for i in range(len(points)):
        matrix = companion(np.array([stack[:, i] for stack in stacks]))
        if matrix is None or (out and len(matrix) != len(out[0])):
            raise InputError(
                f"the order of the polynomial must not change over the values; it does at {points[i].tolist()}. "
                "Leave out the value where a time constant or an effective inertia vanishes."
            )
        out.append(np.linalg.eigvals(matrix))
    return np.array(out)


def _kept(name: str, parameters: dict, constant: dict):
    """A time constant counts as soon as its rate gain varies, even from zero."""
    rate = {"tau_h": "K_hdot", "tau_hp": "K_hpdot", "tau_z": "K_zdot", "tau_y": "K_ydot"}.get(name)
    return parameters[name] if rate is not None and isinstance(parameters[rate], ca.SX) else constant[name]


def _branches(roots: np.ndarray) -> np.ndarray:
    """Columns permuted so that each row continues the one before with the smallest total movement."""
    from scipy.optimize import linear_sum_assignment

    out = roots[:, :].copy()
    out[0] = out[0][np.lexsort((out[0].imag, np.abs(out[0])))]
    for i in range(1, len(out)):
        _, order = linear_sum_assignment(np.abs(out[i - 1][:, None] - out[i][None, :]))
        out[i] = out[i][order]
    return out

"""Numbers of a vehicle as polynomials of the speed, with the error that this makes measured.

    speed -> {name: number}  --sampled at Chebyshev nodes--> polynomials of t = (v − centre)/scale --> SpeedFamily
                             --sampled between the nodes--> largest relative error

Two uses. With printed (decimal) coefficients of a low degree it is what a proof over all speeds starts from: the closed
loop is then a polynomial of the speed. With full doubles of a high degree it is a plant at any speed, which costs a
hundredth of the force law's own.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from workbench.analysis.setting import Setting
from workbench.design.models import VehicleModels
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.machine.budget import heed
from workbench.physics.forces.law import ForceLaw
from workbench.result import Result, Row

DECIMALS = 10  # significant digits of a coefficient that a proof starts from
FORCES = ("lift", "lateral", "moment")
NODES = 10  # force laws from coils are analytic in the logarithm of the speed: see the error measured
CHECKS = 3  # places between the nodes at which the error is measured, and both ends
NEGLIGIBLE = 1e-12  # of the largest number of a quantity's matrix; smaller ones are rounding of zero

Numbers = Callable[[float], Mapping[str, float]]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class SpeedFamily(Result):
    """Named numbers as polynomials Σ_k c_k ((v − centre)/scale)^k over a range of speeds.

    coefficients : name to (c_0, c_1, …), equally many;  error : largest error between the nodes over the largest value
    of that number, by name;  nodes : speeds sampled [m/s]
    """

    range: tuple[float, float]
    centre: float
    scale: float
    coefficients: Mapping[str, tuple[float, ...]]
    error: Mapping[str, float]
    nodes: tuple[float, ...]

    @property
    def degree(self) -> int:
        """Of the polynomials."""
        return max(len(c) for c in self.coefficients.values()) - 1

    @property
    def largest_error(self) -> float:
        """Largest relative error of any number."""
        return max(self.error.values())

    def at(self, speed: float) -> dict[str, float]:
        """The numbers at a speed [m/s] of the range."""
        low, high = self.range
        if not low <= speed <= high:
            raise InputError(f"the family holds from {low:g} to {high:g} m/s; got {speed!r} m/s.")
        t = (speed - self.centre) / self.scale
        return {name: float(np.polynomial.polynomial.polyval(t, c)) for name, c in self.coefficients.items()}

    def to_dict(self) -> dict[str, Any]:
        """For a certificate: decimal strings, and the errors."""
        return {
            "variable": "speed", "unit": "m/s", "range": [repr(float(v)) for v in self.range],
            "centre": repr(self.centre), "scale": repr(self.scale),
            "coefficients": {name: [repr(float(c)) for c in values] for name, values in self.coefficients.items()},
            "relative_error": dict(self.error), "nodes": [repr(v) for v in self.nodes],
        }  # fmt: skip

    def rows(self) -> list[Row]:
        low, high = self.range
        return [
            ("range", f"{low:g} … {high:g}", "m/s"),
            ("degree", self.degree, ""),
            ("numbers", len(self.coefficients), ""),
            ("largest relative error", self.largest_error, "1"),
        ]


def speed_family(
    numbers: Numbers,
    range: tuple[float, float],
    *,
    degree: int,
    nodes: int | None = None,
) -> SpeedFamily:
    """Least-squares polynomials of numbers that depend on the speed, through Chebyshev nodes.

    Parameters
    ----------
    numbers : speed [m/s] to named numbers, the same names at every speed
    degree : of the polynomials;  nodes : speeds sampled, degree + 5 if left out

    The error is measured with the rounded coefficients, at the nodes, midway between them and at both ends.
    """
    low, high = range
    if not 0 < low < high < float("inf"):
        raise InputError(f"a family's range must rise from a positive speed; got {range!r} m/s.")
    count = degree + 5 if nodes is None else nodes
    if not 0 <= degree < count:
        raise InputError(f"the degree must be less than the number of nodes; got {degree} and {count}.")
    centre, scale = (low + high) / 2, (high - low) / 2
    angles = (np.arange(count) + 0.5) * np.pi / count
    places = np.cos(angles)[::-1]
    between = np.concatenate([[-1.0], (places[1:] + places[:-1]) / 2, [1.0]])
    found = [numbers(float(centre + scale * t)) for t in places]
    checks = [numbers(float(np.clip(centre + scale * t, low, high))) for t in between]
    coefficients, error = {}, {}
    everywhere = np.concatenate([places, between])
    for name in found[0]:
        values = np.array([sample[name] for sample in found])
        fit = np.polynomial.chebyshev.chebfit(places, values, degree)
        c = np.polynomial.chebyshev.cheb2poly(fit) if degree else fit
        c = np.pad(c, (0, degree + 1 - len(c)))
        c = np.array([float(f"{x:.{DECIMALS}g}") for x in c])
        truth = np.concatenate([values, [sample[name] for sample in checks]])
        size = np.abs(truth).max()
        off = np.abs(np.polynomial.polynomial.polyval(everywhere, c) - truth).max()
        coefficients[name], error[name] = tuple(map(float, c)), float(off / size) if size else float(off)
    return SpeedFamily(
        range=(float(low), float(high)), centre=float(centre), scale=float(scale), coefficients=coefficients,
        error=error, nodes=tuple(float(centre + scale * t) for t in places),
    )  # fmt: skip


# ---- forces of a coil set


def force_numbers(law: ForceLaw) -> dict[str, float]:
    """What a proof over speeds needs of a force law.

    Numbers: "lift,k", "lateral,k", "moment,k" with k = 0 the force at rest [N, N, N m] and k = 1 … 4 its derivatives by
    gap, lateral gap [1/m], roll [1/rad] and current ratio [1]; "drag_ratio", K_1 = f_D/f_L, and "lift_to_drag" = 1/K_1,
    which is the smoother of the two. The plant is affine in each force and in K_1; times lift_to_drag, it is a
    polynomial of the speed without K_1.
    """
    table = np.hstack(law.tangent(np.zeros((3, 1)), np.zeros(1)))
    out = {f"{kind},{k}": float(x) for kind, row in zip(FORCES, table, strict=True) for k, x in enumerate(row)}
    return {**out, "drag_ratio": float(law.drag_ratio), "lift_to_drag": 1 / float(law.drag_ratio)}


# ---- plants at any speed


@dataclass(frozen=True, slots=True)
class PlantFamily:
    """A problem's plant at any speed of a range, interpolated in the logarithm of the speed.

    curves : matrix name to Chebyshev coefficients (nodes, rows, columns)
    error : largest error of an entry over the largest of its row, measured between the nodes
    """

    problem: Problem
    range: tuple[float, float]
    curves: Mapping[str, np.ndarray]
    error: float

    def problem_at(self, speed: float) -> Problem:
        """The problem at a speed: interpolated plant, the guideway as met at that speed; the vehicle left out."""
        low, high = self.range
        if not low <= speed <= high:
            raise InputError(f"the plants hold from {low:g} to {high:g} m/s; got {speed!r} m/s.")
        setting = self.problem.setting
        moved: Setting = replace(setting, plant=replace(setting.plant, **self._matrices(speed)), speed=speed)
        return self.problem.with_models(VehicleModels(setting=moved))

    def _matrices(self, speed: float) -> dict[str, np.ndarray]:
        u = _place(speed, self.range)
        return {k: np.asarray(np.polynomial.chebyshev.chebval(u, c)) for k, c in self.curves.items()}


def plant_family(problem: Problem, range: tuple[float, float], *, nodes: int = NODES) -> PlantFamily:
    """The plant at any speed of a range, from exact ones at Chebyshev nodes in the logarithm of the speed."""

    def exact(u: float) -> dict[str, np.ndarray]:
        heed("the plants of a schedule")
        speed = float(np.clip(np.exp(middle + u * half), low, high))
        plant = problem.at({"speed_m_s": speed}).setting.plant
        return {k: getattr(plant, k) for k in "ABCD"}

    low, high = range
    middle, half = np.log(low * high) / 2, np.log(high / low) / 2
    places = np.cos((np.arange(nodes) + 0.5) * np.pi / nodes)
    found = [exact(u) for u in places]
    curves = {}
    for k in "ABCD":
        values = np.array([one[k] for one in found])
        fit = np.polynomial.chebyshev.chebfit(places, values.reshape(nodes, -1), nodes - 1)
        still = np.ptp(values, axis=0) <= NEGLIGIBLE * np.abs(values).max(initial=0.0)
        curves[k] = fit.reshape(values.shape)
        curves[k][:, still] = 0.0
        curves[k][0, still] = values[0][still]
    family, worst = PlantFamily(problem, range, curves, 0.0), 0.0
    for u in (-1.0, *((places[1:] + places[:-1]) / 2)[:: max(1, nodes // CHECKS)], 1.0):
        truth, ours = exact(float(u)), family._matrices(float(np.exp(middle + u * half)))
        for k in "ABCD":
            row = np.abs(truth[k]).max(axis=1, initial=1e-300, keepdims=True)
            worst = max(worst, float((np.abs(truth[k] - ours[k]) / row).max(initial=0.0)))
    return replace(family, error=worst)


def _place(speed: float, range: tuple[float, float]) -> float:
    """−1 … 1 of a speed in the logarithm."""
    low, high = range
    return float((2 * np.log(speed) - np.log(low * high)) / np.log(high / low))

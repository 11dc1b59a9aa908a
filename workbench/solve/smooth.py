"""Smooth nonlinear programmes: minimise f(x) subject to g(x) >= 0 and bounds, with exact gradients; SLSQP, IPOPT, SLP.

    Programme: x --at--> Point (f, g, gradients, names) --minimise--> Outcome: x, what binds, multipliers, KKT residual

Constraints are relative to their limits: 0.01 is one per cent. The certificate of stationarity is not the solver's: at
the point it returned, the multipliers are the nonnegative least squares of f's gradient by those of what is active.

Measured on `revenue_vehicle` (tests/bench): SLSQP with exact gradients converges in one to two seconds a start; IPOPT
with a limited-memory Hessian gets near and stops at its iteration limit.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import casadi as ca
import numpy as np

from workbench.errors import unknown_name
from workbench.result import figure
from workbench.solve.sequential import sequential

SOLVERS = ("slsqp", "ipopt", "slp")
FEASIBLE = 1e-4  # relative violation of a smooth constraint that a back-off covers; exact measures decide anyway
ACTIVE = 2e-3  # relative slack below which a constraint is called binding
AT_BOUND = 1e-9  # of a bound's interval
HIGHEST = 10.0  # relative violation at which a search for the least one starts at most


@dataclass(frozen=True, slots=True)
class Point:
    """A programme at one x: objective, constraints g >= 0 (m,) with names, gradients (n,) and (m, n).

    floors : (m,) of the constraints that no compromise takes below a value, −inf of the others; none if left out
    """

    objective: float
    slope: np.ndarray
    constraints: np.ndarray
    jacobian: np.ndarray
    names: tuple[str, ...]
    floors: np.ndarray | None = None

    def firm(self) -> tuple[np.ndarray, np.ndarray]:
        """What is >= 0 in a compromise too, with its gradients: constraints above their floors, (k,) and (k, n)."""
        if self.floors is None:
            return self.constraints[:0], self.jacobian[:0]
        kept = np.isfinite(self.floors)
        return self.constraints[kept] - self.floors[kept], self.jacobian[kept]


class Programme(Protocol):
    """What is minimised; nothing of it changes while it is."""

    def at(self, x: np.ndarray) -> Point:
        """Objective and constraints at x (n,)."""
        ...

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds (n,) of the variables."""
        ...


@dataclass(frozen=True, slots=True)
class Options:
    """How to solve: "slsqp", "ipopt" or "slp", at most so many iterations, down to a change of the objective."""

    solver: str = "slsqp"
    iterations: int = 200
    tolerance: float = 1e-8

    def __post_init__(self) -> None:
        if self.solver not in SOLVERS:
            raise unknown_name("solver", self.solver, SOLVERS)


@dataclass(frozen=True, slots=True)
class Outcome:
    """Where a solver stopped.

    x : variables;  objective : there;  violation : largest relative violation, 0 if none
    binding : names of the violated, else of the active, constraints, the worst first;  message : the solver's words
    multipliers : of the active constraints, summed by name;  residual : norm of the gradient they leave unexplained, in
    units of the objective per variable: 0 at a stationary point
    """

    x: np.ndarray
    objective: float
    violation: float
    binding: tuple[str, ...]
    message: str
    evaluations: int
    multipliers: Mapping[str, float]
    residual: float

    @property
    def feasible(self) -> bool:
        """Whether every constraint holds."""
        return self.violation <= FEASIBLE

    def sentence(self) -> str:
        """Where it stopped and how stationary that is."""
        held = f"violates {', '.join(self.binding)} by {self.violation:.2g}" if not self.feasible else "feasible"
        return f"{self.message}: {figure(self.objective)}, {held}, gradient left {self.residual:.2g}."


def minimise(programme: Programme, x: np.ndarray, options: Options | None = None) -> Outcome:
    """A local minimum of the programme from x."""
    options = options or Options()
    asked = _Asked(programme)
    ways = {"slsqp": _slsqp, "ipopt": _ipopt, "slp": _slp}
    x, message = ways[options.solver](asked, x, options)
    return _outcome(asked, x, message, closest=False)


def least_violation(programme: Programme, x: np.ndarray) -> Outcome:
    """The point whose largest relative violation is smallest: minimise t subject to g(x) + t >= 0, by SLSQP.

    Floors of constraints hold meanwhile: a compromise between limits is looked for among stable loops.
    """
    from scipy.optimize import minimize

    options = Options(tolerance=1e-9)
    asked, size = _Asked(programme), len(x)
    low, high = asked.bounds()
    last = np.eye(size + 1)[size]
    worst = max(0.0, float(-asked.at(x).constraints.min()))

    def rows(z: np.ndarray) -> np.ndarray:
        point = asked.at(z[:size])
        return np.append(point.constraints + z[size], point.firm()[0])

    def slopes(z: np.ndarray) -> np.ndarray:
        point = asked.at(z[:size])
        kept = point.firm()[1]
        relaxes = np.append(np.ones(len(point.jacobian)), np.zeros(len(kept)))
        return np.column_stack([np.vstack([point.jacobian, kept]), relaxes])

    result = minimize(
        lambda z: (z[size], last), np.append(x, min(worst, HIGHEST)), jac=True, method="SLSQP",
        bounds=[*zip(low, high, strict=True), (0.0, None)],
        constraints=[{"type": "ineq", "fun": rows, "jac": slopes}],
        options={"maxiter": options.iterations, "ftol": options.tolerance},
    )  # fmt: skip
    return _outcome(asked, result.x[:size], str(result.message), closest=True)


def stationarity(
    point: Point, x: np.ndarray, low: np.ndarray, high: np.ndarray, active: np.ndarray | None = None
) -> tuple[np.ndarray, float]:
    """Multipliers (m,) >= 0 of a point's constraints, and the norm of the gradient that they and the bounds leave.

    active : numbers of the constraints that may have one; what is violated or at zero if left out

    The first-order conditions of Karush, Kuhn and Tucker, at a point that some solver returned.
    """
    from scipy.optimize import nnls

    active = np.flatnonzero(point.constraints < FEASIBLE) if active is None else active
    room = AT_BOUND * np.where(np.isfinite(high - low), high - low, 1.0)
    sides = np.eye(len(x))
    pulls = np.vstack([point.jacobian[active], sides[x <= low + room], -sides[x >= high - room]])
    multipliers = np.zeros(len(point.constraints))
    if not np.isfinite(point.slope).all() or not np.isfinite(pulls).all():
        return multipliers, float("inf")
    if not len(pulls):
        return multipliers, float(np.linalg.norm(point.slope))
    lengths = np.linalg.norm(pulls, axis=1)
    lengths = np.where(lengths > 0, lengths, 1.0)
    found, residual = nnls((pulls / lengths[:, None]).T, point.slope)
    multipliers[active] = (found / lengths)[: len(active)]
    return multipliers, float(residual)


class _Asked:
    """A programme whose last point is remembered, since solvers ask for value and gradients in turn; counts points."""

    def __init__(self, programme: Programme) -> None:
        self._programme, self.bounds = programme, programme.bounds
        self._key, self.evaluations = b"", 0
        self._point: Point

    def at(self, x: np.ndarray) -> Point:
        x = np.asarray(x, float)
        if self._key != x.tobytes():
            self.evaluations += 1
            self._point, self._key = self._programme.at(x), x.tobytes()
        return self._point


def _outcome(asked: _Asked, x: np.ndarray, message: str, *, closest: bool) -> Outcome:
    """The record of a point; `closest` names what is as much violated as the worst, else what is violated or active."""
    low, high = asked.bounds()
    x = np.clip(x, low, high)
    point = asked.at(x)
    worst = float(point.constraints.min(initial=0.0))
    if closest:
        looked_at = np.flatnonzero(point.constraints < point.constraints.min() + ACTIVE)
    else:
        violated = np.flatnonzero(point.constraints < -FEASIBLE)
        looked_at = violated if len(violated) else np.flatnonzero(point.constraints < ACTIVE)
    order = looked_at[np.argsort(point.constraints[looked_at])]
    multipliers, residual = stationarity(point, x, low, high)
    by_name: dict[str, float] = {}
    for k in np.flatnonzero(multipliers):
        by_name[point.names[k]] = by_name.get(point.names[k], 0.0) + float(multipliers[k])
    return Outcome(
        x=x, objective=point.objective, violation=max(0.0, -worst),
        binding=tuple(dict.fromkeys(point.names[k] for k in order)), message=message, evaluations=asked.evaluations,
        multipliers=by_name, residual=residual,
    )  # fmt: skip


def _slsqp(asked: _Asked, x: np.ndarray, options: Options) -> tuple[np.ndarray, str]:
    from scipy.optimize import minimize

    constraint = {"type": "ineq", "fun": lambda x: asked.at(x).constraints, "jac": lambda x: asked.at(x).jacobian}
    result = minimize(
        lambda x: (asked.at(x).objective, asked.at(x).slope),
        x, jac=True, method="SLSQP", bounds=np.column_stack(asked.bounds()), constraints=[constraint],
        options={"maxiter": options.iterations, "ftol": options.tolerance},
    )  # fmt: skip
    return np.asarray(result.x), str(result.message)


def _slp(asked: _Asked, x: np.ndarray, options: Options) -> tuple[np.ndarray, str]:
    low, high = asked.bounds()
    return sequential(asked.at, x, low, high, iterations=options.iterations, tolerance=10 * options.tolerance)


def _ipopt(asked: _Asked, x: np.ndarray, options: Options) -> tuple[np.ndarray, str]:
    low, high = asked.bounds()
    function = _Evaluation(asked, len(x), len(asked.at(x).constraints))
    variables = ca.MX.sym("x", len(x))
    both = function(variables)
    settings = {
        "print_time": False,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "hessian_approximation": "limited-memory",
            "max_iter": options.iterations,
            "tol": 100 * options.tolerance,
        },
    }
    solver = ca.nlpsol("design", "ipopt", {"x": variables, "f": both[0], "g": both[1:]}, settings)
    result = solver(x0=x, lbx=low, ubx=high, lbg=0.0, ubg=np.inf)
    return result["x"].full().ravel(), str(solver.stats()["return_status"])


class _Callback(ca.Callback):
    """A function of CasADi's that Python evaluates: shapes of what comes in, shape of what goes out."""

    def __init__(self, asked: _Asked, name: str, into: list[tuple[int, int]], out: tuple[int, int]) -> None:
        ca.Callback.__init__(self)
        self._asked, self._into, self._out = asked, into, out
        self.construct(name, {})

    def get_n_in(self) -> int:
        return len(self._into)

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int):
        return ca.Sparsity.dense(*self._into[i])

    def get_sparsity_out(self, i: int):
        return ca.Sparsity.dense(*self._out)


class _Evaluation(_Callback):
    """x -> (objective, constraints) with the programme's own Jacobian, for CasADi's NLP interface."""

    def __init__(self, asked: _Asked, size: int, count: int) -> None:
        self._size, self._count = size, count
        super().__init__(asked, "evaluation", [(size, 1)], (1 + count, 1))

    def eval(self, arg):
        point = self._asked.at(arg[0].full().ravel())
        return [np.concatenate([[point.objective], point.constraints])]

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(self, name: str, inames, onames, opts):
        shapes = [(self._size, 1), (1 + self._count, 1)]
        self._jacobian = _Jacobian(self._asked, name, shapes, (1 + self._count, self._size))
        return self._jacobian


class _Jacobian(_Callback):
    """(x, value) -> Jacobian of `_Evaluation`."""

    def eval(self, arg):
        point = self._asked.at(arg[0].full().ravel())
        return [np.vstack([point.slope, point.jacobian])]

"""Solvers of the nonlinear programme: SLSQP (the default) and IPOPT with the same callbacks.

    stable random starts --> solver with the sensitivity relaxed --> the best few: homotopy to the wanted bound
                         --exchange: what exact measures see beyond the grid--> solver

Measured on `revenue_vehicle` (tests/bench): SLSQP with exact gradients converges in one to two seconds a start; IPOPT
with a limited-memory Hessian gets near and stops at its iteration limit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from workbench.design.steering import Programme
from workbench.errors import unknown_name

SOLVERS = ("slsqp", "ipopt")
COARSE = 1e-6  # of log J, at which a start counts as ended; the best are then solved to 1e-8
RELAXED = 2.0  # multiple of the wanted peak sensitivity at which starts are compared
HOMOTOPY = (1.4, 1.0)  # then these, in turn
FEASIBLE = 1e-4  # relative violation of a smooth constraint that the back-off covers; the exact verdict decides anyway
ITERATIONS = 200


@dataclass(frozen=True, slots=True)
class Outcome:
    """Where a solver stopped.

    x : variables;  cost : J there by the smooth measure;  violation : largest relative violation, 0 if none
    binding : names of the violated, else of the active, constraints, the worst first;  message : the solver's words
    """

    x: np.ndarray
    cost: float
    violation: float
    binding: tuple[str, ...]
    message: str
    evaluations: int

    @property
    def feasible(self) -> bool:
        """Whether every smooth constraint holds."""
        return self.violation <= FEASIBLE


def minimise(
    programme: Programme, x: np.ndarray, *, solver: str = "slsqp", iterations: int = ITERATIONS, tolerance: float = 1e-8
) -> Outcome:
    """A local minimum of the programme from x."""
    if solver not in SOLVERS:
        raise unknown_name("solver", solver, SOLVERS)
    before = programme.evaluations
    x, message = (_slsqp if solver == "slsqp" else _ipopt)(programme, x, iterations, tolerance)
    low, high = programme.bounds()
    x = np.clip(x, low, high)
    point = programme.at(x)
    violated = np.flatnonzero(point.constraints < -FEASIBLE)
    looked_at = violated if len(violated) else np.flatnonzero(point.constraints < ACTIVE)
    order = looked_at[np.argsort(point.constraints[looked_at])]
    return Outcome(
        x=x, cost=float(np.exp(point.objective)), violation=float(max(0.0, -point.constraints.min())),
        binding=tuple(dict.fromkeys(point.names[k] for k in order)), message=message,
        evaluations=programme.evaluations - before,
    )  # fmt: skip


ACTIVE = 2e-3  # relative slack below which a constraint is called binding


def _slsqp(programme: Programme, x: np.ndarray, iterations: int, tolerance: float) -> tuple[np.ndarray, str]:
    from scipy.optimize import minimize

    low, high = programme.bounds()
    constraint = {
        "type": "ineq",
        "fun": lambda x: programme.at(x).constraints,
        "jac": lambda x: programme.at(x).jacobian,
    }
    result = minimize(
        lambda x: (programme.at(x).objective, programme.at(x).slope),
        x, jac=True, method="SLSQP", bounds=np.column_stack([low, high]), constraints=[constraint],
        options={"maxiter": iterations, "ftol": tolerance},
    )  # fmt: skip
    return np.asarray(result.x), str(result.message)


def _ipopt(programme: Programme, x: np.ndarray, iterations: int, tolerance: float) -> tuple[np.ndarray, str]:
    low, high = programme.bounds()
    count = len(programme.at(x).constraints)
    function = _Evaluation(programme, len(x), count)
    variables = ca.MX.sym("x", len(x))
    both = function(variables)
    options = {
        "print_time": False,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "hessian_approximation": "limited-memory",
            "max_iter": iterations,
            "tol": 100 * tolerance,
        },
    }
    solver = ca.nlpsol("design", "ipopt", {"x": variables, "f": both[0], "g": both[1:]}, options)
    result = solver(x0=x, lbx=low, ubx=high, lbg=0.0, ubg=np.inf)
    return result["x"].full().ravel(), str(solver.stats()["return_status"])


class _Evaluation(ca.Callback):
    """x -> (objective, constraints) with the programme's own Jacobian, for CasADi's NLP interface."""

    def __init__(self, programme: Programme, size: int, count: int) -> None:
        ca.Callback.__init__(self)
        self._programme, self._size, self._count = programme, size, count
        self.construct("evaluation", {})

    def get_n_in(self) -> int:
        return 1

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int):
        return ca.Sparsity.dense(self._size, 1)

    def get_sparsity_out(self, i: int):
        return ca.Sparsity.dense(1 + self._count, 1)

    def eval(self, arg):
        point = self._programme.at(arg[0].full().ravel())
        return [np.concatenate([[point.objective], point.constraints])]

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(self, name: str, inames, onames, opts):
        self._jacobian = _Jacobian(self._programme, self._size, self._count, name)
        return self._jacobian


class _Jacobian(ca.Callback):
    """(x, value) -> Jacobian of `_Evaluation`."""

    def __init__(self, programme: Programme, size: int, count: int, name: str) -> None:
        ca.Callback.__init__(self)
        self._programme, self._size, self._count = programme, size, count
        self.construct(name, {})

    def get_n_in(self) -> int:
        return 2

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int):
        return ca.Sparsity.dense(self._size if i == 0 else 1 + self._count, 1)

    def get_sparsity_out(self, i: int):
        return ca.Sparsity.dense(1 + self._count, self._size)

    def eval(self, arg):
        point = self._programme.at(arg[0].full().ravel())
        return [np.vstack([point.slope, point.jacobian])]


def stable_start(programme: Programme, centre: np.ndarray, generator: np.random.Generator, spread: float) -> np.ndarray:
    """A random point around `centre` with every pole in the left half-plane; the nearest to that where none is found.

    Deviations follow Student's t with two degrees of freedom: most stay near, some go far, since the best valleys of
    this problem lie several typical sizes away from textbook gains.
    """
    low, high = programme.bounds()
    best, least = centre, np.inf
    for _ in range(TRIES if spread > 0 else 1):
        x = np.clip(centre + spread * generator.standard_t(2, size=len(centre)), low, high)
        decay = programme.growth(x)
        if decay < STABLE_BY:
            return x
        if decay < least:
            best, least = x, decay
    return _stabilised(programme, best)


TRIES = 2000  # 0.3 ms each
STABLE_BY = -0.05  # [1/s] so that the first evaluations see finite responses


def _stabilised(programme: Programme, x: np.ndarray) -> np.ndarray:
    """Descends on the largest real part of an eigenvalue, which has kinks: Nelder–Mead, no gradient needed."""
    from scipy.optimize import minimize

    low, high = programme.bounds()
    result = minimize(
        lambda z: programme.growth(np.clip(z, low, high)), x, method="Nelder-Mead",
        options={"maxfev": 3000, "fatol": 1e-4},
    )  # fmt: skip
    return np.clip(result.x, low, high)


def relaxed(programme: Programme, x: np.ndarray, *, solver: str = "slsqp") -> Outcome:
    """One start with the peak sensitivity allowed to be `RELAXED` times as large as wanted."""
    wanted = programme.limits.get("peak sensitivity")
    if wanted:
        programme.with_sensitivity(wanted * RELAXED)
    return minimise(programme, x, solver=solver, tolerance=COARSE)


def finish(
    programme: Programme, x: np.ndarray, factors: Sequence[float] = HOMOTOPY, *, solver: str = "slsqp"
) -> Outcome:
    """From a relaxed solution to the wanted limits; what exact measures see and the grid does not is added until none.

    factors : multiples of the allowed peak sensitivity, solved in turn; the last is 1
    """
    wanted = programme.limits.get("peak sensitivity")
    before = programme.evaluations
    for factor in factors if wanted else (1.0,):
        if wanted:
            programme.with_sensitivity(wanted * factor)
        outcome = minimise(programme, x, solver=solver)
        x = outcome.x
    for _ in range(EXCHANGES):
        if programme.growth(x) >= 0 or not programme.exchange(x):
            break
        outcome = minimise(programme, x, solver=solver)
        x = outcome.x
    return replace(outcome, evaluations=programme.evaluations - before)


EXCHANGES = 4  # each adds the exact peaks; two are enough where the grid is dense


def least_violation(programme: Programme, x: np.ndarray) -> Outcome:
    """The point whose largest relative violation is smallest: minimise t subject to g(x) + t >= 0, by SLSQP."""
    from scipy.optimize import minimize

    low, high = programme.bounds()
    size = len(x)
    last = np.eye(size + 1)[size]
    worst = max(0.0, float(-programme.at(x).constraints.min()))
    constraint = {
        "type": "ineq",
        "fun": lambda z: programme.at(z[:size]).constraints + z[size],
        "jac": lambda z: np.hstack(
            [programme.at(z[:size]).jacobian, np.ones((len(programme.at(z[:size]).constraints), 1))]
        ),
    }
    result = minimize(
        lambda z: (z[size], last), np.append(x, min(worst, 10.0)), jac=True, method="SLSQP",
        bounds=[*zip(low, high, strict=True), (0.0, None)], constraints=[constraint],
        options={"maxiter": ITERATIONS, "ftol": 1e-9},
    )  # fmt: skip
    x = np.clip(result.x[:size], low, high)
    point = programme.at(x)
    order = np.argsort(point.constraints)
    near = [k for k in order if point.constraints[k] < point.constraints.min() + ACTIVE]
    return Outcome(
        x=x, cost=float(np.exp(point.objective)), violation=float(max(0.0, -point.constraints.min())),
        binding=tuple(dict.fromkeys(point.names[k] for k in near)), message=str(result.message), evaluations=0,
    )  # fmt: skip

"""Equations of motion of one's own: ẋ = f(x, u), y = g(x, u) with named signals; where they rest, and linear there.

symbols, rates, outputs ──► Dynamics ──rest──► Rest (checked) ──linearise──► Model of small deviations
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from workbench.errors import InfeasibleError, InputError, unknown_name
from workbench.lti import Plant
from workbench.lti.model import Model
from workbench.result import Result, Row

STEPS = 50  # of Newton's method
LEFT = 1e-10  # of the largest term of an equation: what a rest may leave; rounding leaves 1e-15
ZERO = 1e-16  # of the largest value: a state at rest that is not smaller than this may be a rounded zero


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Dynamics(Result):
    """A nonlinear system in CasADi's symbols.

    Parameters
    ----------
    name : str
    states, inputs, outputs : names, in the order of the function's columns
    function : ca.Function
        (x (n,), u (m,)) → dx/dt (n,), y (p,).
    limits : mapping of input name to (low, high)
        What a command is cut to, in the input's own unit.
    least : mapping of state name to number
        States that something one-sided keeps from falling lower, such as the current of a chopper (0 A).

    Raises
    ------
    InputError
        If names and the function's sizes do not fit.
    """

    name: str
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    function: ca.Function
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    least: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        f, given = self.function, (len(self.states), len(self.inputs), len(self.outputs))
        sizes = (f.size1_in(0), f.size1_in(1), f.size1_out(1))
        if sizes != given or f.size1_out(0) != sizes[0]:
            raise InputError(
                f"the function of {self.name!r} must take its {given[0]} states and {given[1]} inputs and return their "
                f"rates and {given[2]} outputs; got sizes {sizes}. Make names and expressions agree."
            )
        for names, known in ((self.limits, self.inputs), (self.least, self.states)):
            for name in names:
                if name not in known:
                    raise unknown_name("signal", name, known)

    @classmethod
    def of(
        cls, name: str, *, states: Mapping[str, tuple[ca.SX, ca.SX]], inputs: Mapping[str, ca.SX],
        outputs: Mapping[str, ca.SX], limits: Mapping[str, tuple[float, float]] | None = None,
        least: Mapping[str, float] | None = None,
    ) -> "Dynamics":  # fmt: skip
        """From scalar expressions.

        states : name → (symbol, expression of its rate);  inputs : name → symbol;  outputs : name → expression
        """
        x, u = ca.vertcat(*(s for s, _ in states.values())), ca.vertcat(*inputs.values())
        rates, seen = ca.vertcat(*(rate for _, rate in states.values())), ca.vertcat(*outputs.values())
        function = ca.Function("dynamics", [x, u], [ca.densify(rates), ca.densify(seen)], {"cse": True})
        return cls(
            name=name, states=tuple(states), inputs=tuple(inputs), outputs=tuple(outputs), function=function,
            limits=dict(limits or {}), least=dict(least or {}),
        )  # fmt: skip

    def jacobians(self, x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """A (n, n), B (n, m), C (p, n), D (p, m) at a point."""
        state, given = ca.SX.sym("x", len(self.states)), ca.SX.sym("u", len(self.inputs))
        parts = self.function(state, given)
        wanted = [ca.densify(ca.jacobian(part, to)) for part in parts for to in (state, given)]
        A, B, C, D = ca.Function("jacobians", [state, given], wanted)(x, u)
        return A.full(), B.full(), C.full(), D.full()

    def rest(self, values: Mapping[str, float], solve_for: Sequence[str]) -> "Rest":
        """The equilibrium with some states and inputs given and others found.

        values : of states and inputs that are known, and first guesses of those that are not; the rest are zero
        solve_for : states and inputs to find, near their guess

        Raises
        ------
        InfeasibleError
            If no equilibrium is found there: the residual is named with its state.
        """
        names = (*self.states, *self.inputs)
        for name in (*values, *solve_for):
            if name not in names:
                raise unknown_name("state or input", name, names)
        n, z = len(self.states), np.array([float(values.get(name, 0.0)) for name in names])
        free = [names.index(name) for name in solve_for]
        for _ in range(STEPS):
            left = self.function(z[:n], z[n:])[0].full().ravel()
            J = np.hstack(self.jacobians(z[:n], z[n:])[:2])
            terms = np.abs(J) @ (np.abs(z) + ZERO * np.abs(z).max())
            if not np.all(np.isfinite(J)):
                break
            if np.all(np.abs(left) <= LEFT * terms):
                return Rest(dynamics=self, state=z[:n], given=z[n:], left=left)
            if not free:
                break
            rows = _inverse(np.abs(J[:, free]).max(axis=1))
            columns = _inverse(np.abs(rows[:, None] * J[:, free]).max(axis=0))
            z[free] -= columns * np.linalg.lstsq(rows[:, None] * J[:, free] * columns, rows * left, rcond=None)[0]
        worst = int(np.argmax(np.abs(left) / np.where(left == 0, 1.0, np.abs(left) + terms)))
        raise InfeasibleError(
            f"{self.name!r} must be at rest: every state's rate zero; near the values given {self.states[worst]!r} "
            f"still changes at {left[worst]:.3g} per second. Solve for a signal that can hold it, or start nearer."
        )

    def rows(self) -> list[Row]:
        return [("states", len(self.states), ""), ("inputs", len(self.inputs), ""), ("outputs", len(self.outputs), "")]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Rest(Result):
    """An equilibrium: state (n,), given (m,) inputs, and the rates (n,) that rounding leaves."""

    dynamics: Dynamics
    state: np.ndarray
    given: np.ndarray
    left: np.ndarray

    def __getitem__(self, name: str) -> float:
        """The value of a state or an input."""
        d = self.dynamics
        for names, values in ((d.states, self.state), (d.inputs, self.given)):
            if name in names:
                return float(values[names.index(name)])
        raise unknown_name("state or input", name, (*d.states, *d.inputs))

    @property
    def seen(self) -> np.ndarray:
        """Outputs (p,) at rest."""
        return self.dynamics.function(self.state, self.given)[1].full().ravel()

    def linearise(self, *, name: str = "") -> Model:
        """Small deviations about it, as a Model whose signals keep their names."""
        d = self.dynamics
        A, B, C, D = d.jacobians(self.state, self.given)
        return Model(
            name or d.name, Plant(A=A, B=B, C=C, D=D, states=d.states, inputs=d.inputs, outputs=d.outputs)
        )  # fmt: skip

    def rows(self) -> list[Row]:
        d = self.dynamics
        return [(name, self[name], "") for name in (*d.states, *d.inputs)]


def _inverse(sizes: np.ndarray) -> np.ndarray:
    """1/size, and 1 where it is nought."""
    return 1 / np.where(sizes == 0, 1.0, sizes)

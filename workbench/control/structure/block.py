"""Controllers as numbers, their tunable parameters, and the block that turns one into the other.

    Parameter (name, value, bounds) ──► Block: theta ──► Controller (A, B, C, D) ──► loop
                                         ▲ pullback: gradient with respect to (A, B, C, D) ──► with respect to theta

A block is a formula in CasADi's symbols, so its gradient is exact. `blocks` and `blocks_space` have the ready-made
ones; `joined.Structure` joins several.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TypeAlias

import casadi as ca
import numpy as np

from workbench.errors import InputError, unknown_name
from workbench.lti.delay import LinedSystem


@dataclass(frozen=True, slots=True, eq=False)
class Controller:
    """dx/dt = A x + B e, u = C x + D e (discrete: x[k+1] = A x[k] + B e[k]), or a gradient with respect to these four.

    Parameters
    ----------
    A, B, C, D : (nk, nk), (nk, ny), (nu, nk), (nu, ny) array_like
        Kept as read-only copies in float64; nk may be 0.

    Raises
    ------
    InputError
        If the shapes do not fit together.
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray

    def __post_init__(self) -> None:
        for name in "ABCD":
            matrix = np.array(getattr(self, name), float)
            if matrix.ndim != 2:
                raise InputError(f"{name} of a controller must be a matrix; got {matrix.ndim} dimensions.")
            matrix.flags.writeable = False
            object.__setattr__(self, name, matrix)
        nk, (nu, ny) = len(self.A), self.D.shape
        if self.A.shape != (nk, nk) or self.B.shape != (nk, ny) or self.C.shape != (nu, nk):
            raise InputError(
                "a controller's matrices must fit together: A (nk, nk), B (nk, ny), C (nu, nk), D (nu, ny); "
                f"got {self.A.shape}, {self.B.shape}, {self.C.shape}, {self.D.shape}."
            )

    @classmethod
    def static(cls, D) -> "Controller":
        """The controller u = D e without states."""
        D = np.atleast_2d(np.asarray(D, float))
        return cls(np.zeros((0, 0)), np.zeros((0, D.shape[1])), np.zeros((len(D), 0)), D)

    @classmethod
    def from_stacked(cls, stacked: np.ndarray, order: int) -> "Controller":
        """From [[A, B], [C, D]] with `order` states."""
        return cls(stacked[:order, :order], stacked[:order, order:], stacked[order:, :order], stacked[order:, order:])

    @property
    def order(self) -> int:
        """Number of states nk."""
        return len(self.A)

    def stacked(self) -> np.ndarray:
        """[[A, B], [C, D]], (nk + nu, nk + ny)."""
        return np.block([[self.A, self.B], [self.C, self.D]])

    def inner(self, other: "Controller") -> float:
        """Sum of the products of equal entries: the first-order change of a function whose gradient is `other`."""
        pairs = ((self.A, other.A), (self.B, other.B), (self.C, other.C), (self.D, other.D))
        return float(sum(np.vdot(a, b) for a, b in pairs))

    def plus(self, other: "Controller", factor: float = 1.0) -> "Controller":
        """Entry by entry self + factor · other; shapes must agree."""
        return Controller(*(getattr(self, m) + factor * getattr(other, m) for m in "ABCD"))

    def scaled(self, factor: float) -> "Controller":
        """All four matrices times a factor (meant for gradients)."""
        return Controller(factor * self.A, factor * self.B, factor * self.C, factor * self.D)

    def poles(self) -> np.ndarray:
        """Eigenvalues of A."""
        return np.linalg.eigvals(self.A) if self.order else np.zeros(0, complex)

    def response(self, omega, sample_time: float | None = None) -> np.ndarray:
        """(k, nu, ny) complex at angular frequencies (k,) [rad/s]; at z = exp(jωh) if a sample time is given.

        An axis pole is refused with its frequency; at infinity D (continuous time alone).
        """
        omega = np.atleast_1d(np.asarray(omega, float))
        alone = LinedSystem(self.A, self.B, self.C, self.D, np.zeros(0), sample_time)
        return alone.response(omega)


@dataclass(frozen=True, slots=True)
class Parameter:
    """A number of a controller: tuned within bounds if `free`, held at its value otherwise.

    Raises InputError for a value or bounds that are no numbers, bounds that do not rise, a value outside them.
    """

    name: str
    value: float
    low: float = -math.inf
    high: float = math.inf
    free: bool = True
    unit: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise InputError(f"a parameter's name must be a word; got {self.name!r}. Give it one.")
        for kind in ("value", "low", "high"):
            given = getattr(self, kind)
            try:
                number = math.nan if isinstance(given, bool | str) else float(given)
            except (TypeError, ValueError):
                number = math.nan
            if math.isnan(number) or (kind == "value" and math.isinf(number)):
                raise InputError(f"{kind} of parameter {self.name!r} must be a number; got {str(given)[:40]!r}.")
            object.__setattr__(self, kind, number)
        if not self.low <= self.high:
            raise InputError(f"bounds of {self.name!r} must rise; got [{self.low:g}, {self.high:g}]. Exchange them.")
        if self.free and not self.low <= self.value <= self.high:
            raise InputError(
                f"parameter {self.name!r} must start within its bounds [{self.low:g}, {self.high:g}]; "
                f"got {self.value:g}. Move the start or widen the bounds."
            )


Plain: TypeAlias = "bool | int | float | str | Sequence[Plain] | Mapping[str, Plain] | None"


def plain(value) -> Plain:
    """The value as plain lists, mappings and scalars, what JSON can hold; anything else is refused."""
    match value:
        case np.ndarray() | np.generic():
            return plain(value.tolist())
        case Mapping():
            return {str(key): plain(inner) for key, inner in value.items()}
        case list() | tuple():
            return [plain(inner) for inner in value]
        case None | bool() | int() | float() | str():
            return value
    raise InputError(f"an option must be a number, a text, a truth value or lists of them; got {value!r}.")


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """A controller of one shape: named signals in and out, named parameters, a formula for (A, B, C, D).

    Parameters
    ----------
    inputs, outputs : names
        Inputs are signals or signed sums of them ("r - y"); outputs are signals.
    parameters : tuple of Parameter
    formula : ca.Function
        parameters (n,) → A (nk, nk), B (nk, ny), C (nu, nk), D (nu, ny).
    sample_time : float or None
        [s] of a block whose states are discrete; None for continuous. Without states it means nothing.
    idle : ((state, (parameter names)), ...)
        A state that nothing sees once the named parameters are all frozen at zero, and is dropped then: the integrator
        of a PID without Ki.
    kind : str
        Word for the shape of the block in files and tables; `registry.make_block` makes the formula again from it.
    options : mapping of str to plain values (numbers, text, truth, lists and mappings of them)
        What the formula depends on besides the parameters: the mask of a gain, the order of a state space. A block
        sampled by Tustin's rule has "tustin_s", its sample time [s].
    slots : names
        What each parameter is called in the formula of its kind, whatever its own name; the parameters' names if left
        out.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    formula: ca.Function
    sample_time: float | None = None
    idle: tuple[tuple[int, tuple[str, ...]], ...] = ()
    kind: str = ""
    options: Mapping[str, Plain] = field(default_factory=dict)
    slots: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for kind in ("inputs", "outputs"):
            names = getattr(self, kind)
            object.__setattr__(self, kind, (names,) if isinstance(names, str) else tuple(names))
        object.__setattr__(self, "parameters", tuple(self.parameters))
        object.__setattr__(self, "options", {key: plain(value) for key, value in self.options.items()})
        object.__setattr__(self, "slots", tuple(self.slots) or tuple(p.name for p in self.parameters))
        self._check()

    def _check(self) -> None:
        names = [p.name for p in self.parameters]
        if len(set(names)) != len(names):
            raise InputError(f"a block's parameters must have distinct names; got {names}. Rename the doubled one.")
        if self.sample_time is not None and not (math.isfinite(self.sample_time) and self.sample_time > 0):
            raise InputError(f"sample time must be positive [s]; got {self.sample_time!r}. Give None for continuous.")
        if len(self.slots) != len(names):
            raise InputError(f"a block must have a slot for each of its {len(names)} parameters; got {self.slots}.")
        nk, ny, nu = self.formula.size1_out(0), len(self.inputs), len(self.outputs)
        if len(set(self.outputs)) != nu or not nu or not ny:
            raise InputError(
                f"a block must have inputs and distinct outputs; got {list(self.inputs)} and {list(self.outputs)}."
            )
        if self.formula.size1_in(0) != len(names):
            raise InputError(
                f"a block's formula must take its {len(names)} parameters; it takes {self.formula.size1_in(0)}."
            )
        for i, (matrix, shape) in enumerate((("A", (nk, nk)), ("B", (nk, ny)), ("C", (nu, nk)), ("D", (nu, ny)))):
            if self.formula.size_out(i) != shape:
                raise InputError(
                    f"matrix {matrix} of a block with {nk} states, {ny} inputs and {nu} outputs must have shape "
                    f"{shape}; got {self.formula.size_out(i)}. Make formula and names agree."
                )

    @property
    def order(self) -> int:
        """Number of states."""
        return self.formula.size1_out(0)

    @property
    def start(self) -> np.ndarray:
        """Values of the parameters (n,)."""
        return np.array([p.value for p in self.parameters])

    def matrices(self, theta) -> Controller:
        """The controller at parameter values (n,), in the order of `parameters`."""
        theta = vector(theta, len(self.parameters), "parameters of the block")
        return Controller(*(np.array(ca.DM(m).full()) for m in self.formula(theta)))

    def pullback(self, theta, G: Controller) -> np.ndarray:
        """Gradient (n,) with respect to the parameters of a scalar whose gradient with respect to (A, B, C, D) is G."""
        theta = vector(theta, len(self.parameters), "parameters of the block")
        return np.array(ca.DM(reverse(self.formula)(theta, G.A, G.B, G.C, G.D)).full()).ravel()

    def renamed(self, names: dict[str, str]) -> "Block":
        """The same block with some parameters renamed; blocks that use one name share the parameter."""
        known = {p.name for p in self.parameters}
        for name in names:
            if name not in known:
                raise unknown_name("parameter", name, known)
        return self.with_parameters([replace(p, name=names.get(p.name, p.name)) for p in self.parameters])

    def with_parameters(self, parameters: Sequence[Parameter]) -> "Block":
        """The same formula with other parameters in the places of its own, one for each."""
        if len(parameters) != len(self.parameters):
            raise InputError(f"a block must get its {len(self.parameters)} parameters; got {len(parameters)}.")
        new = {old.name: given.name for old, given in zip(self.parameters, parameters, strict=True)}
        idle = tuple((state, tuple(new[p] for p in group)) for state, group in self.idle)
        return replace(self, parameters=tuple(parameters), idle=idle)

    def sampled(self, sample_time: float) -> "Block":
        """The block as a sampled one: states by Tustin's rule, s = (2/h)(z − 1)/(z + 1), without prewarping.

        A block that is sampled already is refused; one without states comes back as it is.
        """
        if self.order == 0:
            return self
        if self.sample_time is not None:
            raise InputError(f"a block can be sampled once; got one sampled every {self.sample_time:g} s.")
        theta = ca.SX.sym("theta", len(self.parameters))
        A, B, C, D = self.formula(theta)
        half = A * (sample_time / 2)
        inside = ca.inv(ca.SX.eye(self.order) - half)
        matrices = (
            ca.mtimes(inside, ca.SX.eye(self.order) + half), ca.mtimes(inside, B) * sample_time,
            ca.mtimes(C, inside), D + ca.mtimes(C, ca.mtimes(inside, B)) * (sample_time / 2),
        )  # fmt: skip
        sampled = ca.Function("sampled", [theta], matrices)
        options = {**self.options, "tustin_s": float(sample_time)}
        return replace(self, formula=sampled, sample_time=float(sample_time), options=options)


@lru_cache(maxsize=256)
def reverse(formula: ca.Function) -> ca.Function:
    """The function (theta, GA, GB, GC, GD) → gradient with respect to theta (n,), by reverse differentiation."""
    theta = ca.SX.sym("theta", formula.size1_in(0))
    matrices = formula(theta)
    seeds = [ca.SX.sym(f"G{i}", *formula.size_out(i)) for i in range(4)]
    pairs = [(m, g) for m, g in zip(matrices, seeds, strict=True) if m.numel()]
    outputs, directions = (
        ca.vertcat(*(ca.vec(ca.densify(m)) for m, _ in pairs)),
        ca.vertcat(*(ca.vec(g) for _, g in pairs)),
    )
    return ca.Function("pullback", [theta, *seeds], [ca.densify(ca.jtimes(outputs, theta, directions, True))])


def vector(theta, count: int, what: str) -> np.ndarray:
    """`theta` as float64 (count,); one sentence if it is not that."""
    array = np.asarray(theta, float).ravel()
    if len(array) != count:
        raise InputError(f"theta must hold the {count} {what}; got {len(array)} numbers.")
    return array

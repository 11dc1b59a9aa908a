"""A structure: several blocks as one controller, with shared, frozen and free parameters.

    free parameters theta ──► blocks' parameters ──► blocks' matrices ──► one (A, B, C, D), block-diagonal in the states

Blocks that read the same sum share a column, blocks that make the same signal are added up. Parameters of one name are
one parameter. A state that nothing sees once its parameters are frozen at zero is left out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np

from workbench.compiled import Buffered
from workbench.control.structure.block import Block, Controller, Parameter, vector
from workbench.errors import InputError, unknown_name
from workbench.lti.sums import written


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Structure:
    """What is tuned: blocks and the names of the reference signals that they read.

    Parameters
    ----------
    blocks : Block or tuple of Block
    references : names
        Signals that come from outside and are no signal of the plant, such as "r" of "r - y".

    Attributes
    ----------
    parameters : tuple of Parameter, each once
    names : of the free ones on which the controller depends (the filter of a derivative frozen at zero is not one)
    inputs, outputs : of the joined controller: signed sums, signals
    sample_time : [s] of discrete states, or None
    pattern : (order + outputs, order + inputs) of bool; the entries of [[A, B], [C, D]] that are not zero for every
        value within the bounds

    Raises
    ------
    InputError
        If two blocks declare a parameter of one name differently, or mix continuous and discrete states.
    """

    blocks: tuple[Block, ...]
    references: tuple[str, ...] = ()
    parameters: tuple[Parameter, ...] = field(init=False)
    names: tuple[str, ...] = field(init=False)
    inputs: tuple[str, ...] = field(init=False)
    outputs: tuple[str, ...] = field(init=False)
    sample_time: float | None = field(init=False)
    order: int = field(init=False)
    pattern: np.ndarray = field(init=False)
    _stacked: Buffered | np.ndarray = field(init=False)
    _reverse: Buffered | None = field(init=False)

    def __post_init__(self) -> None:
        def put(name: str, value) -> None:
            object.__setattr__(self, name, value)

        put("blocks", (self.blocks,) if isinstance(self.blocks, Block) else tuple(self.blocks))
        put("references", (self.references,) if isinstance(self.references, str) else tuple(self.references))
        if not self.blocks:
            raise InputError("a structure must have at least one block; got none. Give it a gain, for instance.")
        put("parameters", _merged(self.blocks))
        put("inputs", tuple(dict.fromkeys(written(name) for block in self.blocks for name in block.inputs)))
        put("outputs", tuple(dict.fromkeys(name for block in self.blocks for name in block.outputs)))
        put("sample_time", _sample_time(self.blocks))
        symbols = {p.name: ca.SX.sym(p.name) for p in self.parameters if p.free}
        stacked, order = self._assembled(symbols)
        put("order", order)
        put("pattern", self._pattern(symbols, stacked))
        acting = {s.name() for s in ca.symvar(stacked)}
        put("names", tuple(name for name in symbols if name in acting))
        theta = ca.vertcat(*(symbols[name] for name in self.names))
        if not self.names:
            put("_stacked", ca.DM(stacked).full())
            put("_reverse", None)
            return
        G = ca.SX.sym("G", *stacked.shape)
        gradient = ca.densify(ca.jtimes(ca.vec(stacked), theta, ca.vec(G), True))
        put("_stacked", Buffered(ca.Function("stacked", [theta], [stacked])))
        put("_reverse", Buffered(ca.Function("reverse", [theta, G], [gradient])))

    def __reduce__(self):
        return Structure, (self.blocks, self.references)

    def __repr__(self) -> str:
        return (
            f"<Structure: {', '.join(self.inputs)} → {', '.join(self.outputs)}; {self.order} states; "
            f"{len(self.names)} free of {len(self.parameters)} parameters>"
        )

    def _assembled(self, free: Mapping[str, ca.SX]) -> tuple[ca.SX, int]:
        """[[A, B], [C, D]] of the joined blocks as dense SX, and the number of states."""
        fixed = {p.name: p.value for p in self.parameters if not p.free}
        kept = [_kept(block, fixed) for block in self.blocks]
        order = sum(map(len, kept))
        total = ca.SX.zeros(order + len(self.outputs), order + len(self.inputs))
        first = 0
        for block, states in zip(self.blocks, kept, strict=True):
            own = ca.vertcat(*(free[p.name] if p.free else fixed[p.name] for p in block.parameters))
            A, B, C, D = block.formula(own)
            x = list(range(first, first + len(states)))
            e = [order + self.inputs.index(written(name)) for name in block.inputs]
            u = [order + self.outputs.index(name) for name in block.outputs]
            for rows, columns, part in (
                (x, x, A[states, states]),
                (x, e, B[states, :]),
                (u, x, C[:, states]),
                (u, e, D),
            ):
                for i, row in enumerate(rows):
                    for j, column in enumerate(columns):
                        total[row, column] += part[i, j]
            first += len(states)
        return ca.densify(total), order

    def _pattern(self, symbols: Mapping[str, ca.SX], stacked: ca.SX) -> np.ndarray:
        """Where the joined matrices can differ from zero: a formula knows, whatever the parameters' values."""
        held = {p.name: ca.SX(p.value) for p in self.parameters if p.free and p.low == p.high}
        if held:
            stacked = self._assembled({**symbols, **held})[0]
        rows, columns = stacked.shape
        return np.array([[not stacked[i, j].is_zero() for j in range(columns)] for i in range(rows)])

    @property
    def reach(self) -> np.ndarray:
        """(outputs, inputs) of bool: the entries of the controller's transfer function that can differ from zero."""
        n = self.order
        A, B, C, D = self.pattern[:n, :n], self.pattern[:n, n:], self.pattern[n:, :n], self.pattern[n:, n:]
        driven = B
        for _ in range(n):
            driven = driven | (A @ driven)
        return D | (C @ driven)

    @property
    def start(self) -> np.ndarray:
        """Values of the free parameters (n,)."""
        return np.array([p.value for p in self._tuned()])

    @property
    def bounds(self) -> np.ndarray:
        """Lower and upper bound of each free parameter (n, 2), infinite where there is none."""
        return np.array([(p.low, p.high) for p in self._tuned()]).reshape(-1, 2)

    def _tuned(self) -> list[Parameter]:
        """The parameters of `names`."""
        names = set(self.names)
        return [p for p in self.parameters if p.name in names]

    def controller(self, theta=None) -> Controller:
        """The joined controller at values (n,) of the free parameters, or at the start."""
        if isinstance(self._stacked, np.ndarray):
            return Controller.from_stacked(self._stacked, self.order)
        theta = self.start if theta is None else vector(theta, len(self.names), "free parameters of the structure")
        return Controller.from_stacked(self._stacked(theta)[0], self.order)

    def pullback(self, theta, G: Controller) -> np.ndarray:
        """Gradient (n,) with respect to the free parameters of a scalar whose gradient with respect to K is G."""
        if self._reverse is None:
            return np.zeros(0)
        theta = vector(theta, len(self.names), "free parameters of the structure")
        return self._reverse(theta, G.stacked())[0].ravel().copy()

    def values(self, theta=None) -> dict[str, float]:
        """Every parameter by name: the free ones at theta (or at the start), the frozen ones as they are."""
        theta = self.start if theta is None else vector(theta, len(self.names), "free parameters of the structure")
        free = dict(zip(self.names, theta.tolist(), strict=True))
        return {p.name: free.get(p.name, p.value) for p in self.parameters}

    def parameter(self, name: str) -> Parameter:
        """The parameter of a name; an unknown one is refused with the nearest."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise unknown_name("parameter", name, (p.name for p in self.parameters))

    def freeze(self, name: str, value: float | None = None) -> "Structure":
        """The same structure with a parameter held, at a value or where it is; its bounds then mean nothing."""
        held = self.parameter(name)
        return self._with({name: replace(held, free=False, value=held.value if value is None else value)})

    def held(self, values: Mapping[str, float]) -> "Structure":
        """The same structure with several parameters held at values."""
        return self._with({n: replace(self.parameter(n), free=False, value=v) for n, v in values.items()})

    def free(self, name: str, value: float | None = None) -> "Structure":
        """The same structure with a parameter tuned, from a value or from where it is."""
        freed = self.parameter(name)
        return self._with({name: replace(freed, free=True, value=freed.value if value is None else value)})

    def with_bounds(self, name: str, low: float, high: float) -> "Structure":
        """The same structure with other bounds on a parameter; its start is moved to the nearer bound if need be."""
        old = self.parameter(name)
        value = min(max(old.value, low), high) if old.free else old.value
        return self._with({name: replace(old, low=low, high=high, value=value)})

    def with_values(self, values: Mapping[str, float]) -> "Structure":
        """The same structure with other values: starts of the free parameters, values of the frozen ones."""
        return self._with({name: replace(self.parameter(name), value=value) for name, value in values.items()})

    def sampled(self, sample_time: float) -> "Structure":
        """The same structure with its continuous blocks sampled by Tustin's rule."""
        blocks = (b if b.sample_time is not None else b.sampled(sample_time) for b in self.blocks)
        return Structure(tuple(blocks), self.references)

    def _with(self, changed: Mapping[str, Parameter]) -> "Structure":
        def renewed(block: Block) -> Block:
            if not any(p.name in changed for p in block.parameters):
                return block
            return replace(block, parameters=tuple(changed.get(p.name, p) for p in block.parameters))

        return Structure(tuple(map(renewed, self.blocks)), self.references)


def _merged(blocks: Sequence[Block]) -> tuple[Parameter, ...]:
    """Every parameter once; two of one name must be equal."""
    merged: dict[str, Parameter] = {}
    for parameter in (p for block in blocks for p in block.parameters):
        first = merged.setdefault(parameter.name, parameter)
        if first != parameter:
            differing = [
                k for k in ("low", "high", "value", "free", "unit") if getattr(first, k) != getattr(parameter, k)
            ]
            one, other = ([getattr(p, k) for k in differing] for p in (first, parameter))
            raise InputError(
                f"parameter {parameter.name!r} must be declared alike in every block that shares it; "
                f"got {', '.join(differing)} {one} and {other}. Make them equal, or give one another name."
            )
    return tuple(merged.values())


def _sample_time(blocks: Sequence[Block]) -> float | None:
    """The sample time of the blocks that have states; they must agree."""
    times = {block.sample_time for block in blocks if block.order}
    if len(times) > 1:
        raise InputError(
            f"all blocks of a structure must be sampled alike; got sample times {sorted(map(str, times))}. "
            "Use structure.sampled(h)."
        )
    return times.pop() if times else None


def _kept(block: Block, fixed: Mapping[str, float]) -> list[int]:
    """States of a block that something sees."""
    idle = {state for state, group in block.idle if all(fixed.get(name) == 0 for name in group)}
    return [state for state in range(block.order) if state not in idle]

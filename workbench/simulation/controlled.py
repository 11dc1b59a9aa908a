"""Time histories of equations of one's own under a tuned structure: commands cut, one-sided states held.

rest + deviations ──► outputs ──► structure (sampled or continuous) ──► command, cut ──► four-stage Runge–Kutta
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.compiled import Buffered
from workbench.control.structure.structure import Structure
from workbench.errors import InputError, unknown_name
from workbench.lti.sums import known_terms
from workbench.physics.dynamics import Dynamics, Rest
from workbench.result import Result, Row

Course = Callable[[np.ndarray], np.ndarray]  # times (k,) [s] → deviations (k,)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Motion(Result):
    """Motion over time, up to the first step that left the given bounds.

    time : (k,) [s];  states (n, k), outputs (p, k), commands (c, k) by name through `motion["gap"]`, absolute values
    limited : share of the steps at which a command was cut;  left : state and time [s] at which it left its bounds
    """

    names: tuple[str, ...]
    time: np.ndarray
    values: np.ndarray
    limited: float
    left: tuple[str, float] | None

    def __getitem__(self, name: str) -> np.ndarray:
        """(k,) of a state, an output or a command."""
        if name not in self.names:
            raise unknown_name("signal", name, self.names)
        return self.values[self.names.index(name)]

    def rows(self) -> list[Row]:
        left = "none" if self.left is None else f"{self.left[0]} at {self.left[1]:.4g} s"
        rows: list[Row] = [("simulated", float(self.time[-1]), "s"), ("left its bounds", left, "")]
        return [*rows, ("commands at their limit", self.limited, "of the time")]


def simulate_controlled(
    rest: Rest, structure: Structure, *, duration: float, step: float, start: Mapping[str, float] | None = None,
    courses: Mapping[str, Course] | None = None, within: Mapping[str, tuple[float, float]] | None = None,
) -> Motion:  # fmt: skip
    """The nonlinear system from a disturbed rest, with a structure that sees and commands deviations from it.

    Parameters
    ----------
    rest : Rest
    structure : Structure
        At its values; of outputs and references of its own. A sampled one holds its commands between samples.
    duration, step : float
        [s]; a sample time must be a whole number of steps.
    start : mapping of state to its deviation at the beginning
    courses : mapping of input or reference to its deviation over time
    within : mapping of state to (low, high), absolute
        Where the equations hold; the history ends where a state leaves them, such as a gap that closes.

    Raises
    ------
    InputError
        If signals are unknown, a controlled output depends on a command at once, or times do not fit.
    """
    d, K = rest.dynamics, structure.controller()
    if not 0 < step <= duration < math.inf:
        raise InputError(f"0 < step <= duration must hold; got {step!r} s and {duration!r} s. Choose a smaller step.")
    hold = 1 if structure.sample_time is None else round(structure.sample_time / step)
    if structure.sample_time is not None and abs(hold * step / structure.sample_time - 1) > 1e-9:
        raise InputError(
            f"the sample time {structure.sample_time:g} s must be a whole number of steps; got {step:g} s. "
            f"Take {structure.sample_time / max(hold, 1):g} s."
        )
    commands = tuple(u for u in structure.outputs if u in d.inputs)
    from_seen, from_course, resolved = _wiring(d, structure, K.D)
    outside = tuple(name for name in (*d.inputs, *structure.references) if name not in commands)
    start, courses, within = dict(start or {}), dict(courses or {}), dict(within or {})
    for given, known in ((start, d.states), (courses, outside), (within, d.states)):
        for name in given:
            if name not in known:
                raise unknown_name("signal", name, known)
    direct = rest.dynamics.jacobians(rest.state, rest.given)[3][:, [d.inputs.index(u) for u in commands]]
    if (np.abs(from_seen).sum(axis=0) @ np.abs(direct)).any():
        raise InputError("an output that the structure reads must not follow a command at once; give it a lag.")

    n, k, c = len(d.states), K.order, len(outside)
    x, own, w, held = (ca.SX.sym(s, size) for s, size in (("x", n), ("own", k), ("w", c), ("held", len(commands))))
    at = [d.inputs.index(u) for u in commands]
    rows = [structure.outputs.index(u) for u in commands]

    def told(state, own, w):
        """Structure's rates, and its commands before and after the cut."""
        seen = d.function(state, _given(d, rest, w, outside, at, ca.SX.zeros(len(at))))[1] - rest.seen
        e0 = ca.mtimes(ca.DM(from_seen), seen) + ca.mtimes(ca.DM(from_course), w)
        out = ca.mtimes(ca.DM(resolved[1]), ca.mtimes(ca.DM(K.C), own) + ca.mtimes(ca.DM(K.D), e0))
        e = e0 + ca.mtimes(ca.DM(resolved[0]), out)
        asked = out[rows]
        low, high = (ca.DM([d.limits.get(u, (-np.inf, np.inf))[i] - rest[u] for u in commands]) for i in (0, 1))
        return ca.mtimes(ca.DM(K.A), own) + ca.mtimes(ca.DM(K.B), e), asked, ca.fmin(ca.fmax(asked, low), high)

    def rate(state, own, w, held):
        moved, _, cut = told(state, own, w)
        given = _given(d, rest, w, outside, at, cut if structure.sample_time is None else held)
        return ca.vertcat(d.function(state, given)[0], moved if structure.sample_time is None else ca.SX.zeros(k))

    k1 = rate(x, own, w, held)
    k2 = rate(x + step / 2 * k1[:n], own + step / 2 * k1[n:], w, held)
    k3 = rate(x + step / 2 * k2[:n], own + step / 2 * k2[n:], w, held)
    k4 = rate(x + step * k3[:n], own + step * k3[n:], w, held)
    after = ca.vertcat(x, own) + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    floor = ca.DM([d.least.get(name, -np.inf) for name in d.states])
    seen = d.function(x, _given(d, rest, w, outside, at, held))[1]
    now, before = ca.vertcat(x, own, w), ca.vertcat(x, own, w, held)
    control = Buffered(ca.Function("control", [now], [ca.densify(ca.vertcat(*told(x, own, w)))]))
    advanced = Buffered(
        ca.Function("advanced", [before], [ca.densify(ca.vertcat(ca.fmax(after[:n], floor), after[n:], seen))])
    )

    count = round(duration / step)
    time = step * np.arange(count + 1)
    course = np.array([courses[name](time) * np.ones(count + 1) if name in courses else np.zeros(count + 1)
                       for name in outside]).reshape(c, count + 1)  # fmt: skip
    state, own_now, command = rest.state + np.array([start.get(name, 0.0) for name in d.states]), np.zeros(k), None
    history, limited, left = [], 0, None
    for i in range(count + 1):
        if i % hold == 0:
            moved, wanted, command = np.split(
                control(np.concatenate([state, own_now, course[:, i]]))[0].ravel().copy(), [k, k + len(at)]
            )
            limited += hold * bool((wanted != command).any())
            own_now = own_now if structure.sample_time is None else moved
        found = advanced(np.concatenate([state, own_now, course[:, i], command]))[0].ravel().copy()
        history.append(np.concatenate([state, found[n + k :], command + rest.given[at]]))
        out = [s for s, (low, high) in within.items() if not low <= state[d.states.index(s)] <= high]
        if out or not np.all(np.isfinite(state)):
            left = (out[0] if out else d.states[int(np.argmin(np.isfinite(state)))], float(time[i]))
            break
        state = found[:n]
        own_now = found[n : n + k] if structure.sample_time is None else own_now
    return Motion(
        names=(*d.states, *d.outputs, *commands), time=time[: len(history)], values=np.array(history).T,
        limited=min(limited / len(history), 1.0), left=left,
    )  # fmt: skip


def _given(d: Dynamics, rest: Rest, w, outside: Sequence[str], at: Sequence[int], commands):
    """Inputs (m,), absolute, from the deviations of what comes from outside and of the commands."""
    parts = [ca.SX(float(value)) for value in rest.given]
    for i, name in enumerate(outside):
        if name in d.inputs:
            parts[d.inputs.index(name)] += w[i]
    for j, position in enumerate(at):
        parts[position] += commands[j]
    return ca.vertcat(*parts)


def _wiring(d: Dynamics, structure: Structure, D: np.ndarray):
    """What the structure reads, of outputs, courses and its own outputs: (e, p), (e, c), ((e, v), (I − D own)⁻¹)."""
    made = [u for u in structure.outputs if u in d.inputs]
    outside = [name for name in (*d.inputs, *structure.references) if name not in made]
    known = [*d.outputs, *outside, *structure.outputs]
    size = len(structure.inputs)
    seen, course, own = (np.zeros((size, len(names))) for names in (d.outputs, outside, structure.outputs))
    for i, text in enumerate(structure.inputs):
        for name, factor in known_terms(text, known, known).items():
            for matrix, names in ((seen, d.outputs), (course, outside), (own, structure.outputs)):
                if name in names:
                    matrix[i, list(names).index(name)] = factor
    return seen, course, (own, np.linalg.inv(np.eye(len(structure.outputs)) - D @ own))

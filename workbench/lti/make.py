"""Models as they are written down: transfer functions, zeros and poles, state spaces, each with names and dead times.

    tf    num_ij(s)/den_ij(s) · e^(−s·time_ij) ──► dead times common to a column or a row go to its input or output,
                                                   the rest become delay lines inside ──► states ──► Model
    zpk   gain · ∏(s − zero)/∏(s − pole) ──► sections of first and second order, one after another ──► Model
    ss    A, B, C, D ──► Model

The states of `tf` are those of `lti.fraction`: every root of every denominator, whatever the numerators do. Roots that
cancel are taken out on request, and the model says which. Those of `zpk` are the poles themselves: no polynomial is
multiplied out, so poles that lie close together or decades apart stay where they are given.

Source of the test plant: Wood & Berry, Chemical Engineering Science 28 (1973) 1707.
"""

import math
from collections.abc import Sequence

import numpy as np

from workbench.errors import InputError
from workbench.lti.fraction import realised
from workbench.lti.grid import spread
from workbench.lti.join import series
from workbench.lti.model import DelayLine, Model
from workbench.lti.plant import Plant
from workbench.lti.realisation import Realisation, frequency_response

TOLERANCES = (1e-10, 1e-13)  # of `controllable_observable`, the looser one first
SAME = 1e-8  # relative, of every entry at every frequency looked at
CONJUGATE = 1e-9  # of its size: how far a root may be off the conjugate of its partner

Signals = str | Sequence[str] | None


def tf(
    num,
    den=None,
    *,
    input: Signals = None,
    output: Signals = None,
    dead_time=0.0,
    sample_time: float | None = None,
    name: str = "model",
    minimal: bool = False,
    pade_order: int = 4,
) -> Model:
    """The model of a transfer function, or of a matrix of them.

    Parameters
    ----------
    num, den : coefficients in falling powers of s (of z if sampled), or p rows of m lists of them
        Every entry proper; a number stands for a constant. `num` alone may be a system of python-control.
    input, output : names, one or m and p; u1 …, y1 … if left out
    dead_time : [s], not negative; of all entries, or (p, m)
    sample_time : [s], or None for continuous time
    minimal : bool
        Whether roots that cancel, within an entry or between entries, are taken out; `cancelled` of the model holds
        them. It is done only where every entry's response stays the same to 1e-8 of itself.
    pade_order : see `Model`

    Raises
    ------
    InputError
        If the shapes do not fit, an entry is improper, or a dead time is negative.

    Examples
    --------
    >>> tf([2.0], [1.0, 2.0], input="command", output="current", dead_time=0.001, name="lag")
    <Model lag: 1 states, command → current, 1 dead times, continuous>
    """
    if den is None:
        return _from_control(num, input, output, dead_time, name)
    num, den = _table("numerators", num), _table("denominators", den)
    p, m = len(num), len(num[0])
    if (len(den), len(den[0])) != (p, m):
        raise InputError(f"num and den must form matrices of one shape; got {(p, m)} and {(len(den), len(den[0]))}.")
    times = _times(dead_time, p, m)
    inputs, outputs = names_of("input", input, "u", m), names_of("output", output, "y", p)
    at_input, at_output, inside = _shared(times, np.array([[bool(e.any()) for e in row] for row in num]))
    # A delayed entry has an output of its own, whose line ends at the row's output
    delayed = [(int(i), int(j)) for i, j in np.argwhere(inside > 0)]
    rows = [[num[i][j] if inside[i, j] == 0 else np.zeros(1) for j in range(m)] for i in range(p)]
    dens = [[den[i][j] if inside[i, j] == 0 else np.ones(1) for j in range(m)] for i in range(p)]
    for i, j in delayed:
        rows.append([num[i][j] if k == j else np.zeros(1) for k in range(m)])
        dens.append([den[i][j] if k == j else np.ones(1) for k in range(m)])
    system, gone = Realisation(*realised(rows, dens)), np.zeros(0, complex)
    if minimal:
        system, gone = _cancelled(system)
    A, B, C, D = system
    q = len(delayed)
    through = np.zeros((p + q, q))
    for k, (i, _) in enumerate(delayed):
        through[i, k] = 1.0
    sources = [f"{outputs[i]} from {inputs[j]} into its dead time" for i, j in delayed]
    sinks = [f"{outputs[i]} from {inputs[j]} out of its dead time" for i, j in delayed]
    plant = Plant(
        A=A, B=np.hstack([B, np.zeros((len(A), q))]), C=C, D=np.hstack([D, through]),
        states=tuple(f"x{k + 1}" for k in range(len(A))), inputs=(*inputs, *sinks), outputs=(*outputs, *sources),
    )  # fmt: skip
    lines = tuple(
        DelayLine(source, sink, float(inside[place]))
        for source, sink, place in zip(sources, sinks, delayed, strict=True)
    )
    return Model(
        name, plant,
        input_delay=dict(zip(inputs, at_input.tolist(), strict=True)),
        output_delay=dict(zip(outputs, at_output.tolist(), strict=True)),
        sample_time=sample_time, lines=lines, pade_order=pade_order, cancelled=tuple(gone.tolist()),
    )  # fmt: skip


def zpk(
    zeros: Sequence[complex],
    poles: Sequence[complex],
    gain: float,
    *,
    input: str = "u1",
    output: str = "y1",
    dead_time: float = 0.0,
    sample_time: float | None = None,
    name: str = "model",
    pade_order: int = 4,
) -> Model:
    """The model gain · ∏(s − zero)/∏(s − pole), in z if sampled.

    Parameters
    ----------
    zeros, poles : numbers [rad/s]
        Complex ones with their conjugates, in any order; no more zeros than poles. An integrator is the pole 0, terms
        of second order are `second_order(…)`: `poles=[0, *second_order(20.0, 0.1)]`.
        Nothing cancels: a zero on a pole leaves that pole in the model.
    gain : of the highest powers, not at rest
    dead_time, sample_time : [s]

    Raises
    ------
    InputError
        If a conjugate is missing or the zeros are more than the poles.

    Examples
    --------
    >>> shaft = zpk([], [0, *second_order(20.0, 0.01)], 400.0, input="torque", output="angle", name="shaft")
    >>> sorted(abs(shaft.poles()).round(6).tolist())
    [0.0, 20.0, 20.0]
    """
    if len(zeros) > len(poles):
        raise InputError(f"zeros must not be more than poles; got {len(zeros)} and {len(poles)}. Add a fast pole.")
    if not (isinstance(gain, int | float) and math.isfinite(gain)):
        raise InputError(f"the gain must be a finite number; got {gain!r}.")
    system = Realisation(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.array([[float(gain)]]))
    for top, bottom in _sections(_roots("zeros", zeros), _roots("poles", poles)):
        system = series(_companion(top, bottom), system)
    return ss(
        *system, inputs=input, outputs=output, input_delay={input: dead_time},
        sample_time=sample_time, name=name, pade_order=pade_order,
    )  # fmt: skip


def second_order(frequency: float, damping: float) -> tuple[complex, complex]:
    """The two roots of s² + 2·damping·frequency·s + frequency² [rad/s], real ones for a damping of 1 and more."""
    part = np.sqrt(complex(damping**2 - 1))
    if damping > 1:  # the smaller one without cancellation
        large = -(damping + part.real) * frequency
        return complex(large), complex(frequency**2 / large)
    return complex(-damping * frequency, part.imag * frequency), complex(-damping * frequency, -part.imag * frequency)


def ss(
    A,
    B=None,
    C=None,
    D=None,
    *,
    inputs: Signals = None,
    outputs: Signals = None,
    states: Signals = None,
    input_delay: dict[str, float] | None = None,
    output_delay: dict[str, float] | None = None,
    sample_time: float | None = None,
    name: str = "model",
    pade_order: int = 4,
) -> Model:
    """The model dx/dt = A x + B u, y = C x + D u; x[k+1] = A x[k] + B u[k] if a sample time [s] is given.

    A (n, n), B (n, m), C (p, n), D (p, m) or None for zero; `A` alone may be a system of python-control or a `Plant`.
    Names x1 …, u1 …, y1 … if left out; dead times [s] by signal.

    Examples
    --------
    >>> ss([[0, 1], [-4, -0.4]], [[0], [1]], [[1, 0]], inputs="force", outputs="position", name="oscillator")
    <Model oscillator: 2 states, force → position, 0 dead times, continuous>
    """
    if B is None:
        plant = A if isinstance(A, Plant) else None
        made = Model(name, plant, sample_time=sample_time) if plant else _from_control(A, inputs, outputs, 0.0, name)
        return Model(name, made.plant, input_delay, output_delay, made.sample_time, pade_order=pade_order)
    plain = Plant.from_matrices(A, B, C, D)
    plant = Plant(
        A=plain.A, B=plain.B, C=plain.C, D=plain.D, states=names_of("states", states, "x", len(plain.states)),
        inputs=names_of("inputs", inputs, "u", len(plain.inputs)),
        outputs=names_of("outputs", outputs, "y", len(plain.outputs)),
    )  # fmt: skip
    return Model(name, plant, input_delay, output_delay, sample_time, pade_order=pade_order)


def _from_control(system, input: Signals, output: Signals, dead_time, name: str) -> Model:
    """A system of python-control under other names, with a dead time of every path."""
    made = Model.from_control(system, name)
    inputs = names_of("input", input or made.inputs, "u", len(made.inputs))
    outputs = names_of("output", output or made.outputs, "y", len(made.outputs))
    made = made.renamed(dict(zip((*made.inputs, *made.outputs), (*inputs, *outputs), strict=True)))
    delay = float(_times(dead_time, 1, 1)[0, 0])
    return Model(name, made.plant, dict.fromkeys(inputs, delay), sample_time=made.sample_time)


def _roots(what: str, given: Sequence[complex]) -> tuple[list[float], list[complex]]:
    """Real roots, and the upper one of each pair."""
    try:
        left = [complex(root) for root in given]
    except TypeError:
        left = [complex(math.nan)]
    if not np.isfinite(left).all():
        raise InputError(f"{what} must be finite numbers [rad/s]; got {str(given)[:80]}.")
    real, upper = [root.real for root in left if root.imag == 0], []
    left = [root for root in left if root.imag != 0]
    while left:
        root = left.pop()
        partner = min(left, key=lambda other: abs(other - root.conjugate()), default=None)
        if partner is None or abs(partner - root.conjugate()) > CONJUGATE * abs(root):
            raise InputError(f"complex {what} must come with their conjugates; {root:.4g} is alone. Add its partner.")
        left.remove(partner)
        upper.append(complex(root.real, abs(root.imag)))
    return real, upper


def _sections(zeros, poles) -> list[tuple[np.ndarray, np.ndarray]]:
    """Numerators and denominators of first and second order, each pole with the zeros that lie nearest to it."""
    (real_zeros, pairs), (real_poles, pole_pairs) = zeros, poles
    real_zeros, real_poles = list(real_zeros), sorted(real_poles, key=abs)
    bottoms = [[p, p.conjugate()] for p in pole_pairs]
    while len(bottoms) < len(pairs):  # a pair of zeros needs two poles
        bottoms.append([real_poles.pop(), real_poles.pop()])
    bottoms += [[p] for p in real_poles]
    tops: list[list[complex]] = [[] for _ in bottoms]

    def nearest(zero: complex, count: int) -> list[complex]:
        free = [k for k, bottom in enumerate(bottoms) if len(bottom) - len(tops[k]) >= count]
        return tops[min(free, key=lambda k: min(abs(zero - p) for p in bottoms[k]))]

    for zero in pairs:
        nearest(zero, 2).extend([zero, zero.conjugate()])
    for zero in real_zeros:
        nearest(zero, 1).append(zero)
    return [(np.poly(top).real if top else np.ones(1), np.poly(bottom).real)
            for top, bottom in zip(tops, bottoms, strict=True)]  # fmt: skip


def _companion(top: np.ndarray, bottom: np.ndarray) -> Realisation:
    """One section with all its states, `bottom` monic, `top` of at most its degree."""
    n = len(bottom) - 1
    top = np.r_[np.zeros(n + 1 - len(top)), top]
    A = np.eye(n, k=-1)
    A[0] = -bottom[1:]
    return Realisation(A, np.eye(n, 1), (top[1:] - top[0] * bottom[1:])[None], top[None, :1])


def _shared(times: np.ndarray, there: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Dead times common to the columns (m,), then to the rows (p,), and what remains (p, m); zero entries do not count.

    What remains is 0 where it is rounding.
    """
    at_input = np.where(there.any(axis=0), np.where(there, times, np.inf).min(axis=0), 0.0)
    rest = np.where(there, times - at_input, np.inf)
    at_output = np.where(there.any(axis=1), rest.min(axis=1), 0.0)
    inside = np.where(there, times - at_input - at_output[:, None], 0.0)
    return at_input, at_output, np.where(inside > 1e-12 * times.max(), inside, 0.0)


def _table(what: str, given) -> list[list[np.ndarray]]:
    """Rows of coefficient arrays without leading zeros; of one list of numbers, one row of one."""
    try:
        if np.isscalar(given) or all(np.isscalar(e) for e in given):
            given = [[given]]
        table = [[np.trim_zeros(np.atleast_1d(np.asarray(e, float)), "f") for e in row] for row in given]
    except (TypeError, ValueError):
        table = []
    flat = [e for row in table for e in row]
    if not flat or len({len(row) for row in table}) != 1 or any(e.ndim != 1 or not np.isfinite(e).all() for e in flat):
        raise InputError(
            f"{what} must be a list of coefficients, or rows of them, rows of equal length; got {str(given)[:80]}."
        )
    return [[e if len(e) else np.zeros(1) for e in row] for row in table]


def _times(dead_time, p: int, m: int) -> np.ndarray:
    """Dead times (p, m) [s] of one number or a matrix."""
    try:
        times = np.asarray(dead_time, float)
    except (TypeError, ValueError):
        times = np.full(1, np.nan)
    if times.shape not in ((), (p, m)) or not np.isfinite(times).all() or (times < 0).any():
        raise InputError(f"dead times must be numbers from 0 [s], one or a ({p}, {m}) matrix; got {dead_time!r}.")
    return np.broadcast_to(times, (p, m))


def names_of(kind: str, given: Signals, letter: str, count: int) -> tuple[str, ...]:
    """As many names as there are signals."""
    if given is None:
        return tuple(f"{letter}{i + 1}" for i in range(count))
    names = (given,) if isinstance(given, str) else tuple(given)
    if len(names) != count:
        raise InputError(f"{kind} must name the {count} {kind}s of the system; got {list(names)}.")
    return names


def _cancelled(system: Realisation) -> tuple[Realisation, np.ndarray]:
    """The controllable and observable part and the poles (k,) of the rest; all of it where that is not the same system.

    Two roots are one to a tolerance, so the answer is compared with the question, entry by entry.
    """
    from workbench.lti.minimal import controllable_observable

    nothing = np.zeros(0, complex)
    if len(system.A) == 0:
        return system, nothing
    # The part does not depend on a multiple of I added to A; its tolerance is relative to A, which integrators lack
    shift = np.eye(len(system.A)) * (not system.A.any())
    poles = np.linalg.eigvals(system.A)
    omega = np.unique(np.r_[np.abs(poles[poles != 0]), spread(poles, 40)]) * 1.0123  # beside the poles
    wanted = frequency_response(*system, omega)
    for tolerance in TOLERANCES:
        kept = controllable_observable(system.A + shift, system.B, system.C, tolerance=tolerance)
        part = Realisation(kept.A - shift[: len(kept.A), : len(kept.A)], kept.B, kept.C, system.D)
        if len(part.A) < len(system.A) and np.allclose(frequency_response(*part, omega), wanted, rtol=SAME, atol=0):
            return part, kept.removed_poles - shift[0, 0]
    return system, nothing

"""A model from a matrix of transfer functions with a dead time for each entry.

    num_ij(s)/den_ij(s) · e^(−s·time_ij) ──► dead times common to a column or a row go to its input or output,
                                             the rest become delay lines inside ──► states ──► Model

The states are those of `lti.fraction`: every root of every denominator, whatever the numerators do. Roots that cancel
are taken out on request, and the model says which.

Source of the test plant: Wood & Berry, Chemical Engineering Science 28 (1973) 1707.
"""

from collections.abc import Sequence

import numpy as np

from workbench.errors import InputError
from workbench.lti import Plant
from workbench.lti.fraction import realised
from workbench.lti.model import DelayLine, Model
from workbench.lti.realisation import Realisation, frequency_response

TOLERANCES = (1e-10, 1e-13)  # of `controllable_observable`, the looser one first
SAME = 1e-8  # relative, of every entry at every frequency looked at


def transfer_model(
    name: str,
    numerators,
    denominators,
    dead_times=None,
    *,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    sample_time: float | None = None,
    pade_order: int = 4,
    minimal: bool = False,
) -> Model:
    """The model of a transfer-function matrix.

    Parameters
    ----------
    numerators, denominators : p rows of m lists of coefficients
        In falling powers of s (of z if sampled); every entry proper. A number stands for a constant.
    dead_times : (p, m) array_like, optional
        [s], not negative.
    inputs, outputs : m and p names; u1 …, y1 … if left out
    minimal : bool
        Whether roots that cancel, within an entry or between entries, are taken out; `cancelled` of the model holds
        them. It is done only where every entry's response stays the same to 1e-8 of itself.

    Raises
    ------
    InputError
        If the shapes do not fit, an entry is improper, or a dead time is negative.
    """
    num, den = _table("numerators", numerators), _table("denominators", denominators)
    p, m = len(num), len(num[0])
    if (len(den), len(den[0])) != (p, m):
        raise InputError(
            f"numerators and denominators must form matrices of one shape; got {(p, m)}, {(len(den), len(den[0]))}."
        )
    times = np.zeros((p, m)) if dead_times is None else np.asarray(dead_times, float)
    if times.shape != (p, m) or not np.isfinite(times).all() or (times < 0).any():
        raise InputError(f"dead times must form a ({p}, {m}) matrix of numbers from 0 [s]; got {dead_times!r}.")
    inputs = tuple(f"u{j + 1}" for j in range(m)) if inputs is None else tuple(inputs)
    outputs = tuple(f"y{i + 1}" for i in range(p)) if outputs is None else tuple(outputs)
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
    """Rows of coefficient arrays without leading zeros."""
    try:
        table = [[np.trim_zeros(np.atleast_1d(np.asarray(e, float)), "f") for e in row] for row in given]
    except (TypeError, ValueError):
        table = []
    flat = [e for row in table for e in row]
    if not flat or len({len(row) for row in table}) != 1 or any(e.ndim != 1 or not np.isfinite(e).all() for e in flat):
        raise InputError(f"{what} must be rows of lists of coefficients, rows of equal length; got {str(given)[:80]}.")
    return [[e if len(e) else np.zeros(1) for e in row] for row in table]


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
    sizes = np.abs(np.linalg.eigvals(system.A))
    sizes = sizes[sizes > 0] if sizes.any() else np.ones(1)
    omega = np.unique(np.r_[sizes, np.geomspace(sizes.min() / 10, sizes.max() * 10, 40)]) * 1.0123  # beside the poles
    wanted = frequency_response(*system, omega)
    for tolerance in TOLERANCES:
        kept = controllable_observable(system.A + shift, system.B, system.C, tolerance=tolerance)
        part = Realisation(kept.A - shift[: len(kept.A), : len(kept.A)], kept.B, kept.C, system.D)
        if len(part.A) < len(system.A) and np.allclose(frequency_response(*part, omega), wanted, rtol=SAME, atol=0):
            return part, kept.removed_poles - shift[0, 0]
    return system, nothing

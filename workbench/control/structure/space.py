"""Controller blocks given by their matrices: state spaces, transfer functions, expressions, the modal law.

state_space (tridiagonal A)   transfer_function (free coefficients)   expression (the user's symbols)   modal_law
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict

import casadi as ca
import numpy as np

from workbench.control.gains import GAIN_NAMES, GAIN_UNITS, TIME_CONSTANTS, Gains
from workbench.control.law import VERTICAL_CHANNELS, ModalLaw
from workbench.control.structure.block import Block, Controller, Parameter
from workbench.control.structure.blocks import RANGE
from workbench.errors import InputError, unknown_name


def state_space(
    inputs: str | Sequence[str],
    outputs: str | Sequence[str],
    order: int,
    *,
    direct: bool = False,
    start: Controller | None = None,
    sample_time: float | None = None,
    name: str = "",
) -> Block:
    """A controller of low order with free matrices; A is tridiagonal, which almost every A is in some coordinates.

    Parameters
    ----------
    order : int
        Number of states; with 0 take `gain`.
    direct : bool
        Whether D is tuned; it is zero otherwise (strictly proper).
    start : Controller, optional
        Its A is brought to the tridiagonal form of its real modes. Left out: modes at −1 … −order rad/s (sampled: their
        exp), C = 0, so the loop starts open.

    Parameters are called "A_1_2" … by row and column, behind `name` and a dot if the block has a name.
    """
    inputs, outputs = ((names,) if isinstance(names, str) else tuple(names) for names in (inputs, outputs))
    if not (isinstance(order, int) and order >= 1):
        raise InputError(f"order must be a whole number from 1; got {order!r}. For order 0 take a gain.")
    ny, nu = len(inputs), len(outputs)
    if start is None:
        rate = -np.arange(1.0, order + 1)
        A = np.diag(rate if sample_time is None else np.exp(rate * sample_time))
        B = np.where(np.arange(order)[:, None] % ny == np.arange(ny), 1.0, 0.1)
        start = Controller(A, B, np.zeros((nu, order)), np.zeros((nu, ny)))
    elif (start.order, start.D.shape) != (order, (nu, ny)):
        raise InputError(
            f"the start must have {order} states, {ny} inputs and {nu} outputs; got {start.order} states, D of "
            f"{start.D.shape}."
        )
    else:
        start = _by_modes(start)
    if not direct and start.D.any():
        raise InputError("a strictly proper block must start with D = 0; got another. Say direct=True.")
    parameters: list[Parameter] = []
    symbols: list[ca.SX] = []
    matrices = []
    band = np.abs(np.subtract.outer(np.arange(order), np.arange(order))) <= 1
    for key in "ABCD":
        values = getattr(start, key)
        free = band if key == "A" else np.full(values.shape, direct if key == "D" else True)
        M = ca.SX(*values.shape)
        for i, j in np.argwhere(free):
            label = f"{key}_{i + 1}_{j + 1}"
            parameters.append(Parameter(f"{name}.{label}" if name else label, values[i, j]))
            symbols.append(ca.SX.sym(label))
            M[int(i), int(j)] = symbols[-1]
        matrices.append(M)
    function = ca.Function("state_space", [ca.vertcat(*symbols)], matrices)
    options = {"order": order, "direct": direct, "sample_time_s": sample_time}
    slots = tuple(symbol.name() for symbol in symbols)
    return Block(inputs, outputs, tuple(parameters), function, sample_time, (), "state_space", options, slots)


def _by_modes(K: Controller) -> Controller:
    """The same transfer function with A block-diagonal in its real modes: 1 × 1, and 2 × 2 of a complex pair."""
    values, vectors = np.linalg.eig(K.A)
    columns, i = [], 0
    while i < len(values):
        pair = values[i].imag != 0
        columns += [vectors[:, i].real, vectors[:, i].imag] if pair else [vectors[:, i].real]
        i += 2 if pair else 1
    T = np.column_stack(columns)
    if np.linalg.cond(T) > 1e8:
        raise InputError("the start's A must have distinct eigenvalues; got a Jordan block. Move one a little.")
    A = np.linalg.solve(T, K.A @ T)
    band = np.abs(np.subtract.outer(np.arange(len(A)), np.arange(len(A)))) <= 1
    return Controller(np.where(band, A, 0.0), np.linalg.solve(T, K.B), K.C @ T, K.D)


def transfer_function(
    input: str,
    output: str,
    numerator: Sequence[float],
    denominator: Sequence[float],
    *,
    sample_time: float | None = None,
    name: str = "",
) -> Block:
    """(b_m s^m + … + b_0)/(s^n + a_(n−1) s^(n−1) + … + a_0), m ≤ n, with free coefficients; of z if sampled.

    numerator, denominator : starts in falling powers; both are divided by the denominator's leading coefficient
    """
    num, den = (np.atleast_1d(np.asarray(c, float)) for c in (numerator, denominator))
    if num.ndim != 1 or den.ndim != 1 or not 1 <= len(num) <= len(den) or len(den) < 2 or den[0] == 0:
        raise InputError(
            "a transfer function must have a denominator of degree 1 or more, led by a nonzero coefficient, and no "
            f"more numerator coefficients than that; got {np.shape(numerator)} over {np.shape(denominator)}."
        )
    num, den = num / den[0], den / den[0]
    n = len(den) - 1
    labels = [f"b_{k}" for k in reversed(range(len(num)))] + [f"a_{k}" for k in reversed(range(n))]
    parameters = tuple(
        Parameter(f"{name}.{label}" if name else label, value)
        for label, value in zip(labels, [*num, *den[1:]], strict=True)
    )
    b, a = ca.SX.sym("b", len(num)), ca.SX.sym("a", n)
    full = ca.vertcat(ca.SX.zeros(n + 1 - len(num)), b)  # b_n … b_0
    A = ca.SX(np.eye(n, k=-1))  # x_1 is the highest derivative
    A[0, :] = -a.T
    B, D = ca.SX(np.eye(n, 1)), full[0]
    function = ca.Function("transfer", [ca.vertcat(b, a)], [A, B, (full[1:] - D * a).T, D])
    options = {"numerator_degree": len(num) - 1, "denominator_degree": n, "sample_time_s": sample_time}
    slots = tuple(labels)
    return Block((input,), (output,), parameters, function, sample_time, (), "transfer_function", options, slots)


def expression(
    inputs: str | Sequence[str],
    outputs: str | Sequence[str],
    parameters: Sequence[tuple[Parameter, ca.SX]],
    *,
    A=None,
    B=None,
    C=None,
    D=None,
    sample_time: float | None = None,
) -> Block:
    """A block of the user's own: matrices as CasADi SX expressions of the parameters' symbols.

    Parameters
    ----------
    parameters : sequence of (Parameter, SX symbol)
    A, B, C, D : SX, DM or numbers, (nk, nk), (nk, ny), (nu, nk), (nu, ny)
        A, B and C left out: no states. D left out: zero.

    No file or table can hold it: its formula lives in the program that made it.
    """
    inputs, outputs = ((names,) if isinstance(names, str) else tuple(names) for names in (inputs, outputs))
    ny, nu = len(inputs), len(outputs)
    if len({A is None, B is None, C is None}) > 1:
        raise InputError("an expression must give A, B and C together, or none of them; got some.")
    if A is None or B is None or C is None:
        A, B, C = ca.SX(0, 0), ca.SX(0, ny), ca.SX(nu, 0)
    A, B, C = ca.SX(A), ca.SX(B), ca.SX(C)
    D = ca.SX(nu, ny) if D is None else ca.SX(D)
    theta = ca.vertcat(*(symbol for _, symbol in parameters)) if parameters else ca.SX(0, 1)
    if not theta.is_valid_input() or theta.numel() != len(parameters):
        raise InputError(
            "every parameter of an expression must come with one SX symbol of its own, (Parameter, symbol)."
        )
    function = ca.Function("expression", [theta], [A, B, C, D], {"allow_free": True})
    if function.has_free():
        strange = ", ".join(function.get_free())
        raise InputError(f"an expression must depend on its parameters' symbols alone; got {strange} too.")
    return Block(inputs, outputs, tuple(p for p, _ in parameters), function, sample_time, kind="expression")


def modal_law(law: ModalLaw, gains: Gains, bounds: Mapping[str, tuple[float, float]] | None = None) -> Block:
    """The modal control law of a levitated vehicle with its seventeen gains as parameters.

    Parameters
    ----------
    law : ModalLaw
        Its sensors are the inputs, its commands the outputs.
    gains : Gains
        Start. Time constants must not be zero.
    bounds : mapping of gain to (low, high), optional
        The gains that are free; the others are frozen at `gains`. Left out: all are free.

    A filter whose gain is frozen at zero is left out, as in `ModalLaw.numeric`.
    """
    for name in bounds or ():
        if name not in GAIN_UNITS:
            raise unknown_name("gain", name, GAIN_UNITS)
    given = gains.as_dict()
    parameters = []
    for name in GAIN_NAMES:
        value, free = given[name], bounds is None or name in bounds
        if name in TIME_CONSTANTS and not value > 0:
            raise InputError(
                f"{name} must be positive in a tuned law; got {value!r} s. Give the filter a time constant."
            )
        wide = (value / RANGE, value * RANGE) if name in TIME_CONSTANTS else (-math.inf, math.inf)
        low, high = (bounds or {}).get(name, wide)
        parameters.append(Parameter(name, value, low, high, free, GAIN_UNITS[name]))
    theta = ca.SX.sym("theta", len(GAIN_NAMES))
    function = ca.Function("modal_law", [theta], [ca.densify(ca.SX(m)) for m in law.state_space(theta)])
    owners = [
        *["K_hdot"] * VERTICAL_CHANNELS, *["K_hpdot"] * (5 - VERTICAL_CHANNELS),
        *["K_zdot"] * VERTICAL_CHANNELS, *["K_ydot"] * (5 - VERTICAL_CHANNELS),
    ]  # fmt: skip
    idle = tuple((state, (owner,)) for state, owner in enumerate(owners))
    return Block(
        law.sensors, law.commands, tuple(parameters), function, None, idle, "modal_law", asdict(law), GAIN_NAMES
    )

"""Power series through a CasADi function: every operation on numbers becomes the one on truncated series.

    f, point, directions --coefficients of point + s d--> operation by operation --> coefficients of f(point + s d)

Exact but for rounding, at the price of one evaluation times the square of the degree; derivatives of derivatives, as
expressions, grow threefold with every degree.

Source: Griewank & Walther, Evaluating Derivatives, 2nd ed. (2008), Table 13.1, 13.2.
"""

from collections.abc import Callable

import casadi as ca
import numpy as np


def series(function: ca.Function, point: np.ndarray, directions: np.ndarray, degree: int) -> np.ndarray:
    """Taylor coefficients of a function along lines through a point.

    Parameters
    ----------
    function : SX function of one column (m,) with one column (p,) as its value
    point : (m,);  directions : (k, m);  degree : highest power of s kept

    Returns
    -------
    (degree + 1, k, p)
        f(point + s d) = Σ coefficient · s^n, for each direction d.
    """
    lines = np.zeros((len(point), degree + 1, len(directions)))
    lines[:, 0], lines[:, 1] = np.asarray(point, float)[:, None], np.asarray(directions, float).T
    out = np.zeros((function.size1_out(0), degree + 1, len(directions)))
    work: list[np.ndarray] = [lines[0]] * function.sz_w()
    for k in range(function.n_instructions()):
        operation, where = function.instruction_id(k), function.instruction_output(k)
        if operation == ca.OP_CONST:
            work[where[0]] = np.zeros_like(lines[0])
            work[where[0]][0] = function.instruction_constant(k)
        elif operation == ca.OP_INPUT:
            work[where[0]] = lines[function.instruction_input(k)[1]]
        elif operation == ca.OP_OUTPUT:
            out[where[1]] = work[function.instruction_input(k)[0]]
        elif operation in RULES:
            work[where[0]] = RULES[operation](*(work[i] for i in function.instruction_input(k)))
        else:
            raise NotImplementedError(f"no rule for power series through CasADi's operation {operation}")  # a defect
    return out.transpose(1, 2, 0)


# ---- rules: series (degree + 1, k) to series


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    c = a[0] * b
    for n in range(1, len(a)):
        c[n:] += a[n] * b[: len(b) - n]
    return c


def _quotient(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    c = np.zeros_like(a)
    for n in range(len(a)):
        c[n] = (a[n] - (c[:n] * b[n:0:-1]).sum(axis=0)) / b[0]
    return c


def _root(a: np.ndarray) -> np.ndarray:
    c = np.zeros_like(a)
    c[0] = np.sqrt(a[0])
    for n in range(1, len(a)):
        c[n] = (a[n] - (c[1:n] * c[n - 1 : 0 : -1]).sum(axis=0)) / (2 * c[0])
    return c


def _one_plus(sign: float, a: np.ndarray) -> np.ndarray:
    square = sign * _product(a, a)
    square[0] += 1
    return square


def _integral(first: np.ndarray, a: np.ndarray, slope_of: np.ndarray) -> np.ndarray:
    """∫ a′/slope_of with the value `first` at s = 0."""
    powers = np.arange(len(a))[:, None]
    rate = np.zeros_like(a)
    rate[:-1] = (powers * a)[1:]
    c = np.zeros_like(a)
    c[0], c[1:] = first, _quotient(rate, slope_of)[:-1] / powers[1:]
    return c


def _wave(a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """sin a, cos a."""
    s, c, powers = np.zeros_like(a), np.zeros_like(a), np.arange(len(a))[:, None]
    s[0], c[0] = np.sin(a[0]), np.cos(a[0])
    for n in range(1, len(a)):
        weight = powers[1 : n + 1] * a[1 : n + 1]
        s[n] = (weight * c[n - 1 :: -1][:n]).sum(axis=0) / n
        c[n] = -(weight * s[n - 1 :: -1][:n]).sum(axis=0) / n
    return s, c


RULES: dict[int, Callable[..., np.ndarray]] = {
    ca.OP_ADD: lambda a, b: a + b,
    ca.OP_SUB: lambda a, b: a - b,
    ca.OP_MUL: _product,
    ca.OP_DIV: _quotient,
    ca.OP_NEG: lambda a: -a,
    ca.OP_TWICE: lambda a: 2 * a,
    ca.OP_SQ: lambda a: _product(a, a),
    ca.OP_SQRT: _root,
    ca.OP_FABS: lambda a: np.sign(a[0]) * a,
    ca.OP_SIN: lambda a: _wave(a)[0],
    ca.OP_COS: lambda a: _wave(a)[1],
    ca.OP_ATANH: lambda a: _integral(np.arctanh(a[0]), a, _one_plus(-1.0, a)),
    ca.OP_ASINH: lambda a: _integral(np.arcsinh(a[0]), a, _root(_one_plus(1.0, a))),
}

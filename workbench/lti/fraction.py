"""State space of a matrix of transfer functions, and systems of python-control as they come.

    numerators, denominators --entries of one denominator share their states--> A, B, C, D, nothing cancelled
    python-control system ---> A, B, C, D and names, or one sentence

Entries that have a denominator in common, number for number, share one chain of integrators for each of their columns,
or for each of their rows where those are fewer. Nothing else is merged: whether two roots are one is a question of
tolerance, and a realisation that asks it drops states of coprime fractions.
"""

from typing import Any

import numpy as np

from workbench.errors import InputError

Matrices = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def realised(numerators: list[list[np.ndarray]], denominators: list[list[np.ndarray]]) -> Matrices:
    """A (n, n), B (n, m), C (p, n), D (p, m) of p rows of m proper fractions.

    numerators, denominators : coefficients in falling powers, without leading zeros (a zero numerator: [0])

    Raises
    ------
    InputError
        If an entry is improper, its denominator zero, or its coefficients overflow.
    """
    p, m = len(numerators), len(numerators[0])
    D = np.zeros((p, m))
    groups: dict[tuple[float, ...], dict[tuple[int, int], np.ndarray]] = {}  # denominator: place: numerator
    for i in range(p):
        for j in range(m):
            num, den = numerators[i][j], denominators[i][j]
            if not den.any() or len(num) > len(den):
                raise InputError(
                    f"entry ({i + 1}, {j + 1}) must be proper with a nonzero denominator; "
                    f"got degree {len(num) - 1} over {len(den) - 1 if den.any() else 'zero'}. Add a fast pole."
                )
            with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
                num, den = np.r_[np.zeros(len(den) - len(num)), num] / den[0], den / den[0]
                rest = num[1:] - num[0] * den[1:]
            if not (np.isfinite(num).all() and np.isfinite(rest).all() and np.isfinite(den).all()):
                raise InputError(
                    f"entry ({i + 1}, {j + 1}) must have a leading coefficient that the others can be divided by; its "
                    "quotients overflow. Leave out a leading coefficient that is nearly zero."
                )
            D[i, j] = num[0]
            if rest.any():
                groups.setdefault(tuple(den[1:]), {})[i, j] = rest
    parts = [part for tail, entries in groups.items() for part in _parts(tail, entries, p, m)]
    order = sum(len(A) for A, _, _ in parts)
    A, B, C = np.zeros((order, order)), np.zeros((order, m)), np.zeros((p, order))
    first = 0
    for own, into, out in parts:
        at = slice(first, first + len(own))
        A[at, at], B[at], C[:, at] = own, into, out
        first += len(own)
    return A, B, C, D


def _parts(tail: tuple[float, ...], entries: dict[tuple[int, int], np.ndarray], p: int, m: int):
    """(A, B, C) for each column, or each row, of the strictly proper entries with one denominator."""
    rows, columns = sorted({i for i, _ in entries}), sorted({j for _, j in entries})
    order = len(tail)
    companion = np.eye(order, k=-1)  # of a column: state 1 is the highest derivative of the others
    companion[0] = -np.array(tail)
    parts = []
    for one in columns if len(columns) <= len(rows) else rows:
        by_column = len(columns) <= len(rows)
        numbers = np.zeros((p if by_column else m, order))
        for (i, j), rest in entries.items():
            if one == (j if by_column else i):
                numbers[i if by_column else j] = rest
        unit = np.zeros((order, m if by_column else p))
        unit[0, one] = 1.0
        parts.append((companion, unit, numbers) if by_column else (companion.T, numbers.T, unit.T))
    return parts


def from_control(system: Any) -> tuple[Matrices, tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Matrices, state, input and output names of a StateSpace or TransferFunction of python-control, any size.

    Raises
    ------
    InputError
        For measured responses, nonlinear and improper systems, and what is no system of python-control.
    """
    import control

    if isinstance(system, control.StateSpace):
        matrices = np.asarray(system.A), np.asarray(system.B), np.asarray(system.C), np.asarray(system.D)
        return matrices, tuple(system.state_labels), tuple(system.input_labels), tuple(system.output_labels)
    if not isinstance(system, control.TransferFunction):
        what = {
            control.FrequencyResponseData: "a measured frequency response has no states. Fit a transfer function to it",
            control.NonlinearIOSystem: "a nonlinear system has none. Linearise it with control.linearize first",
        }
        kind = next((words for cls, words in what.items() if isinstance(system, cls)), "")
        kind = kind or f"{type(system).__name__} is neither. Make one with control.ss or control.tf"
        raise InputError(f"a system must be a StateSpace or TransferFunction of python-control; {kind}.")
    inputs, outputs = tuple(system.input_labels), tuple(system.output_labels)
    table = [
        [[np.trim_zeros(np.asarray(entry, float), "f") for entry in row] for row in part]
        for part in (system.num, system.den)
    ]
    num, den = ([[e if len(e) else np.zeros(1) for e in row] for row in part] for part in table)
    matrices = realised(num, den)
    return matrices, tuple(f"x{k + 1}" for k in range(len(matrices[0]))), inputs, outputs

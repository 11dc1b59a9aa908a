"""Linear matrix inequalities handed to Clarabel: minimise c'x while every F0 + Σ x_i F_i stays positive semidefinite.

    Inequality(F0, F) … --stacked triangles--> Clarabel --x and its own words--> whoever asked, who checks x again

Written for many small blocks of like size, which are assembled without a loop. What the solver says about its answer is
handed on as text; nothing here or upstairs takes it for a proof.

Source: Vandenberghe & Boyd, SIAM Review 38 (1996) 49; Goulart & Chen, Clarabel (2024).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from workbench.errors import InputError

MISSING = "linear matrix inequalities need the package clarabel; it is not installed. Run pip install clarabel."


class Inequality(NamedTuple):
    """A stack of equally large inequalities F0[b] + Σ_i x_i F[b, i] ⪰ 0.

    F0 : (b, m, m) symmetric, or Hermitian;  F : (b, k, m, m) likewise, k the number of unknowns
    """

    F0: np.ndarray
    F: np.ndarray


class Answer(NamedTuple):
    """What the solver returned: a point (k,), its own verdict in words, iterations, seconds; x may be anything."""

    x: np.ndarray
    status: str
    iterations: int
    seconds: float


def minimise(c, inequalities: Sequence[Inequality], *, accuracy: float = 1e-9, seconds: float = 60.0) -> Answer:
    """Minimise c'x under stacks of linear matrix inequalities.

    Parameters
    ----------
    c : (k,)
    inequalities : at least one
        A complex stack is replaced by the real one of twice the size with the same eigenvalues, each twice.
    accuracy : float
        Relative gap and residual at which the solver stops.
    seconds : float
        Time after which it stops wherever it is.

    Returns
    -------
    Answer
        Its `x` has to be checked by the caller.

    Raises
    ------
    InputError
        If Clarabel is not installed.
    """
    try:
        import clarabel
    except ImportError as error:
        raise InputError(MISSING) from error
    from scipy import sparse

    c = np.asarray(c, float)
    rows, levels, cones = [], [], []
    for one in inequalities:
        F0, F = _real(np.asarray(one.F0)), _real(np.asarray(one.F))
        blocks, size = F0.shape[0], F0.shape[-1]
        rows.append(-np.moveaxis(_triangle(F), 1, 2).reshape(-1, len(c)))
        levels.append(_triangle(F0).ravel())
        cones += [clarabel.PSDTriangleConeT(size)] * blocks
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.time_limit = seconds
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = accuracy
    settings.max_threads = 1
    A = sparse.csc_matrix(np.vstack(rows))
    nothing = sparse.csc_matrix((len(c), len(c)))
    solution = clarabel.DefaultSolver(nothing, c, A, np.concatenate(levels), cones, settings).solve()
    return Answer(np.array(solution.x), str(solution.status), solution.iterations, solution.solve_time)


def symmetric_basis(size: int) -> np.ndarray:
    """(n(n + 1)/2, n, n): the symmetric matrices with a 1 in one place of the upper triangle and in its mirror."""
    row, column = np.triu_indices(size)
    basis = np.zeros((len(row), size, size))
    basis[np.arange(len(row)), row, column] = 1.0
    basis[np.arange(len(row)), column, row] = 1.0
    return basis


def _real(M: np.ndarray) -> np.ndarray:
    """[[Re, −Im], [Im, Re]] of Hermitian matrices; real ones as they are."""
    if not np.iscomplexobj(M):
        return M
    return np.concatenate(
        [np.concatenate([M.real, -M.imag], axis=-1), np.concatenate([M.imag, M.real], axis=-1)], axis=-2
    )


def _triangle(M: np.ndarray) -> np.ndarray:
    """The upper triangles column by column, off-diagonal entries × √2: the inner product of matrices is kept."""
    column, row = np.tril_indices(M.shape[-1])
    return M[..., row, column] * np.where(row == column, 1.0, math.sqrt(2.0))

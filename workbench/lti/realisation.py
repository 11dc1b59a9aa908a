"""Four real matrices A, B, C, D: checked, balanced, and what they answer at a frequency.

    matrices --checked--> Realisation --balanced--> the same transfer function in better units --responder--> G(jω)

    dx/dt = A x + B u,   y = C x + D u,   G(s) = D + C (sI − A)⁻¹ B

Everything the exact measures (`norm`, `margin`, `disk`, `variance`, `minimal`) have in common. Angular frequency
[rad/s].
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from workbench.errors import InputError

EPS = float(np.finfo(float).eps)


class Realisation(NamedTuple):
    """The matrices of dx/dt = A x + B u, y = C x + D u: (n, n), (n, m), (p, n), (p, m)."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray


def matrix(name: str, value) -> np.ndarray:
    """`value` as a real, finite matrix of float64; one sentence if it is not one."""
    array = np.asarray(value)
    if array.ndim != 2 or array.dtype.kind not in "biuf":
        raise InputError(
            f"{name} must be a real matrix; got {array.ndim} dimensions of {array.dtype}. Give rows of numbers."
        )
    array = array.astype(float)
    if not np.isfinite(array).all():
        raise InputError(f"{name} must be finite; got {array[~np.isfinite(array)][0]} among its entries. Remove it.")
    return array


def square(name: str, value) -> np.ndarray:
    """`value` as a real, finite square matrix."""
    array = matrix(name, value)
    if array.shape[0] != array.shape[1]:
        raise InputError(f"{name} must be square; got shape {array.shape}. Give as many rows as columns.")
    return array


def checked(A, B, C, D=None) -> Realisation:
    """The four matrices as float64, D = 0 if left out.

    Raises
    ------
    InputError
        If one is not a real finite matrix or the shapes do not fit together.
    """
    A, B, C = square("A", A), matrix("B", B), matrix("C", C)
    D = np.zeros((len(C), B.shape[1])) if D is None else matrix("D", D)
    for name, given, wanted in (
        ("B", B.shape, (len(A), B.shape[1])),
        ("C", C.shape, (C.shape[0], len(A))),
        ("D", D.shape, (len(C), B.shape[1])),
    ):
        if given != wanted:
            raise InputError(
                f"{name} must have shape {wanted} beside A {A.shape}, B {B.shape}, C {C.shape}; got {given}."
            )
    if 0 in D.shape:
        raise InputError(
            f"D must have at least one row and one column; got shape {D.shape}. Give an input and an output."
        )
    return Realisation(A, B, C, D)


def state_scale(A: np.ndarray) -> np.ndarray:
    """Powers of two s (n,) for which diag(s)⁻¹ A diag(s) has rows and columns of like size; they round nothing."""
    from scipy.linalg.lapack import dgebal

    if len(A) == 0:
        return np.ones(0)
    return dgebal(A, scale=1, permute=0)[3]  # SciPy's matrix_balance loses scales beyond 2⁶³


def balanced(A, B, C, D) -> Realisation:
    """The same transfer function in state units chosen by `state_scale`, B and C then brought to like norms.

    Every factor is a power of two, so no entry is rounded. Inputs and outputs keep their units.
    """
    scale = state_scale(A)
    A, B, C = A / scale[:, None] * scale, B / scale[:, None], C * scale
    norm_b, norm_c = np.linalg.norm(B), np.linalg.norm(C)
    if norm_b > 0 and norm_c > 0:
        level = 2.0 ** np.round(np.log2(norm_c / norm_b) / 2)
        B, C = B * level, C / level
    return Realisation(A, B, C, D)


def stable_poles(A: np.ndarray, what: str, cure: str) -> np.ndarray:
    """Eigenvalues (n,) of A in balanced units, all with negative real part.

    Raises
    ------
    InputError
        If one has a real part of zero or more; `what` names the matrix, `cure` says what to do.
    """
    scale = state_scale(A)
    poles = np.linalg.eigvals(A / scale[:, None] * scale)
    if len(poles) and poles.real.max() >= 0:
        worst = poles[np.argmax(poles.real)]
        raise InputError(f"{what} must be stable; got the pole {worst.real:.4g} ± {abs(worst.imag):.4g}j 1/s. {cure}")
    return poles


def responder(A, B, C, D) -> Callable[[np.ndarray], np.ndarray]:
    """The function omega (k,) → G(jω) (k, p, m), with the work that does not depend on frequency done once.

    One complex Schur form A = U T Uᴴ of the balanced matrix; at each frequency a triangular back-substitution, all
    frequencies at a time. This needs no eigenvectors, so double poles cost nothing in accuracy: each value is the exact
    response of matrices that differ from the balanced ones by a small multiple of n ε ‖A‖.
    """
    from scipy.linalg import schur
    from scipy.linalg.lapack import ztrtrs

    A, B, C, D = balanced(A, B, C, D)
    n, m, p = len(A), B.shape[1], len(C)
    if n:
        T, U, *_ = schur(A, output="complex")
        left, right, above = C @ U, U.conj().T @ B, np.triu(T, 1)

    def response(omega: np.ndarray) -> np.ndarray:
        answer = np.broadcast_to(D.astype(complex), (len(omega), p, m)).copy()
        finite = np.isfinite(omega)
        s = 1j * omega[finite]
        if n == 0 or len(s) == 0:
            return answer
        pivots = s - T.diagonal()[:, None]
        if not pivots.all():
            at = s[np.nonzero(~pivots.all(axis=0))[0][0]].imag
            raise InputError(
                f"omega must avoid the poles on the imaginary axis; got {float(at)!r} rad/s. Move it or add damping."
            )
        if len(s) == 1:  # root searches ask one frequency at a time: LAPACK's back-substitution, five times as quick
            x, _ = ztrtrs(np.diag(pivots[:, 0]) - above, right)
            answer[finite] += left @ x
            return answer
        inverse = 1 / pivots
        x = np.empty((n, m * len(s)), dtype=complex)
        for i in reversed(range(n)):
            row = (T[i, i + 1 :] @ x[i + 1 :]).reshape(m, len(s))
            row += right[i][:, None]
            row *= inverse[i]
            x[i] = row.ravel()
        answer[finite] += (left @ x).reshape(p, m, len(s)).transpose(2, 0, 1)
        return answer

    return response


def spectral(M: np.ndarray) -> np.ndarray:
    """σ_max (k,) of matrices (k, p, m), infinite where an entry is; a row or column needs no decomposition."""
    if 1 in M.shape[1:]:
        return np.sqrt(np.sum(np.abs(M) ** 2, axis=(1, 2)))
    finite = np.asarray(np.isfinite(M).all(axis=(1, 2)))
    sizes = np.linalg.svd(np.where(finite[:, None, None], M, 0), compute_uv=False)[:, 0]
    return np.where(finite, sizes, np.inf)


def frequency_response(A, B, C, D, omega) -> np.ndarray:
    """G(jω) = D + C (jωI − A)⁻¹ B at many frequencies.

    Parameters
    ----------
    A, B, C, D : (n, n), (n, m), (p, n), (p, m)
        Real; D may be None for zero. Stability is not needed.
    omega : (k,)
        Angular frequency [rad/s]; negative and infinite values are answered too.

    Returns
    -------
    (k, p, m) complex

    Raises
    ------
    InputError
        If shapes do not fit, omega is not a list of real numbers, or a frequency sits exactly on a pole.

    Guaranteed: backward stability, see `responder`. Not guaranteed: relative accuracy of single entries that are far
    below ‖C‖ ‖(jωI − A)⁻¹‖ ‖B‖.

    Examples
    --------
    >>> frequency_response([[-2.0]], [[2.0]], [[1.0]], None, [0.0, 2.0])[:, 0, 0].tolist()
    [(1+0j), (0.5-0.5j)]
    """
    frequencies = np.asarray(omega)
    if frequencies.ndim != 1 or frequencies.dtype.kind not in "biuf" or np.isnan(frequencies).any():
        raise InputError(
            f"omega must be a list of real numbers; got shape {frequencies.shape}, {frequencies.dtype}. Give one axis."
        )
    return responder(*checked(A, B, C, D))(frequencies.astype(float))

"""Unstable modes that a controller cannot move or cannot see: the test of Popov, Belevitch and Hautus.

An eigenvalue λ of A is moved by v if [A − λI, B] has full rank, seen by e if [A − λI; C] has. A structure whose
controller has zeros by pattern (one block for each loop) may still leave λ where it is: it is fixed if no feedback of
that pattern moves it, and random ones decide, since almost all of them move what can be moved.
Source: Wang & Davison, IEEE Trans. Automatic Control 18 (1973) 473.
"""

import numpy as np

from workbench.errors import InputError
from workbench.lti.realisation import EPS, state_scale

UNMOVED = 1e-8  # of the balanced matrix's norm; a multiple eigenvalue is rounded by the root of 1e-16
RANK = 1e-12  # of the balanced matrix's norm: rounding is below 1e-13 of it
WIDEST = 500  # powers of two between units: their products stay within the doubles
ROUNDS = 4  # of balancing: the inputs' and measurements' units follow the states'


def unstable(poles: np.ndarray, sample_time: float | None, rounding: float) -> np.ndarray:
    """Whether each eigenvalue is on or beyond the stability limit, but for rounding."""
    return poles.real >= -rounding if sample_time is None else np.abs(poles) >= 1 - rounding


def check_modes(A: np.ndarray, B: np.ndarray, C: np.ndarray, sample_time: float | None, name: str) -> None:
    """Refuse an unstable eigenvalue of A that B cannot move or C cannot see; the sentence names it.

    A, B, C : (n, n), (n, nu), (ny, n) from the controller's outputs to its inputs
    """
    if len(A) == 0:
        return
    A, B, C, _ = _in_like_units(A, B, C)
    size = max(float(np.linalg.norm(A, 2)), np.finfo(float).tiny)
    poles = np.linalg.eigvals(A)
    B = _unit(B) * size
    C = (_unit(C.T) * size).T
    for pole in poles[unstable(poles, sample_time, len(A) * EPS * size)]:
        shifted = A - pole * np.eye(len(A))
        for joined, lacking, verb, cure in (
            (np.hstack([shifted, B]), "moved", "reach", "Give it another input"),
            (np.hstack([shifted.T, C.T]), "seen", "see", "Give it another measurement"),
        ):
            if np.linalg.svd(joined, compute_uv=False)[-1] < RANK * size:
                raise InputError(
                    f"every unstable mode must be {lacking} by the structure; model {name!r} has the eigenvalue "
                    f"{_written(pole)} that its signals do not {verb}. {cure}, or take the mode out of the model "
                    "(tf(…, minimal=True) does where fractions share it)."
                )


def check_pattern(A, B, C, D, pattern: np.ndarray, sample_time: float | None, name: str) -> None:
    """Refuse an unstable eigenvalue of A that no static feedback with the pattern (nu, ny) of nonzeros moves.

    A, B, C, D : from the controller's outputs to its inputs, all unstable modes moved and seen (`check_modes`)
    """
    if len(A) == 0 or pattern.all():
        return
    A, B, C, _ = _in_like_units(A, B, C)
    size = max(float(np.linalg.norm(A, 2)), np.finfo(float).tiny)
    poles = np.linalg.eigvals(A)
    fixed = poles[unstable(poles, sample_time, len(A) * EPS * size)]
    A, B, C, D = _signals_of_like_size(A / size, B, C, D, pattern)
    fixed = fixed / size
    random = np.random.default_rng(0)

    def moved(F: np.ndarray) -> np.ndarray:
        """How far each suspect moves, relative to A's norm."""
        F = F * min(1.0, 0.5 / max(np.linalg.norm(D @ F, 2), 1e-300))  # I − D F keeps clear of singular
        closed = np.linalg.eigvals(A + B @ F @ np.linalg.solve(np.eye(len(C)) - D @ F, C))
        return np.abs(closed[:, None] - fixed).min(axis=0)

    for _ in range(3):
        full = random.normal(size=pattern.shape)
        fixed = fixed[moved(pattern * full) < np.minimum(UNMOVED, 1e-4 * moved(full))]
    if len(fixed):
        pole = size * fixed[np.argmax(fixed.real)]
        raise InputError(
            f"every unstable mode must be moved by the structure; model {name!r} has the eigenvalue {_written(pole)} "
            "that no controller with this structure's zeros moves. Let another block read or drive it."
        )


def _in_like_units(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> tuple[np.ndarray, ...]:
    """A, B, C in units of the states for which A and a feedback from C to B have rows and columns of like size; those
    units (n,), powers of two. Balancing A alone leaves the units of states that do not touch each other to chance.
    """
    n, nu, ny = len(A), B.shape[1], len(C)
    units = np.ones(n)
    pace = float(np.abs(np.linalg.eigvals(A)).max()) or 1.0
    for _ in range(ROUNDS):
        scaled = np.zeros((n + nu + ny,) * 2)
        scaled[:n, :n] = A / units[:, None] * units
        scaled[:n, n : n + nu] = pace * _unit(B / units[:, None])
        scaled[n : n + nu, n + nu :] = pace
        scaled[n + nu :, :n] = pace * _unit((C * units).T).T
        better = units * state_scale(scaled)[:n]
        if np.any(np.abs(np.log2(better)) > WIDEST):
            break
        units = better
    return A / units[:, None] * units, B / units[:, None], C * units, units


def _signals_of_like_size(A, B, C, D, pattern: np.ndarray) -> tuple[np.ndarray, ...]:
    """The same system in units of its inputs and outputs for which a feedback of ones is of the size of the rest."""
    n, nu, ny = len(A), B.shape[1], len(C)
    into, out = (np.where(s > 0, s, 1.0) for s in (np.linalg.norm(B, axis=0), np.linalg.norm(C, axis=1)))
    B, C, D = B / into, C / out[:, None], D / into / out[:, None]
    joined = np.block([[A, B, np.zeros((n, ny))], [np.zeros((nu, n + nu)), pattern * 1.0], [C, D, np.zeros((ny, ny))]])
    units = state_scale(joined)
    v, e = units[n : n + nu], units[n + nu :]
    return A, B * v, C / e[:, None], D * v / e[:, None]


def _written(pole: complex) -> str:
    return f"{pole.real:.6g}" + (f" ± {abs(pole.imag):.6g}j" if pole.imag else "")


def _unit(B: np.ndarray) -> np.ndarray:
    """Columns of unit length; zero columns stay. Sizes first, so that no square leaves the doubles."""
    for size in (lambda M: np.abs(M).max(axis=0, initial=0.0), lambda M: np.linalg.norm(M, axis=0)):
        length = size(B)
        B = B / np.where(length > 0, length, 1.0)
    return B

"""How many unstable poles a loop with dead times has, counted exactly where poles themselves are infinitely many.

    F(s) = det(I − E(s) Ā),  E = diag(1/(s + a), …, e^(−s·dead time), …),  Ā = A + a on the states' diagonal

is analytic in the closed right half plane, its zeros there are the loop's unstable poles, and without a feedback
through dead times alone it tends to 1 far out. So the turns of F along the imaginary axis count them (argument
principle).
"""

import math

import numpy as np

from workbench.errors import InputError
from workbench.tuning.loop_delay import LinedSystem

STEP = math.pi / 8  # largest turn between neighbouring frequencies that may pass for the shorter way round
TURN = 0.4  # of a dead time's phase between neighbouring frequencies, where it matters
WEAK = 0.05  # gain around the dead times that cannot turn F by more than STEP, for a handful of lines
MOST = 200_000  # frequencies
NEAREST = 1e-11  # of its frequency: a pole this near to the axis counts as on it


def unstable_poles(A: np.ndarray, lines: LinedSystem) -> int:
    """Number of zeros of det(Λ(s) − A) with Re s ≥ 0, A (N, N) and Λ as `lines.symbols` has it; continuous time.

    A zero on the axis itself counts as unstable.

    Raises
    ------
    InputError
        If dead times feed each other at once and without end (a neutral system), whose high frequencies decide.
    """
    n, q = len(lines.A) - len(lines.dead_times), len(lines.dead_times)
    line = np.arange(n, n + q)
    state = np.setdiff1d(np.arange(len(A)), line)
    through = np.abs(A[np.ix_(line, line)])
    if np.linalg.matrix_power(through, max(q, 1)).any():
        raise InputError(
            "unstable poles are counted for loops whose every circle holds a state; here dead times feed each other "
            "directly. Add a lag to the controller or the plant."
        )
    shift = max(float(np.linalg.norm(A[np.ix_(state, state)], 2)), 1e-12)
    shifted = A.copy()
    shifted[state, state] += shift

    def value(omega: np.ndarray) -> np.ndarray:
        E = np.empty((len(omega), len(A)), complex)
        E[:, state] = 1 / (1j * omega[:, None] + shift)
        E[:, line] = np.exp(-1j * omega[:, None] * lines.dead_times)
        return np.linalg.det(np.eye(len(A)) - E[:, :, None] * shifted)

    omega = _first(A, state, line, shift, lines.dead_times)
    F = value(omega)
    while True:
        if not F.all():
            return max(1, _turns(F))
        wide = np.flatnonzero(np.abs(np.angle(F[1:] / F[:-1])) > STEP)
        if not len(wide):
            return _turns(F)
        if (omega[wide + 1] - omega[wide] <= NEAREST * omega[wide + 1]).any():
            return max(1, _turns(F))  # the turn of a pole on the axis, or nearer to it than this
        between = (omega[wide] + omega[wide + 1]) / 2
        omega = np.insert(omega, wide + 1, between)
        F = np.insert(F, wide + 1, value(between))
        _few(len(omega))


def _turns(F: np.ndarray) -> int:
    """Zeros in the right half plane from the values along the upper half of the axis, the last one near 1."""
    F = np.where(F == 0, 1e-300, F)
    total = np.angle(F[1:] / F[:-1]).sum() - np.angle(F[-1])
    return round(-total / math.pi)


def _first(A: np.ndarray, state: np.ndarray, line: np.ndarray, shift: float, dead_times: np.ndarray) -> np.ndarray:
    """Frequencies from 0 to where F is near 1 for good, close together where the lines' loop can turn F.

    F = det(I − E_x Ā_xx) det(I − E_l M), M(jω) = A_ll + A_lx (jω − A_xx)⁻¹ A_xl. The second factor is the one that dead
    times turn quickly, and it cannot turn far where the entries' sizes |M| have a small spectral radius.
    """
    A_xx, A_xl, A_lx, A_ll = (A[np.ix_(i, j)] for i in (state, line) for j in (state, line))
    last = _quiet(A_xx + shift * np.eye(len(state)), A_xl, A_lx, A_ll)
    poles = np.linalg.eigvals(A_xx)
    smallest = min([1e-6 * shift, *(1e-3 * np.abs(poles[np.abs(poles) > 1e-12 * shift]))])
    grid = np.unique(np.r_[0.0, np.geomspace(smallest, last, 400), np.abs(poles.imag), np.abs(poles)])
    grid = grid[grid <= last]
    at = np.where(grid == 0, smallest, grid)[:, None, None] * 1j + 1e-9 * shift  # off the axis, where poles may sit
    M = np.abs(
        A_ll + A_lx @ np.linalg.solve(at * np.eye(len(state)) - A_xx, np.broadcast_to(A_xl, (len(grid), *A_xl.shape)))
    )
    strong = np.abs(np.linalg.eigvals(M)).max(axis=1) > WEAK
    pieces = [grid]
    for low, high, close in zip(grid[:-1], grid[1:], strong[:-1] | strong[1:], strict=True):
        count = math.ceil((high - low) * dead_times.max() / TURN) if close else 1
        _few(count)
        pieces.append(np.linspace(low, high, count + 1)[1:-1])
    omega = np.sort(np.concatenate(pieces))
    _few(len(omega))
    return omega


def _few(count: int) -> None:
    """Refuse more frequencies than can be waited for."""
    if count > MOST:
        raise InputError(
            f"unstable poles are counted on at most {MOST} frequencies; this loop's band times dead time asks for "
            "more. Take fast filters out of the model, or shorten the dead time."
        )


def _quiet(A_xx: np.ndarray, A_xl: np.ndarray, A_lx: np.ndarray, A_ll: np.ndarray) -> float:
    """A frequency beyond which |F − 1| < 1/2, as |det(I − X) − 1| ≤ (1 + ‖X‖)^n − 1 for n states.

    X = (A_xx + A_xl (Λ_l − A_ll)⁻¹ A_lx)/(jω + a) with |Λ_l| = 1 and A_ll nilpotent, A_xx with a on its diagonal.
    """
    through, around = np.abs(A_ll), np.eye(len(A_ll))
    for _ in range(len(A_ll)):
        around = np.eye(len(A_ll)) + through @ around  # Σ |A_ll|^k
    size = np.linalg.norm(A_xx, 2) + np.linalg.norm(np.abs(A_xl) @ around @ np.abs(A_lx), 2)
    return float(size / (1.5 ** (1 / max(len(A_xx), 1)) - 1))

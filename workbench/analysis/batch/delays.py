"""The dead time that each of many loops bears, one channel broken at a time: as `analysis.margin`, by another route.

    S_ii = d + Σ_j r_j/(s − λ_j) --zeros of S(s) + S(−s) − 1 over z = s²--> frequencies where |L_i| = 1 --> lag/ω

With the partial fractions at hand the sum is 2d − 1 + Σ_j 2 r_j λ_j/(z − λ_j²): its zeros are the eigenvalues of a
diagonal matrix less one of rank one, of the loop's own order. Negative real ones are crossings. Each is pursued on S
itself; a row whose zeros lie too near to call, or are not reached, says so and is analysed by itself.
"""

import numpy as np

REAL, UNCLEAR = 1e-9, 1e-3  # of |z|: imaginary parts that are rounding, and those that might be
REACHED = 1e-8  # of Re S − 1/2 at a crossing that was pursued
PURSUITS = 4  # of Newton's method, from eight digits
Found = tuple[np.ndarray, np.ndarray]


def delays(poles: np.ndarray, left: np.ndarray, right: np.ndarray, D: np.ndarray) -> Found:
    """Smallest delay margin over the channels (b,) [s], infinite where |L| = 1 nowhere; and where it is sound (b,).

    poles : (b, n);  left : (b, n, k);  right : (b, k, n);  D : (b, k, k)
    """
    least, sound = np.full(len(poles), np.inf), np.ones(len(poles), bool)
    for i in range(D.shape[1]):
        value, good = _of_channel(poles, right[:, i] * left[:, :, i], D[:, i, i])
        least, sound = np.minimum(least, value), sound & good
    return least, sound


def _of_channel(poles: np.ndarray, residues: np.ndarray, d: np.ndarray) -> Found:
    """The margin of one channel; residues (b, n), d (b,)."""
    n = poles.shape[1]
    through = 2 * d - 1
    sound = np.abs(through) > UNCLEAR  # else |L(∞)| = 1, or nearly
    through = np.where(sound, through, 1.0)
    weights = 2 * residues * poles / through[:, None]
    z = np.linalg.eigvals(np.eye(n) * (poles**2)[:, :, None] - weights[:, None, :])
    off = np.abs(z.imag) / np.maximum(np.abs(z), np.finfo(float).tiny)
    crossing = (z.real < 0) & (off < UNCLEAR)  # those too near to call count: the margin is rather too small
    sound &= ~(crossing & (off >= REAL)).any(axis=1)
    omega, value, reached = _pursued(poles, residues, d, np.sqrt(np.where(crossing, -z.real, 1.0)))
    sound &= (reached | ~crossing).all(axis=1)
    loop = (1 - value) / value
    lag = np.angle(-loop) % (2 * np.pi)
    delay = np.where(crossing, lag / omega, np.inf).min(axis=1, initial=np.inf)
    return np.where(np.abs(1 / np.where(d == 0, np.inf, d) - 1) >= 1, 0.0, delay), sound


def _pursued(poles, residues, d, omega: np.ndarray):
    """Frequencies (b, n) where Re S = 1/2, from near ones; S there; whether it was reached."""
    for last in (*[False] * PURSUITS, True):
        gaps = 1 / (1j * omega[:, :, None] - poles[:, None, :])
        value = d[:, None] + (gaps * residues[:, None, :]).sum(axis=2)
        error = value.real - 0.5
        if last:
            return omega, value, np.abs(error) < REACHED
        slope = (-1j * gaps**2 * residues[:, None, :]).sum(axis=2).real
        step = np.divide(error, slope, out=np.zeros_like(error), where=slope != 0)
        omega = omega - np.clip(step, -1e-3 * omega, 1e-3 * omega)
    raise AssertionError

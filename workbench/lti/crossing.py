"""Frequencies at which one transfer function does something: it is real, or its real part passes a level.

    T(s) --even or odd part--> eigenvalue problem --> frequencies near every crossing --sign changes--> the crossings

On the axis T(−jω) is the conjugate of T(jω), so 2j Im T = T(s) − T(−s) and 2 Re T = T(s) + T(−s), and their zeros are
eigenvalues. These only say where to look; the response itself decides.
"""

from collections.abc import Callable

import numpy as np

from workbench.lti.bracket import zeros_between
from workbench.lti.realisation import responder

RELATIVE = 1e-14  # width of a crossing's last bracket
BESIDE = 0.1  # relative distance at which the function is asked on both sides of a point


class ScalarResponse:
    """T(jω) of one channel, and its even and odd parts as systems whose zeros are wanted."""

    def __init__(self, A, b, c, d) -> None:
        self.A, self.b, self.c, self.d = A, b, c, float(d[0, 0])
        self._response = responder(A, b, c, d)

    def __call__(self, omega: np.ndarray) -> np.ndarray:
        return self._response(omega)[:, 0, 0]

    def zeros(self, sign: int, level: float) -> np.ndarray:
        """Angular frequencies |Im s| of all zeros s of T(s) + sign T(−s) − level."""
        A = np.kron(np.diag([1.0, -1.0]), self.A)
        b, c = np.tile(self.b, (2, 1)), np.kron([[1.0, -sign]], self.c)
        return np.abs(zeros(A, b, c, np.array([[self.d * (1 + sign) - level]])).imag)


def zeros(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray) -> np.ndarray:
    """The finite zeros (k,) of a square D + C (sI − A)⁻¹ B, and possibly some at large s that stand for infinite ones.

    Where D is well enough conditioned they are eigenvalues of A − B D⁻¹ C, else of the system's pencil.
    """
    from scipy.linalg import eigvals

    size = float(np.linalg.norm(A))
    drive, view = float(np.linalg.norm(B)), float(np.linalg.norm(C))
    if len(A) == 0 or size * drive * view == 0:
        return np.zeros(0, dtype=complex)
    if np.linalg.norm(D, -2) * size > 1e-3 * drive * view:  # dividing by D then costs at most three digits
        return np.asarray(eigvals(A - B @ np.linalg.solve(D, C)))
    B, C, D = B / drive * size, C / view * size, D / drive / view * size**2  # border of the size of A
    values = np.asarray(eigvals(np.block([[A, B], [C, D]]), np.diag(np.r_[np.ones(len(A)), np.zeros(len(D))])))
    return values[np.isfinite(values)]


def sign_changes(function: Callable[[np.ndarray], np.ndarray], near: np.ndarray) -> list[float]:
    """Positive frequencies where a real function changes sign, given points of which one is near each of them.

    The function is asked at the geometric means of neighbouring points and outside all of them, so that two sign
    changes share an interval only if they belong to points that coincide; and beside each point, since a mean with a
    point that stands for infinity lies where a steep roll-off leaves rounding alone.
    """
    near = np.unique(near[(near > 0) & np.isfinite(near)])
    if len(near) == 0:
        return []
    means = np.concatenate([[near[0] / 10], np.sqrt(near[1:] * near[:-1]), [near[-1] * 10]])
    beside = np.concatenate([np.maximum(near * (1 - BESIDE), means[:-1]), np.minimum(near * (1 + BESIDE), means[1:])])
    asked = np.unique(np.concatenate([means, beside]))
    signs = np.sign(function(asked))
    found = asked[:-1][signs[:-1] == 0]
    turns = np.flatnonzero(signs[:-1] * signs[1:] < 0)
    low, high = asked[turns], asked[turns + 1]
    below, above = function(low), function(high)
    crossed = below * above < 0
    # asked anew, an end may round to zero or to the other sign: that is where the function changes it
    rounded = np.where(np.abs(below) < np.abs(above), low, high)[~crossed]
    sought = zeros_between(function, low[crossed], high[crossed], RELATIVE) if crossed.any() else np.zeros(0)
    return np.sort(np.concatenate([found, rounded, sought])).tolist()

"""Frequencies at which one transfer function does something: it is real, or its real part passes a level.

    T(s) --even or odd part--> eigenvalue problem --> frequencies near every crossing --sign changes--> the crossings

On the axis T(−jω) is the conjugate of T(jω), so 2j Im T = T(s) − T(−s) and 2 Re T = T(s) + T(−s), and their zeros are
eigenvalues. These only say where to look; the response itself decides.
"""

from collections.abc import Callable

import numpy as np

from workbench.lti.realisation import responder

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
    from scipy.optimize import brentq

    def one(omega: float) -> float:
        return float(function(np.array([omega]))[0])

    near = np.unique(near[(near > 0) & np.isfinite(near)])
    if len(near) == 0:
        return []
    means = np.concatenate([[near[0] / 10], np.sqrt(near[1:] * near[:-1]), [near[-1] * 10]])
    beside = np.concatenate([np.maximum(near * (1 - BESIDE), means[:-1]), np.minimum(near * (1 + BESIDE), means[1:])])
    asked = np.unique(np.concatenate([means, beside]))
    signs = np.sign(function(asked))
    found = []
    for low, high, left, right in zip(asked, asked[1:], signs, signs[1:], strict=False):
        if left * right < 0:
            ends = one(low), one(high)
            if ends[0] * ends[1] < 0:
                found.append(float(brentq(one, low, high, xtol=1e-300, rtol=1e-14)))
            else:  # asked alone, an end rounds to zero or to the other sign: that is where the function changes it
                found.append(float(low if abs(ends[0]) < abs(ends[1]) else high))
        elif left == 0:
            found.append(float(low))
    return found

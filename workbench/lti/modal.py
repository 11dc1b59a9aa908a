"""A system in its modes: G(s) = D + Σ_i right_i left_i/(s − λ_i), of one system or of a stack of them at once.

    A (…, n, n) --modes--> λ, V --residues--> left V⁻¹B, right C V --> responses, peaks, partial fractions

A response then costs n multiplications, whatever the system. What this pays in accuracy shows itself in the condition
of V: callers who cannot bear that ask `modal_responder`, which takes a Schur form instead, or look at the growth.

Shapes: b systems, n states, m inputs, z outputs. Angular frequency [rad/s].
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from workbench.lti.grid import resonance
from workbench.lti.realisation import Realisation, responder

WORST_VECTORS = 1e6  # condition of eigenvectors that still gives a response to ten digits
GRID = 64  # frequencies spread over the decades of the poles, besides those of each pole
TOPS = 3  # local maxima that are pursued, until the highest is clear
ROUNDS = (3, 5)  # with all of them, then with the highest
INSIDE = 7  # points inside a bracket: each round shrinks it fourfold, in all to 5e-6 of ln ω; a parabola does the rest


class Modes(NamedTuple):
    """Poles λ (…, n), and what maps states to modes and back: vectors V (…, n, n), dx/dt = V Λ V⁻¹ x."""

    poles: np.ndarray
    vectors: np.ndarray

    def residues(self, B: np.ndarray, C: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(left (…, n, m), right (…, z, n)): the residue at λ_i of output z and input m is right[z, i] left[i, m]."""
        return np.linalg.solve(self.vectors, B.astype(complex)), C @ self.vectors

    def kernel(self, omega: np.ndarray) -> np.ndarray:
        """1/(jω − λ), (…, k, n) at (…, k) [rad/s]; zero at infinity."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(np.isfinite(omega)[..., None], 1 / (1j * omega[..., None] - self.poles[..., None, :]), 0.0)


def modes(A: np.ndarray) -> Modes:
    """Eigenvalues and eigenvectors of one matrix or a stack (…, n, n)."""
    values, vectors = np.linalg.eig(A)
    return Modes(values.astype(complex), vectors.astype(complex))


def modal_responder(system: Realisation) -> tuple[Callable[[np.ndarray], np.ndarray], np.ndarray]:
    """omega (k,) → G(jω) (k, p, m), and the poles (n,); from eigenvectors where well conditioned, else a Schur form."""
    A, B, C, D = system
    found = modes(A)
    if len(A) and not np.linalg.cond(found.vectors) < WORST_VECTORS:
        return responder(*system), found.poles
    (p, m), n = D.shape, len(A)
    left, right = found.residues(B, C)
    residues = (right.T[:, :, None] * left[:, None, :]).reshape(n, p * m)

    def response(omega: np.ndarray) -> np.ndarray:
        return (found.kernel(omega) @ residues).reshape(len(omega), p, m) + D

    return response, found.poles


def peaks(poles: np.ndarray, left: np.ndarray, right: np.ndarray, D: np.ndarray) -> np.ndarray:
    """sup over ω of σ_max(D + Σ_i right_i left_i/(jω − λ_i)), (b,), of stable loops.

    left : (b, n, k);  right : (b, k, n);  D : (b, k, k)

    A grid over the decades of the poles, the frequencies of every pole, zero and infinity; then the highest local
    maxima are bracketed ever more closely. A maximum between two grid points that neither shows is missed; light
    damping, which makes maxima narrow, puts a grid point on top of them.
    """
    b, n, k = left.shape
    residues = (right.transpose(0, 2, 1)[:, :, :, None] * left[:, :, None, :]).reshape(b, n, k * k)

    def gain(omega: np.ndarray) -> np.ndarray:
        """σ_max² at ω (b, w)."""
        S = (1 / (1j * omega[:, :, None] - poles[:, None, :])) @ residues
        return _largest_square(S.reshape(b, -1, k, k) + D[:, None])

    omega = _frequencies(poles)
    value = gain(omega)
    best = np.maximum(value.max(axis=1), _largest_square(D[:, None].astype(complex))[:, 0])
    x = np.log(omega)
    inner = value[:, 1:-1]
    local = np.where((inner > value[:, :-2]) & (inner >= value[:, 2:]), inner, -np.inf)
    tops = np.argsort(-local, axis=1, kind="stable")[:, :TOPS] + 1
    low, high = np.take_along_axis(x, tops - 1, 1), np.take_along_axis(x, tops + 1, 1)
    share = np.arange(INSIDE + 2) / (INSIDE + 1)
    for number in range(sum(ROUNDS)):
        points = low[:, :, None] + (high - low)[:, :, None] * share
        found = gain(np.exp(points[:, :, 1:-1]).reshape(b, -1)).reshape(b, -1, INSIDE)
        top = np.argmax(found, axis=2)[:, :, None]
        low, high = np.take_along_axis(points, top, 2)[:, :, 0], np.take_along_axis(points, top + 2, 2)[:, :, 0]
        if number == ROUNDS[0] - 1:
            chosen = np.argmax(found.max(axis=2), axis=1)[:, None]
            low, high = np.take_along_axis(low, chosen, 1), np.take_along_axis(high, chosen, 1)
            best = np.maximum(best, found.max(axis=(1, 2)))
    best = np.maximum(best, _vertex(found[:, 0], top[:, 0, 0]))
    at_rest = gain(np.zeros((b, 1)))[:, 0]
    return np.sqrt(np.maximum(best, at_rest))


def _vertex(values: np.ndarray, top: np.ndarray) -> np.ndarray:
    """Height (b,) of the parabola through the highest of equally spaced values (b, k) and its neighbours."""
    centre = np.clip(top, 1, values.shape[1] - 2)[:, None] + np.arange(-1, 2)
    before, at, after = np.take_along_axis(values, centre, 1).T
    bend = 2 * at - before - after
    bent = bend > 1e-13 * at  # flatter than that is rounding
    rise = np.where(bent, (after - before) ** 2 / (8 * np.where(bent, bend, 1.0)), 0.0)
    inside = np.abs(after - before) < 2 * bend  # the vertex lies between the neighbours
    return np.maximum(values.max(axis=1), np.where(bent & inside, at + rise, 0.0))


def _frequencies(poles: np.ndarray) -> np.ndarray:
    """(b, w) rising frequencies [rad/s]: decades around the poles, and |λ|, Im λ and the resonance of each.

    Of a conjugate pair the one below the axis puts its points a tenth beside the resonance instead.
    """
    size = np.abs(poles)
    low, high = np.log(size.min(axis=1) / 10), np.log(size.max(axis=1) * 1000)
    grid = np.exp(low[:, None] + (high - low)[:, None] * np.linspace(0, 1, GRID))
    peak = resonance(poles)
    below = poles.imag < 0
    own = [
        np.where(below, 0.9 * peak, peak), np.where(below, 1.1 * peak, size), np.maximum(poles.imag, 0),
    ]  # fmt: skip
    return np.sort(np.maximum(np.concatenate([grid, *own], axis=1), grid[:, :1]), axis=1)


def _largest_square(S: np.ndarray) -> np.ndarray:
    """σ_max² of matrices (…, k, k)."""
    k = S.shape[-1]
    if k == 1:
        return S[..., 0, 0].real ** 2 + S[..., 0, 0].imag ** 2
    if k == 2:  # from the Frobenius norm and the determinant; the root loses no digit of the larger one
        total = (S.real**2 + S.imag**2).sum(axis=(-1, -2))
        det = S[..., 0, 0] * S[..., 1, 1] - S[..., 0, 1] * S[..., 1, 0]
        return (total + np.sqrt(np.maximum(total**2 - 4 * (det.real**2 + det.imag**2), 0))) / 2
    return np.linalg.svd(S, compute_uv=False)[..., 0] ** 2


@dataclass(frozen=True, slots=True)
class Fractions:
    """A transfer function D + Σ_j residue_j/(s − pole_j) with distinct poles; scalar."""

    poles: np.ndarray
    residues: np.ndarray
    direct: float = 0.0

    @classmethod
    def of(cls, A, B, C, D=0.0) -> "Fractions | None":
        """From a state space; None where eigenvectors are too nearly parallel to say."""
        A = np.atleast_2d(np.asarray(A, float))
        found = modes(A)
        if not np.linalg.cond(found.vectors) <= 1e8:  # residues would keep fewer than eight digits
            return None
        left, right = found.residues(np.reshape(B, (-1, 1)), np.reshape(C, (1, -1)))
        return cls(found.poles, right[0] * left[:, 0], float(np.reshape(D, ())))

    def __call__(self, s: np.ndarray) -> np.ndarray:
        """Value at s, of any shape."""
        return self.direct + (self.residues / (s[..., None] - self.poles)).sum(axis=-1)

"""The characteristic matrix of a loop with dead times, taken apart into what feeds back on itself.

    A (states and lines) --strongly connected parts--> parts without a line: eigenvalues, finitely many
                                                       Cycle: roots of det X(s) = 0, infinitely many

    X(s) = [sI − A_xx, −A_xl; −E A_lx, I − E A_ll],   E = diag(e^(−s·dead time))

det(Λ − A) is the product over the parts, so a dead time that no signal passes twice changes no pole and costs nothing.
States come in balanced units and then in a Schur basis of A_xx. `reach` bounds how far X moves on a disc; where the
entries' sizes of X⁻¹ times that have a spectral radius below one, det X has no zero on the disc (Perron, Frobenius).
"""

from dataclasses import dataclass, field

import numpy as np

from workbench.lti.realisation import EPS, state_scale

POWER = 14  # steps towards the vector that bounds a spectral radius closely; every one of them bounds it
SMALLEST = 1e-250  # of that vector's entries
FAR_LEFT = 300.0  # −Re s · dead time beyond which e^(−s·dead time) leaves the numbers' range


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
    """States and lines that all act on each other: (n, n) quasi-triangular, (n, q), (q, n), (q, q) and (q,) [s]."""

    A_xx: np.ndarray
    A_xl: np.ndarray
    A_lx: np.ndarray
    A_ll: np.ndarray
    dead_times: np.ndarray
    rounding: float = field(init=False)  # [1/s] by how much rounding of A_xx moves a pole that is well conditioned
    states: np.ndarray = field(init=False)  # (n,) eigenvalues of A_xx: the poles with the lines cut

    def __post_init__(self) -> None:
        n = len(self.A_xx)
        object.__setattr__(self, "rounding", 4 * n * EPS * float(np.linalg.norm(self.A_xx, 2)) if n else 0.0)
        object.__setattr__(self, "states", np.linalg.eigvals(self.A_xx))

    def shifted(self, sigma: float) -> "Cycle":
        """The cycle as a function of p = s − σ."""
        fade = np.exp(-sigma * self.dead_times)[:, None]
        moved = self.A_xx - sigma * np.eye(len(self.A_xx))
        return Cycle(moved, self.A_xl, fade * self.A_lx, fade * self.A_ll, self.dead_times)

    def row_size(self, s: np.ndarray) -> np.ndarray:
        """max(1, |E|) (k, q): what a line's row is divided by, so that X keeps its digits far to the left."""
        return np.exp(np.maximum(-s.real[:, None] * self.dead_times, 0.0))

    def at(self, s: np.ndarray, row_size: np.ndarray) -> np.ndarray:
        """X (k, n + q, n + q) at complex s (k,), its lines' rows over a size (k, q)."""
        n, q = self.A_xl.shape
        E = (np.exp(-s[:, None] * self.dead_times) / row_size)[:, :, None]
        X = np.empty((len(s), n + q, n + q), complex)
        X[:, :n, :n], X[:, :n, n:] = -self.A_xx, -self.A_xl
        X[:, n:, :n], X[:, n:, n:] = -E * self.A_lx, -E * self.A_ll
        X[:, range(n), range(n)] += s[:, None]
        X[:, range(n, n + q), range(n, n + q)] += 1 / row_size
        return X

    def slope(self, s: np.ndarray, row_size: np.ndarray) -> np.ndarray:
        """dX/ds (k, n + q, n + q), its lines' rows over a size (k, q)."""
        n, q = self.A_xl.shape
        E = (self.dead_times * np.exp(-s[:, None] * self.dead_times) / row_size)[:, :, None]
        X = np.zeros((len(s), n + q, n + q), complex)
        X[:, range(n), range(n)] = 1
        X[:, n:, :n], X[:, n:, n:] = E * self.A_lx, E * self.A_ll
        return X

    def reach(self, s: np.ndarray, radius: np.ndarray, *, upright: bool) -> np.ndarray:
        """Bounds (k, n + q, n + q) of |X − X(s)| within a radius (k,), rows over `row_size(s)`.

        `upright`: for steps along the imaginary axis only.
        """
        n, q = self.A_xl.shape
        phase = radius[:, None] * self.dead_times
        turn = np.minimum(phase, 2.0) if upright else np.expm1(np.minimum(phase, FAR_LEFT))
        turn = (np.exp(-s.real[:, None] * self.dead_times) / self.row_size(s) * turn)[:, :, None]
        R = np.zeros((len(s), n + q, n + q))
        R[:, range(n), range(n)] = radius[:, None]
        R[:, n:, :n], R[:, n:, n:] = turn * np.abs(self.A_lx), turn * np.abs(self.A_ll)
        return R

    def generator(self, nodes: np.ndarray) -> np.ndarray:
        """A matrix whose rightmost eigenvalues are the cycle's roots, to spectral accuracy in `nodes` (q,) per line.

        Each line is a transport w' = dw/dθ over −T … 0 on Chebyshev points, its inlet w(0) the line's row of A, its
        outlet w(−T) what the others see. Source: Breda, Maset & Vermiglio, SIAM J. Sci. Comput. 27 (2005) 482.
        """
        n, q = self.A_xl.shape
        ends = n + np.cumsum(nodes) - 1  # where the outlets stand
        G = np.zeros((n + int(np.sum(nodes)),) * 2)
        G[:n, :n], G[:n, ends] = self.A_xx, self.A_xl
        inlet = np.zeros((q, len(G)))
        inlet[:, :n], inlet[:, ends] = self.A_lx, self.A_ll
        for k, (count, last) in enumerate(zip(nodes, ends, strict=True)):
            D = chebyshev_slope(int(count)) * (2 / self.dead_times[k])
            rows = slice(last - count + 1, last + 1)
            G[rows, rows] = D[1:, 1:]
            G[rows] += D[1:, :1] * inlet[k]
        return G


def parts(A: np.ndarray, late: np.ndarray) -> tuple[np.ndarray, tuple[Cycle, ...]]:
    """The poles that no dead time touches (k,), and the cycles; A (N, N), dead times (N,) of its rows, 0 of states."""
    from scipy.sparse.csgraph import connected_components

    is_line = late > 0
    count, label = connected_components(A != 0, directed=True, connection="strong") if len(A) else (0, np.zeros(0))
    poles, cycles = [np.zeros(0, complex)], []
    for part in range(count):
        inside = np.flatnonzero(label == part)
        line, state = inside[is_line[inside]], inside[~is_line[inside]]
        if len(line) == 0:
            block = A[np.ix_(state, state)]
            scale = state_scale(block)
            poles.append(np.linalg.eigvals(block / scale[:, None] * scale))
        elif len(state) or A[np.ix_(line, line)].any():
            cycles.append(_cycle(A, state, line, late[line]))
    return np.concatenate(poles), tuple(cycles)


def _cycle(A: np.ndarray, state: np.ndarray, line: np.ndarray, dead_times: np.ndarray) -> Cycle:
    """A part in balanced units, its states in a Schur basis."""
    from scipy.linalg import schur

    order = np.r_[state, line]
    block = A[np.ix_(order, order)]
    scale = state_scale(block)
    block, n = block / scale[:, None] * scale, len(state)
    T, U = schur(block[:n, :n])[:2] if n else (np.zeros((0, 0)), np.zeros((0, 0)))
    return Cycle(T, U.T @ block[:n, n:], block[n:, :n] @ U, block[n:, n:], dead_times)


def perron(P: np.ndarray) -> np.ndarray:
    """Upper bounds (k,) of the spectral radii of nonnegative matrices (k, N, N), close to them.

    Any v > 0 bounds the radius by max (P v)_i/v_i (Collatz & Wielandt). Each step takes the geometric mean of v and
    P v, which finds units that differ by many decades at once and does not oscillate where the powers of P do.
    """
    v = np.ones(P.shape[:-1])
    best = np.full(len(P), np.inf)
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(POWER):
            image = np.einsum("kij,kj->ki", P, v)
            best = np.fmin(best, (image / v).max(axis=1))
            v = np.sqrt(v * np.maximum(image, SMALLEST))
            v = np.maximum(v / v.max(axis=1, keepdims=True), SMALLEST)
    return best


def inverses(X: np.ndarray) -> np.ndarray:
    """X⁻¹ (k, N, N); infinite where X is singular."""
    try:
        return np.linalg.inv(X)
    except np.linalg.LinAlgError:
        if len(X) == 1:
            return np.full_like(X, np.inf)
        half = len(X) // 2
        return np.concatenate([inverses(X[:half]), inverses(X[half:])])


def chebyshev_slope(count: int) -> np.ndarray:
    """Derivative (count + 1, count + 1) of a function of −1 … 1 by its values at cos(πi/count).

    Source: Trefethen, Spectral Methods in MATLAB (2000), ch. 6.
    """
    x = np.cos(np.pi * np.arange(count + 1) / count)
    c = np.r_[2.0, np.ones(count - 1), 2.0] * (-1.0) ** np.arange(count + 1)
    D = np.outer(c, 1 / c) / (x[:, None] - x + np.eye(count + 1))
    return D - np.diag(D.sum(axis=1))

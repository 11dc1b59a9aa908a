"""Step responses with dead times, by the method of steps: no fraction stands for a dead time.

    x' = A_xx x + A_xl η + B_x w,   v = A_lx x + A_ll η + B_l w,   η_i(t) = v_i(t − T_i), nothing before t = 0

Pieces of polynomials, collocated at Radau's points; what a line hands back is read from the pieces before, or from the
same one where the piece is longer than the dead time. Kinks travel through the lines: the first of their instants are
ends of pieces, and each passage through a state smooths them. A piece is halved until its last coefficients are below
the tolerance, and the march ends when states and lines rest.
"""

import math
from bisect import bisect_right
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from workbench.errors import InputError
from workbench.lti.join import difference, series
from workbench.lti.realisation import Realisation, state_scale

POINTS = 9  # of Radau in a piece: order 17
TOLERANCE = 1e-11  # of a signal's largest value: the last coefficients of a piece
RESTS = 1e-10  # of a signal's largest distance from its end
MOST_KINKS = 150
MOST_PIECES = 30_000
FORESEEN = 1000  # pieces after which it is asked whether that many will do
FIRST_STEP = 0.05  # of the fastest state's time
CLOSE = 1e-12  # of an instant: two that differ by less are the same
NEARLY = 0.02  # of the largest: more than a piece's 36 looks are below its own largest
ACCURACY = 1e-9  # of the largest response: a hundred times a piece's tolerance, for what pieces hand on


class Lined(NamedTuple):
    """Rows of states and of delay lines: (N, N), (N, m), (p, N), (p, m), and each row's dead time, 0 for a state."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    dead_times: np.ndarray  # (N,) [s]

    @classmethod
    def of(cls, system: Realisation) -> "Lined":
        """A system without lines."""
        return cls(*system, np.zeros(len(system.A)))

    @property
    def matrices(self) -> Realisation:
        """The four without the dead times."""
        return Realisation(self.A, self.B, self.C, self.D)

    def straight(self) -> bool:
        """Whether some input acts on some output through nothing but lines, so that a jump stays a jump."""
        line = self.dead_times > 0
        reached = (self.B[line] != 0).any(axis=1)
        for _ in range(int(line.sum())):
            reached |= (self.A[np.ix_(line, line)] != 0) @ reached
        return bool(self.D.any() or (self.C[:, line] != 0)[:, reached].any())

    def final(self) -> np.ndarray:
        """What a unit step at each input leads every row and every output to: (N + p, m)."""
        rest = np.linalg.solve(np.diag((self.dead_times > 0).astype(float)) - self.A, self.B)
        return np.vstack([rest, self.C @ rest + self.D])


def lined_series(second: Lined, first: Lined) -> Lined:
    """second · first. Rows: first's, then second's."""
    return Lined(*series(second.matrices, first.matrices), np.r_[first.dead_times, second.dead_times])


def lined_difference(one: Lined, other: Lined) -> Lined:
    """one − other, side by side."""
    return Lined(*difference(one.matrices, other.matrices), np.r_[one.dead_times, other.dead_times])


@dataclass(frozen=True, slots=True)
class Pieces:
    """Unit step responses as polynomials: y(start_k + length_k (1 + ξ)/2) = Σ_d coefficients[k, d] P_d(ξ)."""

    start: np.ndarray  # (k,) [s]
    length: np.ndarray  # (k,) [s]
    coefficients: np.ndarray  # (k, d, p, m)
    final: np.ndarray  # (p, m)
    error: float  # of the largest response

    @property
    def size(self) -> float:
        """The largest value any response takes, about."""
        return float(np.abs(self.coefficients).sum(axis=1).max(initial=0.0))

    def at(self, t: np.ndarray) -> np.ndarray:
        """(k, p, m) at instants (k,)."""
        piece = np.clip(np.searchsorted(self.start, t, side="right") - 1, 0, len(self.start) - 1)
        place = np.minimum(2 * (t - self.start[piece]) / self.length[piece] - 1, 1.0)
        basis = legendre.legvander(place, self.coefficients.shape[1] - 1)
        inside = np.einsum("kd,kdpm->kpm", basis, self.coefficients[piece])
        over = t > self.start[-1] + self.length[-1]
        return np.where(over[:, None, None], self.final, inside)

    def largest(self, begin: float, size) -> tuple[float, float]:
        """The largest size(y) (one input and output) from `begin` on, and its instant."""
        end = self.start + self.length
        inside = end > begin
        coefficients, start, length = self.coefficients[inside, :, 0, 0], self.start[inside], self.length[inside]
        best, when = float(size(self.at(np.array([begin]))[0, 0, 0])), begin
        if not len(start):
            return best, when
        fine = np.linspace(-1, 1, 4 * POINTS)
        values = size(coefficients @ legendre.legvander(fine, POINTS).T)
        times = start[:, None] + length[:, None] * (1 + fine) / 2
        values = np.where(times >= begin, values, -math.inf)
        top = values.max(axis=1)
        for k in np.argsort(-top)[: max(2, int(np.sum(top >= top.max() - NEARLY * abs(top.max()))))]:
            turning = legendre.legroots(np.trim_zeros(legendre.legder(coefficients[k]), "b"))
            turning = turning.real[(np.abs(turning.imag) < 1e-6) & (np.abs(turning.real) <= 1)]
            for place in [*turning, fine[int(np.argmax(values[k]))]]:
                t = float(start[k] + length[k] * (1 + place) / 2)
                value = float(size(legendre.legval(place, coefficients[k])))
                if t >= begin and value > best:
                    best, when = value, t
        return best, when

    def energy(self, order: int) -> float:
        """∫ of the squared distance from rest of the impulse (0), step (1) or ramp (2) response, over all pairs."""
        x, w = legendre.leggauss(POINTS + 2)
        basis = legendre.legvander(x, POINTS)
        away = self.coefficients.copy()
        away[:, 0] -= self.final
        half = (self.length / 2)[:, None, None, None]
        if order == 0:
            slope = np.moveaxis(legendre.legder(np.moveaxis(away, 1, 0)), 0, 1) / half
            values = np.einsum("xd,kdpm->kxpm", basis[:, :-1], slope)
        elif order == 1:
            values = np.einsum("xd,kdpm->kxpm", basis, away)
        else:  # −∫ from t to ∞ of the step's distance
            inner = np.moveaxis(legendre.legint(np.moveaxis(away, 1, 0), lbnd=1), 0, 1) * half
            whole = 2 * away[:, 0] * half[:, 0]
            after = np.cumsum(whole[::-1], axis=0)[::-1] - whole
            inner[:, 0] -= after
            values = np.einsum("xd,kdpm->kxpm", legendre.legvander(x, POINTS + 1), inner)
        return float(np.einsum("x,kxpm,k->", w, values**2, self.length / 2))


@cache
def _rule() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Radau's points c (N,) in (0, 1], ∫_0^{c_i} ℓ_j (N, N), and values at 0, c_1 … c_N → Legendre coefficients."""
    top = np.zeros(POINTS + 1)
    top[-2:] = -1, 1
    c = (1 + np.sort(legendre.legroots(top).real)) / 2
    c[-1] = 1.0
    to_coefficients = np.linalg.inv(legendre.legvander(2 * c - 1, POINTS - 1))
    integral = legendre.legint(np.eye(POINTS), lbnd=-1, axis=0) / 2
    weights = legendre.legvander(2 * c - 1, POINTS) @ integral @ to_coefficients
    dense = np.linalg.inv(legendre.legvander(2 * np.r_[0.0, c] - 1, POINTS))
    return c, weights, dense


def step_pieces(system: Lined) -> Pieces:
    """Unit step responses, from rest to rest, of a stable system with dead times.

    Raises InputError if more than `MOST_PIECES` are needed.
    """
    return _March(system).run()


class _March:
    """One run: the pieces so far and what the next one needs."""

    def __init__(self, system: Lined) -> None:
        state, line = np.flatnonzero(system.dead_times == 0), np.flatnonzero(system.dead_times > 0)
        order = np.r_[state, line]
        A, B = system.A[np.ix_(order, order)], system.B[order]
        n = self.n = len(state)
        scale = np.r_[state_scale(A[:n, :n]), np.ones(len(line))]
        self.A, self.B, self.C, self.D = (
            A / scale[:, None] * scale,
            B / scale[:, None],
            system.C[:, order] * scale,
            system.D,
        )
        self.T = system.dead_times[line]
        full = Lined(self.A, self.B, self.C, self.D, np.r_[np.zeros(n), self.T]).final()
        self.rest, self.final = full[: len(A)], full[len(A) :]
        self.start: list[float] = []
        self.length: list[float] = []
        self.v: list[np.ndarray] = []  # (N + 1, q, m) at 0, c_1 … c_N
        self.y: list[np.ndarray] = []
        self.solvers: dict[float, tuple] = {}

    def run(self) -> Pieces:
        n, m = self.n, self.B.shape[1]
        fastest = float(np.abs(np.linalg.eigvals(self.A[:n, :n])).max()) if n else 0.0
        fastest = max(fastest, 1 / self.T.max(initial=0.0) if len(self.T) else 0.0)
        if fastest == 0:
            fastest = 1.0
        kinks = self._kinks()
        t, x, first = 0.0, np.zeros((n, m)), FIRST_STEP / fastest
        step, size, away = first, np.zeros(len(self.A)), np.abs(self.rest).max(axis=1)
        quiet_since, before, left = math.inf, math.inf, 0.0  # distances of the pieces of late, beside the largest
        while True:
            after = kinks[bisect_right(kinks, t * (1 + CLOSE)) :]
            room = after[0] - t if after else math.inf
            h = min(step, room) if room > 1.5 * step else room
            rows, error = self._piece(t, h, x)
            size_now = np.maximum(size, np.abs(rows).max(axis=(0, 2)))
            size_now = np.maximum(size_now, np.abs(self.rest).max(axis=1))
            rough = float((error / np.where(size_now > 0, size_now, 1.0)).max(initial=0.0))
            if rough > TOLERANCE and h > 1e-3 * first and h > CLOSE * 100 * t:
                step = h / 2
                continue
            size = size_now
            self._keep(t, h, rows)
            x, ends = rows[-1, :n], h == room
            distance = np.abs(rows - self.rest).max(axis=(0, 2))
            away = np.maximum(away, distance)
            t = after[0] if ends else t + h
            resting = bool((distance <= RESTS * np.where(away > 0, away, 1.0)).all())
            quiet_since = min(quiet_since, t - h) if resting else math.inf
            if not after and t - quiet_since > self.T.max(initial=0.0):
                break
            left = max(left, float((distance / np.where(away > 0, away, 1.0)).max(initial=0.0)))
            hopeless = False
            if len(self.start) % FORESEEN == 0:
                hopeless, before, left = not after and self._too_slow(before, left), left, 0.0
            if hopeless or len(self.start) > MOST_PIECES:
                raise InputError(f"the response with dead times does not rest within {MOST_PIECES} pieces.")
            if ends:
                step = first
            elif rough < TOLERANCE / 30:
                step = 2 * h if h == step else step
        y = np.array(self.y)
        dense = _rule()[2]
        coefficients = np.einsum("dc,kcpm->kdpm", dense, y)
        top = np.abs(y).max(initial=0.0)
        rough = np.abs(coefficients[:, -1]).max(initial=0.0) / top if top else 0.0
        if rough > ACCURACY:
            raise InputError(
                "the response with dead times is the small difference of large states; it was not resolved."
            )
        return Pieces(np.array(self.start), np.array(self.length), coefficients, self.final, ACCURACY)

    def _too_slow(self, before: float, left: float) -> bool:
        """Whether, falling as from the pieces before the last `FORESEEN` to those, it would need far too many."""
        if not math.isfinite(before) or left <= RESTS:
            return False
        fall = math.log(before / left) / FORESEEN  # per piece; below zero while beating modes still build up
        return (2 * MOST_PIECES - len(self.start)) * fall < math.log(left / RESTS) and len(self.start) > 3 * FORESEEN

    def _kinks(self) -> list[float]:
        """Sums of dead times, as many passages as stay few."""
        found = np.zeros(1)
        for _ in range(12):
            more = np.unique(np.concatenate([found, *(found + T for T in self.T)])) if len(self.T) else found
            more = more[np.r_[True, np.diff(more) > CLOSE * more[1:]]]
            if len(more) > MOST_KINKS:
                break
            found = more
        return [float(t) for t in found if t > 0]

    def _before(self, times: np.ndarray, line: int) -> np.ndarray:
        """v of a line (k, m) at instants up to the pieces' end, nothing before t = 0.

        On a kink the first instant, a piece's beginning, reads what is behind it, the others what is in front.
        """
        out = np.zeros((len(times), self.B.shape[1]))
        nodes = np.r_[0.0, _rule()[0]]
        for i, t in enumerate(times):
            k = bisect_right(self.start, t + (1 if i == 0 else -1) * CLOSE * (t + 2 * self.T[line])) - 1
            if k >= 0:
                place = np.array([(t - self.start[k]) / self.length[k]])
                out[i] = _basis(nodes, place)[0] @ self.v[k][:, line]
        return out

    def _piece(self, t: float, h: float, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """All rows (N + 1, n + q, m) at 0, c_1 … c_N of a piece, and the size (n + q,) of its last coefficients."""
        c, weights, dense = _rule()
        n, q, m, N = self.n, len(self.T), self.B.shape[1], POINTS
        solve, P, own = self._solver(h)
        eta = np.zeros((q, m))
        known = np.zeros((N, q, m))
        for j in range(q):
            past = np.flatnonzero(~own[j])
            values = self._before(np.r_[t, t + c[past] * h] - self.T[j], j)
            eta[j], known[past, j] = values[0], values[1:]
        v = self.A[n:, :n] @ x + self.A[n:, n:] @ eta + self.B[n:]
        right_x = x + h * weights.sum(axis=1)[:, None, None] * self.B[:n]
        for j in range(q):
            inside = np.flatnonzero(own[j])
            known[inside, j] = P[j][inside, :1] * v[j] + P[j][inside, 1:].sum(axis=1)[:, None] * self.B[n + j]
        z = solve(np.concatenate([right_x.reshape(N * n, m), known.reshape(N * q, m)]))
        rows = np.concatenate([z[: N * n].reshape(N, n, m), z[N * n :].reshape(N, q, m)], axis=1)
        rows = np.concatenate([np.concatenate([x, eta])[None], rows])
        last = np.abs(np.einsum("dc,crm->drm", dense[-2:], rows)).max(axis=(0, 2))
        return rows, last

    def _solver(self, h: float):
        """The factored equations of a piece of length h, the lines' interpolation, and which points read the piece."""
        found = self.solvers.get(h)
        if found is not None:
            return found
        from scipy.linalg import lu_factor, lu_solve

        c, weights, _ = _rule()
        n, q, N = self.n, len(self.T), POINTS
        whole = np.eye(N * (n + q))
        whole[: N * n, : N * n] -= h * np.kron(weights, self.A[:n, :n])
        whole[: N * n, N * n :] -= h * np.kron(weights, self.A[:n, n:])
        P, own = [], []
        for j, T in enumerate(self.T):
            own.append(c * h - T > CLOSE * h)
            P.append(_basis(np.r_[0.0, c], c - T / h))
            for i in np.flatnonzero(own[j]):
                row = N * n + i * q + j
                whole[row, : N * n] -= np.kron(P[j][i, 1:], self.A[n + j, :n])
                whole[row, N * n :] -= np.kron(P[j][i, 1:], self.A[n + j, n:])
        factors = lu_factor(whole)
        found = self.solvers[h] = (lambda right: lu_solve(factors, right)), P, own
        return found

    def _keep(self, t: float, h: float, rows: np.ndarray) -> None:
        n = self.n
        self.start.append(t)
        self.length.append(h)
        self.v.append(self.A[n:] @ rows + self.B[n:])
        self.y.append(self.C @ rows + self.D)


def _basis(nodes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Lagrange's polynomials (len(at), len(nodes))."""
    gaps = nodes[:, None] - nodes + np.eye(len(nodes))
    distance = at[:, None, None] - nodes[None, None, :] + np.zeros((1, len(nodes), 1))
    distance[:, range(len(nodes)), range(len(nodes))] = 1.0
    return distance.prod(axis=2) / gaps.prod(axis=1)

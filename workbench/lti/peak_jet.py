"""Matrices of frequency enclosed on intervals: value and slope in the middle, and a bound of the second derivative.

    A, B, C, D, dead times --Enclosure--> Jet on many intervals at once --sum, product, inverse--> Jet
                                      --> a bound beyond the last interval

On |ω − m| ≤ r a function is value + (ω − m) slope + rest with |rest| ≤ bend r²/2 in the spectral norm. For a response
C (Λ − A)⁻¹ B + D every derivative of Λ is known, and |(Λ − A)⁻¹| is bounded on the interval by its value in the middle
(Neumann), entry by entry, states in a balanced Schur basis. Floating point, not outward-rounded.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from workbench.lti.cycle import inverses, perron
from workbench.lti.realisation import balanced, spectral

HALF = 0.5  # spectral radius up to which a resolvent is bounded on an interval: its bound is then at most doubled


class Jet(NamedTuple):
    """Matrices (k, p, m) on intervals of radius (k,): value, slope, and bend (k,), infinite where there is no bound."""

    value: np.ndarray
    slope: np.ndarray
    bend: np.ndarray
    radius: np.ndarray
    curve: np.ndarray | None = None  # (k, p, m) the bend entry by entry, of a response alone

    def scaled(self, d: np.ndarray) -> "Jet":
        """D · jet · D⁻¹ of a response alone, D (k, m) diagonal and positive: entries, so that units do not count."""
        curve = d[:, :, None] * np.asarray(self.curve) / d[:, None, :]
        bend = np.where(np.isfinite(self.bend), np.linalg.norm(curve, axis=(1, 2)), np.inf)
        value, slope = (d[:, :, None] * part / d[:, None, :] for part in (self.value, self.slope))
        return Jet(value, slope, bend, self.radius)

    def rate(self) -> np.ndarray:
        """A bound (k,) of the first derivative's norm on each interval."""
        return spectral(self.slope) + self.radius * self.bend

    def size(self) -> np.ndarray:
        """A bound (k,) of the norm on each interval."""
        return spectral(self.value) + self.radius * self.rate()

    def largest(self, norm, factor: np.ndarray | float = 1.0) -> np.ndarray:
        """A bound (k,) of a convex norm of the matrices, at most `factor` (k,) times the spectral one."""
        step = self.radius[:, None, None] * self.slope
        return np.maximum(norm(self.value + step), norm(self.value - step)) + factor * self.bend * self.radius**2 / 2

    def __add__(self, other) -> "Jet":  # pyright: ignore[reportIncompatibleMethodOverride]
        return Jet(self.value + other.value, self.slope + other.slope, self.bend + other.bend, self.radius)

    def __matmul__(self, other: "Jet") -> "Jet":
        with np.errstate(invalid="ignore"):
            bend = self.bend * other.size() + 2 * self.rate() * other.rate() + self.size() * other.bend
        bend = np.where(np.isnan(bend), np.inf, bend)  # of one factor nothing is known
        slope = self.slope @ other.value + self.value @ other.slope
        return Jet(self.value @ other.value, slope, bend, self.radius)

    def times(self, factors: "Jet") -> "Jet":
        """The columns times scalar functions, given as a jet (k, 1, m or 1)."""
        value, slope = factors.value, factors.slope
        with np.errstate(invalid="ignore"):
            bend = self.bend * factors.size() + 2 * self.rate() * factors.rate() + self.size() * factors.bend
        bend = np.where(np.isnan(bend), np.inf, bend)
        return Jet(self.value * value, self.slope * value + self.value * slope, bend, self.radius)

    def between(self, left: np.ndarray, right: np.ndarray) -> "Jet":
        """left · jet · right with constant matrices, (p', p) and (m, m') or one of each for every interval."""
        bend = self.bend * np.linalg.norm(left, 2, axis=(-2, -1)) * np.linalg.norm(right, 2, axis=(-2, -1))
        return Jet(left @ self.value @ right, left @ self.slope @ right, bend, self.radius)

    def plus(self, matrix: np.ndarray) -> "Jet":
        """Plus a constant matrix (p, m)."""
        return self._replace(value=self.value + matrix)

    def inverse(self) -> "Jet":
        """The inverse of square matrices; infinite where an interval may hold a singular one."""
        inverse = inverses(self.value)
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            size = spectral(np.where(np.isfinite(inverse), inverse, 0))
            size = np.where(np.isfinite(inverse).all(axis=(1, 2)), size, np.inf)
            room = 1 - size * self.radius * self.rate()
            size = np.where(room > 0, size / room, np.inf)
            bend = 2 * size**3 * self.rate() ** 2 + size**2 * self.bend
            slope = -inverse @ self.slope @ inverse
        clean = np.isfinite(bend)[:, None, None]
        return Jet(
            np.where(clean, inverse, 0), np.where(clean, slope, 0), np.where(np.isnan(bend), np.inf, bend), self.radius
        )


@dataclass(frozen=True, slots=True, eq=False)
class Enclosure:
    """A response that encloses itself on intervals; states first, then delay lines (q,) [s]."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    dead_times: np.ndarray

    @classmethod
    def of(cls, A, B, C, D, late: np.ndarray | None = None) -> "Enclosure":
        """A system; `late` (N,) has the dead times of its rows, 0 of states, none if left out."""
        from scipy.linalg import schur

        late = np.zeros(len(A)) if late is None else late
        order = np.r_[np.flatnonzero(late == 0), np.flatnonzero(late > 0)]
        A, B, C, D = balanced(A[np.ix_(order, order)], B[order], C[:, order], D)
        n = int(np.sum(late == 0))
        U = np.eye(len(A))
        U[:n, :n] = schur(A[:n, :n])[1] if n else np.zeros((0, 0))
        A = U.T @ A @ U
        A[:n, :n] = np.triu(A[:n, :n], -1)
        return cls(A, U.T @ B, C @ U, D, late[order][n:])

    def jet(self, middle: np.ndarray, radius: np.ndarray) -> Jet:
        """The response on intervals (k,) [rad/s]."""
        N, q = len(self.A), len(self.dead_times)
        n = N - q
        if N == 0:
            value = np.broadcast_to(self.D.astype(complex), (len(middle), *self.D.shape))
            return Jet(value, np.zeros_like(value), np.zeros(len(middle)), radius, np.abs(value) * 0)
        symbol = np.empty((len(middle), N), complex)
        symbol[:, :n], symbol[:, n:] = 1j * middle[:, None], np.exp(1j * middle[:, None] * self.dead_times)
        pencil = np.broadcast_to(-self.A.astype(complex), (len(middle), N, N)).copy()
        pencil[:, range(N), range(N)] += symbol
        inverse = inverses(pencil)
        first = np.r_[np.ones(n), self.dead_times]  # |dΛ/dω|
        turn = 1j * np.where(np.arange(N) < n, 1.0, symbol * first)
        moved = np.empty((len(middle), N))
        moved[:, :n], moved[:, n:] = radius[:, None], np.minimum(radius[:, None] * self.dead_times, 2.0)
        with np.errstate(invalid="ignore", over="ignore"):
            P = np.abs(inverse) * moved[:, None, :]
            sound = perron(P) <= HALF
        inverse, P = np.where(np.isfinite(inverse), inverse, 0), np.where(sound[:, None, None], P, 0)
        right = inverse @ self.B
        left = self.C @ inverse
        value = left @ self.B + self.D
        slope = -(left * turn[:, None, :]) @ right
        bound = np.linalg.solve(np.eye(N) - P, np.abs(inverse))  # of |(Λ − A)⁻¹| on the interval
        into, out = bound @ np.abs(self.B), np.abs(self.C) @ bound
        twice = 2 * (out * first) @ bound @ (first[:, None] * into)
        curved = (out[:, :, n:] * self.dead_times**2) @ into[:, n:]
        bend = np.where(sound, np.linalg.norm(twice + curved, axis=(1, 2)), np.inf)
        return Jet(value, slope, bend, radius, twice + curved)

    def beyond(self, start: float) -> tuple[float, float]:
        """Bounds of the response's norm for all |ω| ≥ start: of what stays, and of what falls like 1/ω from there."""
        stays, falls = self.entries_beyond(start)
        if not np.isfinite(stays).all():
            return math.inf, math.inf
        return float(np.linalg.norm(self.D, 2) + np.linalg.norm(stays - np.abs(self.D), 2)), float(
            sum(np.linalg.norm(term, 2) for term in falls)
        )

    def entries_beyond(self, start: float) -> tuple[np.ndarray, list[np.ndarray]]:
        """The same entry by entry, (p, m), the second a sum of terms.

        Both infinite where start is among the poles, or dead times feed each other at once.
        """
        n, q = len(self.A) - len(self.dead_times), len(self.dead_times)
        x, l = slice(n), slice(n, None)
        A_ll, C_l, B_l = np.abs(self.A[l, l]), np.abs(self.C[:, l]), np.abs(self.B[l])
        if q and not np.abs(np.linalg.eigvals(A_ll)).max() < HALF:
            return np.full(self.D.shape, np.inf), [np.full(self.D.shape, np.inf)]
        around = np.linalg.inv(np.eye(q) - A_ll)
        inward, outward = around @ B_l, C_l @ around  # through the lines, whatever their phases
        stays = np.abs(self.D) + C_l @ inward
        A_xl, A_lx = np.abs(self.A[x, l]), np.abs(self.A[l, x])
        whole = np.abs(self.A[x, x]) + A_xl @ around @ A_lx
        if n == 0:
            return stays, [np.zeros(self.D.shape)]
        if not perron(whole[None])[0] < HALF * start:
            return np.full(self.D.shape, np.inf), [np.full(self.D.shape, np.inf)]
        first = (  # what falls like 1/s: products of states as they are, lines by their sizes
            self.C[:, x] @ self.B[x], np.abs(self.C[:, x] @ self.A[x, l]) @ inward,
            outward @ np.abs(self.A[l, x] @ self.B[x]), outward @ np.abs(self.A[l, x] @ self.A[x, l]) @ inward,
        )  # fmt: skip
        into, out = np.abs(self.B[x]) + A_xl @ inward, np.abs(self.C[:, x]) + outward @ A_lx
        rest = out @ whole @ np.linalg.solve(start * np.eye(n) - whole, into)
        return stays, [np.abs(term) / start for term in (*first, rest)]

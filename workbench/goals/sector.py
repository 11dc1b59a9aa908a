"""Passivity and conic sectors: an inequality between a channel's inputs and outputs at every frequency.

    [y; u]ᴴ Q [y; u] ≤ 0,  Q = W₁W₁' − W₂W₂',  H = [T; I]  -->  R(ω) = σ_max( W₁'H (W₂'H)⁻¹ ) ≤ 1

For passivity W₁' = [I, −I]/√2 and W₂' = [I, I]/√2, so R = ‖(I − T)(I + T)⁻¹‖: at most 1 exactly if T + Tᴴ ≥ 0. R(ω)
comes from the orthonormal factor of [W₁'H; W₂'H], which exists where W₂'H is singular too (there R is infinite). Where
the sector is convex in T (Q's upper left block has no negative direction), R ≤ 1 at all frequencies with a stable T is
all that is needed; elsewhere W₂'H must also have its zeros on the left, which is checked. What decides at the sector's
boundary is in `goal_scattering`.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.errors import InputError
from workbench.goals.key import Key, weight
from workbench.goals.measure import NEAR, Measure
from workbench.goals.peak import Axis, PeakMeasure, Piece
from workbench.goals.registry import register
from workbench.goals.scattering import SectorMeasure
from workbench.goals.signals import ChannelGoal, check_pairs, check_weights
from workbench.lti.count import unstable_poles
from workbench.lti.crossing import zeros
from workbench.lti.join import series
from workbench.lti.peak_ceiling import Ceiling, enclosure, sector_ceiling
from workbench.lti.realisation import Realisation
from workbench.lti.weight import Filter, WeightLike, filter_of

WELL_CONDITIONED = 1e8  # of W₂'H(∞), so that its inverse is proper with eight digits left
FAST_ZERO = 1e8  # relative to ‖A‖: zeros beyond stand for infinity


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class Passivity(ChannelGoal):
    """The channel is passive, or passive with a reserve: yᵀu ≥ input_index uᵀu + output_index yᵀy.

    Parameters
    ----------
    inputs, outputs : names, in pairs
    input_index, output_index : float
        0 for mere passivity; with 4 · input_index · output_index < 1.

    value = R, see the module. A strictly proper channel has R = 1 at infinity, one with an integrator at zero: met
    where that is approached from below.
    """

    kind = "passivity"
    keys = (Key("input_index"), Key("output_index"))
    in_pairs = True

    input_index: float = 0.0
    output_index: float = 0.0

    def check_fields(self) -> None:
        _check_indices(self.input_index, self.output_index)

    def measure(self, channel: Any) -> Measure:
        matrix = _passive(len(self.inputs), self.input_index, self.output_index)
        return SectorMeasure(PeakMeasure(channel, SectorShape.of(channel, matrix), self.focus))


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class WeightedPassivity(ChannelGoal):
    """L T W is passive, with filters L after the outputs and W before the inputs; else as `Passivity`."""

    kind = "weighted_passivity"
    keys = (*weight("left"), *weight("right"), *Passivity.keys)

    left: WeightLike = 1.0
    right: WeightLike = 1.0
    input_index: float = 0.0
    output_index: float = 0.0

    def check_fields(self) -> None:
        check_weights(self)
        _check_indices(self.input_index, self.output_index)

    def measure(self, channel: Any) -> Measure:
        left = filter_of("left", self.left, len(self.outputs), side="left")
        right = filter_of("right", self.right, len(self.inputs), side="right")
        count = right.system.D.shape[1]
        if len(left.system.D) != count:
            raise InputError(
                f"the weighted channel must be square to be passive; got {len(left.system.D)} outputs "
                f"and {count} inputs. Mend the filters."
            )
        matrix = _passive(count, self.input_index, self.output_index)
        return SectorMeasure(PeakMeasure(channel, SectorShape.of(channel, matrix, left, right), self.focus))


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class ConicSector(ChannelGoal):
    """The channel lies in a conic sector.

    Parameters
    ----------
    inputs, outputs : names
    sector : (low, high), optional
        (y − low u)ᵀ(y − high u) < 0, low < high, channels in pairs.
    matrix : (p + m, p + m), optional
        Instead: symmetric Q of [y; u]ᵀ Q [y; u] < 0 with as many negative eigenvalues as there are inputs, none zero.
    """

    kind = "conic_sector"
    keys = (Key("sector", read=tuple, written=list), Key("matrix"))

    sector: tuple[float, float] | None = None
    matrix: Any = None

    def check_fields(self) -> None:
        if (self.sector is None) == (self.matrix is None):
            raise InputError(
                "ConicSector needs a sector or a matrix, not both. Give sector=(low, high) for a scalar one."
            )
        if self.sector is not None:
            check_pairs(self)
            low, high = self.sector
            if not (math.isfinite(low) and math.isfinite(high) and low < high):
                raise InputError(f"sector must be (low, high), finite, low < high; got {self.sector!r}. Swap the ends.")
        Q = self._form()
        size = len(self.outputs) + len(self.inputs)
        if Q.shape != (size, size) or not np.allclose(Q, Q.T, rtol=1e-12, atol=0):  # symmetric to double precision
            raise InputError(f"matrix must be symmetric, {size} by {size} for [outputs; inputs]; got shape {Q.shape}.")
        values = np.linalg.eigvalsh(Q)
        if np.sum(values < 0) != len(self.inputs) or np.min(np.abs(values)) < 1e-12 * np.max(np.abs(values)):
            raise InputError(
                f"matrix must have one negative eigenvalue per input ({len(self.inputs)}) and no zero one; "
                f"got {np.array2string(values, precision=3)}. A sector is a cone around a graph."
            )

    def measure(self, channel: Any) -> Measure:
        return SectorMeasure(PeakMeasure(channel, SectorShape.of(channel, self._form()), self.focus))

    def _form(self) -> np.ndarray:
        """Q of [y; u]ᵀ Q [y; u] < 0."""
        if self.sector is None:
            return np.asarray(self.matrix, float)
        low, high = self.sector
        return np.kron([[1.0, -(low + high) / 2], [-(low + high) / 2, low * high]], np.eye(len(self.inputs)))


def _check_indices(into: float, out: float) -> None:
    if not (math.isfinite(into) and math.isfinite(out) and 4 * into * out < 1):
        raise InputError(
            f"input_index and output_index must be finite with 4 × their product below 1; got {into!r}, {out!r}. "
            "No system can do more."
        )


def _passive(count: int, into: float, out: float) -> np.ndarray:
    return np.kron([[2 * out, -1.0], [-1.0, 2 * into]], np.eye(count))


@dataclass(frozen=True, slots=True, eq=False)
class SectorShape:
    """R(ω) of a sector; `above` and `below` are W₁' and W₂', (·, p + m)."""

    matrix: np.ndarray  # Q
    above: np.ndarray
    below: np.ndarray
    convex: bool
    left: Filter | None
    right: Filter | None
    outputs: int  # of the weighted channel
    labels: tuple[str, ...]

    @classmethod
    def of(cls, channel: Any, Q: np.ndarray, left: Filter | None = None, right: Filter | None = None) -> "SectorShape":
        """The shape of a matrix."""
        values, vectors = np.linalg.eigh(Q)
        negative = values < 0
        p = len(Q) - int(negative.sum())
        return cls(
            Q, (vectors[:, ~negative] * np.sqrt(values[~negative])).T,
            (vectors[:, negative] * np.sqrt(-values[negative])).T,
            bool(np.linalg.eigvalsh(Q[:p, :p]).min() >= -1e-12 * np.abs(values).max()),
            left, right, p, tuple(channel.labels if isinstance(channel, cls) else channel.inputs),
        )  # fmt: skip

    def size(self, axis: Axis, T: np.ndarray) -> np.ndarray:
        """(k,): sine over cosine of the largest angle between [W₁'H; W₂'H] and its lower half."""
        X = self._weighted(axis, T)
        graph = np.concatenate([self._half(self.above, X), self._half(self.below, X)], axis=1)
        orthonormal, _ = np.linalg.qr(graph)
        rows = len(self.above)
        sine = np.linalg.svd(orthonormal[:, :rows], compute_uv=False)[:, 0]
        cosine = np.linalg.svd(orthonormal[:, rows:], compute_uv=False)[:, -1]
        with np.errstate(divide="ignore"):
            return sine / cosine

    def in_units(self, T: Realisation, unit: float) -> Realisation | None:
        """W₁'H (W₂'H)⁻¹ of the same sector with the outputs in other units: another R, 1 at the same frequencies."""
        X, sizes = self._system(T), np.r_[np.full(self.outputs, unit), np.ones(len(self.matrix) - self.outputs)]
        other = SectorShape.of(self, self.matrix * np.outer(sizes, sizes))
        return other.system(Realisation(X.A, X.B, X.C / unit, X.D / unit), False)

    def form(self, axis: Axis, T: np.ndarray, rounding: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """λ_max(HᴴQH) (k,) and the size (k,) of the terms it is made of, with what a change (k,) of T makes of it."""
        X = self._weighted(axis, T)
        H = np.concatenate([X, np.broadcast_to(np.eye(X.shape[2]), (len(X), X.shape[2], X.shape[2]))], axis=1)
        turned = np.swapaxes(H, 1, 2)
        value = np.linalg.eigvalsh(turned.conj() @ self.matrix @ H)[:, -1]
        size = np.linalg.norm(np.abs(turned) @ np.abs(self.matrix) @ np.abs(H), axis=(1, 2))
        own, cross = (np.linalg.norm(part, 2) for part in np.split(self.matrix[: self.outputs], [self.outputs], axis=1))
        return value, size + 2 * rounding * (own * np.linalg.norm(X, axis=(1, 2)) + cross)

    def pieces(self, axis: Axis, T: np.ndarray) -> list[Piece]:
        """∂(F G⁻¹) = (P₁ − F G⁻¹ P₂) ∂T G⁻¹, P the columns of W' that meet y."""
        X = self._weighted(axis, T)
        F, G = self._half(self.above, X)[0], self._half(self.below, X)[0]
        try:
            inverse = np.linalg.inv(G)
        except np.linalg.LinAlgError:
            return []
        ratio = F @ inverse
        u, sizes, v = np.linalg.svd(ratio)
        before = (self.above[:, : self.outputs] - ratio @ self.below[:, : self.outputs]).conj().T
        found = []
        for k, size in enumerate(sizes):
            if size < sizes[0] * (1 - NEAR):
                break
            W = before @ np.outer(u[:, k], v[k]) @ inverse.conj().T
            if self.left is not None:
                W = self.left.response(axis.filters)[0].conj().T @ W
            if self.right is not None:
                W = W @ self.right.response(axis.filters)[0].conj().T
            found.append((float(size), W, self.labels[int(np.argmax(np.abs(W).max(axis=0)))]))
        return found

    def system(self, T: Realisation, sampled: bool) -> Realisation | None:
        """W₁'H (W₂'H)⁻¹, where W₂'H(∞) may be inverted."""
        X = self._system(T)
        m = X.D.shape[1]
        P1, U1 = self.above[:, : self.outputs], self.above[:, self.outputs :]
        P2, U2 = self.below[:, : self.outputs], self.below[:, self.outputs :]
        direct = P2 @ X.D + U2
        if direct.shape != (m, m) or np.linalg.cond(direct) > WELL_CONDITIONED:
            return None
        back = np.linalg.inv(direct)
        top = P1 @ X.D + U1
        return Realisation(
            X.A - X.B @ back @ P2 @ X.C, X.B @ back, P1 @ X.C - top @ back @ P2 @ X.C, top @ back
        )  # fmt: skip

    def ends(self, T: Realisation, sampled: bool) -> tuple[float, float]:
        """It has a value at every frequency."""
        return math.nan, math.nan

    def ceiling(self, T: Realisation, late: np.ndarray, end: float | None) -> Ceiling:
        """Bounds on intervals."""
        return sector_ceiling(enclosure(T, late), self.left, self.right, self.above, self.below, self.outputs)

    def corners(self) -> np.ndarray:
        """Of the filters."""
        parts = [np.abs(part.poles()) for part in (self.left, self.right) if part is not None]
        return np.concatenate([np.zeros(0), *parts])

    def refusal(self, T: Realisation) -> str:
        """For sectors that are not convex: a zero of W₂'H on the right."""
        if self.convex:
            return ""
        zeros = self._zeros(self._system(T))
        if len(zeros) and zeros.real.max() >= 0:
            worst = complex(zeros[np.argmax(zeros.real)])
            return (
                f"the channel is on the far side of the sector: W₂'H has the zero {worst.real:.4g} ± "
                f"{abs(worst.imag):.4g}j on the right, so the index means nothing."
            )
        return ""

    def late_refusal(self, T: Realisation, late: np.ndarray) -> str:
        """The same with dead times, zeros of W₂'H counted as the poles of its inverse."""
        if self.convex:
            return ""
        X = self._system(T)
        before, after = (0 if part is None else len(part.system.A) for part in (self.right, self.left))
        P2, U2 = self.below[:, : self.outputs], self.below[:, self.outputs :]
        direct = P2 @ X.D + U2
        if direct.shape[0] != direct.shape[1] or np.linalg.cond(direct) > WELL_CONDITIONED:
            return "zeros of W₂'H with dead times are counted only where W₂'H(∞) has an inverse; choose another sector."
        inverse = X.A - X.B @ np.linalg.solve(direct, P2 @ X.C)
        count = unstable_poles(inverse, np.r_[np.zeros(before), late, np.zeros(after)])
        side = "the channel is on the far side of the sector: W₂'H has zeros on the right, so the index means nothing."
        return side if count else ""

    def _zeros(self, X: Realisation) -> np.ndarray:
        P2, U2 = self.below[:, : self.outputs], self.below[:, self.outputs :]
        n, values = len(X.A), zeros(X.A, X.B, P2 @ X.C, P2 @ X.D + U2)
        scale = FAST_ZERO * max(np.linalg.norm(X.A, 2) if n else 0.0, 1e-300)
        return values[np.abs(values) < scale]

    def _system(self, T: Realisation) -> Realisation:
        T = T if self.right is None else series(T, self.right.system)
        return T if self.left is None else series(self.left.system, T)

    def _half(self, half: np.ndarray, X: np.ndarray) -> np.ndarray:
        return half[:, : self.outputs] @ X + half[:, self.outputs :]

    def _weighted(self, axis: Axis, T: np.ndarray) -> np.ndarray:
        T = T if self.left is None else self.left.response(axis.filters) @ T
        return T if self.right is None else T @ self.right.response(axis.filters)

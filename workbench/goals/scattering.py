"""Whether a channel lies in a sector, its boundary included: the scattering S = W₁'H (W₂'H)⁻¹ instead of the channel.

    T --S stable?--> σ_max(S) ≤ 1 at every frequency --sign of HᴴQH between eigenvalues of level 1--> value

A convex sector holds T exactly if S is stable with σ_max(S) ≤ 1, so poles of T on the axis (an integrator) are no
special case. A strictly proper T comes to the boundary of many sectors at infinity, one with an integrator at zero:
there, and where it vanishes, σ_max(S) = 1 to all digits, and only the sign of the form HᴴQH, relative to the size of
its terms, tells from which side. A limit approached from inside is met. It does not steer: nothing can be gained there.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.errors import InputError
from workbench.goals.goal import stability_reason
from workbench.goals.measure import NEAR, Value, infinite, near
from workbench.goals.peak import Axis, PeakMeasure
from workbench.lti.bilinear import in_w_plane, unwarped
from workbench.lti.grid import seeds
from workbench.lti.norm import intervals_above, peak_gain, proposals
from workbench.lti.peak_search import peaks
from workbench.lti.realisation import EPS, Realisation, balanced, responder, spectral

if TYPE_CHECKING:
    from workbench.control.structure.block import Controller

ROUNDING = 1e-12  # of the terms of HᴴQH: a sum smaller than this has no sign
AT_LIMIT = 1e-6  # of 1: σ_max(S) this near the boundary of a sector that is nowhere left is as good as at a limit
BESIDE = 1e-3, 1e4 * EPS  # of a pole on the axis, and of ‖A‖: nearer to it the form is rounding, S's stability decides
METHOD = "certified bracket of the scattering, side of the boundary by the sign of the form"


@dataclass(frozen=True, slots=True)
class Scattering:
    """T and S of one controller, in the w plane if sampled, and what they answer at a frequency there."""

    T: Realisation
    S: Realisation
    channel: Callable[[np.ndarray], np.ndarray]  # ω (k,) -> T (k, p, m)
    gain: Callable[[np.ndarray], np.ndarray]  # ω (k,) -> σ_max(S) (k,)
    limits: np.ndarray  # frequencies of T's poles on the axis

    def rounding(self, omega: np.ndarray) -> np.ndarray:
        """Size (k,) of the terms that add up to T, times the unit roundoff over ROUNDING: T may cancel to nothing."""
        A, B, C, D = self.T
        states = np.linalg.norm(responder(A, B, np.eye(len(A)), np.zeros(B.shape))(omega), axis=(1, 2)) if len(A) else 0
        return len(A) * EPS / ROUNDING * (np.linalg.norm(C) * states + np.linalg.norm(D) + np.zeros(len(omega)))

    def beside(self, omega: np.ndarray) -> np.ndarray:
        """Whether each of the frequencies (k,) is as good as at a pole on the axis."""
        near, least = BESIDE
        reach = np.maximum(near * self.limits, least * np.linalg.norm(self.T.A))
        return np.asarray((np.abs(omega[:, None] - self.limits) <= reach).any(axis=1))


@dataclass(frozen=True, slots=True)
class SectorMeasure:
    """σ_max(S) over a band; where there is no stable S, or dead time, the index over frequency of `peak`."""

    peak: PeakMeasure

    def evaluate(self, K: "Controller") -> Value:
        """The largest peaks that are no mere limits, with gradients; all of them where the sector is left."""
        found = self._scattering(K)
        if not isinstance(found, Scattering):
            return found or self.peak.evaluate(K)
        left = self._outside(found)
        tops = peaks(found.gain, self._grid(found, "sparse"), lambda level: intervals_above(*found.S, level))
        if not left:
            tops = [peak for peak in tops if peak[1] < 1 - AT_LIMIT] or tops[:1]
        shape, h = self.peak.shape, self.peak.channel.sample_time
        pieces, label = [], ""
        for omega, value in tops:
            if value < tops[0][1] * (1 - NEAR) and pieces:
                continue
            if not math.isfinite(omega) or found.beside(np.array([omega]))[0] or (not left and value >= 1 - AT_LIMIT):
                continue
            true = self._true(omega)
            for piece, W, where in shape.pieces(
                Axis(np.array([true]), np.array([omega])), found.channel(np.array([omega]))
            ):
                if np.isfinite(W).all():
                    label = label or where
                    pieces.append((piece, self.peak.channel.response_pullback(K, np.array([true]), W[None])))
        value = max([tops[0][1], *(piece for piece, _ in pieces)])
        value = max(value, 1 + EPS) if left else min(value, 1.0)
        return Value(
            value=value, gradients=near(pieces), frequency=self._true(tops[0][0]), channel=label,
            method="two-step on the Hamiltonian" + (" in the w plane" if h is not None else ""),
        )  # fmt: skip

    def exact(self, K: "Controller") -> Value:
        """A bracket; at most 1 exactly if the form has its sign everywhere, by more than its rounding or within it."""
        found = self._scattering(K)
        if not isinstance(found, Scattering):
            return found or self.peak.exact(K)
        left = self._outside(found)
        if self.peak.full:
            peak = peak_gain(*found.S)
            omega, value, upper = peak.frequency, peak.value, peak.upper
        else:
            tops = peaks(found.gain, self._grid(found, "dense"), lambda level: intervals_above(*found.S, level))
            omega, value = tops[0]
            upper = value
        if left:
            omega = omega if value > 1 else left[0]
            value, upper = max(value, 1 + EPS), max(upper, 1 + EPS)
        else:
            value, upper = min(value, 1.0), min(upper, 1.0)
        return Value(value=value, upper=upper, frequency=self._true(omega), method=METHOD)

    def _scattering(self, K: "Controller") -> Scattering | Value | None:
        """T and S; a value where there is nothing to measure, None where `peak` has the answer."""
        channel, shape = self.peak.channel, self.peak.shape
        if channel.delayed:
            return None
        h = channel.sample_time
        try:
            T: Realisation | None = Realisation(*channel.system(K))
        except InputError as error:
            return infinite(str(error))
        if not all(np.isfinite(block).all() for block in T):
            return infinite("the closed loop's matrices overflow.")
        T = T if h is None else in_w_plane(T, h)
        if T is None:
            return infinite("the channel has a pole at z = −1; its measure does not exist.")
        T = balanced(*T)
        poles = np.linalg.eigvals(T.A)
        reason = stability_reason(poles, h, in_w_plane=h is not None)
        S = shape.system(T, h is not None)
        stable = S is not None and np.linalg.eigvals(balanced(*S).A).real.max(initial=-math.inf) < 0
        refused = "" if reason else shape.refusal(T)
        if reason or refused or S is None or not stable:
            if (reason and not (stable and shape.convex)) or refused:
                return infinite(reason or refused)
            if S is None or not stable:
                return None
        answer, scattered = responder(*T), responder(*S)
        axis = np.abs(poles.imag[poles.real >= -len(poles) * EPS * np.linalg.norm(T.A, 2)])
        return Scattering(T, S, answer, lambda omega: spectral(scattered(omega)), axis)

    def _outside(self, found: Scattering) -> list[float]:
        """Frequencies where the form has the wrong sign by more than its rounding, one in each stretch at least."""
        low, high = self._band()
        omega = self._grid(found, "normal")
        inside = omega[(omega > 0) & np.isfinite(omega) & ~found.beside(omega)]
        sizes = spectral(found.channel(inside))
        sizes = sizes[(sizes > 0) & np.isfinite(sizes)]
        unit = float(np.exp(np.mean(np.log(sizes)))) if len(sizes) else 1.0
        S = self.peak.shape.in_units(found.T, unit) or found.S
        omega = np.r_[omega, proposals(*balanced(*S), 1.0)]
        omega = np.unique(omega[(omega >= low) & (omega <= high) & np.isfinite(omega)])
        omega = omega[~found.beside(omega)]
        form, size = self.peak.shape.form(Axis(self._true(omega), omega), found.channel(omega), found.rounding(omega))
        return omega[form > ROUNDING * size].tolist()

    def _grid(self, found: Scattering, density: str) -> np.ndarray:
        poles = np.r_[np.linalg.eigvals(found.S.A), np.linalg.eigvals(found.T.A)]
        return seeds(poles, self.peak.shape.corners(), self._band(), density)

    def _band(self) -> tuple[float, float]:
        """The band, in the w plane if sampled."""
        low, high = (
            float(Axis.of(np.array([end]), self.peak.channel.sample_time).filters[0]) for end in self.peak.band
        )
        return low, high

    def _true(self, omega: Any) -> Any:
        """Frequencies [rad/s] of those in the w plane."""
        h = self.peak.channel.sample_time
        if h is None:
            return omega
        found = unwarped(omega, h)
        return found if np.ndim(omega) else float(found)

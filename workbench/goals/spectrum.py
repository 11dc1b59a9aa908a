"""Spectra of a channel's outputs under random inputs: a mask over frequency, and the rms within a band.

    input PSDs S_j(f) --|T_ij(j2πf)|²--> output PSD Σ_j |T_ij|² S_j --mask--> Spectrum    sup √(PSD/mask)
                                                                    --∫ df--> RmsLimit    rms/limit

PSDs are one-sided and per hertz, inputs uncorrelated. Frequencies of densities and masks are in hertz, as in standards;
the focus band is in rad/s like everywhere. A density given by breakpoints is zero beyond them for the rms.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.constants import GRAVITY
from workbench.errors import InputError
from workbench.goals.goal import positive
from workbench.goals.key import Key, densities, magnitude
from workbench.goals.limit import Scales
from workbench.goals.measure import NEAR, Asked, Measure, Value, infinite
from workbench.goals.peak import Axis, PeakMeasure, Piece, sampled
from workbench.goals.registry import register
from workbench.goals.signals import ChannelGoal
from workbench.lti.bilinear import unwarped
from workbench.lti.end import first_terms, limit
from workbench.lti.grid import seeds
from workbench.lti.peak_ceiling import Ceiling, density_ceiling, enclosure
from workbench.lti.realisation import Realisation
from workbench.lti.weight import Profile, ProfileLike, profile_of

if TYPE_CHECKING:
    from workbench.control.structure.block import Controller

UNITS = {"output": 1.0, "g": GRAVITY}  # of a mask's amplitude, in units of the outputs
HALVINGS, SETTLED = 5, 1e-7  # of the panels of a judged integral, and the relative change that ends them
PANEL_NODES = {"normal": 6, "dense": 12, "checking": 8}  # Gauss–Legendre nodes between frequencies of the grid
LADDER = 2.0 ** np.arange(3, 30)  # widths of a mode at which panels end
RADIANS = 400  # of a dead time's turn that panels follow one by one
Densities = tuple[Profile, ...]


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class Spectrum(ChannelGoal):
    """The PSD of every output stays under a mask: value = sup √(PSD/mask).

    Parameters
    ----------
    inputs, outputs : names
    density : one for all inputs, or a tuple with one for each
        A number, {hertz: PSD}, or (numerator, denominator) of a filter H with PSD |H(j2πf)|²; one-sided,
        (input unit)²/Hz.
    mask : number or {hertz: PSD}
        One-sided, (unit)²/Hz.
    unit : "output" or "g"
        "g" for a mask in g²/Hz and outputs in m/s².
    """

    kind = "spectrum"
    keys = (*magnitude("mask", square=True), *densities("density"), Key("unit"))

    mask: ProfileLike
    density: Any = 1.0
    unit: str = "output"

    def check_fields(self) -> None:
        _densities(self.density, len(self.inputs))
        amplitude_of("mask", self.mask)
        if self.unit not in UNITS:
            raise InputError(f"unit must be 'output' or 'g'; got {self.unit!r}. Use 'g' for masks in g²/Hz.")

    @property
    def scales(self) -> Scales:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The measure is an amplitude; a mask in numbers is a PSD, its square, and a filter's is an amplitude."""
        return (("mask", 1 if isinstance(self.mask, tuple) else 2),)

    def measure(self, channel: Any) -> Measure:
        densities = _densities(self.density, len(self.inputs))
        shape = DensityShape(densities, amplitude_of("mask", self.mask), UNITS[self.unit], self.outputs)
        return PeakMeasure(channel, shape, self.focus)


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class RmsLimit(ChannelGoal):
    """The rms of the outputs together, √(Σ_i ∫ PSD_i df) over the focus band, is at most a limit: value = rms/limit.

    inputs, outputs, density, unit : as in `Spectrum`; limit : float, in the unit
    """

    kind = "rms_limit"
    keys = (Key("limit"), *densities("density"), Key("unit"))
    sizes = (("limit", ""),)

    limit: float
    density: Any = 1.0
    unit: str = "output"

    def check_fields(self) -> None:
        _densities(self.density, len(self.inputs))
        if self.unit not in UNITS:
            raise InputError(f"unit must be 'output' or 'g'; got {self.unit!r}. Use 'g' for a limit in g.")

    def asked(self) -> Asked:
        return Asked("<=", self.limit, "g" if self.unit == "g" else "1", lambda v: self.limit * v)

    def measure(self, channel: Any) -> Measure:
        densities = _densities(self.density, len(self.inputs))
        return RmsMeasure(channel, densities, self.limit * UNITS[self.unit], self.focus)


def amplitude_of(what: str, value: ProfileLike) -> Profile:
    """The square root of a PSD as a profile over rad/s: from a number, {hertz: PSD}, or a filter H with PSD |H|²."""
    if isinstance(value, Profile):
        return value
    if isinstance(value, Mapping):
        if any(not (float(f) > 0 and float(psd) > 0) for f, psd in value.items()):
            raise InputError(f"{what} must map positive frequencies [Hz] to positive PSDs; got {value!r}.")
        return profile_of(what, {2 * math.pi * float(f): math.sqrt(float(psd)) for f, psd in value.items()})
    if isinstance(value, int | float | np.number):
        return profile_of(what, math.sqrt(positive(what, float(value))))
    return profile_of(what, value)


def _densities(value: Any, count: int) -> Densities:
    """One amplitude profile per input."""
    rational = isinstance(value, tuple) and len(value) == 2 and all(np.ndim(part) == 1 for part in value)
    several = isinstance(value, tuple) and not rational
    parts = value if several else (value,) * count
    found = tuple(amplitude_of("density", part) for part in parts)
    if len(found) != count:
        raise InputError(f"density must be one for all or one per input ({count}); got {len(found)}.")
    return found


def _amplitudes(densities: Densities, omega: np.ndarray, *, ended: bool = False) -> np.ndarray:
    """√S_j (k, m); zero beyond breakpoints if `ended`, constant otherwise."""
    columns = []
    for density in densities:
        size = density.magnitude(omega)
        if ended and density.breakpoints is not None:
            size = np.where((omega >= density.breakpoints[0, 0]) & (omega <= density.breakpoints[-1, 0]), size, 0.0)
        columns.append(size)
    return np.stack(columns, axis=1)


def weight_end(densities: Densities, *, far: bool, ended: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Powers and coefficients (m,) of √S_j at an end of the axis; `ended`: none beyond breakpoints."""
    ends = [(0, 0.0) if ended and density.breakpoints is not None else density.end(far=far) for density in densities]
    return np.array([power for power, _ in ends]), np.array([size for _, size in ends])


@dataclass(frozen=True, slots=True, eq=False)
class DensityShape:
    """The largest over the outputs of √(Σ_j |T_ij|² S_j / mask)."""

    densities: Densities
    mask: Profile
    unit: float
    names: tuple[str, ...]

    def size(self, axis: Axis, T: np.ndarray) -> np.ndarray:
        """(k,)"""
        return self._rows(axis, T).max(axis=1)

    def pieces(self, axis: Axis, T: np.ndarray) -> list[Piece]:
        """One for each output near the largest."""
        rows = self._rows(axis, T)[0]
        weight = self._weight(axis)[0]
        found = []
        for i, size in enumerate(rows):
            if size < rows.max() * (1 - NEAR) or size == 0:
                continue
            W = np.zeros(T.shape[1:], complex)
            W[i] = T[0, i] * weight**2 / size
            found.append((float(size), W, self.names[i]))
        return sorted(found, key=lambda piece: -piece[0])

    def system(self, T: Realisation, sampled: bool) -> Realisation | None:
        """None: breakpoints are not rational."""
        return None

    def ends(self, T: Realisation, sampled: bool) -> tuple[float, float]:
        """Limits at ω = 0 and ∞ where a density or the mask is 0 or ∞ there."""
        found = [math.nan, math.nan]
        for k, far in enumerate((False, True)):
            power, size = weight_end(self.densities, far=far)
            mask_power, mask_size = self.mask.end(far=far)
            if (power != mask_power).any() and not (far and sampled):
                weight = size / (mask_size * self.unit)
                limits = limit(*first_terms(T, far=far), power - mask_power, weight, far=far)
                found[k] = float(np.linalg.norm(limits, axis=1).max())
        return found[0], found[1]

    def ceiling(self, T: Realisation, late: np.ndarray, end: float | None) -> Ceiling:
        """Bounds on intervals."""
        return density_ceiling(enclosure(T, late), self.densities, self.mask, self.unit, end)

    def corners(self) -> np.ndarray:
        """Of the densities and the mask."""
        return np.concatenate([profile.corners() for profile in (*self.densities, self.mask)])

    def refusal(self, T: Realisation) -> str:
        """A stable channel has a spectrum."""
        return ""

    def _weight(self, axis: Axis) -> np.ndarray:
        with np.errstate(divide="ignore", invalid="ignore"):
            weight = _amplitudes(self.densities, axis.omega) / (self.mask.magnitude(axis.omega) * self.unit)[:, None]
        at_end = (axis.omega == 0) | np.isinf(axis.omega)
        return np.where(at_end[:, None] & ~(np.isfinite(weight) & (weight > 0)), np.nan, weight)  # `ends` has the limit

    def _rows(self, axis: Axis, T: np.ndarray) -> np.ndarray:
        return np.sqrt(np.sum(np.abs(T * self._weight(axis)[:, None, :]) ** 2, axis=2))


@dataclass(frozen=True, slots=True)
class RmsMeasure:
    """rms/limit by Gauss–Legendre panels between frequencies made from the poles; the last in 1/ω to infinity."""

    channel: Any
    densities: Densities
    limit: float
    band: tuple[float, float]

    def evaluate(self, K: "Controller") -> Value:
        """One gradient: that of the whole integral."""
        found, omega, weight, T = self._integral(K, "normal")
        if not math.isfinite(found.value) or found.value == 0:
            return found
        # value² limit² = Σ weight |T|² S, so W = weight S T/(value limit²)
        W = (
            weight[:, None, None]
            * T
            * _amplitudes(self.densities, omega, ended=True)[:, None, :] ** 2
            / (found.value * self.limit**2)
        )
        gradient = self.channel.response_pullback(K, omega, W)
        return Value(
            value=found.value, gradients=((found.value, gradient),), frequency=found.frequency, channel=found.channel,
            method=found.method,
        )  # fmt: skip

    def exact(self, K: "Controller") -> Value:
        """Twice the nodes on ten times the panels; as far off as two thirds of the nodes are, at most."""
        found, few = self._integral(K, "dense")[0], self._integral(K, "checking")[0]
        if not math.isfinite(found.value):
            return found
        return replace(found, upper=found.value + abs(found.value - few.value))

    def _integral(self, K: "Controller", density: str) -> tuple[Value, np.ndarray, np.ndarray, np.ndarray]:
        nothing = np.zeros(0)
        state = sampled(self.channel, K)
        if state.reason:
            return infinite(state.reason), nothing, nothing, nothing
        h = self.channel.sample_time
        low, high = self._band()
        for far, within in ((False, low == 0), (True, math.isinf(high))):
            if within and self._diverges(state.system, far=far):
                where = "does not fall off" if far else "grows too fast towards ω = 0"
                reason = f"the output's PSD {where}, so its rms is infinite; add a filter or a focus band."
                return infinite(reason), nothing, nothing, nothing
        corners = np.concatenate([density_.corners() for density_ in self.densities])
        poles = state.poles if h is None else state.poles.real + 1j * unwarped(state.poles.imag, h)
        grid = seeds(poles, corners, (low, high), "dense" if density == "checking" else density)
        widths = np.abs(poles.real)[:, None] * np.r_[-LADDER, LADDER]  # a light mode's tail reaches far beyond its peak
        tails = (poles.imag[:, None] + np.where(np.abs(widths) < np.abs(poles)[:, None], widths, 0.0)).ravel()
        grid = np.unique(np.r_[grid, tails[(tails > low) & (tails < high)]])
        if self.channel.delayed:  # a radian of every dead time, as far as many of them
            ripples = np.arange(1, RADIANS) / float(self.channel.late(K).max())
            grid = np.unique(np.r_[grid, ripples[(ripples > low) & (ripples < high)]])
        omega, weight = frequency_nodes(grid, PANEL_NODES[density])
        axis = Axis.of(omega, h)
        T = state.response(axis)
        psd = np.sum(np.abs(T * _amplitudes(self.densities, omega, ended=True)[:, None, :]) ** 2, axis=2)  # (k, p)
        total = weight @ psd
        value = math.sqrt(float(total.sum())) / self.limit
        worst = int(np.argmax(total))
        method = f"integral over {len(omega)} frequencies"
        where = float(omega[int(np.argmax(psd[:, worst]))])
        return (
            Value(value=value, frequency=where, channel=self.channel.outputs[worst], method=method), omega, weight, T,
        )  # fmt: skip

    def _band(self) -> tuple[float, float]:
        """The focus within the range of the densities' breakpoints and below the Nyquist frequency."""
        low, high = self.band
        ends = [density.breakpoints for density in self.densities if density.breakpoints is not None]
        if len(ends) == len(self.densities):
            low, high = max(low, min(e[0, 0] for e in ends)), min(high, max(e[-1, 0] for e in ends))
        h = self.channel.sample_time
        return low, high if h is None else min(high, math.pi / h)

    def _diverges(self, system: Realisation, *, far: bool) -> bool:
        """Whether ∫ |T_ij|² S_j df has no bound at an end: |T_ij| √S_j falls no faster than a constant, or grows."""
        power, size = weight_end(self.densities, far=far, ended=True)
        order, term = first_terms(system, far=far)
        total, present = order + power, term * size != 0
        return bool(np.any(present & (total >= 0 if far else total < 0)))


def frequency_nodes(grid: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """ω (k,) and weights (k,) of ∫ df = ∫ dω/2π over the grid's panels, the last one in 1/ω if it ends at infinity."""
    x, w = np.polynomial.legendre.leggauss(count)
    endless = math.isinf(grid[-1])
    low, high = (grid[:-2], grid[1:-1]) if endless else (grid[:-1], grid[1:])
    middle, half = (low + high) / 2, (high - low) / 2
    omega = (middle[:, None] + half[:, None] * x).ravel()
    weight = (half[:, None] * w).ravel()
    if endless:
        top = 1 / grid[-2]
        v = top / 2 * (1 + x)
        omega, weight = np.r_[omega, 1 / v], np.r_[weight, top / 2 * w / v**2]
    return omega, weight / (2 * math.pi)

"""Roughness spectra: how much of a guideway's unevenness lies at which wavelength.

    Ω [rad/m] --psd--> S(Ω) [m²/(rad/m)]          one-sided: the mean square is ∫₀^∞ S dΩ
    f [Hz], V --psd_frequency--> S_f(f) = (2π/V) S(2πf/V) [m²/Hz]
    V --shaping_filter--> (A, B, C) driven by white noise

`Rational` covers every closed form in use (power laws, the American and German railway spectra of `catalogue`),
`PowerLaw` a corner given as a time frequency, `tabulated` a measured curve. Each carries where it comes from and the
wavelengths it was made for: outside them it refuses, unless `extrapolate` says that the form may be continued. Symbols
(SX, MX) cannot be checked against those limits.

White noise here is w with E[w(t) w(t+τ)] = δ(τ), two-sided intensity 1; the output of H then has the one-sided PSD per
hertz 2|H(j2πf)|².
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from workbench.errors import InputError
from workbench.physics.guideway.validity import (
    check_all_wavelengths,
    check_inside,
    check_limits,
    check_speed,
    check_strength,
)


class Spectrum(Protocol):
    """What the rest of the workbench asks of a roughness spectrum."""

    @property
    def provenance(self) -> str: ...  # where form and numbers come from, and how far to trust them

    @property
    def verified(self) -> bool: ...  # False: the numbers were not checked against a primary source

    @property
    def wavelength_min(self) -> float | None: ...  # [m], None: no limit stated

    @property
    def wavelength_max(self) -> float | None: ...  # [m], None: no limit stated

    @property
    def extrapolate(self) -> bool: ...  # whether those limits may be passed

    def psd(self, wavenumber) -> Any:
        """One-sided S(Ω) [m²/(rad/m)] at Ω [rad/m], elementwise."""
        ...

    def psd_frequency(self, frequency_hz, speed) -> Any:
        """One-sided S_f(f) [m²/Hz] seen at a speed [m/s], elementwise."""
        ...

    def scaled(self, factor: float) -> "Spectrum":
        """The spectrum times a factor: ¼ turns the spectrum of a difference into that of half the difference."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Rational:
    """S(Ω) = strength · Ω^(2·zeros) / ∏ (Ω² + Ω_k²), k = 1…n.

    Parameters
    ----------
    strength : S's numerator [m²/(rad/m) · (rad/m)^(2n − 2·zeros)], positive
    corners : (n,) corner wavenumbers Ω_k [rad/m], n = 1…3; 0 is a bare Ω² in the denominator
    zeros : power of Ω² in the numerator, 0 ≤ zeros < n
    wavelength_min, wavelength_max : limits of validity [m]; None if the source states none
    extrapolate : whether those limits may be passed
    """

    strength: float
    corners: tuple[float, ...]
    zeros: int = 0
    provenance: str
    verified: bool = False
    wavelength_min: float | None = None
    wavelength_max: float | None = None
    extrapolate: bool = False

    def __post_init__(self) -> None:
        check_strength("Rational.strength", self.strength)
        if not 1 <= len(self.corners) <= 3 or not all(0 <= corner < np.inf for corner in self.corners):
            raise InputError(
                f"Rational.corners must be one to three wavenumbers [rad/m], none negative; got {self.corners!r}. "
                "Write Ω² in the denominator as corner 0."
            )
        if not 0 <= self.zeros < len(self.corners):
            raise InputError(
                f"Rational.zeros must be at least 0 and below the number of corners {len(self.corners)}; "
                f"got {self.zeros!r}. A spectrum that does not fall off has no finite mean square."
            )
        check_limits(self)

    def psd(self, wavenumber):
        """One-sided S(Ω) [m²/(rad/m)] at Ω [rad/m], elementwise (scalar, array, DM, SX)."""
        check_inside(self, wavenumber, zero_allowed=0.0 not in self.corners)
        value = self.strength * wavenumber ** (2 * self.zeros)
        for corner in self.corners:
            value = value / (wavenumber**2 + corner**2)
        return value

    def psd_frequency(self, frequency_hz, speed):
        """One-sided S_f(f) = (2π/V) S(2πf/V) [m²/Hz] at f [Hz] and V [m/s], elementwise."""
        return _seen_at_speed(self, frequency_hz, speed)

    def scaled(self, factor: float) -> "Rational":
        """The spectrum times a factor."""
        return replace(self, strength=factor * self.strength)

    def shaping_filter(self, speed: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """State space x' = A x + B w, height = C x, whose output has this spectrum at a speed.

        Parameters
        ----------
        speed : vehicle speed V [m/s], positive

        Returns
        -------
        A : (n, n), B : (n, 1), C : (1, n)
            With H(s) = C (sI − A)⁻¹ B and white noise E[w(t) w(t+τ)] = δ(τ), the one-sided PSD per hertz
            2|H(j2πf)|² equals `psd_frequency(f, speed)`. The poles are −VΩ_k.

        Raises
        ------
        InputError
            If the spectrum has limits of validity that a filter, which acts at all wavelengths, would pass unasked.
        """
        check_speed(speed)
        check_all_wavelengths(self, "a shaping filter")
        n = len(self.corners)
        poles = speed * np.asarray(self.corners)
        A = np.diag(-poles)
        B = np.zeros((n, 1))
        B[0, 0] = 1.0
        # A chain: each block's state is 1/(s + VΩ_k) of its input. The last `zeros` blocks pass on the derivative of
        # their state, input − VΩ_k state; `signal` is the row that reads what one block hands to the next.
        signal = np.zeros(n)
        signal[0] = 1.0
        for block in range(1, n):
            A[block] += signal
            passes_derivative = block >= n - self.zeros
            signal = A[block].copy() if passes_derivative else np.eye(n)[block]
        gain = np.sqrt(np.pi * self.strength * speed ** (2 * n - 2 * self.zeros - 1))
        return A, B, gain * signal.reshape(1, n)

    def mean_square(self) -> float:
        """∫₀^∞ S(Ω) dΩ [m²] in closed form, free of cancellation also where corners coincide.

        Raises
        ------
        InputError
            If the integral diverges at Ω = 0, or limits of validity would be passed unasked.
        """
        check_all_wavelengths(self, "the mean square over all wavelengths")
        if sum(corner == 0 for corner in self.corners) > self.zeros:
            raise InputError(
                f"the mean square is finite only with a corner; corners {self.corners!r} let S grow without bound "
                "towards long waves. Give a corner, or ask for a band with band_mean_square."
            )
        return float(self.strength * _mean_square_of_unit(self.corners, self.zeros))


def _mean_square_of_unit(corners: tuple[float, ...], zeros: int) -> float:
    """∫₀^∞ Ω^(2·zeros)/∏(Ω² + Ω_k²) dΩ as a symmetric function of the corners, from partial fractions in Ω²."""
    if len(corners) == 1:
        (a,) = corners
        return np.pi / (2 * a)
    if len(corners) == 2:
        a, b = corners
        return np.pi / (2 * (a + b)) / (a * b if zeros == 0 else 1)
    a, b, c = corners
    pairs = 2 * (a + b) * (b + c) * (c + a)
    if zeros == 0:
        return np.pi * (a + b + c) / (a * b * c * pairs)
    return np.pi / pairs * (1 if zeros == 1 else a * b + b * c + c * a)


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerLaw:
    """S(Ω) = A/(Ω² + Ω_c²), the corner a wavenumber or the frequency a vehicle at speed V sees: Ω_c = 2πf_c/V.

    A corner in time frequency belongs to no wavenumber of the guideway until the speed is known; `psd` then refuses
    and `at_speed` gives the spectrum at that speed.

    Examples
    --------
    >>> law = PowerLaw(roughness=1.5e-6, corner_frequency_hz=0.1)
    >>> print(f"{1e3 * law.mean_square(134.0) ** 0.5:.1f} mm rms at 134 m/s")
    22.4 mm rms at 134 m/s
    """

    roughness: float  # A [m], i.e. m²/(rad/m) · (rad/m)²
    corner_wavenumber: float | None = None  # Ω_c [rad/m]
    corner_frequency_hz: float | None = None  # f_c [Hz]
    provenance: str = "level given by the user"
    verified: bool = False  # whether the numbers were checked against a primary source
    wavelength_min: float | None = None
    wavelength_max: float | None = None
    extrapolate: bool = False

    def __post_init__(self) -> None:
        check_strength("PowerLaw.roughness", self.roughness)
        if (self.corner_wavenumber is None) == (self.corner_frequency_hz is None):
            raise InputError(
                f"PowerLaw needs exactly one corner; got corner_wavenumber={self.corner_wavenumber!r} and "
                f"corner_frequency_hz={self.corner_frequency_hz!r}. "
                "Give corner_wavenumber=0 for a law without corner."
            )
        corner = self.corner_frequency_hz if self.corner_wavenumber is None else self.corner_wavenumber
        if corner is None or not 0 <= corner < np.inf:
            raise InputError(
                f"the corner of a PowerLaw must be finite and not negative; got {corner!r}. Use 0 for none."
            )
        check_limits(self)

    def at_speed(self, speed: float) -> Rational:
        """The spectrum of the guideway as a vehicle at this speed [m/s] meets it."""
        corner = self.corner_wavenumber
        if self.corner_frequency_hz is not None:
            check_speed(speed)
            corner = 2 * np.pi * self.corner_frequency_hz / speed
        return Rational(
            strength=self.roughness,
            corners=(corner,),
            provenance=self.provenance,
            verified=self.verified,
            wavelength_min=self.wavelength_min,
            wavelength_max=self.wavelength_max,
            extrapolate=self.extrapolate,
        )

    def psd(self, wavenumber):
        """One-sided S(Ω) [m²/(rad/m)] at Ω [rad/m], elementwise; needs a corner given as a wavenumber."""
        if self.corner_wavenumber is None:
            raise InputError(
                f"S(Ω) needs the corner as a wavenumber; got corner_frequency_hz={self.corner_frequency_hz!r}. "
                "Ask at_speed(V).psd(Ω)."
            )
        return self.at_speed(1.0).psd(wavenumber)

    def psd_frequency(self, frequency_hz, speed):
        """One-sided S_f(f) = 2πAV/(ω² + ω_c²) [m²/Hz] at f [Hz] and V [m/s], elementwise in f."""
        return self.at_speed(speed).psd_frequency(frequency_hz, speed)

    def scaled(self, factor: float) -> "PowerLaw":
        """The law times a factor."""
        return replace(self, roughness=factor * self.roughness)

    def shaping_filter(self, speed: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(A, B, C) with A = −VΩ_c, C = √(πAV); normalised as `Rational.shaping_filter`."""
        return self.at_speed(speed).shaping_filter(speed)

    def mean_square(self, speed: float = 1.0) -> float:
        """πA/(2Ω_c) [m²]; the speed [m/s] matters only where the corner is a frequency."""
        return self.at_speed(speed).mean_square()


def band_mean_square(spectrum: Spectrum, wavelength_min: float, wavelength_max: float) -> float:
    """∫ S(Ω) dΩ [m²] over the wavelengths from wavelength_min to wavelength_max [m], numerically to 1e-9."""
    from scipy.integrate import quad

    if not 0 < wavelength_min < wavelength_max < np.inf:
        raise InputError(
            f"a band of wavelengths needs 0 < wavelength_min < wavelength_max; got {wavelength_min!r} and "
            f"{wavelength_max!r}. Give both in metres, shorter first."
        )
    low, high = np.log(2 * np.pi / wavelength_max), np.log(2 * np.pi / wavelength_min)
    edges = np.linspace(low, high, int(np.ceil((high - low) / np.log(10))) + 1)
    pieces = pairwise(edges)
    return float(
        sum(quad(lambda x: np.exp(x) * spectrum.psd(np.exp(x)), *ends, epsabs=0, epsrel=1e-9)[0] for ends in pieces)
    )


def _seen_at_speed(spectrum: Spectrum, frequency_hz, speed):
    check_speed(speed)
    return 2 * np.pi / speed * spectrum.psd(2 * np.pi * frequency_hz / speed)

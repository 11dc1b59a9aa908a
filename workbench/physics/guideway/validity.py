"""Where a roughness spectrum may be asked: refusals of numbers outside its limits, of impossible speeds and strengths.

Symbols (SX, MX) have no value yet and pass unchecked; a formula's numbers are checked where they enter it.
"""

import casadi as ca
import numpy as np

from workbench.errors import InputError

_EDGE = 1 + 1e-12  # a wavelength computed from a frequency may miss its own limit by rounding


def check_strength(name: str, value: float) -> None:
    if not 0 < value < np.inf:
        raise InputError(
            f"{name} must be positive and finite; got {value!r}. Leave a type of irregularity out with None."
        )


def check_speed(speed) -> None:
    if isinstance(speed, ca.SX | ca.MX):
        return
    value = np.array(speed, float)
    if not np.all(np.isfinite(value) & (value > 0)):
        raise InputError(f"speed must be positive and finite [m/s]; got {speed!r}. A guideway is felt in motion only.")


def check_limits(spectrum) -> None:
    shortest, longest = spectrum.wavelength_min, spectrum.wavelength_max
    if not 0 < (shortest or 1e-300) < (longest or np.inf):
        raise InputError(
            f"wavelength limits must be positive and in order; got wavelength_min={shortest!r} and "
            f"wavelength_max={longest!r}. Give metres, shortest first, or None."
        )
    if not spectrum.provenance.strip():
        raise InputError("provenance must name the source of a spectrum; got an empty text. Write 'assumed' if it is.")


def check_inside(spectrum, wavenumber, *, zero_allowed: bool) -> None:
    """Numbers must lie where the spectrum is defined and valid; symbols pass unchecked."""
    if isinstance(wavenumber, ca.SX | ca.MX):
        return
    values = np.array(wavenumber, float)
    if not np.all(np.isfinite(values) & ((values >= 0) if zero_allowed else (values > 0))):
        sign = "not negative" if zero_allowed else "positive"
        raise InputError(f"wavenumber must be finite and {sign} [rad/m]; got {_extent(values)}. Spectra are one-sided.")
    if spectrum.extrapolate or values.size == 0:
        return
    lowest = 2 * np.pi / spectrum.wavelength_max / _EDGE if spectrum.wavelength_max else 0.0
    highest = 2 * np.pi / spectrum.wavelength_min * _EDGE if spectrum.wavelength_min else np.inf
    if values.min() < lowest or values.max() > highest:
        longest = 2 * np.pi / values.min() if values.min() > 0 else np.inf
        raise InputError(
            f"wavelengths must lie within {_limits(spectrum)}, where this spectrum is valid; asked for "
            f"{2 * np.pi / values.max():.4g}…{longest:.4g} m. Narrow the band, or set extrapolate=True and say so."
        )


def check_all_wavelengths(spectrum, what: str) -> None:
    if not spectrum.extrapolate and (spectrum.wavelength_min or spectrum.wavelength_max):
        raise InputError(
            f"{what} needs a spectrum valid at all wavelengths; this one is limited to {_limits(spectrum)}. "
            "Set extrapolate=True to continue its form beyond them."
        )


def _limits(spectrum) -> str:
    return f"{spectrum.wavelength_min or 0:.4g}…{spectrum.wavelength_max or np.inf:.4g} m"


def _extent(values: np.ndarray) -> str:
    return f"values from {values.min():g} to {values.max():g}"

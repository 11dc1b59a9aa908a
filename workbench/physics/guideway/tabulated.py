"""A measured or read-off roughness spectrum: points, and straight lines between them on log-log paper."""

from dataclasses import dataclass, replace

import numpy as np

from workbench.physics.guideway.interpolation import LogLog
from workbench.physics.guideway.validity import check_inside, check_limits, check_speed


@dataclass(frozen=True, slots=True, kw_only=True)
class Tabulated:
    """A spectrum given by points, straight lines between them on log-log paper, valid from the first to the last."""

    wavenumber: tuple[float, ...]  # (k,) [rad/m], increasing
    density: tuple[float, ...]  # (k,) [m²/(rad/m)], one-sided
    provenance: str
    verified: bool = False
    extrapolate: bool = False

    def __post_init__(self) -> None:
        table = LogLog(self.wavenumber, self.density)
        object.__setattr__(self, "wavenumber", table.x)
        object.__setattr__(self, "density", table.y)
        check_limits(self)

    @property
    def wavelength_min(self) -> float:
        """Shortest wavelength of the table [m]."""
        return 2 * np.pi / self.wavenumber[-1]

    @property
    def wavelength_max(self) -> float:
        """Longest wavelength of the table [m]."""
        return 2 * np.pi / self.wavenumber[0]

    def psd(self, wavenumber):
        """One-sided S(Ω) [m²/(rad/m)] at Ω [rad/m], elementwise."""
        check_inside(self, wavenumber, zero_allowed=False)
        return LogLog(self.wavenumber, self.density).value(wavenumber)

    def psd_frequency(self, frequency_hz, speed):
        """One-sided S_f(f) = (2π/V) S(2πf/V) [m²/Hz] at f [Hz] and V [m/s], elementwise."""
        check_speed(speed)
        return 2 * np.pi / speed * self.psd(2 * np.pi * frequency_hz / speed)

    def scaled(self, factor: float) -> "Tabulated":
        """The table times a factor."""
        return replace(self, density=tuple(factor * value for value in self.density))

    def mean_square(self) -> float:
        """∫ S(Ω) dΩ [m²] between the first and the last point, exactly."""
        return LogLog(self.wavenumber, self.density).integral(self.wavenumber[0], self.wavenumber[-1])

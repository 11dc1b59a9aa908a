"""The winding as an electrical load: conductor, resistance, inductance, voltage, apparent power and efficiency.

    current density --> cross-section --> R per coil --x coils of a section--> I²R, u, VA, efficiency against length

Current density is rms, for the 200 to 600 A/cm² that the report calls typical (7.4 b); currents are peaks. What is left
out is listed in `dq.NOT_MODELLED`.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from workbench.errors import InputError
from workbench.physics.coils import WireLoop, mutual_inductance
from workbench.physics.motor.dq import DqMotor
from workbench.physics.motor.winding import REPORT_WINDING, Winding
from workbench.result import Result, Row

COPPER = 1.724e-8  # [Ω m] at 20 °C: International Annealed Copper Standard, IEC 60028
ALUMINIUM = 2.828e-8  # [Ω m] at 20 °C: electrical conductor grade, 61 % IACS, IEC 60889
DENSITY_LOW, DENSITY_HIGH = 2e6, 6e6  # [A/m²]: report, Appendix F, 7.4 b
REACH = 24  # coils on either side that count for the inductance; the tail alternates and falls as distance⁻³


@dataclass(frozen=True, slots=True, kw_only=True)
class WindingSection:
    """One phase of a section that is excited as a whole.

    Parameters
    ----------
    winding : Winding
        Its current is the rated peak.
    length : float
        Of the section [m].
    current_density : float
        At rated current, rms [A/m²].
    resistivity : float
        Of the conductor at working temperature [Ω m].

    Source: report, Appendix F, 7.4 a, b; resistivities are ours (IEC 60028, IEC 60889), the report prints none.
    """

    winding: Winding = REPORT_WINDING
    length: float = 1000.0
    current_density: float = 4e6
    resistivity: float = ALUMINIUM

    def __post_init__(self) -> None:
        for name in ("length", "current_density", "resistivity"):
            value = getattr(self, name)
            if not 0 < value < np.inf:
                raise InputError(f"WindingSection.{name} must be positive and finite; got {value!r}. Use SI units.")

    @property
    def conductor_area(self) -> float:
        """Cross-section of the conductor [m²]."""
        return self.winding.current / np.sqrt(2) / self.current_density

    @property
    def coils(self) -> float:
        """Rectangles of one phase in the section."""
        return self.length / self.winding.pole_pitch

    @property
    def conductor_length(self) -> float:
        """Of one phase [m]: every rectangle has its own four sides."""
        return self.coils * 2 * (self.winding.width + self.winding.length)

    @property
    def resistance(self) -> float:
        """Per phase, direct current [Ω]."""
        return self.resistivity * self.conductor_length / self.conductor_area

    @property
    def inductance(self) -> float:
        """Synchronous inductance per phase, own minus mutual to another phase [H]."""
        radius = 0.7788 * np.sqrt(self.conductor_area / np.pi)  # geometric mean distance of a round section, e^{-1/4} r
        return self.coils * _synchronous_inductance(self.winding, float(radius))

    def operation(self, motor: DqMotor, *, i_q: float, speed: float, i_d: float = 0.0) -> "Operation":
        """Voltage, powers and efficiency with one component motor on the section.

        Parameters
        ----------
        motor : DqMotor
            The vehicle's coils above the section.
        i_q, i_d : float
            Currents [A], peak.
        speed : float
            [m/s].

        Raises
        ------
        InputError
            If the currents exceed the winding's rating or the vehicle coils do not fit on the section.
        """
        amplitude = float(np.hypot(i_d, i_q))
        if not amplitude <= self.winding.current * (1 + 1e-9):
            raise InputError(
                f"the current must not exceed the rated {self.winding.current:g} A peak; got {amplitude:g} A. "
                "Lower it or rate the winding higher."
            )
        if motor.coils > self.coils + 1e-9:
            raise InputError(
                f"the section must be at least as long as the motor's {motor.coils} coils; got {self.length:g} m. "
                f"Use {motor.coils * self.winding.pole_pitch:g} m or more."
            )
        u_d, u_q = motor.voltage(i_d, i_q, speed, resistance=self.resistance, inductance=self.inductance)
        loss = 1.5 * self.resistance * amplitude**2
        mechanical = float(motor.thrust(i_d, i_q)) * speed
        return Operation(
            section_length=self.length,
            thrust=float(motor.thrust(i_d, i_q)),
            voltage=float(np.hypot(u_d, u_q)),
            apparent_power=1.5 * float(np.hypot(u_d, u_q)) * amplitude,
            electrical_power=1.5 * float(u_d * i_d + u_q * i_q),
            mechanical_power=mechanical,
            resistive_loss=loss,
        )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Operation(Result):
    """A section at work: length [m], thrust [N], phase voltage [V, peak], powers of three phases [VA, W]."""

    section_length: float
    thrust: float
    voltage: float
    apparent_power: float
    electrical_power: float
    mechanical_power: float
    resistive_loss: float

    @property
    def efficiency(self) -> float:
        """Mechanical over electrical power, resistive loss of the winding only."""
        return self.mechanical_power / self.electrical_power

    @property
    def power_factor(self) -> float:
        """Electrical over apparent power."""
        return self.electrical_power / self.apparent_power

    def rows(self) -> list[Row]:
        return [
            ("section length", self.section_length, "m"),
            ("thrust", self.thrust, "N"),
            ("efficiency", self.efficiency, ""),
            ("power factor", self.power_factor, ""),
            ("phase voltage, peak", self.voltage, "V"),
            ("apparent power", self.apparent_power, "VA"),
            ("mechanical power", self.mechanical_power, "W"),
            ("resistive loss", self.resistive_loss, "W"),
        ]


def operation_over_length(section: WindingSection, lengths, motor: DqMotor, *, i_q: float, speed: float):
    """`Operation` for each section length [m] in `lengths`, other data as in `section`; a tuple."""
    sections = (
        WindingSection(
            winding=section.winding,
            length=float(length),
            current_density=section.current_density,
            resistivity=section.resistivity,
        )
        for length in lengths
    )
    return tuple(item.operation(motor, i_q=i_q, speed=speed) for item in sections)


@lru_cache(maxsize=32)
def _synchronous_inductance(winding: Winding, distance: float) -> float:
    """L_a − M_ab of one rectangle of an endless row [H]; conductors `distance` [m] apart stand for one conductor.

    Phases lie `distance` above each other where they cross, as wound conductors do.
    """
    coil = WireLoop.rectangle(winding.width, winding.length)  # coil axes: x along the track, z normal

    def row(shift: float) -> float:
        total = 0.0
        for k in range(-REACH, REACH + 1):
            weight = 0.5 if abs(k) == REACH else 1.0  # half the last one: the mean of two partial sums that alternate
            place = coil.placed((k * winding.pole_pitch + shift, 0.0, distance))
            total += (-1) ** k * weight * float(mutual_inductance(coil, place))
        return total

    return row(0.0) - row(2 * winding.pole_pitch / 3)

"""What the motor must be rated for: short-term thrust for accelerating, long-term thrust for cruising; fuel of a fan.

    force of one coil and phase × 3/2 × coils = thrust at the winding's peak current
    thrust is proportional to the current ──► current and share of the rating for any thrust

Source: report, Appendix F, 4.3.1 (fuel) and 6.2 (ratings).
"""

import math
from dataclasses import dataclass

from workbench.errors import InfeasibleError
from workbench.physics.propulsion.quantity import count, not_negative, positive
from workbench.result import Result, Row

PHASES = 1.5  # three phases, 120° apart in place and time, make 3/2 of one phase's amplitude (report, eq. 8)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class MotorRating(Result):
    """A synchronous motor at its largest winding current, all coils at zero slip."""

    coil_force: float  # longitudinal force on one vehicle coil by one phase at `current` [N], fundamental
    current: float  # largest winding current [A-turns], peak
    coils: int  # coils on the vehicle

    def __post_init__(self) -> None:
        object.__setattr__(self, "coil_force", positive("MotorRating.coil_force", self.coil_force, "N"))
        object.__setattr__(self, "current", positive("MotorRating.current", self.current, "A"))
        count("MotorRating.coils", self.coils)

    @property
    def thrust(self) -> float:
        """Short-term thrust [N] at the largest current."""
        return PHASES * self.coil_force * self.coils

    def current_for(self, thrust: float) -> float:
        """Winding current [A-turns] for a thrust [N]. Raises InfeasibleError above the rating."""
        wanted = not_negative("thrust", thrust, "N")
        if wanted > self.thrust:
            raise InfeasibleError(
                f"the motor must reach {wanted:.6g} N; {self.coils} coils give {self.thrust:.6g} N "
                f"at {self.current:g} A. Use at least {coils_for(wanted, self.coil_force)} coils or a larger current."
            )
        return self.current * wanted / self.thrust

    def rows(self) -> list[Row]:
        return [
            ("coils", self.coils, ""),
            ("short-term current", self.current, "A"),
            ("short-term thrust", self.thrust, "N"),
        ]


REPORT_MOTOR = MotorRating(coil_force=1340.0, current=1500.0, coils=32)  # report, Appendix F, 6.2


def coils_for(thrust: float, coil_force: float) -> int:
    """The smallest even number of coils, two equal motors, for a thrust [N] at `coil_force` [N] per coil and phase.

    Examples
    --------
    >>> coils_for(64.0e3, 1340.0)
    32
    """
    one_side = positive("thrust", thrust, "N") / (2 * PHASES * positive("coil_force", coil_force, "N"))
    return 2 * math.ceil(one_side * (1 - 1e-12))  # a quotient that is whole but for rounding needs no further pair


def fuel_fraction(*, rate: float, duration: float, mass: float, reserve: float = 0.0) -> float:
    """Fuel over vehicle mass [1]: rate [kg/s] times duration [s] over mass [kg], `reserve` [1] on top.

    Source: report, Appendix F, 4.3.1.

    Examples
    --------
    >>> print(f"{fuel_fraction(rate=2600 / 3600, duration=7200.0, mass=45400.0):.4f}")
    0.1145
    """
    burnt = positive("rate", rate, "kg/s") * positive("duration", duration, "s")
    return burnt * (1 + not_negative("reserve", reserve, "1")) / positive("mass", mass, "kg")

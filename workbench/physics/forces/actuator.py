"""What stands between a command and the current that makes the force.

command ──► Actuator ──► current ──► force law
               ▲ inductance, voltage of motion (of a coil that feels them)

CurrentLoop   a quick inner loop: the current follows the command with a lag
VoltageFed    the command is the voltage: L di/dt = u − R i − (∂λ/∂gap) d(gap)/dt
"""

import math
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from workbench.errors import InputError


@runtime_checkable
class Actuator(Protocol):
    """What equations of motion need to know about a coil's supply."""

    @property
    def command(self) -> str:
        """Name of the signal it obeys."""
        ...

    @property
    def limits(self) -> tuple[float, float]:
        """Least and largest command, in its unit."""
        ...

    @property
    def least_current(self) -> float:
        """The current does not fall below [A]: 0 for a supply of one direction, −∞ for one of both."""
        ...

    def current_rate(self, current, command, inductance, motion_voltage) -> Any:
        """Rate of the current [A/s], elementwise for numbers or symbols.

        inductance : ∂λ/∂i [H];  motion_voltage : (∂λ/∂gap) d(gap)/dt [V]
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentLoop:
    """The current follows its command through 1/(1 + T s); the coil's voltage is the inner loop's affair.

    lag : T [s]
    """

    lag: float
    limits: tuple[float, float] = (-math.inf, math.inf)
    least_current: float = -math.inf
    command: str = "current command"

    def __post_init__(self) -> None:
        _positive("lag", self.lag, "s")

    def current_rate(self, current, command, inductance, motion_voltage):
        """(command − current)/T [A/s]; see Actuator."""
        return (command - current) / self.lag


@dataclass(frozen=True, slots=True, kw_only=True)
class VoltageFed:
    """The command is the voltage over the coil.

    resistance : of coil and supply [Ω];  limits : of the voltage [V];  least_current : 0 where diodes let the current
    flow one way only
    """

    resistance: float
    limits: tuple[float, float] = (-math.inf, math.inf)
    least_current: float = -math.inf
    command: str = "voltage"

    def __post_init__(self) -> None:
        _positive("resistance", self.resistance, "Ω")

    def current_rate(self, current, command, inductance, motion_voltage):
        """(u − R i − motion voltage)/L [A/s]; see Actuator."""
        return (command - self.resistance * current - motion_voltage) / inductance


def _positive(name: str, value: float, unit: str) -> None:
    if not 0 < value < math.inf:
        raise InputError(f"an actuator's {name} must be positive and finite; got {value!r} {unit}.")

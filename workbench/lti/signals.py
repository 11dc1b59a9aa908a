"""Names of a vehicle's signals, shared by those who make a plant and those who close a loop around it.

coordinates Z, Θ, Y, Φ, Ψ;  <coordinate>_rate, <coordinate>_acceleration
per coil set i = 1 … n: command_i, current_i, zeta_i, eta_i, bank_i,
                        gap_i, gap_lateral_i, acceleration_z_i, acceleration_y_i
"""

from dataclasses import dataclass
from enum import StrEnum

COORDINATES = ("Z", "Theta", "Y", "Phi", "Psi")
SYMMETRIC = ("Z", "Theta")
ANTISYMMETRIC = ("Y", "Phi", "Psi")


def numbered(kind: str, count: int) -> list[str]:
    """kind_1 … kind_count.

    Examples
    --------
    >>> numbered("gap", 4)
    ['gap_1', 'gap_2', 'gap_3', 'gap_4']
    """
    return [f"{kind}_{i + 1}" for i in range(count)]


class Quantity(StrEnum):
    """What a signal of a coil set is."""

    COMMAND = "command"
    CURRENT = "current"
    ZETA = "zeta"
    ETA = "eta"
    BANK = "bank"
    GAP = "gap"
    GAP_LATERAL = "gap_lateral"
    ACCELERATION_Z = "acceleration_z"
    ACCELERATION_Y = "acceleration_y"


@dataclass(frozen=True, slots=True)
class SetSignal:
    """A quantity at a coil set, counted from 1."""

    quantity: Quantity
    number: int

    @property
    def name(self) -> str:
        """As plants and laws call it."""
        return f"{self.quantity}_{self.number}"


def set_signals(count: int) -> dict[str, SetSignal]:
    """Every signal that each of `count` coil sets has, by name.

    Examples
    --------
    >>> set_signals(4)["gap_lateral_3"].number
    3
    """
    signals = [SetSignal(quantity, i + 1) for quantity in Quantity for i in range(count)]
    return {signal.name: signal for signal in signals}


def motion(coordinate: str) -> tuple[str, str, str]:
    """Names of a coordinate, its rate and its acceleration."""
    return coordinate, f"{coordinate}_rate", f"{coordinate}_acceleration"


def current_of(pattern: str) -> str:
    """Name of the current that follows the command of a pattern of coil sets."""
    return f"current of {pattern}"

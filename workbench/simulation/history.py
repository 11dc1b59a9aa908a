"""What a simulation returns: the motion over time, and where it touched the guideway."""

from dataclasses import dataclass

import numpy as np

from workbench.errors import unknown_name
from workbench.result import Result, Row

POINT_ROWS = {"z": (0, 1, 3), "y": (2, 4, 3)}


def point_row(place, direction: str) -> np.ndarray:
    """(5,) factors on the accelerations that give the one at (x, y, z), "z" down or "y" right, to first order."""
    if direction not in POINT_ROWS:
        raise unknown_name("direction", direction, POINT_ROWS)
    x, y, z = place
    row = np.zeros(5)
    row[list(POINT_ROWS[direction])] = (1.0, -x, y) if direction == "z" else (1.0, x, -z)
    return row


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Contact(Result):
    """The first touch: time [s], to half an integration step; coil set (counted from 1); "floor" or "wall".

    "diverged" instead of a surface: the numbers left the model's range within one step.
    """

    time: float
    coil_set: int
    surface: str

    def rows(self) -> list[Row]:
        return [("contact after", self.time, "s"), ("coil set", self.coil_set, ""), ("surface", self.surface, "")]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class History(Result):
    """Motion over time, up to the first contact if there was one.

    time : (k,) [s];  pose : (5, k) Z, Θ, Y, Φ, Ψ from the nominal pose;  velocity : (5, k) dZ/dt, q, dY/dt, p, r
    acceleration : (5, k) their derivatives;  current, command : (m, k) α, one per command position
    gap, gap_lateral : (n, k) changes from the nominal gaps [m], one per coil set;  rest : (2, n) the same at rest
    floor, wall : (n,) smallest clearance of each set's filaments [m], over every step
    contact : the first touch, or None;  limited : share of the steps at which a command was cut to its limit
    duration : asked for [s];  warning : a sentence where the step is coarse for the fastest pole
    """

    time: np.ndarray
    pose: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    current: np.ndarray
    command: np.ndarray
    motor: np.ndarray
    motor_command: np.ndarray
    gap: np.ndarray
    gap_lateral: np.ndarray
    rest: np.ndarray
    floor: np.ndarray
    wall: np.ndarray
    contact: Contact | None
    limited: float
    duration: float
    warning: str | None = None

    def point_acceleration(self, place, direction: str) -> np.ndarray:
        """(k,) acceleration at (x, y, z) from the centre of gravity, "z" down or "y" right, to first order."""
        return point_row(place, direction) @ self.acceleration

    def after(self, start: float) -> "History":
        """The part from a time [s] on; smallest clearances stay those of the whole."""
        kept = self.time >= start
        parts = {name: getattr(self, name)[..., kept] for name in (
            "time", "pose", "velocity", "acceleration", "current", "command", "motor", "motor_command", "gap",
            "gap_lateral")}  # fmt: skip
        whole = ("rest", "floor", "wall", "contact", "limited", "duration", "warning")
        rest = {name: getattr(self, name) for name in whole}
        return History(**parts, **rest)

    def rows(self) -> list[Row]:
        swing = self.gap - self.rest[0][:, None]
        sideways = self.gap_lateral - self.rest[1][:, None]
        touched = "none" if self.contact is None else f"set {self.contact.coil_set}, {self.contact.surface}"
        return [
            ("simulated", float(self.time[-1]) if len(self.time) else 0.0, "s"),
            ("contact", touched, ""),
            ("largest gap change", float(np.abs(swing).max(initial=0.0)), "m"),
            ("largest lateral gap change", float(np.abs(sideways).max(initial=0.0)), "m"),
            ("smallest clearance, floor", float(self.floor.min()), "m"),
            ("smallest clearance, wall", float(self.wall.min()), "m"),
            ("largest current", float(np.abs(self.current).max(initial=0.0)), "of main coil"),
            ("commands at their limit", self.limited, "of the time"),
        ]

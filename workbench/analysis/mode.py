"""Modes: what each eigenvalue looks like, and which coordinate moves most in it."""

from dataclasses import dataclass

import numpy as np

from workbench.control.loop import Subject
from workbench.lti import Plant
from workbench.result import Result, Row

NAMES = {"Z": "heave", "Theta": "pitch", "Y": "sway", "Phi": "roll", "Psi": "yaw"}
REAL = 1e-9  # imaginary part over modulus below which a pole counts as real
FILTER_SHARE = 1e-6  # of the state's energy in coordinates below which a mode lives in filters alone


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Mode(Result):
    """One pole or conjugate pair: name, |p|/2π [Hz], −Re p/|p|, and the pole with Im p >= 0 [rad/s]."""

    name: str
    frequency_hz: float
    damping: float
    pole: complex

    @property
    def oscillates(self) -> bool:
        """Whether the pole has an imaginary part."""
        return abs(self.pole.imag) > REAL * abs(self.pole)

    def rows(self) -> list[Row]:
        return [("mode", self.name, ""), ("frequency", self.frequency_hz, "Hz"), ("damping", self.damping, "1")]


def modes_of(subject: Subject, closed: Plant) -> list[Mode]:
    """Modes of a group's closed loop, named after the coordinate with the largest kinetic energy."""
    inertia = _inertia(subject.plant)
    values, vectors = np.linalg.eig(closed.A)
    at = closed.index("states", [f"{c}_rate" for c in subject.coordinates])
    weights = np.array([inertia[c] for c in subject.coordinates])
    out = []
    for value, vector in zip(values, vectors.T, strict=True):
        if value.imag < -REAL * abs(value):
            continue
        energy = weights * np.abs(vector[at]) ** 2
        name = NAMES[subject.coordinates[int(np.argmax(energy))]] if _moves(vector, at, weights) else "filter"
        out.append(
            Mode(
                name=name,
                frequency_hz=float(abs(value) / (2 * np.pi)),
                damping=float(-value.real / abs(value)),
                pole=complex(value),
            )
        )
    return out


def _moves(vector: np.ndarray, at: list[int], weights: np.ndarray) -> bool:
    """Whether the body takes part: its rates against the whole eigenvector, scaled to the heaviest coordinate."""
    body = np.sqrt(weights / weights.max()) * np.abs(vector[at])
    return bool(np.linalg.norm(body) > FILTER_SHARE * np.linalg.norm(vector))


def _inertia(plant: Plant) -> dict[str, float]:
    """Mass and moments of inertia, from the acceleration per external load."""
    loads = {"Z": "force_z", "Theta": "moment_pitch", "Y": "force_y", "Phi": "moment_roll", "Psi": "moment_yaw"}
    out = {}
    for coordinate, load in loads.items():
        rate = f"{coordinate}_rate"
        if rate in plant.states:
            out[coordinate] = 1.0 / float(plant.B[plant.index("states", [rate])[0], plant.index("inputs", [load])[0]])
    return out

"""Spectra of a vehicle on its guideway: densities of accelerations, gaps and currents.

    Setting, Gains --response of each group × spectra of A1…A4--> Spectra

One-sided, per hertz; frequency in Hz. The wheel base is in the phases of the inputs. Each type of irregularity acts
through the group of motion it excites, as in `analysis.response`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.analysis.response import exciting_types, guideway_response, point_acceleration
from workbench.analysis.setting import Setting
from workbench.control import Gains
from workbench.errors import InputError, unknown_name
from workbench.physics.guideway.irregularity import TYPES, phasors
from workbench.result import Result, Row

ENDS = ("front", "rear")
UNITS = {"acceleration_z": "m/s²", "acceleration_y": "m/s²", "gap": "m", "gap_lateral": "m", "current": "1"}
SHOWN_HZ = (0.03, 30.0)  # a decade below the slowest mode of the shipped vehicle, above it nothing is left
NUMBER_OF_POINTS = 361


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Spectra(Result):
    """Densities of a vehicle's response, one-sided per hertz.

    frequency_hz : (k,)
    density : (quantity, place) to (k,); quantities acceleration_z, acceleration_y [(m/s²)²/Hz] at the setting's points,
        gap, gap_lateral [m²/Hz] and current [1/Hz] at front and rear
    """

    frequency_hz: np.ndarray
    density: dict[tuple[str, str], np.ndarray]

    @property
    def low_hz(self) -> float:
        """Lowest frequency."""
        return float(self.frequency_hz[0])

    @property
    def high_hz(self) -> float:
        """Highest frequency."""
        return float(self.frequency_hz[-1])

    def of(self, quantity: str) -> dict[str, np.ndarray]:
        """Place to density of one quantity."""
        found = {place: values for (name, place), values in self.density.items() if name == quantity}
        if not found:
            raise unknown_name("quantity", quantity, {name for name, _ in self.density})
        return found

    def rms(self, quantity: str, place: str) -> float:
        """Root of the area under one density over the frequencies given (trapezoidal rule)."""
        return float(np.sqrt(np.trapezoid(self.density[quantity, place], self.frequency_hz)))

    def to_dict(self) -> dict:
        """Frequencies, and densities by quantity and place."""
        quantities = dict.fromkeys(name for name, _ in self.density)
        document = {q: {place: values.tolist() for place, values in self.of(q).items()} for q in quantities}
        return {"frequency_hz": self.frequency_hz.tolist(), **document}

    def rows(self) -> list[Row]:
        band = f"{self.low_hz:g} to {self.high_hz:g} Hz"
        return [(f"rms {q}, {place}, {band}", self.rms(q, place), UNITS[q]) for q, place in self.density]


def response_spectra(
    setting: Setting, gains: Gains, frequency_hz: Sequence[float] | np.ndarray | None = None
) -> Spectra:
    """The densities of a stable vehicle's response.

    Parameters
    ----------
    frequency_hz : (k,) increasing, positive; 0.03 … 30 Hz, evenly on a logarithmic axis, if left out

    Raises
    ------
    InputError
        If the frequencies do not rise from a positive one, or the loop is unstable.
    """
    f = np.geomspace(*SHOWN_HZ, NUMBER_OF_POINTS) if frequency_hz is None else np.asarray(frequency_hz, float)
    if f.ndim != 1 or len(f) < 2 or not f[0] > 0 or np.any(np.diff(f) <= 0) or not np.isfinite(f[-1]):
        raise InputError(
            f"frequencies must rise from a positive one, at least two; got shape {f.shape}. Give Hz in order."
        )
    omega = 2 * np.pi * f
    waves = phasors(setting.sets, setting.speed, omega)
    keys: list[tuple[str, str]] = []
    total: np.ndarray | None = None
    for subject in setting.subjects:
        closed = subject.close(gains)
        if closed.poles().real.max() >= 0:
            raise InputError(
                f"spectra need a stable loop; {subject.name} is unstable under these gains. Change the gains."
            )
        keys, rows = looked_at(setting, closed.outputs)
        acting = [TYPES.index(t) for t in exciting_types(setting, subject)]
        transfer = np.zeros((len(f), len(rows), len(TYPES)), complex)
        transfer[:, :, acting] = rows @ guideway_response(setting, closed, omega, waves[:, :, acting])
        total = transfer if total is None else total + transfer
    assert total is not None  # a setting has at least one group
    density = np.einsum("kij,kjl,kil->ik", total, setting.guideway.amplitude_psd(f, setting.speed), total.conj()).real
    density = np.maximum(density, 0.0)  # a sum of squares in complex arithmetic: rounding may go below an exact zero
    return Spectra(frequency_hz=f, density=dict(zip(keys, density, strict=True)))


def looked_at(setting: Setting, names: Sequence[str]) -> tuple[list[tuple[str, str]], np.ndarray]:
    """Keys, and rows over a loop's outputs, of everything a Spectra holds."""
    keys, rows = [], []
    for direction in "zy":
        for point, place in setting.points.items():
            keys.append((f"acceleration_{direction}", point))
            rows.append(point_acceleration(names, place, direction))
    for end, i in zip(ENDS, setting.ends, strict=True):
        for kind in ("gap", "gap_lateral", "current"):
            row = np.zeros(len(names))
            row[list(names).index(f"{kind}_{i + 1}")] = 1.0
            keys.append((kind, end))
            rows.append(row)
    return keys, np.array(rows)

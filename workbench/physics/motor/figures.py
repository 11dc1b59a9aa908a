"""Data of the report's Figures 4 to 20: what each plots, computed.

    figure("7")  -->  Figure: abscissa and curves  -->  workbench.plots.motor

The report's pictures are lost but for their captions; ranges that no caption or text gives are ours: lateral to ±20 cm
and gaps 15 to 45 cm as in 5.4.1, roll to ±6°, pitch and yaw to 1.06° as in 5.4.3. Figures 14 to 16 are of two coils
whose distance and pivot are lost: two pole pitches apart and about the middle here, which comes nearest.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from workbench.errors import unknown_name
from workbench.physics.motor.lin_motor import CENTRED, profile
from workbench.physics.motor.phasor import mutual_phasor
from workbench.physics.motor.pose import COMPONENTS, UNITS
from workbench.physics.motor.winding import REPORT_COIL, REPORT_GAP, REPORT_WINDING
from workbench.result import Result, Row

ARM = 0.82  # [m] magnets to the vehicle's centre, report 6.3
MUTUAL_GAP = 2 * ARM - REPORT_GAP  # [m] magnets to the other side's winding
ANGLE = np.radians(1.06)  # largest pitch and yaw of 5.4.3
ROLL = np.radians(6.0)
OFFSETS = (0.0, 0.10, 0.20)  # [m] lateral displacements of figures 7 to 12


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """One curve: label, unit and values (k,)."""

    label: str
    unit: str
    values: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Figure(Result):
    """A figure of the report: number, title, name and unit of the abscissa, its values (k,) and the curves over it."""

    number: str
    title: str
    abscissa: str
    unit: str
    values: np.ndarray
    curves: tuple[Curve, ...]

    def rows(self) -> list[Row]:
        return [(f"largest {c.label}", float(np.abs(c.values).max()), c.unit) for c in self.curves]


def figure(number: str) -> Figure:
    """The data of one figure.

    Parameters
    ----------
    number : str
        "4a", "4b", "5" … "12", "13a", "13b", "14" … "20".

    Raises
    ------
    InputError
        If the report has no such figure.

    Source: report, Appendix F, captions of figures 4 to 20.
    """
    if number not in FIGURES:
        raise unknown_name("figure", number, FIGURES)
    return FIGURES[number](number)


def two_coil_amplitudes(axis: int, angles, spacing: float = 2 * REPORT_WINDING.pole_pitch) -> np.ndarray:
    """(k, 6) amplitudes of two coils `spacing` apart, turned together about the point midway between them.

    Parameters
    ----------
    axis : int
        3 pitch, 4 yaw, 5 roll.
    angles : (k,) array_like
        [rad].
    spacing : float
        A multiple of the pole pitch [m]; the coils' polarities follow.

    Source: report, Appendix F, 5.4.3, figures 14 to 16.
    """
    poses = np.zeros((len(np.atleast_1d(angles)), 6))
    poses[:, 1], poses[:, axis] = REPORT_GAP, angles
    return np.abs(_two_coils(poses, spacing))


def _two_coils(poses: np.ndarray, spacing: float = 2 * REPORT_WINDING.pole_pitch) -> np.ndarray:
    """(k, 6) complex forces and torques of the two."""
    total = np.zeros((len(poses), 6), complex)
    for end in (-0.5, 0.5):
        placed = poses.copy()
        placed[:, 2] = end * spacing
        phasor = mutual_phasor(placed, REPORT_WINDING, REPORT_COIL, pivot=(0.0, 0.0, -end * spacing), order=1)
        total += np.exp(-1j * REPORT_WINDING.wave_number * end * spacing) * phasor.gradient
    return REPORT_WINDING.current * REPORT_COIL.ampere_turns * total


def _signed(forces: np.ndarray) -> np.ndarray:
    """Amplitudes with the sign that each component has in its own axis, so that odd ones show as odd.

    A component's own axis is the one in which most of it acts over the sweep: d with a repelling, q with a driving
    current.
    """
    parts = np.stack([-forces.real, forces.imag])
    own = np.abs(parts).sum(axis=1).argmax(axis=0)
    return np.copysign(np.abs(forces), np.where(own == 0, parts[0], parts[1]))


def _one_coil(poses: np.ndarray) -> np.ndarray:
    """(k, 6) complex forces and torques of one coil and one phase."""
    phasor = mutual_phasor(poses, REPORT_WINDING, REPORT_COIL, order=1)
    return REPORT_WINDING.current * REPORT_COIL.ampere_turns * phasor.gradient


def _profile(number: str, title: str, components: slice, pose=CENTRED, pivot=(0.0, 0.0, 0.0)) -> Figure:
    found = profile(pose, pivot=pivot)
    return _figure(number, title, "slip", "m", found.slip, found.wrench, components)


def _sweep(number: str, title: str, abscissa: str, axis: int, values: np.ndarray, components: slice) -> Figure:
    poses = np.tile(CENTRED, (len(values), 1))
    poses[:, axis] = values
    return _figure(number, title, abscissa, "m" if axis < 3 else "rad", values, _signed(_one_coil(poses)), components)


def _figure(number, title, abscissa, unit, values, forces, components: slice) -> Figure:
    labels = zip(COMPONENTS[components], UNITS[components], forces.T[components], strict=True)
    curves = tuple(Curve(label=label, unit=unit, values=row) for label, unit, row in labels)
    return Figure(number=number, title=title, abscissa=abscissa, unit=unit, values=values, curves=curves)


def _gap(number: str) -> Figure:
    index = int(number) - 7
    gaps = np.linspace(0.15, 0.45, 31)
    curves = []
    for offset in OFFSETS:
        poses = np.zeros((len(gaps), 6))
        poses[:, 0], poses[:, 1] = offset, gaps
        values = np.abs(_one_coil(poses)[:, index])
        curves.append(Curve(label=f"{COMPONENTS[index]} at x = {offset:.1f} m", unit=UNITS[index], values=values))
    title = f"Fundamental of {COMPONENTS[index]} over the gap"
    return Figure(number=number, title=title, abscissa="gap y", unit="m", values=gaps, curves=tuple(curves))


def _pair(number: str, title: str, abscissa: str, axis: int, picked: tuple[int, ...]) -> Figure:
    angles = np.linspace(-ANGLE, ANGLE, 21)
    poses = np.tile(CENTRED, (len(angles), 1))
    poses[:, axis] = angles
    forces = _signed(_two_coils(poses))
    curves = tuple(Curve(label=COMPONENTS[i], unit=UNITS[i], values=forces[:, i]) for i in picked)
    return Figure(number=number, title=title, abscissa=abscissa, unit="rad", values=angles, curves=curves)


_FORCES, _TORQUES, _ALONG = slice(0, 3), slice(3, 6), slice(1, 4)
_ASIDE = (0.10, *CENTRED[1:])
_CENTRE = (0.0, -ARM, 0.0)
_LATERAL = np.linspace(-0.20, 0.20, 41)
_ROLLS = np.linspace(-ROLL, ROLL, 41)

FIGURES: dict[str, Callable[[str], Figure]] = {
    "4a": lambda n: _profile(n, "Single-phase forces, coil 10 cm aside", _FORCES, _ASIDE),
    "4b": lambda n: _profile(n, "Single-phase torques, coil 10 cm aside", _TORQUES, _ASIDE),
    "5": lambda n: _sweep(n, "Fundamental of forces over lateral displacement", "x", 0, _LATERAL, _FORCES),
    "6": lambda n: _sweep(n, "Fundamental of torques over lateral displacement", "x", 0, _LATERAL, _TORQUES),
    **dict.fromkeys(("7", "8", "9", "10", "11", "12"), _gap),
    "13a": lambda n: _sweep(n, "Fundamental of forces over roll", "roll", 5, _ROLLS, _FORCES),
    "13b": lambda n: _sweep(n, "Fundamental of torques over roll", "roll", 5, _ROLLS, _TORQUES),
    "14": lambda n: _pair(n, "Two coils over pitch", "pitch", 3, (1, 2, 3)),
    "15": lambda n: _pair(n, "Two coils over yaw: even components", "yaw", 4, (1, 2, 3)),
    "16": lambda n: _pair(n, "Two coils over yaw: odd components", "yaw", 4, (0, 4, 5)),
    "17": lambda n: _profile(n, "One motor, torque about the vehicle's centre", _ALONG, CENTRED, _CENTRE),
    "18": lambda n: _profile(
        n, "Magnets in the other side's winding", _ALONG, (0.0, MUTUAL_GAP, 0.0, 0.0, 0.0, 0.0), _CENTRE
    ),
    "19": lambda n: _profile(n, "Torques about the vehicle's centre, 10 cm too high", _TORQUES, _ASIDE, _CENTRE),
    "20": lambda n: _profile(
        n, "Torques about the vehicle's centre, 20 cm too high", _TORQUES, (0.20, *CENTRED[1:]), _CENTRE
    ),
}

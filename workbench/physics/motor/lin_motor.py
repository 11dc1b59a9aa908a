"""What the report's program LINMOTR computes: force and torque profiles along one phase, and their Fourier components.

    pose, pivot  --harmonics m = 1, 3, 5 …-->  Components  --Σ Re c_m e^{imκz}-->  Profile over z or over slip

The report differentiates a coil sum numerically at many places along the winding and Fourier-analyses the result. Here
every harmonic is analytic in z, so one evaluation per harmonic gives the components, and the profile is their sum.
"""

from dataclasses import dataclass

import numpy as np

from workbench.physics.motor.kernel import harmonics
from workbench.physics.motor.phasor import coil_geometry, mutual_phasor
from workbench.physics.motor.pose import COMPONENTS, UNITS
from workbench.physics.motor.winding import REPORT_COIL, REPORT_GAP, REPORT_WINDING, VehicleCoil, Winding
from workbench.result import Result, Row

CENTRED = (0.0, REPORT_GAP, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Components(Result):
    """Fourier components of one coil and one phase: component i at z is Re Σ_m complex[m, i] e^{imκz}.

    harmonic : (n,) odd numbers m
    complex : (n, 6)  of F_x, F_y, F_z [N], T_x, T_y, T_z [N m]; its modulus is the amplitude
    wave_number : κ [rad/m]
    """

    harmonic: np.ndarray
    complex: np.ndarray
    wave_number: float

    @property
    def amplitude(self) -> np.ndarray:
        """(n, 6) amplitudes."""
        return np.abs(self.complex)

    def at(self, z) -> np.ndarray:
        """(k, 6) forces and torques at the places z [m], relative to the pose they were computed for."""
        angle = np.multiply.outer(np.atleast_1d(np.asarray(z, dtype=float)), self.harmonic * self.wave_number)
        return np.real(np.exp(1j * angle) @ self.complex)

    def rows(self) -> list[Row]:
        return [
            (f"{name}, harmonic {m}", float(value), unit)
            for m, row in zip(self.harmonic, self.amplitude, strict=True)
            for name, value, unit in zip(COMPONENTS, row, UNITS, strict=True)
        ]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Profile(Result):
    """Forces and torques of one coil and one phase along the winding.

    slip : (k,)  distance the coil lags behind the crest of thrust [m]
    wrench : (k, 6)  F_x, F_y, F_z [N], T_x, T_y, T_z [N m]
    """

    slip: np.ndarray
    wrench: np.ndarray

    @property
    def maximum(self) -> np.ndarray:
        """(6,) largest magnitude of each component over the profile."""
        return np.abs(self.wrench).max(axis=0)

    def rows(self) -> list[Row]:
        figures = zip(COMPONENTS, self.maximum, UNITS, strict=True)
        return [(f"largest {name}", float(value), unit) for name, value, unit in figures]


def components(
    pose=CENTRED,
    *,
    winding: Winding = REPORT_WINDING,
    coil: VehicleCoil = REPORT_COIL,
    pivot=(0.0, 0.0, 0.0),
    highest: int | None = None,
) -> Components:
    """Fourier components along the winding of the forces and torques of one coil and one phase.

    Parameters
    ----------
    pose : (6,) array_like
        x, y, z [m], pitch, yaw, roll [rad].
    winding, coil
        Geometry and currents.
    pivot : (3,) array_like
        From the coil's centre to the point of reference of torques [m].
    highest : int, optional
        Last harmonic; when left out, all that are stronger than 1e-12 of the fundamental at the lowest corner.

    Source: report, Appendix F, eq. (2) and 5.1.3.
    """
    orders = harmonics(coil_geometry(pose, coil, pivot), winding)
    if highest is not None:
        orders = tuple(range(1, highest + 1, 2))
    currents = winding.current * coil.ampere_turns
    found = [mutual_phasor(pose, winding, coil, harmonic=m, pivot=pivot, order=1).gradient[0] for m in orders]
    return Components(
        harmonic=np.array(orders), complex=currents * np.array(found), wave_number=float(winding.wave_number)
    )


def profile(
    pose=CENTRED,
    *,
    winding: Winding = REPORT_WINDING,
    coil: VehicleCoil = REPORT_COIL,
    pivot=(0.0, 0.0, 0.0),
    slip=None,
    highest: int | None = None,
) -> Profile:
    """Forces and torques of one coil and one phase as functions of slip.

    Parameters
    ----------
    pose, winding, coil, pivot, highest
        As in `components`; z of the pose shifts the origin.
    slip : (k,) array_like, optional
        [m]; 97 places over one pole pitch, from −1/2 to +1/2, when left out. The coil at slip s is half a pole pitch
        and s behind the centre of a positive rectangle, so thrust is +cos κs and normal force +sin κs.

    Source: report, Appendix F, 5.1.3, figures 4 and 17 to 20.
    """
    slip = np.linspace(-0.5, 0.5, 97) * winding.pole_pitch if slip is None else np.atleast_1d(np.asarray(slip, float))
    found = components(pose, winding=winding, coil=coil, pivot=pivot, highest=highest)
    return Profile(slip=slip, wrench=found.at(-winding.pole_pitch / 2 - slip))

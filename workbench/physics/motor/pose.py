"""Forces, torques and stiffness of one vehicle coil and one phase of the winding, in any pose about any pivot.

    Phasor (per ampere²)  --times currents-->  PoseForces: d axis (real part), q axis (imaginary part), amplitudes

d axis: the phase current's pattern stands where it links the most flux of an unturned coil at z = 0 (positive current
attracts). q axis: the pattern half a pole pitch ahead of that, which gives thrust. A coil that runs at slip against
the pattern is a coil at z ≠ 0. Three balanced phases give 3/2 of all this (report, Appendix F, eqs. 11 and 12).
"""

from dataclasses import dataclass

import numpy as np

from workbench.physics.motor.kernel import ACCURACY
from workbench.physics.motor.phasor import mutual_phasor
from workbench.physics.motor.winding import REPORT_COIL, REPORT_WINDING, VehicleCoil, Winding
from workbench.result import Result, Row

COMPONENTS = ("F_x", "F_y", "F_z", "T_x", "T_y", "T_z")
UNITS = ("N", "N", "N", "N m", "N m", "N m")


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PoseForces(Result):
    """What one phase does to one coil in one pose.

    pose : (6,)  x, y, z [m], pitch, yaw, roll [rad]
    pivot : (3,)  from the coil's centre to the point of reference of torques [m]
    harmonic : m
    inductance : M_m [H], complex
    d, q : (6,)  F_x, F_y, F_z [N], T_x, T_y, T_z [N m] at rated current in the d and in the q axis
    stiffness_d, stiffness_q : (6, 6)  their derivatives by x, y, z, pitch, yaw, roll [N/m, N/rad, N, N m/rad]

    Torques are moments about the winding's axes, so a stiffness has an antisymmetric part where a torque acts: half of
    it in (pitch, yaw, roll), none at rest.
    """

    pose: np.ndarray
    pivot: np.ndarray
    harmonic: int
    inductance: complex
    d: np.ndarray
    q: np.ndarray
    stiffness_d: np.ndarray
    stiffness_q: np.ndarray

    @property
    def amplitude(self) -> np.ndarray:
        """(6,) largest value of each component while the pattern passes."""
        return np.abs(self.d + 1j * self.q)

    @property
    def force(self) -> np.ndarray:
        """(3,) amplitudes [N]."""
        return self.amplitude[:3]

    @property
    def torque(self) -> np.ndarray:
        """(3,) amplitudes [N m]."""
        return self.amplitude[3:]

    def thrust(self, coils: int = 1) -> float:
        """Of `coils` coils under three phases, all current in the q axis [N]."""
        return 1.5 * coils * float(self.amplitude[2])

    def normal(self, coils: int = 1) -> float:
        """Normal force of `coils` coils under three phases, all current in the d axis [N], magnitude."""
        return 1.5 * coils * float(self.amplitude[1])

    def rows(self) -> list[Row]:
        figures = zip(COMPONENTS, self.amplitude, UNITS, strict=True)
        return [
            *((f"amplitude of {name}", float(value), unit) for name, value, unit in figures),
            ("thrust of three phases", self.thrust(), "N"),
            ("normal force of three phases", self.normal(), "N"),
            ("mutual inductance", abs(self.inductance), "H"),
            *((f"d stiffness {n}", float(self.stiffness_d[i, i]), u) for i, (n, u) in enumerate(_DIAGONAL)),
        ]


_DIAGONAL = tuple(zip(("x", "y", "z", "pitch", "yaw", "roll"), ("N/m",) * 3 + ("N m/rad",) * 3, strict=True))


def pose_forces(
    pose=(0.0, 0.3, 0.0, 0.0, 0.0, 0.0),
    *,
    winding: Winding = REPORT_WINDING,
    coil: VehicleCoil = REPORT_COIL,
    pivot=(0.0, 0.0, 0.0),
    harmonic: int = 1,
    accuracy: float = ACCURACY,
) -> PoseForces:
    """Forces, torques and stiffness of one coil and one phase.

    Parameters
    ----------
    pose : (6,) array_like
        x, y, z [m], pitch, yaw, roll [rad]; see `mutual_phasor`.
    winding, coil
        Geometry and currents; the report's 1 m × 1.1 m, 1.5 kA and 500 kA-turns unless given.
    pivot : (3,) array_like
        From the unturned coil's centre to the point about which it turns and torques are taken [m].
    harmonic : int
        m, odd.
    accuracy : float
        Of the quadrature.

    Raises
    ------
    InputError
        If the pose is not six finite numbers or the coil reaches into the winding.

    Source: report, Appendix F, eqs. (21), (24).

    Examples
    --------
    >>> found = pose_forces((0.0, 0.30, 0.0, 0.0, 0.0, 0.0))
    >>> print(f"{found.thrust(32):.5g} N")  # 32 coils, three phases
    64312 N
    """
    phasor = mutual_phasor(pose, winding, coil, pivot=pivot, harmonic=harmonic, accuracy=accuracy)
    currents = winding.current * coil.ampere_turns
    wrench, stiffness = currents * phasor.gradient[0], currents * phasor.hessian[0]
    return PoseForces(
        pose=np.asarray(pose, dtype=float),
        pivot=np.asarray(pivot, dtype=float),
        harmonic=harmonic,
        inductance=complex(phasor.value[0]),
        d=wrench.real,
        q=wrench.imag,
        stiffness_d=stiffness.real,
        stiffness_q=stiffness.imag,
    )


def amplitudes(
    poses,
    *,
    winding: Winding = REPORT_WINDING,
    coil: VehicleCoil = REPORT_COIL,
    pivot=(0.0, 0.0, 0.0),
    harmonic: int = 1,
) -> np.ndarray:
    """(k, 6) amplitudes of F_x … T_z [N, N m] of one coil and one phase over (k, 6) poses."""
    phasor = mutual_phasor(poses, winding, coil, pivot=pivot, harmonic=harmonic, order=1)
    return winding.current * coil.ampere_turns * np.abs(phasor.gradient)

"""The hybrid motor on the vehicle: two component motors, from currents to forces and moments about its centre.

    (i_d, i_q) right, left  --one energy W = 3/2 I_v Σ Re M (i_d − j i_q)-->  X, Y, Z, L, M, N, stiffness, input matrix

Vehicle axes: X forward, Y right, Z down about the centre of gravity; pose (Z, Θ, Y, Φ, Ψ) by yaw, pitch and roll in
that order. Both windings face outwards, the magnets of each side outside of them. Axes of the right motor: x = −Z, y
= Y, z = X; of the left: x = Z, y = −Y, z = X. So a current i_d > 0 draws a side's magnets inwards and i_q > 0 drives
forward.

Forces are along the axes of the guideway and moments about those of the body, as in the vehicle's equations. The
windings' pattern keeps pace with the vehicle; X moves the vehicle against it.
"""

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from workbench.errors import InputError
from workbench.physics.motor.phasor import pulled_back, rectangle
from workbench.physics.motor.winding import REPORT_COIL, REPORT_WINDING, VehicleCoil, Winding
from workbench.result import Result, Row

COORDINATES = ("X", "Z", "Theta", "Y", "Phi", "Psi")  # of a pose, and of the force or moment that belongs to each
CURRENTS = ("i_dR", "i_qR", "i_dL", "i_qL")
COUPLINGS = {"none": 0.0, "mirrored": -1.0, "parallel": 1.0}
RIGHT, LEFT = 1.0, -1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class HybridMotor:
    """Two component motors, one on each side of the vehicle.

    Parameters
    ----------
    winding, coil
        Of each component motor; the winding's current is the rated one.
    coils : int
        Vehicle coils on each side.
    spacing : float, optional
        Of their centres [m], a multiple of the pole pitch, the row centred below the centre of gravity; the pole pitch
        when left out. Polarities follow so that all coils of a side push alike.
    magnet_offset, winding_offset : float
        Distance of magnets and windings from the plane of symmetry [m]; the gap is their difference.
    drop : float
        z_L, how far the motors lie below the centre of gravity [m]. The report does not print it.
    coupling : {"none", "mirrored", "parallel"}
        Whether a side's magnets feel the other side's winding too: not at all (the report's control equations), with
        the magnets' moments pointing outwards on both sides, or both to the right.

    Source: report, Appendix F, 6.1 to 6.3: 16 coils a side, magnets at 0.82 m, gaps 0.30 m and 1.34 m.
    """

    winding: Winding = REPORT_WINDING
    coil: VehicleCoil = REPORT_COIL
    coils: int = 16
    spacing: float | None = None
    magnet_offset: float = 0.82
    winding_offset: float = 0.52
    drop: float = 0.0
    coupling: str = "none"

    def __post_init__(self) -> None:
        if self.coils < 1:
            raise InputError(
                f"HybridMotor.coils must be at least 1; got {self.coils!r}. The report has 16 on each side."
            )
        if not 0 < self.winding_offset < self.magnet_offset < np.inf:
            raise InputError(
                "the magnets must lie outside the windings, 0 < winding_offset < magnet_offset; "
                f"got {self.winding_offset!r} m and {self.magnet_offset!r} m. The report has 0.52 m and 0.82 m."
            )
        if not np.isfinite(self.drop):
            raise InputError(f"HybridMotor.drop must be finite; got {self.drop!r}. Give z_L in metres.")
        poles = self.step / self.winding.pole_pitch
        if not (poles >= 0.5 and abs(poles - round(poles)) < 1e-9 * poles):
            raise InputError(
                f"the spacing must be a multiple of the pole pitch {self.winding.pole_pitch!r} m; "
                f"got {self.spacing!r} m. Otherwise the coils of a side do not push alike."
            )
        if self.coupling not in COUPLINGS:
            raise InputError(f"coupling must be one of {', '.join(COUPLINGS)}; got {self.coupling!r}. Use 'none'.")

    @property
    def step(self) -> float:
        """Distance of two neighbouring coils [m]."""
        return self.winding.pole_pitch if self.spacing is None else self.spacing

    @property
    def stations(self) -> np.ndarray:
        """(coils,) X of the coil centres [m]."""
        return (np.arange(self.coils) - (self.coils - 1) / 2) * self.step

    def forces(self, currents=(0.0, 0.0, 0.0, 0.0), pose=(0.0,) * 6) -> "HybridForces":
        """Forces and moments, their stiffness and their dependence on the currents.

        Parameters
        ----------
        currents : (4,) array_like
            i_d and i_q of the right, then of the left motor [A], peak.
        pose : (6,) array_like
            X, Z [m], Θ [rad], Y [m], Φ, Ψ [rad] of the vehicle against the synchronous pattern.

        Raises
        ------
        InputError
            If a current or coordinate is not finite, or a coil reaches into a winding.
        """
        currents = _checked(currents, 4, "currents", "i_dR, i_qR, i_dL, i_qL in amperes")
        pose = _checked(pose, 6, "pose", "X, Z, Theta, Y, Phi, Psi in metres and radians")
        inputs, stiffness = _maps(self, tuple(pose.tolist()))
        return HybridForces(
            currents=currents,
            pose=pose,
            wrench=inputs @ currents,
            full_stiffness=np.tensordot(currents, stiffness, axes=1),
            full_input_matrix=inputs.copy(),
        )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class HybridForces(Result):
    """What the hybrid motor does to the vehicle at given currents, in a given pose.

    currents : (4,)  i_dR, i_qR, i_dL, i_qL [A]
    pose : (6,)  X, Z, Θ, Y, Φ, Ψ
    wrench : (6,)  force X, force Z [N], moment M [N m], force Y [N], moments L, N [N m]; order of the coordinates
    full_stiffness : (6, 6)  derivative of wrench by pose at constant currents; positive on the diagonal is unstable
    full_input_matrix : (6, 4)  derivative of wrench by currents [N/A, N m/A]
    """

    currents: np.ndarray
    pose: np.ndarray
    wrench: np.ndarray
    full_stiffness: np.ndarray
    full_input_matrix: np.ndarray

    @property
    def stiffness(self) -> np.ndarray:
        """(5, 5) derivative of (Z, M, Y, L, N) by (Z, Θ, Y, Φ, Ψ): add to the vehicle's."""
        return self.full_stiffness[1:, 1:]

    @property
    def input_matrix(self) -> np.ndarray:
        """(5, 4) derivative of (Z, M, Y, L, N) by (i_dR, i_qR, i_dL, i_qL)."""
        return self.full_input_matrix[1:]

    @property
    def thrust_row(self) -> np.ndarray:
        """(4,) derivative of the thrust X by the currents [N/A]."""
        return self.full_input_matrix[0]

    def rows(self) -> list[Row]:
        names = (("X", "N"), ("Z", "N"), ("M", "N m"), ("Y", "N"), ("L", "N m"), ("N", "N m"))
        units = ("N/m", "N m/rad", "N/m", "N m/rad", "N m/rad")
        return [
            *((name, float(value), unit) for (name, unit), value in zip(names, self.wrench, strict=True)),
            *(
                (f"stiffness {name}", float(self.stiffness[i, i]), unit)
                for i, (name, unit) in enumerate(zip(COORDINATES[1:], units, strict=True))
            ),
        ]


def vehicle_rotation(Phi, Theta, Psi):
    """Body to guideway axes, (3, 3): R_Z(Ψ) R_Y(Θ) R_X(Φ); scalar or SX."""
    cf, sf, ct, st, cp, sp = ca.cos(Phi), ca.sin(Phi), ca.cos(Theta), ca.sin(Theta), ca.cos(Psi), ca.sin(Psi)
    yaw = ca.vertcat(ca.horzcat(cp, -sp, 0), ca.horzcat(sp, cp, 0), ca.horzcat(0, 0, 1))
    pitch = ca.vertcat(ca.horzcat(ct, 0, st), ca.horzcat(0, 1, 0), ca.horzcat(-st, 0, ct))
    roll = ca.vertcat(ca.horzcat(1, 0, 0), ca.horzcat(0, cf, -sf), ca.horzcat(0, sf, cf))
    return ca.mtimes([yaw, pitch, roll])


def on_vehicle(pose: ca.SX, motion: ca.SX, parameters: ca.SX) -> ca.SX:
    """A coil of the vehicle in the axes of a winding; motion is a displacement along the guideway's axes and a small
    rotation about the body's, in the order of COORDINATES.

    `parameters` : (9,) X, Y, Z of the coil in the body [m], its side (±1), width, length [m]; X, Y, Z of the origin
    of the winding [m].
    """
    arm, side, width, length, origin = (parameters[:3], parameters[3], parameters[4], parameters[5], parameters[6:])
    R = vehicle_rotation(pose[4], pose[2], pose[5])
    turn = ca.vertcat(motion[4], motion[2], motion[5])
    centre = ca.vertcat(pose[0] + motion[0], pose[3] + motion[3], pose[1] + motion[1])

    def to_winding(vector):
        return ca.vertcat(-side * vector[2], side * vector[1], vector[0])

    def turned(vector):
        return ca.mtimes(R, vector + ca.cross(turn, vector))

    place = centre + turned(arm) - origin
    across, along = turned(ca.vertcat(0, 0, -side * width)), turned(ca.vertcat(length, 0, 0))
    return rectangle(to_winding(place), to_winding(across), to_winding(along))


@lru_cache(maxsize=64)
def _maps(motor: HybridMotor, pose: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """(6, 4) wrench per ampere and (4, 6, 6) stiffness per ampere, from the phasors of every coil and winding."""
    inputs, stiffness = np.zeros((6, 4)), np.zeros((4, 6, 6))
    for magnets in (RIGHT, LEFT):
        for wound in (RIGHT, LEFT):
            sign = 1.0 if magnets == wound else COUPLINGS[motor.coupling]
            if sign == 0.0:
                continue
            gradient, hessian = _side(motor, pose, magnets, wound)
            factor = 1.5 * motor.coil.ampere_turns * sign
            first = 0 if wound == RIGHT else 2
            for axis, part in enumerate((np.real, np.imag)):
                inputs[:, first + axis] += factor * part(gradient)
                stiffness[first + axis] += factor * part(hessian)
    return inputs, stiffness


def _side(motor: HybridMotor, pose: tuple[float, ...], magnets: float, wound: float) -> tuple[np.ndarray, np.ndarray]:
    """Sum over one side's coils in one winding's field: (6,) gradient and (6, 6) Hessian, complex, per ampere²."""
    stations = motor.stations
    fixed = [magnets, motor.coil.width, motor.coil.length, stations[0], wound * motor.winding_offset, motor.drop]
    parameters = np.array([[X, magnets * motor.magnet_offset, motor.drop, *fixed] for X in stations])
    phasor = pulled_back(on_vehicle, np.tile(pose, (len(stations), 1)), parameters, 6, motor.winding, 1, 2)
    polarity = np.where(np.round((stations - stations[0]) / motor.winding.pole_pitch) % 2 == 0, 1.0, -1.0)
    return polarity @ phasor.gradient, np.tensordot(polarity, phasor.hessian, axes=1)


def _checked(values, count: int, name: str, what: str) -> np.ndarray:
    array = np.asarray(values, dtype=float)
    if array.shape != (count,) or not np.all(np.isfinite(array)):
        raise InputError(f"{name} must be {count} finite numbers; got {values!r}. Give {what}.")
    return array

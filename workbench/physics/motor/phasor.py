"""Complex mutual inductance of one phase and one vehicle coil in any pose, with its first and second derivatives.

    pose, pivot --geometry--> (r, e1, e2, S) --kernel.wave_sums--> M and its derivatives --pulled back--> Phasor

The pull-back is the chain rule, written by CasADi once for any way to pose a coil (`pull_back`): gradient by a small
motion (whose derivatives are forces and torques), and how that gradient changes with the pose.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np

from workbench.errors import InputError
from workbench.physics.motor.kernel import ACCURACY, wave_sums
from workbench.physics.motor.winding import VehicleCoil, Winding


@dataclass(frozen=True, slots=True)
class Phasor:
    """M_m of k poses: what the winding at 1 A and the coil at 1 A-turn share, as a complex amplitude.

    A phase displaced along z by Δ shares Re(M_m e^{−imκΔ}).

    value : (k,) complex  M_m [H]
    gradient : (k, n) complex  by the small motion: displacement x, y, z [H/m] and rotation about x, y, z [H/rad]
    hessian : (k, n, n) complex  [i, j]: derivative of gradient[i] by pose coordinate j (x, y, z, pitch, yaw, roll)
    """

    value: np.ndarray
    gradient: np.ndarray
    hessian: np.ndarray


def mutual_phasor(
    poses,
    winding: Winding,
    coil: VehicleCoil,
    *,
    harmonic: int = 1,
    pivot=(0.0, 0.0, 0.0),
    order: int = 2,
    accuracy: float = ACCURACY,
) -> Phasor:
    """Complex mutual inductance of one phase of the winding and one vehicle coil, with derivatives.

    Parameters
    ----------
    poses : (6,) or (k, 6) array_like
        x, y, z [m], pitch, yaw, roll [rad]. x, y, z place the coil's centre before it is turned; z = 0 is above the
        centre of a positive rectangle. The coil is turned by R = R_y(yaw) R_x(pitch) R_z(roll) about the pivot.
    winding, coil
        Geometry; the currents are not used.
    harmonic : int
        m, odd and positive.
    pivot : (3,) array_like
        From the unturned centre of the coil to the point about which it turns and torques are taken [m].
    order : int
        0: value only; 1: with gradient; 2: with Hessian. What is not asked for is an array of NaN.
    accuracy : float
        Of the quadrature, relative to a centred coil at the same height.

    Raises
    ------
    InputError
        If a pose is not six finite numbers, a corner is lower than 5 mm above the winding, or the harmonic is even.

    Source: report, Appendix F, eqs. (20)-(26), for the energy; `kernel` for the plane-wave form.
    """
    poses, pivot = checked_poses(poses), checked_point(pivot)
    parameters = np.concatenate([pivot, [coil.width, coil.length]])
    return pulled_back(about_pivot, poses, parameters, 6, winding, harmonic, order, accuracy)


def coil_geometry(poses, coil: VehicleCoil, pivot=(0.0, 0.0, 0.0)) -> np.ndarray:
    """(12, k) centre, edges and area vector of the coil in each pose, in the winding's axes [m, m²]."""
    parameters = np.concatenate([checked_point(pivot), [coil.width, coil.length]])
    place, _ = pull_back(about_pivot, 6, 6, len(parameters), 0)
    return np.asarray(place(checked_poses(poses).T, parameters))


Geometry = Callable[[ca.SX, ca.SX, ca.SX], ca.SX]  # pose, small motion, parameters -> (12,) r, e1, e2, S


def about_pivot(pose: ca.SX, motion: ca.SX, parameters: ca.SX) -> ca.SX:
    """The coil turned about a pivot; motion is a displacement and a small rotation in the winding's axes.

    `parameters` : (5,) pivot, width, length of the coil.
    """
    pivot, width, length = parameters[:3], parameters[3], parameters[4]
    R = rotation(pose[3], pose[4], pose[5])
    arm = ca.mtimes(R, -pivot)
    vectors = [arm, ca.mtimes(R, ca.vertcat(width, 0, 0)), ca.mtimes(R, ca.vertcat(0, 0, length))]
    arm, across, along = (vector + ca.cross(motion[3:], vector) for vector in vectors)
    return rectangle(pose[:3] + pivot + motion[:3] + arm, across, along)


def rectangle(place, across, along):
    """(12,) r, e1, e2, S = e2 × e1."""
    return ca.vertcat(place, across, along, ca.cross(along, across))


def rotation(pitch, yaw, roll):
    """R_y(yaw) R_x(pitch) R_z(roll), (3, 3): the coil rolls first, then pitches, then yaws; scalar or SX [rad]."""
    cp, sp, cy, sy, cr, sr = ca.cos(pitch), ca.sin(pitch), ca.cos(yaw), ca.sin(yaw), ca.cos(roll), ca.sin(roll)
    about_y = ca.vertcat(ca.horzcat(cy, 0, sy), ca.horzcat(0, 1, 0), ca.horzcat(-sy, 0, cy))
    about_x = ca.vertcat(ca.horzcat(1, 0, 0), ca.horzcat(0, cp, -sp), ca.horzcat(0, sp, cp))
    about_z = ca.vertcat(ca.horzcat(cr, -sr, 0), ca.horzcat(sr, cr, 0), ca.horzcat(0, 0, 1))
    return ca.mtimes([about_y, about_x, about_z])


def pulled_back(
    geometry: Geometry,
    poses: np.ndarray,
    parameters: np.ndarray,
    motions: int,
    winding: Winding,
    harmonic: int,
    order: int,
    accuracy: float = ACCURACY,
) -> Phasor:
    """Phasor of the coil that `geometry` poses; `parameters` (p,) for all poses or (k, p) for each."""
    count, coordinates = poses.shape
    place, derivatives = pull_back(geometry, coordinates, motions, parameters.shape[-1], order)
    parameters = parameters if parameters.ndim == 1 else parameters.T
    sums = wave_sums(np.asarray(place(poses.T, parameters)), winding, harmonic, order, accuracy)
    value = np.asarray(sums[0])
    shape = (count, motions)
    gradient, hessian = np.full(shape, np.nan + 0j), np.full((*shape, coordinates), np.nan + 0j)
    if order > 0:
        parts = [np.asarray(part) for part in derivatives.call([ca.DM(poses.T), ca.DM(parameters), *sums[1:]])]
        gradient = _complex(parts[0].reshape(motions, count, 2, 1))[:, :, 0]
        if order > 1:
            hessian = _complex(parts[1].reshape(motions, count, 2, coordinates))
    return Phasor(value[0] + 1j * value[1], gradient, hessian)


@cache
def pull_back(geometry: Geometry, coordinates: int, motions: int, parameters: int, order: int):
    """Compiled geometry, and the chain rule from its twelve numbers to motion and pose.

    Returns
    -------
    place : ca.Function
        pose, parameters -> (12,)
    derivatives : ca.Function
        pose, parameters, (12, 2) gradient, (12, 24) Hessian of M, real and imaginary part side by side
        -> (n, 2) gradient by motion; (n, 2c) its derivative by the pose.
    """
    q, u, p = ca.SX.sym("q", coordinates), ca.SX.sym("u", motions), ca.SX.sym("p", parameters)
    moved = geometry(q, u, p)
    placed = ca.substitute(moved, u, 0)
    tangent = ca.substitute(ca.jacobian(moved, u), u, 0)
    place = ca.Function("place", [q, p], [placed])
    g, H = ca.SX.sym("g", 12, 2), ca.SX.sym("H", 12, 24)
    inputs, outputs = [q, p, g], [ca.mtimes(tangent.T, g)]
    if order > 1:
        along_pose = ca.jacobian(placed, q)
        curved = [
            ca.jacobian(outputs[0][:, side], q) + ca.mtimes([tangent.T, H[:, 12 * side : 12 * (side + 1)], along_pose])
            for side in (0, 1)
        ]
        inputs, outputs = [*inputs, H], [*outputs, ca.horzcat(*curved)]
    return place, ca.Function("derivatives", inputs, outputs, {"cse": True})


def checked_poses(poses) -> np.ndarray:
    """(k, 6) array of finite numbers, or a refusal."""
    poses = np.atleast_2d(np.asarray(poses, dtype=float))
    if poses.ndim != 2 or poses.shape[1] != 6 or not np.all(np.isfinite(poses)):
        raise InputError(
            "a pose must be six finite numbers x, y, z [m], pitch, yaw, roll [rad]; "
            f"got {np.array2string(poses, threshold=12)}. Give one row of six for each pose."
        )
    return poses


def checked_point(point) -> np.ndarray:
    """(3,) array of finite numbers, or a refusal."""
    point = np.asarray(point, dtype=float)
    if point.shape != (3,) or not np.all(np.isfinite(point)):
        raise InputError(
            f"the pivot must be three finite coordinates; got {point!r}. Give metres from the coil centre."
        )
    return point


def _complex(parts: np.ndarray) -> np.ndarray:
    """(n, k, 2, c) real parts and imaginary parts as (k, n, c)."""
    return (parts[:, :, 0] + 1j * parts[:, :, 1]).transpose(1, 0, 2)

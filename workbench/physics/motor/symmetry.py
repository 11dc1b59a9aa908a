"""Table 1 of the report: how forces and torques of one coil answer to each displacement, read off the computed phasors.

c(−δ) against c(+δ) of the complex amplitudes  -->  symmetric, antisymmetric or zero;  over the gap  -->  monotonic
"""

import numpy as np

from workbench.physics.motor.lin_motor import CENTRED, profile
from workbench.physics.motor.phasor import mutual_phasor
from workbench.physics.motor.pose import amplitudes
from workbench.physics.motor.winding import REPORT_COIL, REPORT_WINDING

COLUMNS = ("side", "vertical", "longitudinal", "pitch", "yaw", "roll")
ZERO = 1e-9  # of the largest component of its kind: rounding and quadrature, six decades below anything that acts


def table_1(offset: float = 0.07, angle: float = 0.02) -> dict[str, str]:
    """The answers of F_x, F_y, F_z, T_x, T_y, T_z to each displacement, one letter each.

    Parameters
    ----------
    offset : float
        Lateral displacement at which the side, vertical and longitudinal columns are taken, because F_x, T_y and T_z
        vanish on the centre line [m].
    angle : float
        Rotation compared with its opposite [rad].

    Returns
    -------
    dict
        Column to six letters: S symmetric, A antisymmetric, M monotonic, N neither, 0 identically zero. The
        longitudinal column is about zero slip, the pitch column of amplitudes (the phase turns with the coil).

    Source: report, Appendix F, 5.2, Table 1.
    """
    slips = np.array([-0.2, 0.2])
    sliding = profile((offset, *CENTRED[1:]), slip=slips).wrench
    return {
        "side": _letters(*_pair(0, offset)),
        "vertical": _monotonic(offset),
        "longitudinal": _letters(sliding[0], sliding[1]),
        "pitch": _letters(*(np.abs(c) for c in _pair(3, angle))),
        "yaw": _letters(*_pair(4, angle)),
        "roll": _letters(*_pair(5, angle)),
    }


def _pair(axis: int, displacement: float) -> np.ndarray:
    """(2, 6) complex forces and torques at −displacement and +displacement."""
    poses = np.tile(CENTRED, (2, 1))
    poses[:, axis] = -displacement, displacement
    return mutual_phasor(poses, REPORT_WINDING, REPORT_COIL, order=1).gradient


def _letters(minus: np.ndarray, plus: np.ndarray) -> str:
    letters = ""
    for i in range(6):
        kind = slice(0, 3) if i < 3 else slice(3, 6)
        floor = ZERO * np.abs(plus[kind]).max()
        if abs(plus[i]) < floor and abs(minus[i]) < floor:
            letters += "0"
        elif abs(plus[i] - minus[i]) < floor:
            letters += "S"
        else:
            letters += "A" if abs(plus[i] + minus[i]) < floor else "N"
    return letters


def _monotonic(offset: float) -> str:
    poses = np.tile((offset, *CENTRED[1:]), (31, 1))
    poses[:, 1] = np.linspace(0.15, 0.45, 31)
    steps = np.diff(amplitudes(poses), axis=0)
    return "".join("M" if np.all(column < 0) or np.all(column > 0) else "N" for column in steps.T)

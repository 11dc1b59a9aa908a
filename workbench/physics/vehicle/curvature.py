"""How the coil sets' forces bend: what is left of a force law once its straight line at rest is taken off.

    force law, pose and currents at rest --forces on a grid of deviations--> polynomial --> derivatives 2 … 5 at rest
    equations of motion                  --Jacobians-------------------------------------> arms of the forces

The polynomial is the least-squares one over the region in which a ride moves, half the clearance to either side: there
it follows the law more closely than an expansion at one point, and a law of ten thousand operations need not be
differentiated five times. In the current every law is a parabola.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from math import factorial, prod

import casadi as ca
import numpy as np

from workbench.physics.forces.law import ForceLaw
from workbench.physics.vehicle.assembly import assembly
from workbench.physics.vehicle.body import inertia
from workbench.physics.vehicle.operating import OperatingPoint

SIGNALS = 4  # of a set: Δh, Δh' [m], roll φ [rad], current ratio α
ORDER = 5  # of the highest derivatives kept: of the mean of a Gaussian ride they matter by 1e-3
FITTED = 7  # degree of the polynomial
NODES = 8  # Chebyshev points along each of Δh, Δh', φ
ROLL = 0.05  # [rad] half width of the region; α: of main coil
ALPHA = 0.2
POWERS = tuple(p for p in product(range(FITTED + 1), repeat=3) if sum(p) <= FITTED)


@dataclass(frozen=True, slots=True, kw_only=True)
class Curvature:
    """Forces of n coil sets beyond their straight line at rest, and what they act on.

    derivatives : of orders 2 … 5, each (n, 3, 4, …, 4) of lift, lateral force [N] and roll moment [N m] by Δh, Δh' [m],
        φ [rad] and α
    by_pose : (n, 3, 5) Δh, Δh' and φ of each set by (Z, Θ, Y, Φ, Ψ);  spread : (n, commands) which command it follows
    loads : (5, n, 3) force down, pitch moment, force right, roll and yaw moment per force of each set [1, m]
    floor, wall : (n, edges, 3) distance of each edge of the coils from floor and wall by Δh, Δh', φ
    clear : (2, n, edges) these distances at rest [m]
    length : of a coil [m]
    """

    derivatives: tuple[np.ndarray, ...]
    by_pose: np.ndarray
    spread: np.ndarray
    loads: np.ndarray

    @property
    def straight(self) -> bool:
        """Whether nothing is left: the force law is its own straight line."""
        return not any(part.any() for part in self.derivatives)


def curvature(point: OperatingPoint, law: ForceLaw, clearance: tuple[float, float]) -> Curvature:
    """What bends at an operating point.

    law : of every set;  clearance : of the coils from floor and wall at rest [m], half of which the region spans
    """
    vehicle, n = point.vehicle, point.vehicle.count
    reach = (0.5 * clearance[0], 0.5 * clearance[1], ROLL)
    rest = [(*map(float, d), float(a)) for d, a in zip(point.deviation.T, point.trim.currents, strict=True)]
    each = [_derivatives(law, one, reach) for one in rest]
    tensors = tuple(s * np.stack(part) for part, s in ((part, 1.0) for part in zip(*each, strict=True)))
    open_body = assembly(vehicle)
    pose, forces = ca.SX.sym("pose", 5), ca.SX.sym("forces", 3, n)
    still = ca.DM.zeros(n)
    seen, _ = open_body.kinematics(pose, ca.DM.zeros(5), still, still, still)
    moved, _ = open_body.dynamics(
        point.trim.pose, ca.DM.zeros(5), forces, still, still, still, ca.DM.zeros(5)
    )
    slopes = ca.Function("arms", [pose], [ca.jacobian(ca.vec(seen), pose), ca.jacobian(moved[5:], ca.vec(forces))])
    by_pose, by_force = (np.array(ca.densify(J)) for J in slopes(point.trim.pose))
    return Curvature(
        derivatives=tensors, by_pose=by_pose.reshape(n, 3, 5), spread=vehicle.spread,
        loads=(inertia(vehicle)[:, None] * by_force).reshape(5, n, 3),
    )  # fmt: skip


@lru_cache(maxsize=64)
def _derivatives(law: ForceLaw, rest: tuple[float, ...], reach: tuple[float, ...]) -> tuple[np.ndarray, ...]:
    """Derivatives 2 … ORDER of one set's three forces at its rest, each (3, 4, …, 4)."""
    node = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    grid = np.array(list(product(node, repeat=3))).T
    basis = np.array([np.prod(grid.T**p, axis=1) for p in POWERS]).T
    shifted = [r + g * w for r, g, w in zip(rest, grid, reach, strict=False)]
    below, at, above = (np.array(law.forces(*shifted, rest[3] + a)) for a in (-ALPHA, 0.0, ALPHA))
    parts = at, (above - below) / 2, (above + below) / 2 - at  # α⁰, α¹, α² in units of ALPHA
    fitted = [np.linalg.lstsq(basis, np.broadcast_to(part, (3, grid.shape[1])).T, rcond=None)[0] for part in parts]
    out = [np.zeros((3, *[SIGNALS] * k)) for k in range(2, ORDER + 1)]
    size = np.array([*reach, ALPHA])
    for degree, coefficients in enumerate(fitted):
        for power, values in zip(POWERS, coefficients, strict=True):
            whole = (*power, degree)
            order = sum(whole)
            if not 2 <= order <= ORDER:
                continue
            derivative = values * prod(map(factorial, whole)) / np.prod(size**whole)
            for place in product(range(SIGNALS), repeat=order):
                if all(place.count(k) == whole[k] for k in range(SIGNALS)):
                    out[order - 2][(slice(None), *place)] = derivative
    return tuple(out)

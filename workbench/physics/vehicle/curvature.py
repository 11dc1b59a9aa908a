"""How the coil sets' forces bend: what is left of a force law once its straight line at rest is taken off.

    exact law of the coils --expansion--> polynomial ┐
    a vehicle's own law -----------------------------┴--CasADi--> derivatives 2 … 5 at rest of every set
    equations of motion --Jacobians--> where the sets sit: their deviations by pose, their forces as loads
    coils --> distances of their edges from floor and wall

Products of angles and rates in the rigid body's own motion are not in it: they add a thousandth to the ride.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from workbench.lti.signals import COORDINATES
from workbench.physics.forces.energy import edge_distances
from workbench.physics.forces.law import ForceLaw
from workbench.physics.forces.taylor import HIGHEST_ORDER, TaylorLaw
from workbench.physics.vehicle.assembly import assembly
from workbench.physics.vehicle.body import inertia
from workbench.physics.vehicle.offset import GapOffsets
from workbench.physics.vehicle.operating import OperatingPoint

SIGNALS = 4  # of a set: Δh, Δh' [m], roll φ [rad], current ratio α


@dataclass(frozen=True, kw_only=True)
class ForceBend:
    """Forces of n coil sets beyond their straight line at rest, and what they act on.

    derivatives : of orders 2 … 5, each (n, 3, 4, …, 4): lift, lateral force [N], roll moment [N m] by Δh, Δh' [m], φ, α
    by_pose : (n, 3, 5) Δh, Δh' and φ of each set by (Z, Θ, Y, Φ, Ψ);  spread : (n, commands) whose current it carries
    loads : (5, n, 3) force down, pitch moment, force right, roll and yaw moment per force of each set [1, m]
    edges : (n, surfaces, edges, 3) distance of each edge of a set's coils from floor and wall by Δh, Δh', φ
    clear : (n, surfaces, edges) those distances at rest [m];  length : of a coil [m]
    """

    derivatives: tuple[np.ndarray, ...]
    by_pose: np.ndarray
    spread: np.ndarray
    loads: np.ndarray
    edges: np.ndarray
    clear: np.ndarray
    length: float

    @property
    def straight(self) -> bool:
        """Whether nothing is left: the force law is its own straight line."""
        return not any(part.any() for part in self.derivatives)


@dataclass(frozen=True, kw_only=True)
class Bend:
    """Where a vehicle rests, and the law that it flies on: of its coils where they are known, else its own."""

    point: OperatingPoint
    offsets: GapOffsets

    @cached_property
    def curvature(self) -> ForceBend:
        """What bends there."""
        exact, point = self.offsets.law, self.point
        law = point.vehicle.force_law if exact is None else TaylorLaw.from_corner(exact, HIGHEST_ORDER)
        n = point.vehicle.count
        rests = [(*d, a) for d, a in zip(point.deviation.T, point.trim.currents, strict=True)]
        each = [_derivatives(law)(np.array(rest)) for rest in rests]
        shapes = [(3, *[SIGNALS] * order) for order in range(2, HIGHEST_ORDER + 1)]
        tensors = [
            np.stack([one[k].full().reshape(shape, order="F") for one in each]) for k, shape in enumerate(shapes)
        ]
        by_pose, loads = _places(point)
        gaps = np.array([self.offsets.gap, self.offsets.gap_lateral, 0.0])[:, None] + point.deviation
        edges = [_edges(self.offsets)(pose) for pose in gaps.T]
        clear, slopes = (np.stack([one[k].full() for one in edges]) for k in (0, 1))
        return ForceBend(
            derivatives=tuple(tensors), by_pose=by_pose, spread=point.vehicle.spread, loads=loads,
            edges=slopes.reshape(n, 2, -1, 3, order="F"), clear=clear.reshape(n, 2, -1, order="F"),
            length=self.offsets.coils.length,
        )  # fmt: skip


@lru_cache(maxsize=32)
def _derivatives(law: ForceLaw) -> ca.Function:
    """(Δh, Δh', φ, α) -> derivatives 2 … 5 of the three forces, each unrolled column by column."""
    x = ca.SX.sym("deviation", SIGNALS)
    part, parts = ca.vertcat(*law.forces(*ca.vertsplit(x))), []
    for _ in range(HIGHEST_ORDER):
        part = ca.densify(ca.jacobian(ca.vec(part), x))
        parts.append(part)
    return ca.Function("force_derivatives", [x], parts[1:])


def _places(point: OperatingPoint) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3, 5) deviations of the sets by pose, and (5, n, 3) loads by their forces, at rest."""
    vehicle, n = point.vehicle, point.vehicle.count
    body, still = assembly(vehicle), np.zeros(5)
    pose, forces = ca.SX.sym("pose", len(COORDINATES)), ca.SX.sym("forces", 3, n)
    under = list(point.irregularity)
    seen, _ = body.kinematics(pose, still, *under)
    moved, _ = body.dynamics(pose, still, forces, *under, still)
    slopes = ca.Function(
        "places", [pose, forces], [ca.jacobian(ca.vec(seen), pose), ca.jacobian(moved[5:], ca.vec(forces))]
    )
    by_pose, by_force = (J.full() for J in slopes(point.trim.pose, np.zeros((3, n))))
    shared = point.strength[None, :, None] * by_force.reshape(5, n, 3)
    return by_pose.reshape(n, 3, 5), inertia(vehicle)[:, None, None] * shared


@lru_cache(maxsize=32)
def _edges(offsets: GapOffsets) -> ca.Function:
    """(h, h', φ) -> distances of a set's edges from floor, then wall (8), and their slopes (8, 3)."""
    pose = ca.SX.sym("pose", 3)
    floor, wall = edge_distances(offsets.coils, *ca.vertsplit(pose))
    distances = ca.vertcat(*(d for pair in zip(floor, wall, strict=True) for d in pair))
    return ca.Function("edges", [pose], [distances, ca.densify(ca.jacobian(distances, pose))])

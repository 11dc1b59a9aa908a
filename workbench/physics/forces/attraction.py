"""An iron-cored magnet under a ferromagnetic rail: everything it does is a derivative of one co-energy.

    W'(gap, i) [J]  ──► force −∂W'/∂gap (towards the rail)   flux linkage λ = ∂W'/∂i
                    ──► inductance ∂λ/∂i    voltage of motion (∂λ/∂gap) d(gap)/dt

Source: Sinha, Electromagnetic Suspension (1987), ch. 2; Woodson & Melcher, Electromechanical Dynamics I (1968), ch. 3.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol

import casadi as ca

from workbench.constants import MU_0
from workbench.errors import InputError
from workbench.physics.forces.elementwise import elementwise


class Magnet(Protocol):
    """What equations of motion need to know about a magnet, elementwise at a gap [m] and a current [A]."""

    def force(self, gap, current) -> Any:
        """Pull towards the rail [N]."""
        ...

    def inductance(self, gap, current) -> Any:
        """∂λ/∂i [H]."""
        ...

    def flux_per_gap(self, gap, current) -> Any:
        """∂λ/∂gap [V s/m]."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class AttractionMagnet:
    """A U-shaped magnet whose flux crosses the gap twice; iron linear.

    Parameters
    ----------
    turns : int
    pole_area : float
        Of one pole [m²].
    iron : float
        Length of the iron's path over twice its relative permeability [m]: what it adds to the gap; 0 for ideal iron.
    leakage : float
        Inductance of the flux that does not reach the rail [H].
    """

    turns: int
    pole_area: float
    iron: float = 0.0
    leakage: float = 0.0

    def __post_init__(self) -> None:
        for name, unit in (("turns", ""), ("pole_area", " m²")):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(f"AttractionMagnet.{name} must be positive; got {getattr(self, name)!r}{unit}.")
        for name, unit in (("iron", "m"), ("leakage", "H")):
            if not 0 <= getattr(self, name) < math.inf:
                raise InputError(f"AttractionMagnet.{name} must not be negative; got {getattr(self, name)!r} {unit}.")

    def co_energy(self, gap, current):
        """W' = ½ (μ₀ N² A/(2 (gap + iron)) + leakage) i² [J]."""
        inductance = MU_0 * self.turns**2 * self.pole_area / (2 * (gap + self.iron)) + self.leakage
        return inductance * current**2 / 2

    def force(self, gap, current):
        """Pull towards the rail [N], elementwise."""
        return elementwise(_derivatives(self), gap, current)[0]

    def flux_linkage(self, gap, current):
        """λ [V s], elementwise."""
        return elementwise(_derivatives(self), gap, current)[1]

    def inductance(self, gap, current):
        """∂λ/∂i [H], elementwise."""
        return elementwise(_derivatives(self), gap, current)[2]

    def flux_per_gap(self, gap, current):
        """∂λ/∂gap [V s/m], elementwise: times d(gap)/dt, the voltage of motion; minus it, newtons per ampere."""
        return elementwise(_derivatives(self), gap, current)[3]


@lru_cache(maxsize=32)
def _derivatives(magnet: AttractionMagnet) -> ca.Function:
    gap, current = ca.SX.sym("gap"), ca.SX.sym("current")
    energy = magnet.co_energy(gap, current)
    linkage = ca.gradient(energy, current)
    outputs = [-ca.gradient(energy, gap), linkage, ca.gradient(linkage, current), ca.gradient(linkage, gap)]
    return ca.Function("attraction", [gap, current], outputs)

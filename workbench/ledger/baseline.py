"""The vehicle and the gains that the printed numbers of Appendices B to D belong to.

Geometry: B.1 (preliminary vehicle). Forces: A.3, first-order expansion. The inertias are not printed: they are inferred
from the roots of C.5 and C.6, roll 7.53e4, pitch 3.41e6, yaw 3.35e6 kg m². Gains: C.5 and C.6 in the reading that
reproduces the printed roots (position gain of the lateral gap zero, acceleration gain −0.02 lateral, rate gains equal).
"""

from functools import cache

from workbench.constants import GRAVITY
from workbench.control import Gains, ModalLaw
from workbench.physics.forces.law import report_first_order
from workbench.physics.vehicle import Linearisation, Vehicle, linearise

WEIGHT = 444.8e3  # [N] report, A.3


@cache
def report_vehicle() -> Vehicle:
    """The preliminary revenue vehicle at 134 m/s, without the physics the report leaves out."""
    return Vehicle.four_corners(
        front=9.00, rear=7.65, half_track=0.965, depth=1.21, mass=WEIGHT / GRAVITY,
        roll_inertia=7.53e4, pitch_inertia=3.41e6, yaw_inertia=3.35e6, speed=134.0, force_law=report_first_order(),
    )  # fmt: skip


@cache
def report_model() -> Linearisation:
    """Its linearisation at the nominal pose."""
    return linearise(report_vehicle())


def report_law() -> ModalLaw:
    """The modal law on its coil places."""
    return ModalLaw(report_vehicle().positions, report_vehicle().depth)


def report_gains() -> Gains:
    """The gains of C.5 and C.6."""
    return Gains(
        K_h=-2.155, K_hdot=0.15, tau_h=0.637, K_hp=0.0, K_hpdot=0.294, tau_hp=0.637,
        K_zddot=0.0, K_zdot=0.15, tau_z=0.637, K_yddot=-0.02, K_ydot=0.294, tau_y=0.637,
        K_heave=1.0, K_pitch=1.0, K_sway=0.518, K_roll=1.25, K_yaw=3.5,
    )  # fmt: skip

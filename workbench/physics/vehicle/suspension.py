"""One magnet that carries a mass under a rail: the smallest levitated vehicle, on a rigid or a bending guideway.

    voltage ──► Actuator ──► current ──► AttractionMagnet ──► pull ──► mass ──► velocity ──► gap
                                                       └─────────► span ──► deflection ──┘

Down is positive. gap grows as the mass falls; a span bends down under the pull, which closes the gap.
Source: Sinha, Electromagnetic Suspension (1987), ch. 3; Popp & Schiehlen, Ground Vehicle Dynamics (2010), ch. 4 and 8.
"""

import math

import casadi as ca

from workbench.constants import GRAVITY
from workbench.errors import InputError
from workbench.physics.dynamics import Dynamics
from workbench.physics.forces.actuator import Actuator
from workbench.physics.forces.attraction import Magnet
from workbench.physics.guideway.span import Span


def suspension(
    mass: float, magnet: Magnet, actuator: Actuator, *, span: Span | None = None, speed: float = 0.0,
    name: str = "suspension",
) -> Dynamics:  # fmt: skip
    """Heave of a mass on one magnet.

    Parameters
    ----------
    mass : float
        [kg]
    magnet : Magnet
    actuator : Actuator
    span : Span, optional
        The guideway bends; without it, it is rigid.
    speed : float
        At which the place on the span moves [m/s]; the deflection's slope then changes the gap too.

    Returns
    -------
    Dynamics
        States gap [m], velocity (down) [m/s], current [A]; with a span, mode_k [m] and mode_k_rate.
        Inputs: the actuator's command; force (down, on the mass) [N]; surface_rate, at which the rail's irregularity
        moves down [m/s]; with a span, place [m].
        Outputs gap_sensor [m], acceleration (down) [m/s²], current_sensor [A]; with a span, deflection [m].
    """
    if not 0 < mass < math.inf:
        raise InputError(f"the mass of a suspension must be positive and finite; got {mass!r} kg.")
    gap, velocity, current = (ca.SX.sym(symbol) for symbol in ("gap", "velocity", "current"))
    command, load, surface_rate = (ca.SX.sym(symbol) for symbol in ("command", "force", "surface_rate"))
    pull = magnet.force(gap, current)
    acceleration = GRAVITY + (load - pull) / mass
    inputs = {actuator.command: command, "force": load, "surface_rate": surface_rate}
    outputs = {"gap_sensor": gap, "acceleration": acceleration, "current_sensor": current}
    bending, falling = {}, ca.SX(0)
    if span is not None:
        place, q, rate = ca.SX.sym("place"), ca.SX.sym("q", span.modes), ca.SX.sym("rate", span.modes)
        shapes = span.shapes(place)
        bent = span.acceleration(q, rate, pull, place)
        falling = ca.dot(shapes, rate) + speed * ca.dot(ca.jacobian(shapes, place), q)
        for k in range(span.modes):
            bending[f"mode_{k + 1}"] = (q[k], rate[k])
            bending[f"mode_{k + 1}_rate"] = (rate[k], bent[k])
        inputs["place"] = place
        outputs["deflection"] = ca.dot(shapes, q)
    gap_rate = velocity - falling - surface_rate
    motion_voltage = magnet.flux_per_gap(gap, current) * gap_rate
    current_rate = actuator.current_rate(current, command, magnet.inductance(gap, current), motion_voltage)
    least = {} if actuator.least_current == -math.inf else {"current": actuator.least_current}
    return Dynamics.of(
        name,
        states={
            "gap": (gap, gap_rate), "velocity": (velocity, acceleration), "current": (current, current_rate), **bending
        },
        inputs=inputs, outputs=outputs, limits={actuator.command: actuator.limits}, least=least,
    )  # fmt: skip

"""The schedule of least peak power by its shape: as fast as acceleration, thrust and power limits allow at every speed.

    power P ──► stretches (which limit holds where) ──► time(P), distance(P) ──► the P that meets the demand

Why it is the optimum. At a given speed a larger acceleration shortens both time (∫ dv/a) and distance (∫ v dv/a), so
for a given P the largest acceleration allowed at each speed,

    m a(v) = min(m a_max, T_max − D(v), P/v − D(v)),

is best, whatever the measure. Time and distance then fall as P grows, and the smallest P is the one that just meets the
demand. P/v falls while m a_max + D(v) meets it once only, so the power limit holds above one corner speed; below it
the other two exchange at most twice, because D is convex.

So every stretch is smooth, and time and distance are integrals over speed of the equation of motion, to the accuracy of
QUADPACK. The unknown is the margin, the power above what the final speed needs: with it P − D(v) v has no cancellation,
however small the margin, and log(v1 − v + const) as the variable of integration spreads out the slow approach to v1.
"""

import math
from itertools import pairwise

import numpy as np

from workbench.errors import InfeasibleError
from workbench.physics.propulsion.drag import constant_acceleration, drag_curves
from workbench.physics.propulsion.quantity import count
from workbench.physics.propulsion.schedule import Demand, SpeedSchedule, Stretch

MEASURES = ("time", "distance")  # in the order of every (time, distance) pair below
CLOSEST = 1e-12  # margin over least power at which the search ends: four digits above the power's rounding


def least_power_schedule(demand: Demand, *, samples: int = 100) -> SpeedSchedule:
    """The schedule of least peak power.

    Parameters
    ----------
    demand : Demand
    samples : int
        Points per stretch, at least 1, of the sampled schedule; the figures do not depend on it.

    Returns
    -------
    SpeedSchedule
        Figures good to about ten digits. Where even a power 1e-12 (relative) above the final speed's drag power meets
        the demand, that one is returned, and time or distance stay below what is allowed.

    Raises InfeasibleError if time or distance is shorter than with the acceleration and thrust limits alone.

    Examples
    --------
    >>> from workbench.physics.propulsion.drag import DragLaw
    >>> law = DragLaw(magnetic=2.0e5, aerodynamic=1.3)
    >>> demand = Demand(
    ...     law=law, mass=45400.0, initial_speed=30.0, final_speed=134.0, acceleration_limit=1.0, time=212.0
    ... )
    >>> print(f"{least_power_schedule(demand).peak_power:.4g} W")
    5.957e+06 W
    """
    from scipy.optimize import brentq

    def excess(log_margin: float) -> float:
        return math.log(_measure(demand, math.exp(log_margin)) / demand.allowed)

    least = fastest(demand)
    demand.refuse_unless_reachable(least)
    smallest, largest = demand.least_power * CLOSEST, demand.largest_power - demand.least_power
    if demand.allowed <= least:
        return _sampled(demand, largest, None, samples)
    if excess(math.log(smallest)) <= 0:
        return _sampled(demand, smallest, None, samples)
    margin = math.exp(brentq(excess, math.log(smallest), math.log(largest), xtol=1e-13, rtol=1e-14))
    return _sampled(demand, margin, 1 / _slope(demand, margin), samples)


def fastest(demand: Demand) -> float:
    """Time [s] or distance [m], whichever the demand limits, with the acceleration and thrust limits alone."""
    return _measure(demand, demand.largest_power - demand.least_power)


def _measure(demand: Demand, margin: float) -> float:
    """Time [s] or distance [m] at a power `margin` [W] above the least."""
    index = MEASURES.index(demand.measure)
    return sum(_span(demand, margin, *part)[index] for part in _parts(demand, margin))


def _parts(demand: Demand, margin: float) -> list[tuple[str, float, float]]:
    """(limit, from [m/s], to [m/s]) in order of speed."""
    power = demand.least_power + margin
    v0, v1 = demand.initial_speed, demand.final_speed
    corner = max(power / demand.thrust_limit, _power_meets_acceleration(demand, power))
    corner = min(max(corner, v0), v1)
    exchanges = [v for v in _thrust_meets_acceleration(demand) if v0 < v < corner]
    edges = [v0, *exchanges, corner]
    parts = []
    for start, end in pairwise(edges):
        if end > start:
            middle = (start + end) / 2
            free = demand.mass * demand.acceleration_limit + float(demand.law.force(middle))
            parts.append(("acceleration" if free <= demand.thrust_limit else "thrust", start, end))
    return [*parts, ("power", corner, v1)] if corner < v1 else parts


def _power_meets_acceleration(demand: Demand, power: float) -> float:
    """The speed [m/s] with (m a_max + D(v)) v = P, which rises with v; the end of the way if it lies beyond it."""
    inertia = demand.mass * demand.acceleration_limit
    return _crossing(
        lambda v: inertia * v + float(demand.law.power(v)) - power, demand.initial_speed, demand.final_speed
    )


def _thrust_meets_acceleration(demand: Demand) -> list[float]:
    """The speeds [m/s] with D(v) = T_max − m a_max: one on either side of the least drag, ends of the way included."""
    if demand.thrust_limit == math.inf:
        return []
    left = demand.thrust_limit - demand.mass * demand.acceleration_limit
    v0, v1 = demand.initial_speed, demand.final_speed
    least = demand.law.least_drag_speed
    inner = v0 if least is None else min(max(least, v0), v1)
    bottom = min((v0, inner, v1), key=lambda v: float(demand.law.force(v)))
    if float(demand.law.force(bottom)) >= left:  # thrust is the tighter limit throughout
        return []
    return [
        _crossing(lambda v: left - float(demand.law.force(v)), v0, bottom),
        _crossing(lambda v: float(demand.law.force(v)) - left, bottom, v1),
    ]


def _crossing(rising, start: float, end: float) -> float:
    """Where a rising function is zero between two speeds; the nearer end if it has one sign throughout."""
    from scipy.optimize import brentq

    if rising(start) >= 0:
        return start
    return end if rising(end) <= 0 else float(brentq(rising, start, end, xtol=1e-12, rtol=1e-14))


def _span(demand: Demand, margin: float, limit: str, start: float, end: float) -> tuple[float, float]:
    """(time [s], distance [m]) between two speeds [m/s] under one limit."""
    if limit == "acceleration":
        a = demand.acceleration_limit
        return (end - start) / a, (end**2 - start**2) / (2 * a)
    if limit == "thrust":
        return _at_thrust_limit(demand, 0, start, end), _at_thrust_limit(demand, 1, start, end)
    return _at_power_limit(demand, margin, 0, start, end), _at_power_limit(demand, margin, 1, start, end)


def _at_thrust_limit(demand: Demand, order: int, start: float, end: float) -> float:
    """∫ m v^order/(T − D) dv: time [s] for order 0, distance [m] for 1."""
    law, m, T = demand.law, demand.mass, demand.thrust_limit
    return _quadrature(lambda v: m * v**order / (T - float(law.force(v))), start, end)


def _at_power_limit(demand: Demand, margin: float, order: int, start: float, end: float, degree: int = 1) -> float:
    """∫ m v^(order+1)/(P − D v)^degree dv: for degree 1 time [s] or distance [m], order 0 or 1.

    P − D v is the margin plus the rise of the drag power up to v1: with r = v1 − v,
    C_m r/(√v1 + √v) + C_a r (v1² + v1 v + v²).
    """
    law, m, v1 = demand.law, demand.mass, demand.final_speed
    slope = float(law.magnetic_drag(v1)) / 2 + 3 * float(law.aerodynamic_drag(v1))  # d(D v)/dv at v1
    shift = min(margin / slope, v1 - demand.initial_speed)

    def transformed(x: float) -> float:
        r = math.exp(x) - shift
        v = v1 - r
        rise = law.magnetic * r / (v1**0.5 + v**0.5) + law.aerodynamic * r * (v1 * v1 + v1 * v + v * v)
        return math.exp(x) * m * v ** (order + 1) / (margin + rise) ** degree

    return _quadrature(transformed, math.log(v1 - end + shift), math.log(v1 - start + shift))


def _quadrature(integrand, start: float, end: float) -> float:
    from scipy.integrate import quad

    value, error = quad(integrand, start, end, epsabs=0, epsrel=1e-12, limit=400, full_output=1)[:2]
    if not error <= 1e-8 * abs(value):
        raise InfeasibleError(
            f"the limits must leave the vehicle some acceleration everywhere; here its motion is known to "
            f"{error / abs(value):.1g} of its value only. Raise the thrust limit a little."
        )
    return value


def _slope(demand: Demand, margin: float) -> float:
    """Change of time [s] or distance [m] per watt of peak power.

    Only the power stretch contributes, since the integrand is continuous across the corner:
    d/dP ∫ m v/(P − D v) dv = −∫ m v/(P − D v)² dv.
    """
    _, start, end = next(part for part in _parts(demand, margin) if part[0] == "power")
    return -_at_power_limit(demand, margin, MEASURES.index(demand.measure), start, end, degree=2)


def _sampled(demand: Demand, margin: float, marginal: float | None, samples: int) -> SpeedSchedule:
    """The schedule at `samples` points per stretch, each with its time and position."""
    power = demand.least_power + margin
    stretches, speeds = [], [np.array([demand.initial_speed])]
    times, positions = [np.zeros(1)], [np.zeros(1)]
    for limit, start, end in _parts(demand, margin):
        v = np.linspace(start, end, count("samples", samples) + 1)
        steps = [_span(demand, margin, limit, *step) for step in pairwise(v.tolist())]
        time, position = np.cumsum(steps, axis=0).T
        stretches.append(
            Stretch(
                limit=limit, initial_speed=start, final_speed=end, time=float(time[-1]), distance=float(position[-1])
            )
        )
        times.append(times[-1][-1] + time)
        positions.append(positions[-1][-1] + position)
        speeds.append(v[1:])
    v = np.concatenate(speeds)
    drag = drag_curves(demand.law, v, mass=demand.mass).drag
    thrusts = np.minimum(np.minimum(demand.mass * demand.acceleration_limit + drag, demand.thrust_limit), power / v)
    return SpeedSchedule(
        demand=demand,
        method="power corner",
        peak_power=power,
        time=float(times[-1][-1]),
        distance=float(positions[-1][-1]),
        peak_thrust=float(thrusts.max()),
        energy=sum(_energy(demand, power, stretch) for stretch in stretches),
        marginal_power=marginal,
        stretches=tuple(stretches),
        speeds=v,
        times=np.concatenate(times),
        positions=np.concatenate(positions),
        thrusts=thrusts,
    )


def _energy(demand: Demand, power: float, stretch: Stretch) -> float:
    """Thrust times distance [J] on one stretch."""
    if stretch.limit == "power":
        return power * stretch.time
    if stretch.limit == "thrust":
        return demand.thrust_limit * stretch.distance
    return constant_acceleration(
        demand.law,
        mass=demand.mass,
        initial_speed=stretch.initial_speed,
        final_speed=stretch.final_speed,
        acceleration=demand.acceleration_limit,
    ).energy

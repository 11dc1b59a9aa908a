"""The schedule of least peak power as an optimal-control problem, solved by IPOPT.

    minimise P over the acceleration a(v), with speed as the independent variable:
        ∫ dv/a ≤ time  or  ∫ v dv/a ≤ distance,   (m a + D(v)) v ≤ P,   m a + D(v) ≤ T_max,   0 < a ≤ a_max

1/a is convex and everything else is linear in (a, P), so the discretised problem has one minimum and IPOPT finds it
from anywhere. Time and distance use the trapezoidal rule, whose error falls with the square of the element; the ends
are nodes, so that the power holds the final speed. This route does not know the optimum's shape; `power_corner.py`
does; the multiplier of the time or distance is the marginal power.
"""

from functools import lru_cache

import casadi as ca
import numpy as np

from workbench.errors import InfeasibleError, InputError
from workbench.physics.propulsion.drag import drag_curves
from workbench.physics.propulsion.power_corner import fastest
from workbench.physics.propulsion.schedule import Demand, SpeedSchedule

SLOWEST = 1e-6  # smallest acceleration over the largest possible; keeps 1/a finite while IPOPT searches


def optimised_schedule(demand: Demand, *, elements: int = 400) -> SpeedSchedule:
    """The schedule of least peak power by optimisation.

    Parameters
    ----------
    demand : Demand
    elements : int
        Speed elements, at least 10; the schedule is given at their ends.

    Returns
    -------
    SpeedSchedule
        With an empty `stretches`. 400 elements agree with `least_power_schedule` to 2e-5 on the report's vehicle;
        less where most of the time goes into the last elements, with a time far beyond what is needed.

    Raises InfeasibleError if time or distance is too short, or if the solver does not converge.
    """
    if isinstance(elements, bool) or not isinstance(elements, int) or elements < 10:
        raise InputError(f"elements must be a whole number of at least 10; got {elements!r}. 400 give five digits.")
    demand.refuse_unless_reachable(fastest(demand))
    v = np.linspace(demand.initial_speed, demand.final_speed, elements + 1)
    width = np.full(elements + 1, v[1] - v[0])
    width[[0, -1]] /= 2
    drag = drag_curves(demand.law, v, mass=demand.mass).drag
    ceiling = np.minimum(demand.acceleration_limit, (demand.thrust_limit - drag) / demand.mass)
    slowness = width * (v if demand.measure == "distance" else 1) / (ceiling * demand.allowed)
    scale = demand.largest_power
    solver = _solver(v.size)
    solution = solver(
        x0=np.append(np.full(v.size, 0.5), 1.0),
        p=np.concatenate([slowness, v * demand.mass * ceiling / scale, v * drag / scale]),
        lbx=np.append(np.full(v.size, SLOWEST), 0.0),
        ubx=np.append(np.ones(v.size), np.inf),
        lbg=-np.inf,
        ubg=np.append(np.zeros(v.size), 1.0),
    )
    if not solver.stats()["success"]:
        raise InfeasibleError(
            f"the schedule's optimisation must converge; it ended with "
            f"{solver.stats()['return_status']!r} at {elements} elements. "
            "Use more elements, allow more time or distance, or take least_power_schedule."
        )
    x = np.array(solution["x"]).ravel()
    a, peak = x[:-1] * ceiling, float(x[-1] * scale)
    thrust = demand.mass * a + drag
    rates = np.stack([1 / a, v / a])  # dt/dv, dx/dv
    steps = (rates[:, 1:] + rates[:, :-1]) / 2 * np.diff(v)
    times, positions = np.hstack([np.zeros((2, 1)), np.cumsum(steps, axis=1)])
    return SpeedSchedule(
        demand=demand,
        method="optimised",
        peak_power=peak,
        time=float(times[-1]),
        distance=float(positions[-1]),
        peak_thrust=float(thrust.max()),
        energy=float((width * v / a) @ thrust),
        marginal_power=-float(solution["lam_g"][-1]) * scale / demand.allowed,
        stretches=(),
        speeds=v,
        times=times,
        positions=positions,
        thrusts=thrust,
    )


@lru_cache(maxsize=8)
def _solver(nodes: int) -> ca.Function:
    """Minimise q over (b, q) with Σ slowness/b ≤ 1 and inertia·b + drag ≤ q; everything over its scale, silent."""
    b, q = ca.SX.sym("b", nodes), ca.SX.sym("q")
    slowness, inertia, drag = (ca.SX.sym(name, nodes) for name in ("slowness", "inertia", "drag"))
    problem = {
        "x": ca.vertcat(b, q),
        "p": ca.vertcat(slowness, inertia, drag),
        "f": q,
        "g": ca.vertcat(inertia * b + drag - q, ca.sum1(slowness / b)),
    }
    quiet = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-10}}
    return ca.nlpsol("least_power", "ipopt", problem, quiet)

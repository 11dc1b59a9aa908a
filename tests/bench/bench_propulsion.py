"""Solve time of the least-power schedule: IPOPT with CasADi's derivatives against scipy's SLSQP, and the power corner.

The peer gets the same discretisation, scaling, start and exact gradients, written in NumPy.
"""

from time import perf_counter

import numpy as np

from workbench.constants import GRAVITY
from workbench.physics.propulsion import Demand, DragLaw, least_power_schedule, optimised_schedule

ELEMENTS = 100


def rows() -> list[tuple[str, float, float, float]]:
    """(name, our seconds, peer's seconds, peer over ours)."""
    demand = Demand(
        law=DragLaw(magnetic=2e5, aerodynamic=1.3),
        mass=45_400.0,
        initial_speed=30.0,
        final_speed=134.0,
        acceleration_limit=0.15 * GRAVITY,
        time=212.1,
    )
    optimised_schedule(demand, elements=ELEMENTS)  # builds the solver once, as any further call finds it
    ours, solved = _seconds(lambda: optimised_schedule(demand, elements=ELEMENTS).peak_power)
    exact, power = _seconds(lambda: least_power_schedule(demand).peak_power)
    peer, found = _seconds(lambda: _slsqp(demand))
    if abs(found / solved - 1) > 1e-5 or abs(solved / power - 1) > 1e-3:  # same problem; error of 100 elements
        raise RuntimeError(f"the routes disagree: {found:.6g}, {solved:.6g}, {power:.6g} W")
    return [
        (f"speed schedule, {ELEMENTS} elements, IPOPT, against SLSQP", ours, peer, peer / ours),
        ("speed schedule by its power corner, against SLSQP", exact, peer, peer / exact),
    ]


def _seconds(run, repeats: int = 3) -> tuple[float, float]:
    """(best time of a few, the result)."""
    best, result = np.inf, 0.0
    for _ in range(repeats):
        start = perf_counter()
        result = run()
        best = min(best, perf_counter() - start)
    return best, result


def _slsqp(demand: Demand) -> float:
    """Peak power [W] of the same discretised problem."""
    from scipy.optimize import minimize

    v = np.linspace(demand.initial_speed, demand.final_speed, ELEMENTS + 1)
    width = np.full(v.size, v[1] - v[0])
    width[[0, -1]] /= 2
    weight = width / (demand.acceleration_limit * demand.allowed)
    inertia = v * demand.mass * demand.acceleration_limit / demand.largest_power
    drag = (demand.law.magnetic * np.sqrt(v) + demand.law.aerodynamic * v**3) / demand.largest_power
    power_gradient = np.hstack([-np.diag(inertia), np.ones((v.size, 1))])
    result = minimize(
        lambda x: x[-1],
        np.append(np.full(v.size, 0.5), 1.0),
        jac=lambda x: np.append(np.zeros(v.size), 1.0),
        bounds=[(1e-6, 1.0)] * v.size + [(0.0, None)],
        constraints=[
            {"type": "ineq", "fun": lambda x: x[-1] - inertia * x[:-1] - drag, "jac": lambda x: power_gradient},
            {
                "type": "ineq",
                "fun": lambda x: np.array([1 - np.sum(weight / x[:-1])]),
                "jac": lambda x: np.append(weight / x[:-1] ** 2, 0.0)[None, :],
            },
        ],
        method="SLSQP",
        options={"maxiter": 500, "ftol": 1e-10},
    )
    return float(result.x[-1] * demand.largest_power)


if __name__ == "__main__":
    for name, ours, peer, ratio in rows():
        print(f"{name:60} {ours:9.4f} s {peer:9.4f} s {ratio:8.1f}")

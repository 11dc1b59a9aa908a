"""Nonlinear simulation against real time, and against scipy's integrator on the same equations.

Each row lays the seconds a run takes beside the seconds it stands for; the last beside scipy's solve_ivp (RK45, 1e-6)
on the linear loop of the same vehicle, which it follows to 1e-3.
"""

from time import perf_counter

import numpy as np

from workbench.control import Gains
from workbench.control.loop import close
from workbench.files.problem import load_problem
from workbench.physics.forces.operating import law_at
from workbench.physics.forces.taylor import TaylorLaw
from workbench.physics.guideway.realisation import realisation
from workbench.physics.vehicle.operating import operating_point
from workbench.simulation import LoadStep, Rig
from workbench.simulation.simulate import Simulator

GAINS = Gains(
    K_h=-2.155, K_hdot=0.15, tau_h=0.637, K_hp=0.0, K_hpdot=0.152, tau_hp=0.2, K_zddot=0.0, K_zdot=0.15, tau_z=0.637,
    K_yddot=-0.01, K_ydot=0.152, tau_y=0.2, K_heave=1.0, K_pitch=1.0, K_sway=1.0, K_roll=1.73, K_yaw=6.76,
)  # fmt: skip
SAMPLED, SMOOTH = {"sample_time": 0.001}, {"step": 0.004}


def rows() -> list[tuple[str, float, float, float]]:
    """(name, our seconds, peer's seconds, peer over ours); the peer is real time, but for the last row."""
    problem = load_problem("comfort_limit")
    exact = law_at()
    laws = {"first order": problem.vehicle.force_law, "third order": TaylorLaw.from_corner(exact, 3), "exact": exact}
    track = realisation(problem.setting.guideway, length=134.0 * 20, spacing=0.2, seed=1, speed=134.0)
    out = []
    for name, law in laws.items():
        for words, timing in (("continuous law, 4 ms steps", SMOOTH), ("sampled law, 1 kHz", SAMPLED)):
            simulator = _simulator(problem.vehicle.with_values(force_law=law), **timing)
            simulated = 4.0 if name == "exact" else 20.0
            seconds = _seconds(lambda s=simulator, t=simulated: s.run(t, course=track))
            out.append((f"{name} force law, {words}, against real time", seconds, simulated, simulated / seconds))
    simulator = _simulator(problem.vehicle, **SMOOTH)
    ours = _seconds(lambda: simulator.run(10.0, loads=[LoadStep(load=(100.0, 0.0, 0.0, 0.0, 0.0))]))
    peer, theirs = _peer(problem)
    end = simulator.run(10.0, loads=[LoadStep(load=(100.0, 0.0, 0.0, 0.0, 0.0))]).gap[0, -1]
    if abs(end / theirs - 1) > 1e-3:  # products of deviations, which the peer does not have
        raise RuntimeError(f"the routes disagree: {end} and {theirs} m")
    out.append(("step response of the vehicle, against solve_ivp on the linear loop", ours, peer, peer / ours))
    return out


def _simulator(vehicle, **timing) -> Simulator:
    rig = Rig(point=operating_point(vehicle), gains=GAINS, gap=0.3, gap_lateral=0.3, **timing)
    simulator = Simulator.of(rig)
    simulator.run(0.5)
    return simulator


def _seconds(run) -> float:
    best = np.inf
    for _ in range(3):
        start = perf_counter()
        run()
        best = min(best, perf_counter() - start)
    return best


def _peer(problem) -> tuple[float, float]:
    from scipy.integrate import solve_ivp

    system = close(problem.setting.plant, problem.law, GAINS).system
    push = 100.0 * system.B[:, system.inputs.index("force_z")]
    start = perf_counter()
    found = solve_ivp(lambda t, x: system.A @ x + push, (0.0, 10.0), np.zeros(len(push)), rtol=1e-6, atol=1e-12)
    return perf_counter() - start, float(system.C[system.outputs.index("gap_1")] @ found.y[:, -1])


if __name__ == "__main__":
    for name, ours, peer, ratio in rows():
        print(f"{name:75s} {ours:9.4f} s {peer:9.4f} s {ratio:8.1f}")

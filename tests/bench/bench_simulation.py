"""Nonlinear simulation against real time, and against scipy's integrator on the same equations.

Each row lays the seconds a run takes beside the seconds it stands for; then one beside scipy's solve_ivp (RK45, 1e-6)
on the linear loop of the same vehicle, which it follows to 1e-3. The last lays a second of flight, side by side in
the exponential integrator, its course and sums included, beside a second of one history by Runge–Kutta at 1 ms.
"""

from dataclasses import replace
from time import perf_counter

import numpy as np

from tests.bench import Row, against
from workbench.control import Gains
from workbench.control.loop import close
from workbench.files.problem import load_problem
from workbench.physics.forces.operating import law_at
from workbench.physics.forces.taylor import TaylorLaw
from workbench.physics.guideway.realisation import realisation
from workbench.physics.vehicle.operating import operating_point
from workbench.simulation import LoadStep, Rig
from workbench.simulation.course import Guideways
from workbench.simulation.exponential import Exponential
from workbench.simulation.flight import flown_over
from workbench.simulation.reading import Reader, usual_places
from workbench.simulation.simulate import Simulator
from workbench.study.flights import grid, rig_of

GAINS = Gains(
    K_h=-2.155, K_hdot=0.15, tau_h=0.637, K_hp=0.0, K_hpdot=0.152, tau_hp=0.2, K_zddot=0.0, K_zdot=0.15, tau_z=0.637,
    K_yddot=-0.01, K_ydot=0.152, tau_y=0.2, K_heave=1.0, K_pitch=1.0, K_sway=1.0, K_roll=1.73, K_yaw=6.76,
)  # fmt: skip
CORNERS = ((9.0, 0.965), (9.0, -0.965), (-7.65, 0.965), (-7.65, -0.965))
BESIDE_SECONDS = 20.0
ALIKE = 0.0021  # [s] of the exponential integrator, at which both err alike
SAMPLED, SMOOTH = {"sample_time": 0.001}, {"step": 0.004}


def rows() -> list[tuple | Row]:
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
    return [*out, _side_by_side()]


def _side_by_side() -> Row:
    """Seconds per second flown of the exponential integrator and of Runge–Kutta, and what both err by."""
    problem = load_problem("revenue_vehicle")
    rig, _ = rig_of(problem, problem.approved, 5)
    spacing, split = grid(rig, ALIKE)
    points, flights = round(134.0 * BESIDE_SECONDS / spacing), 16
    tracks = [
        realisation(problem.setting.guideway, length=points * spacing, spacing=spacing, seed=s, speed=134.0)
        for s in range(flights)
    ]
    step = spacing / 134.0 / split
    integrator, guideways = Exponential(rig, step), Guideways.of(tracks, split=split)
    reader = Reader(rig, usual_places(rig))
    whole = _seconds(lambda: flown_over(integrator, guideways, reader, duration=BESIDE_SECONDS, warm_up=0.0))
    ours = whole / flights / BESIDE_SECONDS
    steps = int(BESIDE_SECONDS / step)
    _, path = integrator.fly(integrator.start(1), Guideways.of(tracks[:1], split=split).met(CORNERS, 0, steps))

    def history(h: float, every: int):
        runge_kutta = Simulator.of(replace(rig, step=h))
        taken = _seconds(lambda: runge_kutta.run(steps * step, course=tracks[0], keep_every=every))
        return taken / (steps * step), runge_kutta.run(steps * step, course=tracks[0], keep_every=every)

    theirs, coarse = history(0.001, 1)
    _, fine = history(step / 8, 8)
    at = slice(int(1 / step), steps - 1)
    current = fine.current[:, at.start + 1 : steps].T
    errors = (
        np.abs(path.state[at, 0, 10:14] - current).max(),
        np.abs([np.interp(fine.time[at.start + 1 : steps], coarse.time, c) for c in coarse.current] - current.T).max(),
    )
    words = [f"{e / current.std():.1e}" for e in errors]
    note = (
        f"a second of flight against one by Runge–Kutta at 1 ms; largest error of a current over its rms {words[0]}, "
        f"theirs {words[1]} (with {step * 1e3:.3g} ms against Runge–Kutta at an eighth of it)"
    )
    return against("flights side by side, fifth order force law, a second", ours, theirs, note, at_least=3.0)


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
    for name, ours, peer, ratio, *_ in rows():
        print(f"{name:75s} {ours:9.4f} s {peer:9.4f} s {ratio:8.1f}")

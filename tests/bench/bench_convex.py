"""The Wood-Berry column by the smooth tuner, by convex restriction and by cvxpy's formulation; inequalities; bounds.

All three tuners start from the same slow integral gain. cvxpy's problem is built once with parameters (DPP) and solved
again at every step, on the frequencies that our sequence ends with; its points are judged by the same proof. Everything
runs on one thread.
"""

from collections.abc import Iterator

import numpy as np
from threadpoolctl import threadpool_limits

from tests.bench import Row, alone, best, timed
from workbench.convex.bound import lower_bound
from workbench.convex.delayed import AffineLaw, DelayedPlant, Rational
from workbench.convex.delayed_loop import Sample
from workbench.convex.gain_bound import bounded_real
from workbench.convex.lyapunov import lyapunov_certificate
from workbench.convex.pid_problem import PidProblem, PidTuning, verified
from workbench.convex.restriction import BACK_OFF, restriction
from workbench.convex.smooth_tuner import smooth_tuning
from workbench.files.problem import load_problem
from workbench.lti.norm import peak_gain

PUBLISHED = 2.2465
LONGEST = 10.0  # [s]
FREQUENCIES = 80  # of cvxpy's problem: about as many as our sequence ends with
MASSES = np.linspace(0.85, 1.15, 9)  # shares of the nominal one
STEPS = 15  # about as many as our sequence takes


def rows() -> Iterator[Row]:
    """Tuners, inequalities and bounds."""
    with threadpool_limits(1):
        yield from _tuners()
        yield from _inequalities()
        yield from _bounds()


def column() -> PidProblem:
    """Wood & Berry's column as Boyd, Hast & Åström pose it (2016)."""

    def lag(gain: float, time: float, delay: float) -> Rational:
        return Rational(numerator=(gain,), denominator=(time, 1.0), delay=delay)

    plant = DelayedPlant(
        entries=((lag(12.8, 16.7, 1.0), lag(-18.9, 21.0, 3.0)), (lag(6.6, 10.9, 7.0), lag(-19.4, 14.4, 3.0)))
    )
    smallest = float(np.linalg.svd(plant.static_gain(), compute_uv=False)[-1])
    return PidProblem(
        name="wood_berry", title="Wood-Berry column", plant=plant, law=AffineLaw.pid(2, 2, filter_time=0.3),
        limits={"S": 1.4, "T": 1.4, "Q": 3 / smallest}, sources={},
    )  # fmt: skip


def _tuners() -> Iterator[Row]:
    problem = column()
    restriction(problem, steps=1)  # what is made once
    for name, run in (("smooth tuner", smooth_tuning), ("convex restriction, Clarabel", restriction)):
        seconds, found = timed(lambda run=run: run(problem))
        yield alone(f"Wood-Berry column, {name}, proof included", seconds, f"objective {found.objective:.5f}", LONGEST)
        yield _objective(name, found)
    seconds, found = timed(lambda: by_cvxpy(problem))
    yield alone("Wood-Berry column, convex restriction, cvxpy with parameters", seconds, "built once, solved again")
    yield _objective("cvxpy", found)


def _objective(name: str, found: PidTuning) -> Row:
    good = found.stable and found.within_limits
    note = "limits hold at all frequencies" if good else f"limits fail, for instance at {found.undecided}"
    met = bool(found.objective <= PUBLISHED and good) if name != "cvxpy" else None
    return Row(
        f"Wood-Berry column, {name}: ‖(P(0) K_I)⁻¹‖", found.objective, PUBLISHED, PUBLISHED / found.objective,
        aim=f"<= {PUBLISHED}, within limits" if met is not None else "", met=met, unit="min", note=note,
    )  # fmt: skip


def by_cvxpy(problem: PidProblem) -> PidTuning:
    """The same sequence as a user of cvxpy writes it, on a fixed grid."""
    import warnings
    from time import perf_counter

    import cvxpy as cp

    begin = perf_counter()
    sample = Sample.of(problem.plant, problem.law, np.geomspace(1e-3, 30.0, FREQUENCIES))
    n = len(problem.law.terms)
    x, level = cp.Variable(n), cp.Variable()
    limits = {name: limit * (1 - BACK_OFF) for name, limit in problem.limits.items()}
    rules, pencils = [], []
    for _ in sample.omega:
        for name in limits:  # entries of the real 8 × 8 form, affine in x, as parameters
            size = 8
            F0, F = cp.Parameter((size, size), symmetric=True), cp.Parameter((size * size, n))
            rules.append(F0 + cp.reshape(F @ x, (size, size), order="C") >> 0)
            pencils.append((name, F0, F))
    G0, G = cp.Parameter((2, 2), symmetric=True), cp.Parameter((4, n))
    rules.append(G0 + cp.reshape(G @ x, (2, 2), order="C") - level * np.eye(2) >> 0)
    programme = cp.Problem(cp.Maximize(level), rules)
    integral = problem.plant.static_gain() @ problem.law.integral()
    point = problem.start()
    history = [problem.objective(point)]
    for _ in range(STEPS):
        inverse = np.linalg.inv(sample.returned(point))
        for k, (name, F0, F) in enumerate(pencils):
            f = k // len(limits)
            own = 1j * sample.omega[f] * inverse[f]
            moved = sample.W[f] @ inverse[f]
            over = {"S": 0 * moved, "T": moved, "Q": sample.Q[f] @ inverse[f]}[name] / limits[name]
            fixed = own / limits[name] if name == "S" else 0 * own
            F0.value = _real(np.block([[own + own.conj().T - np.eye(2), fixed.conj().T], [fixed, np.eye(2)]]))
            F.value = np.array(
                [
                    _real(np.block([[m + m.conj().T, o.conj().T], [o, 0 * m]])).ravel()
                    for m, o in zip(moved, over, strict=True)
                ]
            ).T
        here = np.tensordot(point, integral, 1)
        size = float(np.linalg.svd(here, compute_uv=False)[-1]) ** 2
        G0.value = -(here.T @ here) / size
        G.value = np.array([(m.T @ here + here.T @ m).ravel() / size for m in integral]).T
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # "may be inaccurate": judged below
            programme.solve(solver=cp.CLARABEL)
        if x.value is None or problem.objective(x.value) >= history[-1]:
            break
        point = x.value
        history.append(problem.objective(point))
    return verified(problem, point, history=history, solves=len(history), frequencies=FREQUENCIES,
                    seconds=lambda: perf_counter() - begin, outcome="fixed grid")  # fmt: skip


def _real(M: np.ndarray) -> np.ndarray:
    return np.block([[M.real, -M.imag], [M.imag, M.real]])


def _inequalities() -> Iterator[Row]:
    for name in ("heave_pitch", "sway_roll_yaw"):
        problem = load_problem(name)
        groups = [
            problem.with_vehicle(problem.vehicle.with_values(mass=share * problem.vehicle.mass)).subjects[0]
            for share in MASSES
        ]
        matrices = [group.close(problem.gains).A for group in groups]
        seconds, found = timed(lambda matrices=matrices: lyapunov_certificate(matrices))
        note = f"{len(matrices[0])} states, margin {found.margin:.3g} 1/s, condition {found.condition:.3g}"
        yield alone(f"{name}: common Lyapunov matrix at nine masses, holds: {found.holds}", seconds, note)
        seconds, found = timed(
            lambda matrices=matrices: lyapunov_certificate(matrices, parameters=MASSES, rate=0.05)
        )  # fmt: skip
        yield alone(f"{name}: the same affine in the mass, 5 % a second, holds: {found.holds}", seconds, note)
        loop = groups[4].sensitivity(groups[4].close(problem.gains))
        seconds, bound = timed(lambda loop=loop: bounded_real([loop]))
        hamiltonian = best(lambda loop=loop: peak_gain(*loop), 3)
        note = f"ours an inequality: {bound.bound:.6f}; peer our Hamiltonian two-step: {peak_gain(*loop).value:.6f}"
        yield Row(f"{name}: peak sensitivity from above", seconds, hamiltonian, hamiltonian / seconds, note=note)


def _bounds() -> Iterator[Row]:
    for name in ("heave_pitch", "sway_roll_yaw", "revenue_vehicle"):
        problem = load_problem(name)
        for noise in (False, True):
            seconds, found = timed(lambda problem=problem, noise=noise: lower_bound(problem, noise=noise))
            note = f"bound {found.bound:.4g}, J {found.cost:.4g}, √(bound/J) {found.ratio:.3f}, active: {found.active}"
            yield alone(f"{name}: bound of J from below, {'with' if noise else 'without'} sensor noise", seconds, note)

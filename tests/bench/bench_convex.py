"""The Wood-Berry column by the smooth tuner, by convex restriction and by cvxpy's formulation; inequalities; bounds.

All three tuners start from the same slow integral gain. cvxpy's problem is built once with parameters (DPP) and solved
again at every step, on a fixed grid; its points are judged by the same exact measures. Everything runs on one thread.
"""

from collections.abc import Iterator

import numpy as np
from threadpoolctl import threadpool_limits

from tests.bench import Row, alone, timed
from workbench.convex.bound import lower_bound
from workbench.convex.lyapunov import lyapunov_certificate
from workbench.design.design import design
from workbench.design.problem import Problem
from workbench.design.record import Design, given
from workbench.design.restriction.affine import Affine
from workbench.design.restriction.local import BACK_OFF
from workbench.design.restriction.sequence import tangent
from workbench.files.problem import load_problem

PUBLISHED, MINUTE = 2.2465, 60.0  # [min], [s]
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


def _tuners() -> Iterator[Row]:
    problem = load_problem("wood_berry")
    design(problem, method="restriction", seconds=0.1)  # what is made once
    for name, method in (("smooth method", "slsqp"), ("convex restriction, Clarabel", "restriction")):
        seconds, found = timed(lambda method=method: design(problem, method=method))
        value = found.verdicts[-1].value / MINUTE
        yield alone(f"Wood-Berry column, {name}, verdicts included", seconds, f"objective {value:.5f}", LONGEST)
        yield _objective(name, found)
    seconds, found = timed(lambda: by_cvxpy(problem))
    yield alone("Wood-Berry column, convex restriction, cvxpy with parameters", seconds, "built once, solved again")
    yield _objective("cvxpy", found)


def _objective(name: str, found: Design) -> Row:
    *hard, soft = found.verdicts
    good = all(v.met for v in hard)
    note = "limits hold at all frequencies" if good else f"limits fail: {next(v.where for v in hard if not v.met)}"
    value = soft.value / MINUTE
    met = bool(value <= PUBLISHED and good) if name != "cvxpy" else None
    return Row(
        f"Wood-Berry column, {name}: ‖(P(0) K_I)⁻¹‖", value, PUBLISHED, PUBLISHED / value,
        aim=f"<= {PUBLISHED}, within limits" if met is not None else "", met=met, unit="min", note=note,
    )  # fmt: skip


def by_cvxpy(problem: Problem) -> Design:
    """The same sequence as a user of cvxpy writes it, on a fixed grid."""
    import warnings

    import cvxpy as cp

    affine = Affine(problem)
    grid = np.geomspace(1e-3 / MINUTE, 30.0 / MINUTE, FREQUENCIES)
    rows = [affine.rows(k, grid) for k in range(len(affine.limited))]
    point = affine.start()
    n, p = len(point), affine.integral.shape[-1]
    x, level = cp.Variable(n), cp.Variable()
    size, rules, pencils = 4 * p, [], []
    for _ in rows:
        for _ in grid:  # entries of the real form, affine in x, as parameters
            F0, F = cp.Parameter((size, size), symmetric=True), cp.Parameter((size * size, n))
            rules.append(F0 + cp.reshape(F @ x, (size, size), order="C") >> 0)
            pencils.append((F0, F))
    G0, G = cp.Parameter((p, p), symmetric=True), cp.Parameter((p * p, n))
    rules.append(G0 + cp.reshape(G @ x, (p, p), order="C") - level * np.eye(p) >> 0)
    programme = cp.Problem(cp.Maximize(level), rules)
    best = affine.objective(point)
    for _ in range(STEPS):
        units = affine.sizes(point)
        blocks = [tangent(one, point, units, BACK_OFF) for one in rows]
        each = [(F0, F) for block in blocks for F0, F in zip(block.F0, block.F, strict=True)]
        for (F0, F), (constant, linear) in zip(pencils, each, strict=True):
            F0.value = _real(constant)
            F.value = np.array([_real(M).ravel() for M in linear[:-1]]).T
        here = np.tensordot(point, affine.integral, 1)
        least = float(np.linalg.svd(here, compute_uv=False)[-1]) ** 2
        G0.value = -(here.T @ here) / least
        G.value = np.array(
            [(m.T @ here + here.T @ m).ravel() * u / least for u, m in zip(units, affine.integral, strict=True)]
        ).T
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # "may be inaccurate": judged below
            programme.solve(solver=cp.CLARABEL)
        if x.value is None or affine.objective(x.value * units) >= best:
            break
        point = x.value * units
        best = affine.objective(point)
    return given(problem, dict(zip(problem.structure.names, point.tolist(), strict=True)), solver="cvxpy")


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


def _bounds() -> Iterator[Row]:
    for name in ("heave_pitch", "sway_roll_yaw", "comfort_limit"):
        problem = load_problem(name)
        for noise in (False, True):
            seconds, found = timed(lambda problem=problem, noise=noise: lower_bound(problem, noise=noise))
            note = f"bound {found.bound:.4g}, J {found.cost:.4g}, √(bound/J) {found.ratio:.3f}, active: {found.active}"
            yield alone(f"{name}: bound of J from below, {'with' if noise else 'without'} sensor noise", seconds, note)

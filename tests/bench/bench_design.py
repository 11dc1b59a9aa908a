"""The optimiser's work on `comfort_limit`: gradients against finite differences, a design against a global search.

The peers' values agree with ours to rounding, their differences with our derivatives to the differences' own error;
otherwise the run stops. Everything but the commands runs on one thread.
"""

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from time import perf_counter

import numpy as np
from threadpoolctl import threadpool_limits

from tests.bench import Row, against, alone, best, timed
from tests.bench.vehicle_peer import ROUTES, ByFraction, ByHand, ByNames, ByPlant, Reduction, slack
from workbench.control import Gains
from workbench.design.design import design
from workbench.design.problem import Problem
from workbench.design.solve import relaxed, stable_start
from workbench.design.starts import BACK_OFFS, CENTRE, SPREADS
from workbench.design.steering import Programme
from workbench.files.problem import load_problem

PROBLEM = "comfort_limit"
STARTS = 3  # of the design and of the solvers that are compared; the command's default is more
LONGEST_SEARCH = 120.0  # [s] of the global search
RUN = "from workbench.cli import main; main()"
STEP = 1e-7  # of the differences; the variables are of size one
SMOOTHING = 1e-7  # relative: what the smoothed absolute values add to the static errors
DIFFERENCING = 1e-4  # relative to the largest slope: error of a forward difference with that step
ABOUT = {
    ByNames: ("python-control, by names", "interconnect() by signal names, then the system called", 300.0),
    ByFraction: ("python-control, by lft()", "lft() of a plant prepared beforehand: the leanest way found", None),
    ByPlant: ("our vectorised response", "loop.close() and Plant.response(), a batched NumPy solve", 20.0),
    ByHand: ("hand-made NumPy", "the plant's responses beforehand, 4×4 matrices at all frequencies at once", None),
}


def rows() -> Iterator[Row]:
    """Gradients, whole designs, solvers, and the command with and without a C compiler."""
    with threadpool_limits(1):
        problem = load_problem(PROBLEM)
        yield from _gradients(problem)
        yield from _designs(problem)
        yield from _solvers(problem)
    yield from _commands()


def _gradients(problem: Problem) -> Iterator[Row]:
    programme = Programme(problem)
    x = programme.x(Gains(**CENTRE))
    shifts = iter(1e-9 * np.arange(1, 1000))
    ours = best(lambda: programme.at(x + next(shifts)), 100)
    value, slope = _values(programme, x)
    for route in ROUTES:
        peer = route(problem)
        vector = peer(programme.theta(x)).vector()[: len(value)]
        if np.abs(vector / value - 1).max() > SMOOTHING:
            raise RuntimeError(f"{route.__name__} and our measures disagree by {np.abs(vector / value - 1).max():.1e}")
        error = np.abs(_differences(peer, programme, x)[: len(value)] - slope) / np.abs(slope).max(
            axis=1, keepdims=True
        )
        if error.max() > DIFFERENCING:
            raise RuntimeError(f"differences by {route.__name__} and our derivatives disagree by {error.max():.1e}")
        name, note, aim = ABOUT[route]
        theirs = best(lambda peer=peer: _differences(peer, programme, x), 3)
        note = f"forward differences in {len(x)} variables, {len(x) + 1} evaluations of all values: {note}"
        yield against(f"cost and constraint gradients, against {name}", ours, theirs, note, aim)


def _values(programme: Programme, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """log J and the mean squares in the peers' order, and their slopes by the variables."""
    theta, point = programme.theta(x), programme.at(x)
    squares: dict[str, float] = {}
    slopes: dict[str, np.ndarray] = {}
    for group in programme.groups:
        mean = group.responses(theta).mean
        for name, value, slope in zip(group.classes, mean.value, mean.gradient, strict=True):
            squares[name] = squares.get(name, 0.0) + value
            slopes[name] = slopes.get(name, 0.0) + slope
    order = list(dict.fromkeys(Reduction(programme.problem).names))
    inner = np.array([(programme.theta(x + h) - programme.theta(x - h)).sum() for h in STEP * np.eye(len(x))]) / (
        2 * STEP
    )
    gradient = np.array([slopes[name][programme.free] * inner for name in order])
    return np.array([point.objective, *(squares[name] for name in order)]), np.vstack([point.slope, gradient])


def _differences(peer: Reduction, programme: Programme, x: np.ndarray) -> np.ndarray:
    """Forward differences of everything by the variables."""
    start = peer(programme.theta(x)).vector()
    return np.column_stack([(peer(programme.theta(x + h)).vector() - start) / STEP for h in STEP * np.eye(len(x))])


def _designs(problem: Problem) -> Iterator[Row]:
    ours, found = timed(lambda: design(problem, starts=STARTS))
    allowed = min(10 * ours, LONGEST_SEARCH)
    theirs, cost, missed, count = _global_search(problem, allowed)
    better = cost is None or found.analysis.cost < cost
    end = (
        f"its best point misses a limit by {100 * missed:.2g} %" if cost is None else "its best point meets every limit"
    )
    note = (
        f"scipy differential_evolution, 15 × 15 points, constraints by its own rules, values by hand-made NumPy, "
        f"stopped after {allowed:.0f} s and {count} evaluations: {end}"
    )
    yield Row(
        f"a design from a cold start ({STARTS} starts), against a global search", ours, theirs, theirs / ours,
        aim="better cost in a tenth of the time", met=better and 10 * ours <= theirs, note=note,
    )  # fmt: skip
    yield Row(
        "  cost J reached", found.analysis.cost, cost, None if cost is None else cost / found.analysis.cost, unit="J"
    )


def _global_search(problem: Problem, seconds: float) -> tuple[float, float | None, float, int]:
    """(time, cost of the best feasible point or None, largest relative miss, evaluations)."""
    from scipy.optimize import NonlinearConstraint, differential_evolution

    programme, peer = Programme(problem), ByHand(problem)
    known: dict[bytes, tuple[float, np.ndarray]] = {}
    count = 0

    def values(x: np.ndarray) -> tuple[float, np.ndarray]:
        nonlocal count
        key = x.tobytes()
        if key not in known:
            count += 1
            known.clear()  # the search asks for the constraints of a point, then for its cost
            measured = peer(programme.theta(x))
            known[key] = measured.cost, slack(problem, measured)
        return known[key]

    end = perf_counter() + seconds
    spent, result = timed(
        lambda: differential_evolution(
            lambda x: values(x)[0], list(zip(*programme.bounds(), strict=True)), seed=0, polish=False, maxiter=10**6,
            constraints=NonlinearConstraint(lambda x: values(x)[1], 0.0, np.inf),
            callback=lambda *_, **__: perf_counter() > end,
        )
    )  # fmt: skip
    cost, left = values(np.asarray(result.x))
    return spent, cost if left.min() >= 0 else None, float(max(0.0, -left.min())), count


def _solvers(problem: Problem) -> Iterator[Row]:
    ours, best_cost, counts = _solved(problem, "slsqp")
    theirs, peer_cost, peer_counts = _solved(problem, "ipopt")
    note = (
        "IPOPT with a limited-memory Hessian, same callbacks and starts, sensitivity relaxed; "
        f"(feasible ends, evaluations): IPOPT {peer_counts}, SLSQP {counts}"
    )
    yield against(f"SLSQP from {STARTS} stable starts, against IPOPT", ours, theirs, note)
    if best_cost is not None:
        ratio = None if peer_cost is None else peer_cost / best_cost
        yield Row("  best feasible cost J reached", best_cost, peer_cost, ratio, unit="J")


def _solved(problem: Problem, solver: str) -> tuple[float, float | None, tuple[int, int]]:
    """(seconds, best feasible cost, (feasible ends, evaluations)) of one solver from the common starts."""
    programme, generator = Programme(problem, back_off=BACK_OFFS[0]), np.random.default_rng(0)
    centre = programme.x(Gains(**CENTRE))
    points = [stable_start(programme, centre, generator, SPREADS[k % len(SPREADS)]) for k in range(STARTS)]
    seconds, outcomes = timed(lambda: [relaxed(programme, x, solver=solver) for x in points])
    costs = [o.cost for o in outcomes if o.feasible]
    return seconds, min(costs, default=None), (len(costs), sum(o.evaluations for o in outcomes))


def _commands() -> Iterator[Row]:
    modules = "workbench.design.steering as s, workbench.files.problem as e"
    build = f"import {modules}; s.Programme(e.load_problem({PROBLEM!r}))"
    whole = f"workbench design {PROBLEM}: all starts on all cores, trade-off, robustness, table and report"
    with tempfile.TemporaryDirectory() as folder:
        fresh = {"WORKBENCH_CACHE": f"{folder}/cache"}
        seconds, worked = _process(["-c", build], fresh)
        note = f"Programme() with an empty cache, interpreter included; {worked:.1f} s of processor time"
        yield alone("compiling the kernels, once per machine", seconds, note)
        for name, more, limit in (
            ("make design with a warm cache", fresh, 30.0),
            ("make design without a C compiler", {"WORKBENCH_COMPILER": "none"}, 120.0),
        ):
            seconds, worked = _process(["-c", RUN, "design", PROBLEM, "--json", "--out", f"{folder}/{limit:g}"], more)
            yield alone(name, seconds, f"{whole}; {worked:.0f} s of processor time", limit)


def _process(arguments: list[str], more: dict[str, str]) -> tuple[float, float]:
    """Seconds that a Python process takes, and how many of them, on all cores, it works."""

    def worked() -> float:
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime

    def work() -> None:
        subprocess.run([sys.executable, *arguments], env=os.environ | more, check=True, stdout=subprocess.DEVNULL)

    before = worked()
    return timed(work)[0], worked() - before

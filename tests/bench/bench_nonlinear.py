"""The nonlinear ride: how long the closure and its gradients take, and how it agrees with drawn guideways.

Ratios of the cost, nonlinear over linear: ours by the closure, the peer's by 16 guideways drawn with one seed, each
beside the linear ride over the same one; the note has the standard error.
"""

from collections.abc import Iterator

from threadpoolctl import threadpool_limits

from tests.bench import Row, alone, best, timed
from workbench.analysis.analysis import analyse
from workbench.analysis.nonlinear_ride import BentLoop
from workbench.files.problem import load_problem

PROBLEMS = ("revenue_vehicle", "robust_vehicle", "comfort_limit", "hybrid_motor", "report_1975")
MISSES = 0.03  # what the closure may miss of the cost, beside two standard errors


def rows() -> Iterator[Row]:
    """Times on `revenue_vehicle`, then every problem's cost."""
    with threadpool_limits(1):
        for name in PROBLEMS:
            problem = load_problem(name)
            bend = problem.setting.bend
            assert bend is not None
            seconds = timed(lambda b=bend: b.curvature)[0]
            at = BentLoop(problem.setting, problem.approved)
            linear = analyse(problem.setting, problem.approved).cost
            if name == PROBLEMS[0]:
                yield alone(
                    "derivatives of the coils' forces to the fifth, once a process", seconds, "power series", 3.0
                )
                fresh = best(lambda p=problem: BentLoop(p.setting, p.approved).cost_change, 3)
                yield alone("nonlinear ride cost", fresh, "responses, closure", 1.0)
                yield alone("its gradient by seventeen parameters", best(lambda a=at: _slope(a), 3), "adjoint", 1.0)
            closure = 1 + at.cost_change / linear
            drawn = at.drawn(rides=16, seed=0)
            off = abs(closure / drawn.ratio[0] - 1)
            yield Row(
                f"{name}: nonlinear over linear cost", closure, float(drawn.ratio[0]), None, "within 3 % and 2 errors",
                off <= MISSES + 2 * drawn.error[0], "",
                f"drawn: ± {drawn.error[0]:.4f}, {drawn.rides} rides of {at.loop.duration:.3g} s, {drawn.lost} lost",
            )  # fmt: skip


def _slope(at: BentLoop) -> None:
    at.__dict__.pop("cost_slope", None)  # asked for anew
    _ = at.cost_slope

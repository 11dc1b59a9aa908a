"""A study of 10 000 analyses in points per second, against a loop over python-control computing the same figures.

Both in one process on one thread. The figures agree to the tolerance stated at the comparison; otherwise the run stops.
"""

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from tests.bench import Row, against, alone, timed
from workbench.analysis.analysis import analyse
from workbench.analysis.mode import REAL
from workbench.analysis.response import Driven, driven
from workbench.analysis.setting import Setting
from workbench.constants import GRAVITY
from workbench.control import Gains
from workbench.control.gains import GAIN_NAMES
from workbench.files.problem import load_problem
from workbench.lti.signals import numbered
from workbench.study.definition import Limit, Parameter, Study
from workbench.study.run import StudyResult, run_study

PROBLEM = "comfort_limit"
POINTS = 10_000
COMPARED = 40  # points of the loops; the time of a point does not depend on how many there are
AGREEMENT = 1e-5  # relative; python-control's norm stops at 1e-6 of both sides
STEADY = Limit(quantity="damping", sense=">=", value=0.2)  # of its own: the problem's would need its delay margin too
WIDTH = 0.02  # of each gain, so that every loop is stable and nothing is skipped
QUANTITIES = (
    "stable", "damping", "decay", "peak_sensitivity.heave_pitch", "peak_sensitivity.sway_roll_yaw", "cost",
    "rms.gap.front", "rms.gap.rear", "rms.gap_lateral.front", "rms.gap_lateral.rear", "sum_alpha_squared",
    "static_error.gap", "static_error.gap_lateral",
)  # fmt: skip


def rows() -> Iterator[Row]:
    """A study of gains, one of gains and vehicle, and the parts of the first."""
    problem = load_problem(PROBLEM)
    approved = problem.approved
    if approved is None:
        raise RuntimeError(f"{PROBLEM} has no approved gains")
    free = [name for name in GAIN_NAMES if getattr(approved, name) != 0 and name not in ("K_heave", "K_sway")]
    gains = tuple(_around(name, getattr(approved, name)) for name in free)
    factors = tuple(_around(name, 1.0) for name in ("mass", "inertia.pitch", "inertia.roll", "current_force"))
    with threadpool_limits(1), TemporaryDirectory() as place:
        folder = Path(place)
        _study(gains, folder / "first", 2 * COMPARED)  # imports and compiled functions
        ours, result = timed(lambda: _study(gains, folder / "gains"))
        settings = [(problem.setting, _gains(result, approved, k)) for k in range(COMPARED)]
        loops = [_prepared(*one) for one in settings]
        peer, theirs = timed(lambda: [_python_control(*one) for one in loops])
        _agree(result, theirs)
        computing = result.provenance["compute_seconds"]
        note = (
            f"python-control's poles, norm(p='inf') to 1e-6, lyap for mean squares, dcgain for static errors: "
            f"{COMPARED} points scaled to {POINTS}; its loops and systems made ready untimed. Ours is the whole study, "
            f"table and all, {POINTS / ours:.0f} points/s; rows alone {POINTS / computing:.0f} points/s"
        )
        yield against(
            f"study of {POINTS} analyses over {len(gains)} gains", ours, peer * POINTS / COMPARED, note, 100.0
        )
        exact, _ = timed(lambda: [analyse(*one) for one in settings])
        yield against(
            f"rows of that study: {POINTS} analyses", computing, exact * POINTS / COMPARED,
            "our own exact analysis, one by one",
        )  # fmt: skip
        both, whole = timed(lambda: _study((*gains, *factors), folder / "both"))
        yield alone(
            f"study of {POINTS} analyses over gains and {len(factors)} factors of the vehicle", both,
            f"plants from a proved family; the rows alone {POINTS / whole.provenance['compute_seconds']:.0f} points/s",
        )  # fmt: skip
        yield alone("the same study found finished", timed(lambda: _study(gains, folder / "gains"))[0], "")


def _around(name: str, value: float) -> Parameter:
    low, high = sorted((value * (1 - WIDTH), value * (1 + WIDTH)))
    return Parameter(name=name, distribution="uniform", low=low, high=high)


def _study(parameters: tuple[Parameter, ...], folder: Path, count: int = POINTS) -> StudyResult:
    study = Study(problem=PROBLEM, count=count, parameters=parameters, quantities=QUANTITIES, limits=(STEADY,))
    return run_study(study, folder)


def _gains(result: StudyResult, approved: Gains, row: int) -> Gains:
    return approved.with_values(**{name: result.columns[name][row] for name in result.study.names})


class _Group(NamedTuple):
    """One group made ready: closed loop, sensitivity, driven system with the outputs asked for, bias inputs."""

    name: str
    loop: Any
    sensitivity: Any
    driven: Driven
    outputs: list[str]
    C: np.ndarray
    bias: Any


def _prepared(setting: Setting, gains: Gains) -> tuple[Setting, list[_Group]]:
    """What python-control is given."""
    import control

    n, out = setting.law.count, []
    sensors = [f"error_{name}" for name in numbered("acceleration_z", n) + numbered("acceleration_y", n)]
    for s in setting.subjects:
        closed = s.close(gains)
        d = driven(setting, s, closed)
        names = [f"{kind}_{i + 1}" for kind in ("gap", "gap_lateral") for i in setting.ends]
        C = np.vstack([d.rows(names), d.rows(numbered("current", n)), *(row[None] for row in d.weighted.values())])
        seen = closed.select(inputs=sensors, outputs=numbered("gap", n) + numbered("gap_lateral", n))
        out.append(
            _Group(
                s.name, closed.to_control(), control.ss(*s.sensitivity(closed)), d,
                [*names, *["alpha"] * n, *["felt"] * len(d.weighted)], C, seen.to_control(),
            )
        )  # fmt: skip
    return setting, out


def _python_control(setting: Setting, groups: list[_Group]) -> dict[str, float]:
    """The same figures by python-control."""
    import control
    from scipy.linalg import expm

    found: dict[str, float] = {}
    squares: dict[str, float] = {}
    n, poles, static = setting.law.count, [], 0.0
    for g in groups:
        poles.append(control.poles(g.loop))
        found[f"peak_sensitivity.{g.name}"] = float(control.norm(g.sensitivity, p="inf", tol=1e-6))
        met_again = expm(g.driven.A * g.driven.delay) @ g.driven.B_front
        for k in range(len(g.driven.types)):
            front, rear = g.driven.B_front[:, k], g.driven.B_rear[:, k]
            cross = np.outer(met_again[:, k], rear)
            P = control.lyap(g.driven.A, np.outer(front, front) + np.outer(rear, rear) + cross + cross.T)
            for name, value in zip(g.outputs, np.einsum("pi,ij,pj->p", g.C, P, g.C), strict=True):
                squares[name] = squares.get(name, 0.0) + float(value)
        static = static + np.real(control.dcgain(g.bias))
    p = np.concatenate(poles)
    moving = p[np.abs(p.imag) > REAL * np.abs(p)]
    worst = np.abs(static).sum(axis=1) * setting.accelerometer_bias
    ends = dict(zip(("front", "rear"), setting.ends, strict=True))
    return found | {
        "decay": float(-p.real.max()), "damping": float((-moving.real / np.abs(moving)).min()),
        "cost": 1e4 / GRAVITY**2 * squares["felt"], "sum_alpha_squared": squares["alpha"],
        **{f"rms.{kind}.{end}": float(np.sqrt(squares[f"{kind}_{i + 1}"]))
           for kind in ("gap", "gap_lateral") for end, i in ends.items()},
        "static_error.gap": float(worst[:n].max()), "static_error.gap_lateral": float(worst[n:].max()),
    }  # fmt: skip


def _agree(result: StudyResult, theirs: list[dict[str, float]]) -> None:
    for row, figures in enumerate(theirs):
        for name, value in figures.items():
            ours = result.columns[name][row]
            if ours is None or abs(ours - value) > AGREEMENT * abs(value):
                raise RuntimeError(f"{name} in row {row}: ours {ours!r}, python-control's {value!r}")

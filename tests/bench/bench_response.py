"""Exact measures of `comfort_limit` against python-control and scipy, and how long the commands take to answer.

The peers' results agree with ours to the tolerance stated at each comparison; otherwise the run stops.
"""

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from tests.bench import Row, against, alone, best
from workbench.analysis.response import driven
from workbench.analysis.setting import Setting
from workbench.control import Gains
from workbench.control.loop.closed import close
from workbench.design.starts import CENTRE
from workbench.files.problem import load_problem
from workbench.lti.norm import peak_gain
from workbench.lti.realisation import frequency_response
from workbench.lti.signals import COORDINATES, numbered

PROBLEM = "comfort_limit"
FREQUENCY_HZ = np.geomspace(1e-3, 60.0, 1000)
PEAK_TOLERANCE = 1e-6  # relative, of both sides


def rows() -> Iterator[Row]:
    """Frequency response, peak of the sensitivity, mean squares with delay, and the commands."""
    setting, gains = load_problem(PROBLEM).setting, Gains(**CENTRE)
    with threadpool_limits(1):
        yield _response(setting, gains)
        yield _peak(setting, gains)
        yield _mean_squares(setting, gains)
    yield from _commands(gains)


def _response(setting: Setting, gains: Gains) -> Row:
    law = setting.law
    outputs = [f"{c}_acceleration" for c in COORDINATES]
    outputs += [name for kind in ("gap", "gap_lateral", "current") for name in numbered(kind, law.count)]
    closed = close(setting.plant, law, gains).system
    seen = closed.select(inputs=numbered("zeta", law.count) + numbered("eta", law.count), outputs=outputs)
    system, omega = seen.to_control(), 2 * np.pi * FREQUENCY_HZ
    ours, theirs = frequency_response(seen.A, seen.B, seen.C, seen.D, omega), system(1j * omega).transpose(2, 0, 1)
    _agree("frequency responses", ours, theirs, 1e-11)  # 24 states, condition of the balanced matrix 1e3
    return against(
        f"response of {len(outputs)} outputs to 8 inputs at {len(omega)} frequencies",
        best(lambda: frequency_response(seen.A, seen.B, seen.C, seen.D, omega), 15),
        best(lambda: system(1j * omega), 3),
        "python-control: the closed loop's StateSpace called; one solve per frequency", 10.0,
    )  # fmt: skip


def _peak(setting: Setting, gains: Gains) -> Row:
    import control

    loops = [s.sensitivity(s.close(gains)) for s in setting.subjects]
    systems = [control.ss(*loop) for loop in loops]
    ours = [peak_gain(*loop).value for loop in loops]
    _agree("peak sensitivities", ours, [control.norm(s, p="inf", tol=PEAK_TOLERANCE) for s in systems], 1e-5)
    return against(
        "peak sensitivity of both groups, over all frequencies, bracketed",
        best(lambda: [peak_gain(*loop, tolerance=PEAK_TOLERANCE) for loop in loops], 10),
        best(lambda: [control.norm(s, p="inf", tol=PEAK_TOLERANCE) for s in systems], 3),
        "python-control's norm(p='inf') to the same 1e-6: bisection on Hamiltonian eigenvalues",
    )  # fmt: skip


def _mean_squares(setting: Setting, gains: Gains) -> Row:
    from scipy.linalg import expm, solve_continuous_lyapunov

    systems = [driven(setting, s, s.close(gains)) for s in setting.subjects]

    def peer() -> list[np.ndarray]:
        found = []
        for system in systems:
            met_again = expm(system.A * system.delay) @ system.B_front
            for front, rear, again in zip(system.B_front.T, system.B_rear.T, met_again.T, strict=True):
                cross = np.outer(again, rear)
                found.append(solve_continuous_lyapunov(
                    system.A, -(np.outer(front, front) + np.outer(rear, rear) + cross + cross.T)
                ))  # fmt: skip
        return found

    def squares(covariances) -> np.ndarray:
        numbers = iter(covariances)
        return np.concatenate([
            [np.diag(C @ next(numbers) @ C.T) for _ in system.types]
            for system, C in zip(systems, rows_of, strict=True)
        ])  # fmt: skip

    rows_of = [np.array(list(system.weighted.values())) for system in systems]
    ours = np.concatenate([system.stationary().mean_squares(C) for system, C in zip(systems, rows_of, strict=True)])
    _agree("mean squares", ours, squares(peer()), 1e-7)  # scipy's solution is not refined; the states span 1e6
    return against(
        "mean squares with the wheel-base delay, all types, with error bounds",
        best(lambda: [system.stationary() for system in systems], 10), best(peer, 5),
        "scipy: expm and one solve_continuous_lyapunov per type; neither refined nor bounded",
    )  # fmt: skip


def _agree(what: str, ours, theirs, tolerance: float) -> None:
    error = np.abs(np.asarray(ours) - np.asarray(theirs)).max() / np.abs(np.asarray(theirs)).max()
    if error > tolerance:
        raise RuntimeError(f"{what}: the routes disagree by {error:.1e} of the largest")


def _commands(gains: Gains) -> Iterator[Row]:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "gains.toml"
        file.write_text("\n".join(f"{name} = {value!r}" for name, value in gains.as_dict().items()))
        analyse = [
            "-c",
            "from workbench.cli import main; main()",
            "analyse",
            PROBLEM,
            "--gains",
            str(file),
            "--json",
        ]
        yield alone("cold workbench analyse", _process(analyse), "the whole process", 3.0)
    command = "from workbench.cli import main; main()"
    yield alone("workbench --help", _process(["-c", command, "--help"]), "the whole process", 1.0)
    yield alone("import workbench", _process(["-c", "import workbench"]), "the whole process", 0.5)
    everything = "import workbench.design.design, workbench.files.problem, workbench.analysis.full"
    yield alone("importing what an analysis and a design use", _process(["-c", everything]), "the whole process")


def _process(arguments: list[str]) -> float:
    """Shortest of three runs of a Python process [s]."""

    def run() -> None:
        subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)

    return best(run, 3)

"""The explorer's answer to a moved slider, and how long each command takes before it says anything."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from tests.bench import Row, alone, best
from workbench.explore import Session
from workbench.explore.picture import Picture
from workbench.files.problem import load_problem, shipped_problems

PROGRAM = str(Path(sys.executable).parent / "workbench")
TABLE = str(shipped_problems()["heave"] / "approved.json")
COMMANDS = {
    "--help": ("--help",), "problems": ("problems",), "analyse": ("analyse", "heave"),
    "model": ("model", "heave"), "compare": ("compare", "heave", "heave_pitch"), "forces": ("forces",),
    "motor": ("motor",), "propulsion": ("propulsion",), "noise": ("noise",), "verify": ("verify", TABLE),
    "export": ("export", TABLE, "--format", "csv"),
}  # fmt: skip
LONGEST = 0.1  # [s] of the linear analyses behind a moved slider
REPEATS = 7


def rows() -> Iterator[Row]:
    """Analyses and picture of the largest shipped problem; then each command that does not search, cold."""
    session, picture = Session(load_problem("comfort_limit")), Picture()
    picture.png(session.snapshot)
    factor = iter(1 + 1e-3 * k for k in range(10 * REPEATS))

    def move() -> None:
        session.set(K_zdot=session.gains.K_zdot * next(factor))
        _ = session.snapshot

    analysed = best(move, REPEATS)
    yield alone("explorer: analyses after a moved slider, comfort_limit", analysed,
                "poles, margins, mean squares, spectra, loops, root locus, every requirement", LONGEST)  # fmt: skip
    yield alone("explorer: analyses and picture", best(lambda: (move(), picture.png(session.snapshot)), REPEATS),
                "the same, drawn and packed as PNG")  # fmt: skip
    for name, arguments in COMMANDS.items():
        yield alone(f"cold start: workbench {name}", best(lambda a=arguments: _run(a), 3), "a process of its own")


def _run(arguments) -> None:
    subprocess.run([PROGRAM, *arguments], check=False, capture_output=True)

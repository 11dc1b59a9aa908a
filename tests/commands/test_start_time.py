"""The command answers at once: what starting costs, and which libraries it must not touch."""

import subprocess
import sys
from time import perf_counter

import pytest

SLACK = 3.0  # the limits hold on an idle machine; tests share theirs
HEAVY = ("scipy", "control", "matplotlib", "cvxpy", "pandas")


def process(code: str, *arguments: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, timeout=60, check=True
    )


def seconds(code: str, *arguments: str) -> float:
    times = []
    for _ in range(2):  # the first may find cold files
        start = perf_counter()
        process(code, *arguments)
        times.append(perf_counter() - start)
    return min(times)


def test_importing_takes_less_than_half_a_second():
    assert seconds("import workbench") < 0.5 * SLACK


def test_help_takes_less_than_a_second():
    assert seconds("from workbench.cli import main; main()", "--help") < 1.0 * SLACK


@pytest.mark.parametrize(
    "work",
    [
        "import workbench",
        "import workbench.cli",
        "import workbench.design.design, workbench.analysis.full, workbench.files.problem, workbench.plots.design",
        "from workbench.cli import run; run(['--help'])",
        "from workbench.cli import run; run(['problems'])",
    ],
)
def test_slow_libraries_are_imported_only_where_they_are_used(work):
    found = process(f"{work}\nimport sys\nprint('\\n', [m for m in {HEAVY!r} if m in sys.modules])")
    assert found.stdout.splitlines()[-1].strip() == "[]"

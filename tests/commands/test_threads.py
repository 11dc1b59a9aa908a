"""One thread for linear algebra: set where the libraries are loaded, and designs that do not depend on the process."""

import os
import subprocess
import sys

import pytest

from workbench.machine.threads import VARIABLES, one_thread

# A first design in a fresh process: threads of every BLAS while a start is solved, then the gains to the last bit
FIRST = """
import sys
import threadpoolctl
from workbench.files.problem import load_problem
import workbench.design.starts as module
from workbench.design.design import design

def watched(*arguments, _own=module.relaxed, **options):
    out = _own(*arguments, **options)
    print({i["num_threads"] for i in threadpoolctl.threadpool_info()})
    return out

module.relaxed = watched
assert "scipy.linalg" not in sys.modules
print(*map(float.hex, design(load_problem("heave"), starts=1).gains.as_dict().values()))
"""
# Equal designs in any order, with one to three processes
EQUAL = """
import sys
from workbench.design.design import design
from workbench.files.problem import load_problem

if __name__ == "__main__":
    heave = load_problem("heave")
    for k, workers in enumerate(map(int, sys.argv[1])):
        if k % 3 == 1:
            design(heave, starts=2, seed=k)  # another one in between
        print(*map(float.hex, design(heave, starts=3, workers=workers).gains.as_dict().values()))
"""


def lines(code, *arguments, threads="2", where):
    script = where / "script.py"
    script.write_text(code, encoding="utf-8")
    environment = {**os.environ, **dict.fromkeys(VARIABLES, threads)}
    done = subprocess.run(
        [sys.executable, str(script), *arguments], env=environment, check=True, capture_output=True, text=True
    )
    return done.stdout.splitlines()


@pytest.mark.slow
def test_the_first_design_of_a_process_runs_on_one_thread_whatever_the_environment_says(tmp_path):
    threads, two = lines(FIRST, where=tmp_path)
    assert threads == "{1}"
    assert lines(FIRST, threads="1", where=tmp_path) == ["{1}", two]


@pytest.mark.slow
def test_ten_equal_designs_in_any_order_on_one_to_three_processes_are_equal_bit_for_bit(tmp_path):
    one = lines(EQUAL, "1112311", where=tmp_path)
    other = lines(EQUAL, "321", where=tmp_path)
    assert len(one + other) == 10
    assert len({*one, *other}) == 1


def test_the_environment_comes_back_after_a_call(monkeypatch):
    monkeypatch.setenv(VARIABLES[0], "7")
    monkeypatch.delenv(VARIABLES[1], raising=False)
    with one_thread():
        assert {os.environ[name] for name in VARIABLES} == {"1"}
    assert os.environ[VARIABLES[0]] == "7"
    assert VARIABLES[1] not in os.environ

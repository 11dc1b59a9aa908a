"""Worker processes end with whoever began them, however that one ends."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from workbench.machine.workers import pool

SCRIPT = """
import os, signal, sys, time
from workbench.machine.workers import pool

def prepare(word):
    globals()["ready"] = word

def asleep(_):
    print(ready, os.getpid(), flush=True)
    time.sleep(60)

if __name__ == "__main__":
    with pool(2, prepare, "begun") as executor:
        for one in (1, 2):
            executor.submit(asleep, one)
        {end}
"""
DEAF = """
import signal
from workbench.machine.workers import pool

def deaf():
    blocked = signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])
    return signal.getsignal(signal.SIGINT) == signal.SIG_IGN, blocked

if __name__ == "__mp_main__":  # a worker that reads the script, before it has begun
    assert deaf() == (False, True)
if __name__ == "__main__":
    with pool(1) as executor:
        print(executor.submit(deaf).result(), deaf())
"""
ENDS = {
    "killed": "time.sleep(60)",
    "interrupted": "time.sleep(60)",
    "left by an exception": "sys.stdin.readline(); raise KeyError",
}


def _is_alive(pid: int) -> bool:
    """Whether there is such a process, and not only its entry for a parent that did not ask yet."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.mark.parametrize("end", ENDS)
def test_busy_workers_end_when_their_parent_does(end, tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.format(end=ENDS[end]))
    parent = subprocess.Popen(
        [sys.executable, str(script)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        text=True, start_new_session=True,
    )  # fmt: skip
    begun = [parent.stdout.readline().split() for _ in range(2)]
    assert [word for word, _ in begun] == ["begun", "begun"]
    if end == "left by an exception":
        parent.stdin.write("\n")
        parent.stdin.flush()
    else:
        parent.send_signal(signal.SIGKILL if end == "killed" else signal.SIGINT)
    parent.communicate(timeout=30)
    waited = time.monotonic()
    while any(_is_alive(int(pid)) for _, pid in begun):
        assert time.monotonic() - waited < 30, "a worker outlived its parent"
        time.sleep(0.02)


def test_work_that_ends_well_returns_what_was_submitted():
    with pool(1) as executor:
        assert executor.submit(pow, 2, 5).result() == 32


def test_a_worker_is_deaf_to_ctrl_c_from_its_first_line_and_its_parent_is_not(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(DEAF)
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=60)
    assert (done.stdout, done.stderr) == ("(True, False) (False, False)\n", "")

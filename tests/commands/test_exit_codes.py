"""Each ending of a command has its own exit code: done, not met, bad input, our defect, interrupted, terminated."""

import contextlib
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from workbench.errors import BudgetEnded, InfeasibleError, InputError

MAIN = "from workbench.cli import main; main()"


def process(*arguments: str, code: str = MAIN, **options) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options
    )


def ended(begun: subprocess.Popen) -> tuple[int, str, str]:
    with begun:
        out, err = begun.communicate(timeout=60)
        return begun.returncode, out, err


def raising(monkeypatch, error: BaseException):
    """Makes `workbench problems` raise."""

    def raised(*_):
        raise error

    monkeypatch.setattr("workbench.files.problem.shipped_problems", raised)


@pytest.mark.parametrize(
    ("error", "code", "sentence"),
    [
        (InputError("x must be y"), 2, "x must be y\n"),
        (InfeasibleError("not met"), 1, "not met\n"),
        (BudgetEnded("too short"), 1, "too short\n"),
        (KeyboardInterrupt(), 130, "interrupted; nothing half-written is left.\n"),
        (OSError(28, "No space left on device", "/x"), 2, "/x must be usable; the system says: No space left"),
        (InputError("a\x1b[8m\u202eb\nc"), 2, "a\\x1b[8m\\u202eb c\n"),
    ],
)
def test_what_a_command_raises_becomes_its_code_and_one_sentence(command, monkeypatch, error, code, sentence):
    raising(monkeypatch, error)
    done = command("problems")
    assert done.code == code
    assert sentence in done.err
    assert done.err.count("\n") == 1


@pytest.mark.parametrize(
    "error", [ZeroDivisionError("division"), SystemExit(0), RecursionError(), MemoryError(), KeyError(3)]
)
def test_a_defect_of_ours_exits_with_3_one_line_and_a_traceback_in_a_file_of_its_own(
    command, monkeypatch, tmp_path, error
):
    raising(monkeypatch, error)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    done = command("problems")
    assert done.code == 3
    assert done.err.count("\n") == 1
    assert f"internal error, a defect of the workbench and not of your input ({type(error).__name__}" in done.err
    place = Path(re.search(r"The traceback is in (\S+);", done.err)[1])
    assert "in raised" in place.read_text()
    assert place.stat().st_mode & 0o077 == 0  # of its owner alone


def test_a_defect_is_told_even_where_no_traceback_can_be_kept(command, monkeypatch, tmp_path):
    raising(monkeypatch, ZeroDivisionError())
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "gone"))
    assert "The traceback is in no file (No such file or directory)" in command("problems").err


@pytest.mark.parametrize("arguments", [("problems",), ("motor", "--json"), ("model", "heave", "--latex")], ids=" ".join)
def test_a_reader_that_leaves_early_changes_nothing(arguments):
    begun = process(*arguments)
    begun.stdout.close()
    with begun:
        err = begun.stderr.read()
        begun.wait(timeout=60)
    assert (begun.returncode, err) == (0, "")


def test_a_reader_that_leaves_early_does_not_turn_not_met_into_met():
    begun = process("noise", "--limit", "20")
    begun.stdout.close()
    with begun:
        err = begun.stderr.read()
        begun.wait(timeout=60)
    assert (begun.returncode, err) == (1, "")


def test_a_full_disk_behind_stdout_is_told():
    with open("/dev/full", "w") as full:
        done = subprocess.run([sys.executable, "-c", MAIN, "problems"], stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2
    assert done.stderr == (
        "standard output must be usable; the system says: No space left on device. Check path and space.\n"
    )


@pytest.mark.slow
def test_closed_streams_are_no_fault():
    closed = "import os, sys; os.close(1); os.close(2); sys.stdout = sys.stderr = None; "
    assert ended(process("problems", code=closed + MAIN))[0] == 0
    assert ended(process("analyse", "hevae", code=closed + MAIN))[0] == 2


# A command that says it has begun, and works, as soon as it imports a certain module
BEGUN = """
import os, sys, time
class Finder:
    def find_spec(self, name, *_):
        if name == {module!r}:
            try:
                os.write(1, f"begun {{os.getpid()}}\\n".encode())
                {work}
            except {caught}:
                os.write(1, b"again\\n")
                time.sleep(60)
sys.meta_path.insert(0, Finder())
from workbench.cli import main
main()
"""
BY_THE_COMMAND = "workbench.files.problem"


def begun_at(
    *arguments: str, module: str = BY_THE_COMMAND, work: str = "time.sleep(60)", caught: str = "()", first: str = ""
) -> tuple[subprocess.Popen, int]:
    """The command once it has begun its work, and the process that does it."""
    begun = process("analyse", "heave", *arguments, code=first + BEGUN.format(module=module, work=work, caught=caught))
    word, worker = begun.stdout.readline().split()
    assert word == "begun"
    return begun, int(worker)


@pytest.mark.parametrize(
    ("number", "code", "word"), [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")]
)
@pytest.mark.parametrize("module", [pytest.param("workbench.commands", marks=pytest.mark.slow), BY_THE_COMMAND])
def test_a_signal_during_imports_has_its_exit_code_and_a_word(number, code, word, module):
    begun, _ = begun_at(module=module)
    begun.send_signal(number)
    returned, _, err = ended(begun)
    assert returned == code
    assert err.startswith(word)
    assert err.count("\n") == 1


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_reaches_the_work_behind_a_budget(number, code):
    begun, worker = begun_at("--budget-seconds", "50")
    assert worker != begun.pid
    begun.send_signal(number)
    returned, _, err = ended(begun)
    assert returned == code
    assert err.count("\n") == 1


def test_a_second_signal_ends_work_that_does_not_heed_the_first():
    begun, _ = begun_at(
        caught="KeyboardInterrupt", first="from workbench.machine import interrupts; interrupts.AGAIN = 0.0\n"
    )
    begun.send_signal(signal.SIGINT)
    assert begun.stdout.readline() == "again\n"
    begun.send_signal(signal.SIGINT)
    assert ended(begun)[0] == 130


@pytest.mark.parametrize("budget", ["0", "-1", "nan", "inf"])
def test_a_budget_that_cannot_be_kept_is_refused(refused, budget):
    sentence = f"--budget-seconds must be a positive, finite number of seconds; got {float(budget)}"
    assert sentence in refused("analyse", "heave", "--budget-seconds", budget)


def test_work_that_hangs_in_a_library_is_ended_with_its_budget():
    # one call of the regular expression engine, which keeps Python from running anything else for years
    begun, _ = begun_at("--budget-seconds", "3", work='import re; re.match("(a*)*b", "a" * 40)')
    code, out, err = ended(begun)
    assert out == ""
    assert code == 1
    assert err == (
        "the budget of 3 s must suffice for the analysis; it ended before. Nothing half-written is left. "
        "Give more with --budget-seconds.\n"
    )


@pytest.mark.slow
def test_a_command_within_its_budget_says_what_it_says_without(command):
    code, out, err = ended(process("analyse", "heave", "--budget-seconds", "60", "--json"))
    assert (code, err) == (0, "")
    assert out == command("analyse", "heave", "--json").out


def test_work_that_dies_behind_a_budget_is_a_defect():
    code, _, err = ended(begun_at("--budget-seconds", "30", work="os.kill(os.getpid(), 9)")[0])
    assert code == 3
    assert "the analysis was ended by SIGKILL" in err


def test_work_behind_a_budget_ends_with_the_process_that_was_started():
    begun, worker = begun_at("--budget-seconds", "50")
    assert worker != begun.pid
    begun.kill()
    ended(begun)
    for _ in range(1000):
        if not Path(f"/proc/{worker}").exists() or " Z " in Path(f"/proc/{worker}/stat").read_text():
            return
        time.sleep(0.01)
    pytest.fail("the work outlived the command")


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGKILL, -9)])
def test_a_design_leaves_no_worker_behind(tmp_path, number, code):
    begun = process("design", "comfort_limit", "--starts", "60", "--out", str(tmp_path), start_new_session=True)

    def session() -> set[str]:
        """Processes of the command's session that still run."""
        found = set()
        for place in Path("/proc").glob("[0-9]*/stat"):
            with contextlib.suppress(OSError):
                state, _, _, own = place.read_text().rpartition(")")[2].split()[:4]
                if int(own) == begun.pid and state != "Z":
                    found.add(place.parent.name)
        return found

    while len(session()) < 3:  # itself, multiprocessing's tracker and a worker
        assert begun.poll() is None
        time.sleep(0.05)
    begun.send_signal(number)
    assert ended(begun)[0] == code
    for _ in range(600):
        if not session():
            return
        time.sleep(0.05)
    pytest.fail(f"still there: {session()}")

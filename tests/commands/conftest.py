"""What tests of the command line share: one command run in this process, and the files it is given."""

from collections.abc import Callable
from typing import NamedTuple

import pytest

from workbench.cli import run
from workbench.files.problem import shipped_problems

REPORT_GAINS = {
    "K_h": -2.155, "K_hdot": 0.15, "tau_h": 0.637, "K_hp": 0.0, "K_hpdot": 0.294, "tau_hp": 0.637,
    "K_zddot": 0.0, "K_zdot": 0.15, "tau_z": 0.637, "K_yddot": -0.02, "K_ydot": 0.294, "tau_y": 0.637,
    "K_heave": 1.0, "K_pitch": 1.0, "K_sway": 0.518, "K_roll": 1.25, "K_yaw": 3.5,
}  # fmt: skip


class Done(NamedTuple):
    """Exit code, standard output and standard error of a command."""

    code: int
    out: str
    err: str


@pytest.fixture
def command(capsys) -> Callable[..., Done]:
    """Runs `workbench` with the given arguments."""

    def call(*arguments: str) -> Done:
        capsys.readouterr()
        code = run([str(a) for a in arguments])
        return Done(code, *capsys.readouterr())

    return call


@pytest.fixture
def refused(command) -> Callable[..., str]:
    """Runs `workbench`, which must refuse with exit code 2, one line on stderr and nothing on stdout; that line."""

    def call(*arguments: str) -> str:
        done = command(*arguments)
        assert done.code == 2, done
        assert done.out == ""
        assert done.err.count("\n") == 1
        assert "Traceback" not in done.err
        assert len(done.err) < 1000  # a sentence, not a dump of what was given
        return done.err.strip()

    return call


@pytest.fixture
def report_gains(tmp_path):
    """A TOML file with the report's gains."""
    path = tmp_path / "report.toml"
    path.write_text("\n".join(f"{name} = {value!r}" for name, value in REPORT_GAINS.items()))
    return path


@pytest.fixture
def changed_problem(tmp_path) -> Callable[..., str]:
    """A copy of a shipped problem's data with one text replaced by another; its folder."""

    def call(before: str, after: str, name: str = "heave") -> str:
        text = (shipped_problems()[name] / "data.toml").read_text(encoding="utf-8")
        assert before in text
        folder = tmp_path / "changed"
        folder.mkdir()
        (folder / "data.toml").write_text(text.replace(before, after, 1), encoding="utf-8")
        return str(folder)

    return call

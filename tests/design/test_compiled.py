"""Functions as machine code give the interpreter's numbers, and nothing depends on there being a compiler."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from workbench.compiled import Buffered, compile_function, compiler


def function() -> ca.Function:
    x = ca.SX.sym("x", 3)
    y = ca.vertcat(ca.sin(x[0]) * x[1], ca.exp(-x[2]) / (1 + x[0] ** 2))
    return ca.Function("sample", [x], [y, ca.densify(ca.jacobian(y, x))])


def test_without_a_compiler_the_function_is_itself(monkeypatch):
    monkeypatch.setenv("WORKBENCH_COMPILER", "none")
    f = function()
    assert compiler() is None
    assert compile_function(f) is f


def test_machine_code_and_interpreter_agree(monkeypatch, tmp_path):
    monkeypatch.setenv("WORKBENCH_CACHE", str(tmp_path))
    point = np.array([0.3, -1.2, 0.7])
    for ours, theirs in zip(compile_function(function())(point), function()(point), strict=True):
        # the compiler may contract a·b + c: a unit in the last place
        np.testing.assert_allclose(ours.full(), theirs.full(), rtol=1e-14)


def entry(folder: Path) -> Path:
    """The one library in a cache."""
    (library,) = folder.glob("maglev-workbench/*.so")
    return library


def cut(library: Path, share: float) -> None:
    library.write_bytes(library.read_bytes()[: int(share * library.stat().st_size)])


def as_folder(library: Path) -> None:
    library.unlink()
    (library / "with" / "content").mkdir(parents=True)


def another_library(library: Path) -> None:
    x = ca.SX.sym("x", 3)
    compile_function(ca.Function("sample", [x], [x, x]))
    (other,) = set(library.parent.glob("*.so")) - {library}
    os.replace(other, library)


def flipped(library: Path) -> None:
    content = bytearray(library.read_bytes())
    content[len(content) // 2] ^= 1
    library.write_bytes(content)


def linked(library: Path) -> None:
    moved = library.with_name("moved")
    library.rename(moved)
    library.symlink_to(moved)


def writable_by_others(library: Path) -> None:
    library.chmod(0o666)


def a_pipe(library: Path) -> None:
    library.unlink()
    os.mkfifo(library)


DAMAGE = {
    "empty": lambda e: cut(e, 0.0), "cut short": lambda e: cut(e, 0.01), "cut in half": lambda e: cut(e, 0.5),
    "without its last byte": lambda e: e.write_bytes(e.read_bytes()[:-1]),
    "garbage": lambda e: e.write_bytes(b"\x7fELF" + os.urandom(1000)),
    "a system library": lambda e: shutil.copy(LIBC, e),
    "a folder": as_folder, "of another function": another_library, "one bit flipped": flipped,
    "a dangling link": lambda e: (e.unlink(), e.symlink_to("/nowhere")), "a link": linked, "a pipe": a_pipe,
    "writable by others": writable_by_others,
}  # fmt: skip
LIBC = next(Path("/lib").glob("*/libm.so.6"), Path("/lib64/libm.so.6"))
NEEDS_A_COMPILER = pytest.mark.skipif(compiler() is None, reason="nothing is cached without a C compiler")


@NEEDS_A_COMPILER
@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_entry_of_the_cache_is_built_anew(monkeypatch, tmp_path, damage):
    monkeypatch.setenv("WORKBENCH_CACHE", str(tmp_path))
    compile_function(function())
    library = entry(tmp_path)
    whole = library.read_bytes()
    DAMAGE[damage](library)
    f = compile_function(function())
    assert f(np.array([0.3, -1.2, 0.7]))[0].full().shape == (2, 1)
    assert library.is_file()
    assert not library.is_symlink()
    assert library.stat().st_mode & 0o022 == 0
    assert len(library.read_bytes()) == len(whole)


@NEEDS_A_COMPILER
def test_what_is_whole_in_the_cache_is_not_built_again(monkeypatch, tmp_path):
    monkeypatch.setenv("WORKBENCH_CACHE", str(tmp_path))
    compile_function(function())
    before = entry(tmp_path).stat()
    monkeypatch.setattr("subprocess.run", lambda *_, **__: pytest.fail("built again"))
    compile_function(function())
    assert entry(tmp_path).stat().st_ino == before.st_ino


@NEEDS_A_COMPILER
def test_a_cache_that_others_may_write_to_is_closed_to_them_or_left_alone(monkeypatch, tmp_path):
    monkeypatch.setenv("WORKBENCH_CACHE", str(tmp_path))
    folder = tmp_path / "maglev-workbench"
    folder.mkdir()
    folder.chmod(0o777)
    compile_function(function())
    assert folder.stat().st_mode & 0o777 == 0o700
    monkeypatch.setattr("os.geteuid", lambda: os.getuid() + 1)  # as if it were another user's
    f = function()
    assert compile_function(f) is f


@NEEDS_A_COMPILER
@pytest.mark.parametrize("faulty", ["true", "false", "cat"])
def test_a_compiler_that_makes_no_library_is_no_obstacle(monkeypatch, tmp_path, faulty):
    monkeypatch.setenv("WORKBENCH_CACHE", str(tmp_path))
    monkeypatch.setenv("WORKBENCH_COMPILER", faulty)
    f = function()
    assert compile_function(f) is f


@NEEDS_A_COMPILER
def test_processes_that_fill_the_cache_at_once_do_not_meet(monkeypatch, tmp_path):
    monkeypatch.setenv("WORKBENCH_CACHE", str(tmp_path))
    script = (
        "import sys; sys.path.insert(0, sys.argv[1]); from test_compiled import function, compile_function\n"
        "for _ in range(3): print(compile_function(function())([0.3, -1.2, 0.7])[0])"
    )
    begun = [
        subprocess.Popen(
            [sys.executable, "-c", script, str(Path(__file__).parent)], stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        for _ in range(4)
    ]
    said = [process.communicate(timeout=60) for process in begun]
    assert {out for out, _ in said} == {said[0][0]}
    assert {err for _, err in said} == {b""}
    assert [p.name for p in (tmp_path / "maglev-workbench").iterdir()] == [entry(tmp_path).name]


def test_a_cache_that_cannot_be_written_is_no_obstacle(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("WORKBENCH_CACHE", str(tmp_path / "file"))
    f = function()
    assert compile_function(f) is f


def test_a_buffered_function_gives_the_same_numbers_with_fixed_arguments():
    x, p = ca.SX.sym("x", 2), ca.SX.sym("p", 2, 2)
    f = ca.Function("buffered", [x, p], [ca.mtimes(p, x)])
    p_value = np.array([[1.0, 2.0], [3.0, 4.0]])
    buffered = Buffered(f, {1: p_value})
    for x_value in (np.array([1.0, -1.0]), np.array([0.5, 2.0])):
        np.testing.assert_array_equal(buffered(x_value)[0].ravel(), p_value @ x_value)

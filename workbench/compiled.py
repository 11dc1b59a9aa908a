"""CasADi functions turned into machine code where a C compiler is at hand, with a cache; interpreted otherwise.

    Function --C code--> hash --in the cache, whole?--> shared library --ca.external--> Function

The cache holds one library per text of C code, so a change of the model never meets a stale library. What it holds is
run: so it is ours, not writable by others, and sealed by a digest; anything else is built anew. Set WORKBENCH_COMPILER
to another compiler, or to "none" for the interpreter; WORKBENCH_CACHE moves the cache.
"""

import hashlib
import os
import shutil
import stat
import subprocess
import tempfile
import threading
from pathlib import Path

import casadi as ca
import numpy as np

from workbench.errors import InputError
from workbench.machine.writing import replacing

OPTIONS = ("-fPIC", "-shared", "-fno-math-errno")
LARGE = 20_000  # instructions; beyond, -O1 takes a minute for a factor of two at run time, and -O0 three seconds
DIGEST = hashlib.sha256().digest_size
OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def compiler() -> str | None:
    """Path of the C compiler in use, or None."""
    wanted = os.environ.get("WORKBENCH_COMPILER", "")
    if wanted == "none":
        return None
    return shutil.which(wanted) if wanted else (shutil.which("cc") or shutil.which("gcc") or shutil.which("clang"))


def cache_folder() -> Path:
    """Where compiled libraries are kept."""
    base = os.environ.get("WORKBENCH_CACHE") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base).absolute() / "maglev-workbench"


def compile_function(function: ca.Function) -> ca.Function:
    """The same function as machine code, or itself where no compiler or no cache of ours is at hand."""
    cc = compiler()
    if cc is None:
        return function
    try:
        return _from_cache(function, cc)
    except (OSError, subprocess.SubprocessError, InputError, RuntimeError):  # no room, no right, no loader
        return function  # the interpreter gives the same numbers, only slower


class Buffered:
    """A function with dense inputs and outputs, called on NumPy memory without conversions.

    The arrays it returns are its own and are overwritten by the next call from the same thread; every thread has its
    own. Fixed arguments are given once.
    """

    def __init__(self, function: ca.Function, fixed: dict[int, np.ndarray] | None = None) -> None:
        self._function, self._fixed = function, dict(fixed or {})
        self._own = threading.local()

    def __call__(self, *arguments: np.ndarray) -> list[np.ndarray]:
        """Results for the leading arguments, the fixed ones keeping their values."""
        try:
            memory = self._own.memory
        except AttributeError:
            memory = self._own.memory = _Memory(self._function, self._fixed)
        for own, given in zip(memory.arguments, arguments, strict=False):
            own[...] = given.reshape(own.shape)
        memory.run()
        return memory.results


class _Memory:
    """Arguments and results of one thread, and the call that goes from one to the other."""

    def __init__(self, function: ca.Function, fixed: dict[int, np.ndarray]) -> None:
        self._buffer, self.run = function.buffer()
        self.arguments = [np.zeros(function.size_in(i), order="F") for i in range(function.n_in())]
        self.results = [np.zeros(function.size_out(i), order="F") for i in range(function.n_out())]
        for i, value in fixed.items():
            self.arguments[i][...] = value
        for i, array in enumerate(self.arguments):
            self._buffer.set_arg(i, memoryview(array.T))  # pyright: ignore[reportCallIssue]
        for i, array in enumerate(self.results):
            self._buffer.set_res(i, memoryview(array.T))  # pyright: ignore[reportCallIssue]


def _from_cache(function: ca.Function, cc: str) -> ca.Function:
    with tempfile.TemporaryDirectory() as folder:
        generator = ca.CodeGenerator(f"{function.name()}.c")
        generator.add(function)
        source = Path(folder) / f"{function.name()}.c"
        generator.generate(f"{folder}/")
        options = ("-O0" if function.n_instructions() > LARGE else "-O1", *OPTIONS)
        made_by = " ".join((cc, *options, os.uname().machine))
        key = hashlib.sha256(source.read_bytes() + made_by.encode()).digest()
        library = _own(cache_folder()) / f"{function.name()}_{key.hex()[:24]}.so"

        def build() -> None:
            built = Path(folder) / "built.so"
            subprocess.run([cc, *options, str(source), "-o", str(built), "-lm"], check=True, capture_output=True)
            _keep(library, built.read_bytes(), key)

        if not _is_whole(library, key):
            build()
        try:
            return ca.external(function.name(), str(library))
        except RuntimeError:  # whole, but of another system that shares this folder
            build()
            return ca.external(function.name(), str(library))


def _own(folder: Path) -> Path:
    """The cache's folder, made where there is none; nobody but us may write to it, since what lies there is run."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    found = folder.stat()
    if found.st_uid != os.geteuid():
        raise PermissionError(f"{folder} belongs to somebody else")
    if found.st_mode & OTHERS_WRITE:
        folder.chmod(0o700)
    return folder


def _is_whole(library: Path, key: bytes) -> bool:
    """Whether the cache holds this very library, complete, and it is ours: half a library ends the process (SIGBUS)."""
    try:
        found = library.lstat()
        if not stat.S_ISREG(found.st_mode) or found.st_uid != os.geteuid() or found.st_mode & OTHERS_WRITE:
            return False
        content = library.read_bytes()  # nobody else may put another file there: the folder is ours
    except OSError:
        return False
    return content[-DIGEST:] == _seal(content[:-DIGEST], key)


def _keep(library: Path, content: bytes, key: bytes) -> None:
    """Puts a library into the cache, its seal behind it, where the loader does not look."""
    if library.is_dir() and not library.is_symlink():
        shutil.rmtree(library)
    elif library.exists() and not library.is_file():  # a pipe, a device
        library.unlink()
    with replacing(library) as file:
        os.fchmod(file.fileno(), 0o600)
        file.write(content + _seal(content, key))


def _seal(content: bytes, key: bytes) -> bytes:
    """The digest of a library under its key: that of another function does not fit."""
    return hashlib.sha256(key + content).digest()

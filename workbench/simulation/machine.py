"""One time step as machine code, where a C compiler is at hand; interpreted otherwise, with the same numbers.

    Function --C code--> hash --in the cache?--> shared library --ca.external--> Function

WORKBENCH_COMPILER names another compiler, or "none" for the interpreter; WORKBENCH_CACHE moves the cache.
"""

import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import casadi as ca

OPTIONS = ("-O1", "-fPIC", "-shared", "-fno-math-errno")


def as_machine_code(function: ca.Function) -> ca.Function:
    """The same function from a shared library, or itself where none can be built or cached."""
    wanted = os.environ.get("WORKBENCH_COMPILER", "")
    compiler = shutil.which(wanted or "cc") if wanted != "none" else None
    if compiler is None:
        return function
    base = os.environ.get("WORKBENCH_CACHE") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    try:
        with tempfile.TemporaryDirectory() as folder:
            library = _library(function, compiler, Path(base) / "maglev-workbench", Path(folder))
            return ca.external(function.name(), str(library))
    except (OSError, subprocess.SubprocessError):
        return function


def _library(function: ca.Function, compiler: str, cache: Path, folder: Path) -> Path:
    generator = ca.CodeGenerator(f"{function.name()}.c")
    generator.add(function)
    generator.generate(f"{folder}/")
    source = folder / f"{function.name()}.c"
    made_by = " ".join((compiler, *OPTIONS, os.uname().machine))
    key = hashlib.sha256(source.read_bytes() + made_by.encode()).hexdigest()[:24]
    library = cache / f"{function.name()}_{key}.so"
    if not library.exists():
        cache.mkdir(parents=True, exist_ok=True)
        built = cache / f"{library.name}.{os.getpid()}"
        subprocess.run([compiler, *OPTIONS, str(source), "-o", str(built), "-lm"], check=True, capture_output=True)
        built.replace(library)  # whole or not at all, whoever else builds it
    return library

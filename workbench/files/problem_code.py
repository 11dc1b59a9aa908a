"""A folder's problem.py: code of somebody else's, run; whatever it does becomes a problem or one sentence.

problem.py --executed--> its function problem(data) --called--> a problem
              `---- raised, left, printed: an InputError that names the line; prints go to stderr ----'
"""

import importlib.util
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path

from workbench.errors import InfeasibleError, InputError

NAME = "problem.py"
OURS = Path(__file__).parents[1]


def maker(folder: Path, plain: Callable, kind: str) -> Callable:
    """The function `problem` of the folder's problem.py, which makes a `kind`; the plain one where there is none."""
    path = folder / NAME
    if not path.is_file():
        return plain
    spec = importlib.util.spec_from_file_location(f"workbench_problem_{folder.resolve().name}", path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path} must be a Python file; it cannot be imported.")
    module = importlib.util.module_from_spec(spec)
    with _answerable(path):
        spec.loader.exec_module(module)
    if not callable(getattr(module, "problem", None)):
        raise InputError(f"{path} must define problem(data) that returns a {kind}.")

    def guarded(data):
        with _answerable(path):
            return module.problem(data)

    return guarded


def fault_of_problem_code(error: BaseException) -> str | None:
    """The sentence of an error that arose in some problem.py, or in a library it called; None for one of ours."""
    path, line = _origin(error)
    return _sentence(path, line, error) if path is not None and _is_theirs(path) else None


@contextmanager
def _answerable(path: Path) -> Iterator[None]:
    """Turns whatever the code does but refuse in our words into one sentence; keeps stdout for the command."""
    try:
        with redirect_stdout(sys.stderr):
            yield
    except (InputError, InfeasibleError):
        raise
    except SyntaxError as error:
        raise InputError(f"{path} must be valid Python; line {error.lineno}: {error.msg}.") from error
    except (Exception, SystemExit) as error:
        origin, line = _origin(error)
        if origin is not None and not _is_theirs(origin):
            raise  # a defect of ours, in what the code called
        raise InputError(_sentence(path, line, error)) from error


def _origin(error: BaseException) -> tuple[Path | None, int | None]:
    """The last place in some problem.py or in this package, but this module, that the error came through."""
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        path = Path(frame.filename)
        if _is_theirs(path) or (OURS in path.parents and path != Path(__file__)):
            return path, frame.lineno
    return None, None


def _is_theirs(path: Path) -> bool:
    """Whether this is the problem.py of some folder of data, and not a module of ours that has the same name."""
    return path.name == NAME and (path.parent / "data.toml").is_file()


def _sentence(path: Path, line: int | None, error: BaseException) -> str:
    what = f"{type(error).__name__}: {str(error)[:200]}".removesuffix(": ")
    where = "" if line is None else f"line {line}: "
    return f"{path} must define problem(data), run and return; {where}{what}. Mend it there."

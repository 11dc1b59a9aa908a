"""What a problem's own code may read: every file beside its problem.py, so that a study knows when one has changed.

    folder --without outputs and hidden names--> {relative path: content} --SHA-256 of each--> identity of a study

A problem without problem.py is its data alone, and none of its other files counts.
"""

import hashlib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

from workbench.errors import InputError
from workbench.files.problem import shipped_folder

KNOWN = ("data.toml", "approved.json")  # data and gains stand in the identity by themselves
OUTPUTS = ("results", "__pycache__")  # where commands write unless told otherwise
STUDY = "study.json"  # a folder that holds it is the output of a study
MOST_FILES, MOST_BYTES = 2_000, 64_000_000  # they travel to every worker


def own_files(folder: Path) -> dict[str, bytes]:
    """Relative path to content of everything that problem.py may import or read there; nothing without one."""
    if not (folder / "problem.py").is_file():
        return {}
    out: dict[str, bytes] = {}
    size = 0
    for path in _walked(folder):
        try:
            size += path.stat().st_size
            if size > MOST_BYTES or len(out) == MOST_FILES:
                raise InputError(
                    f"a problem's folder must hold at most {MOST_FILES} files of {MOST_BYTES // 10**6} MB in all; "
                    f"{folder} holds more. Move what the problem does not need into a folder 'results'."
                )
            out[path.relative_to(folder).as_posix()] = path.read_bytes()
        except OSError as error:
            raise InputError(f"{path} must be readable; {error.strerror or error}. Mend or move it.") from error
    return out


def hashes(files: Mapping[str, bytes]) -> dict[str, str]:
    """Relative path to SHA-256."""
    return {name: hashlib.sha256(content).hexdigest() for name, content in sorted(files.items())}


def check_trusted(folder: Path) -> None:
    """Refuses a folder whose problem.py would be run, unless it ships with the workbench."""
    path = folder / "problem.py"
    if path.is_file() and not folder.resolve().is_relative_to(shipped_folder().resolve()):
        raise InputError(
            f"the problem of this study must ship with the workbench, or be trusted; {path} is a program that would be "
            "run with your rights. Read it, then give --trust."
        )


@cache
def workbench_sha256() -> str:
    """Of the workbench's own files: rows computed by other code are not this study's."""
    root = Path(__file__).parents[1]
    found = hashlib.sha256()
    for path in sorted(
        p for p in root.rglob("*") if p.suffix in (".py", ".toml", ".json") and "shipped" not in p.parts
    ):
        found.update(f"{path.relative_to(root).as_posix()}\0".encode())
        found.update(hashlib.sha256(path.read_bytes()).digest())
    return found.hexdigest()


def _walked(folder: Path) -> Iterator[Path]:
    """Files in the order of their names, without hidden ones, outputs, and what stands in the identity already."""
    for path in sorted(folder.iterdir()):
        if path.name.startswith(".") or path.name in OUTPUTS:
            continue
        if path.is_dir():
            if not (path / STUDY).is_file() and not path.is_symlink():
                yield from _walked(path)
        elif path.is_file() and path.name not in KNOWN:
            yield path

"""A problem of one's own to begin with: the folder of one that ships, comments and all, under another name.

new("my_loop", like="dc_motor") --> my_loop/data.toml and what it reads --> workbench design my_loop
"""

from dataclasses import dataclass
from pathlib import Path

from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.files.kind import is_own
from workbench.files.own_plant import own_problem_data
from workbench.files.problem import folder_of, load_problem
from workbench.files.writing import problem_toml
from workbench.machine.reading import LARGEST_FILE, read_mapping
from workbench.machine.writing import write_folder
from workbench.result import Result, Row

READ = ("data.toml", "problem.py", "approved.json")  # what every folder may hold


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Begun(Result):
    """A folder that was made, the names of its files, and the title of its problem."""

    folder: str
    files: tuple[str, ...]
    title: str

    def rows(self) -> list[Row]:
        return [("folder", self.folder, ""), ("files", ", ".join(self.files), ""), ("title", self.title, "")]


def new(folder: str | Path, like: str | Problem = "dc_motor") -> Begun:
    """Makes a folder whose problem can be designed at once, to be changed from there.

    Parameters
    ----------
    folder : where; there must be nothing of that name
    like : name of a shipped problem, a folder, or a problem made in a program

    Raises
    ------
    InputError
        If something is there already, the problem is none, or no file can state it; nothing is written then.
    """
    folder = Path(folder)
    if isinstance(like, Problem):
        files, title = {"data.toml": problem_toml(like).encode()}, like.title
    else:
        title = load_problem(like).title
        files = _files(folder_of(like))
    write_folder(folder, files)
    return Begun(folder=str(folder), files=tuple(files), title=title)


def _files(source: Path) -> dict[str, bytes]:
    """The files of a problem's folder, by name."""
    document = read_mapping(source / "data.toml")
    read = own_problem_data(source, document).files() if is_own(document) else ()
    found = {}
    for name in dict.fromkeys([*READ, *read]):
        if (source / name).is_file():
            found[name] = (source / name).read_bytes()
            if len(found[name]) > LARGEST_FILE:
                raise InputError(f"{source / name} must have at most {LARGEST_FILE} bytes; it has more.")
    return found

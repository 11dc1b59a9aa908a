"""The problem behind a study, with some of its numbers changed: by its files alone, so that it travels to any worker.

data.toml, problem.py and what lies beside it, gains --contents--> Source --changes, speed--> design.Problem
"""

import shutil
import tempfile
import tomllib
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any

from workbench.control import Gains
from workbench.control.schedule import Schedule
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.files.gains import read_gains, read_schedule
from workbench.files.kind import is_own
from workbench.files.number import FACTOR, numbers, with_numbers
from workbench.files.own_plant import OwnData, own_problem_data
from workbench.files.problem import ProblemData, builder, load_problem, parse_problem, shipped_problems
from workbench.files.problem_code import maker
from workbench.machine.reading import read_text
from workbench.study.folder import check_trusted, own_files


@dataclass(frozen=True)
class Source:
    """A problem's folder by its contents.

    name : of the problem;  data, sha256 : of data.toml;  files : problem.py and all beside it, by relative path
    approved : name to value of the gains last approved, or None;  schedule : over speed, where they are scheduled
    folder : where all this was read
    """

    name: str
    data: str
    files: Mapping[str, bytes]
    sha256: str
    approved: Mapping[str, float] | None
    schedule: Schedule | None
    folder: str
    _made: dict[Any, Problem] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def of(cls, name: str, *, trust: bool = False) -> "Source":
        """The contents of a shipped problem or of a folder; a problem.py that does not ship is run only if trusted."""
        folder = shipped_problems().get(name, Path(name))
        if not trust:
            check_trusted(folder)
        problem = load_problem(name)  # refuses what cannot be used, in its own words
        approved = folder / "approved.json"
        there = approved.is_file() and problem.flies
        return cls(
            name=problem.name, data=read_text(folder / "data.toml"), files=own_files(folder),
            sha256=problem.data_sha256, approved=read_gains(approved).as_dict() if there else None,
            schedule=read_schedule(approved) if there else None, folder=str(folder.resolve()),
        )  # fmt: skip

    def __getstate__(self) -> dict[str, Any]:
        return {f.name: getattr(self, f.name) for f in fields(self) if f.init}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, _made={})

    @cached_property
    def _mapping(self) -> dict[str, Any]:
        return tomllib.loads(self.data)

    @cached_property
    def _build(self):
        """What problem.py makes of data: in its own folder if that is as it was, else in one made of the contents."""
        own = Path(self.folder)
        if (own / "data.toml").is_file() and own_files(own) == self.files:
            return self._builder(own)
        place = tempfile.mkdtemp(prefix="workbench-study-")
        weakref.finalize(self, shutil.rmtree, place, ignore_errors=True)  # problem.py may read as long as it builds
        folder = Path(place) / self.name
        folder.mkdir()
        for name, content in self.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        return self._builder(folder)

    def _builder(self, folder: Path):
        if not is_own(self._mapping):
            return builder(folder)
        make = maker(folder, OwnData.build, "design.Problem")
        return lambda mapping: make(own_problem_data(folder, mapping))

    def numbers(self) -> dict[str, float]:
        """Dotted path to value of every number in the data."""
        return numbers(self._mapping)

    def check(self, path: str, own: Sequence[str] = ()) -> None:
        """Refuses a path that is no number of the data, with the nearest one that is.

        own : of a plant of one's own, its structure's parameters
        """
        known = self.numbers()
        if path not in known:
            near = get_close_matches(path, [*own, *known], n=1, cutoff=0.4)
            hint = f"did you mean {near[0]!r}? " if near else ""
            vehicle = "the seventeen gains, a factor (mass, inertia.pitch, gap_force, sensor_scale, …), speed"
            what = f"the structure's ({', '.join(own)})" if own else vehicle
            raise InputError(
                f"unknown parameter {path[:80]!r}; {hint}A parameter is one of {what}, or a number of "
                f"{self.name}'s data."
            )

    def problem(self, changes: Mapping[str, float] | None = None, speed: float | None = None) -> Problem:
        """The problem with numbers of its data changed by dotted path, and at another speed; the last few are kept."""
        key = (tuple(sorted((changes or {}).items())), speed)
        if key not in self._made:
            while len(self._made) >= 4:
                self._made.pop(next(iter(self._made)))
            self._made[key] = self._problem(changes or {}, speed)
        return self._made[key]

    def _problem(self, changes: Mapping[str, float], speed: float | None) -> Problem:
        for name in changes:
            self.check(name.removeprefix(FACTOR))
        mapping = with_numbers(self._mapping, changes)
        if is_own(mapping):
            return self._build(mapping)
        approved = None if self.approved is None else Gains.from_mapping(self.approved)
        data = ProblemData(parse_problem(mapping, f"{self.name}'s data"), self.name, self.sha256, approved)
        problem = self._build(data if speed is None else data.at_speed(speed))
        if not isinstance(problem, Problem):
            raise InputError(
                f"problem.py of {self.name!r} must return a design.Problem; got a {type(problem).__name__}."
            )
        return problem

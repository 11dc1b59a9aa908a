"""The problem behind a study, with some of its numbers changed: by texts alone, so that it travels to any worker.

data.toml, problem.py, gains --texts--> Source --changes, speed--> design.Problem
"""

import tempfile
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any

from workbench.control import Gains
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.export.problem import ProblemData, builder, load_problem, parse_problem, read_gains, shipped_problems
from workbench.export.reading import read_text


@dataclass(frozen=True)
class Source:
    """A problem's folder as texts.

    name : of the problem;  data, code : of data.toml and problem.py;  sha256 : of data.toml
    approved : name to value of the gains last approved, or None;  folder : where the texts were read
    """

    name: str
    data: str
    code: str | None
    sha256: str
    approved: Mapping[str, float] | None
    folder: str
    _made: dict[Any, Problem] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def of(cls, name: str) -> "Source":
        """The texts of a shipped problem or of a folder."""
        problem = load_problem(name)  # refuses what cannot be used, in its own words
        folder = shipped_problems().get(name, Path(name))
        code, approved = folder / "problem.py", folder / "approved.json"
        return cls(
            name=problem.name, data=read_text(folder / "data.toml"),
            code=read_text(code) if code.is_file() else None, sha256=problem.data_sha256,
            approved=read_gains(approved).as_dict() if approved.is_file() else None, folder=str(folder.resolve()),
        )  # fmt: skip

    def __getstate__(self) -> dict[str, Any]:
        return {key: getattr(self, key) for key in ("name", "data", "code", "sha256", "approved", "folder")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, _made={})

    @cached_property
    def _mapping(self) -> dict[str, Any]:
        return tomllib.loads(self.data)

    @cached_property
    def _build(self):
        """What problem.py makes of data: in its own folder where that is at hand, else in one made for it."""
        own = Path(self.folder) / "problem.py"
        if self.code is not None and own.is_file() and read_text(own) == self.code:
            return builder(own.parent)
        with tempfile.TemporaryDirectory(prefix="workbench-study-") as place:
            folder = Path(place) / self.name
            folder.mkdir()
            if self.code is not None:
                (folder / "problem.py").write_text(self.code, encoding="utf-8")
            return builder(folder)

    def numbers(self) -> dict[str, float]:
        """Dotted path to value of every number in the data."""
        out: dict[str, float] = {}

        def walk(value: Any, path: str) -> None:
            if isinstance(value, dict | list):
                pairs = value.items() if isinstance(value, dict) else enumerate(value)
                for key, item in pairs:
                    walk(item, f"{path}.{key}" if path else str(key))
            elif isinstance(value, int | float) and not isinstance(value, bool):
                out[path] = value

        walk(self._mapping, "")
        return out

    def check(self, path: str) -> None:
        """Refuses a path that is no number of the data, with the nearest one that is."""
        known = self.numbers()
        if path not in known:
            near = get_close_matches(path, known, n=1, cutoff=0.4)
            hint = f"did you mean {near[0]!r}? " if near else ""
            raise InputError(
                f"unknown parameter {path[:80]!r}; {hint}A parameter is one of the seventeen gains, a factor "
                f"(mass, inertia.pitch, current_force, gap_force, sensor_scale, …), speed, or a number of "
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
        mapping = tomllib.loads(self.data)
        for path, value in changes.items():
            self.check(path)
            *way, last = path.split(".")
            at: Any = mapping
            for step in way:
                at = at[int(step)] if isinstance(at, list) else at[step]
            place = int(last) if isinstance(at, list) else last
            at[place] = int(value) if isinstance(at[place], int) and float(value).is_integer() else float(value)
        approved = None if self.approved is None else Gains.from_mapping(self.approved)
        data = ProblemData(parse_problem(mapping, f"{self.name}'s data"), self.name, self.sha256, approved)
        problem = self._build(data if speed is None else data.at_speed(speed))
        if not isinstance(problem, Problem):
            raise InputError(
                f"problem.py of {self.name!r} must return a design.Problem; got a {type(problem).__name__}."
            )
        return problem

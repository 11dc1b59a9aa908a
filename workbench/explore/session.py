"""An exploration without its sliders: gains, an operating point, pinned designs, and what may be done with them.

Session(problem) --set, vary, optimise, pin, undo--> Session;  .snapshot, .comparison(), .table(), .save(path)
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.analysis.first_tables import MarkedTable
from workbench.control import GAIN_NAMES, Gains
from workbench.control.gains import GAIN_UNITS, TIME_CONSTANTS
from workbench.design.problem import Problem
from workbench.errors import InputError, unknown_name
from workbench.explore.snapshot import Snapshot, Sweep, snapshot
from workbench.result import Row, figure

FACTORS = {"mass": (0.7, 1.3), "current_force": (0.7, 1.3), "gap_force": (0.7, 1.3)}  # of the nominal vehicle
GROUPS = {
    "vertical filters": ("K_h", "K_hdot", "tau_h", "K_zddot", "K_zdot", "tau_z"),
    "lateral filters": ("K_hp", "K_hpdot", "tau_hp", "K_yddot", "K_ydot", "tau_y"),
    "modal gains": ("K_heave", "K_pitch", "K_sway", "K_roll", "K_yaw"),
    "operating point": tuple(FACTORS),
}
STATE = "maglev-workbench exploration"


@dataclass(frozen=True, slots=True)
class Pin:
    """A design to come back to: its gains, the operating point it was seen at, and its figures there."""

    name: str
    gains: Gains
    factors: Mapping[str, float]
    shot: Snapshot


class Exploration:
    """What an exploration does whatever its problem: pins to come back to, a comparison, a file."""

    pins: dict[str, Any]

    @property
    def snapshot(self) -> Any:
        """Everything shown at the present values; its `shown()` are rows."""
        raise NotImplementedError

    def settle(self) -> tuple[list[Row], tuple[MarkedTable, ...]]:
        """Completes the present position: verdicts on reserves; the smallest figures, and the tables, read first."""
        return self.snapshot.first

    def to_dict(self) -> dict[str, Any]:
        """What `save` writes and `load` reads."""
        raise NotImplementedError

    def unpin(self, name: str) -> None:
        """Forgets a pinned design."""
        if name not in self.pins:
            raise unknown_name("pinned design", name, self.pins)
        del self.pins[name]

    def comparison(self) -> tuple[list[str], list[list[str]]]:
        """Heads and rows of a table: present and pinned designs side by side."""
        shots = {"now": self.snapshot, **{p.name: p.shot for p in self.pins.values()}}
        tables = [{name: (value, unit) for name, value, unit in shot.shown()} for shot in shots.values()]
        names = dict.fromkeys(name for table in tables for name in table)
        rows = [
            [name, *(figure(t[name][0]) if name in t else "–" for t in tables),
             next(t[name][1] for t in tables if name in t)]
            for name in names
        ]  # fmt: skip
        return ["", *shots, "unit"], rows

    def save(self, path: Path | str) -> None:
        """Writes values and pins as JSON, beside and renamed."""
        from workbench.machine.writing import write_text

        write_text(Path(path), json.dumps(self.to_dict(), indent=1, ensure_ascii=False) + "\n")

    def _saved(self, path: Path | str, problem: str) -> dict[str, Any]:
        """The document of a saved exploration of the same problem."""
        from workbench.machine.reading import read_mapping

        document = read_mapping(Path(path))
        if document.get("format") != STATE or document.get("problem") != problem:
            raise InputError(
                f"{path} must be a saved exploration of {problem!r}; got one of "
                f"{str(document.get('problem'))[:60]!r}. Give another file, or open that problem."
            )
        return document


class Session(Exploration):
    """What the explorer holds; every button is one of its methods.

    Parameters
    ----------
    problem : Problem
    gains : Gains, optional
        To start from; the problem's approved ones if left out.

    Raises
    ------
    InputError
        If no gains are given and the problem has none approved.
    """

    def __init__(self, problem: Problem, gains: Gains | None = None) -> None:
        gains = gains or problem.gains
        if gains is None:
            raise InputError(
                f"an exploration needs gains to start from; problem {problem.name!r} has none approved. Give gains=…."
            )
        self.nominal, self.problem, self.gains, self.begun = problem, problem, gains, gains
        self.factors = dict.fromkeys(FACTORS, 1.0)
        self.moved = "K_h"
        self.pins: dict[str, Pin] = {}
        self.past: list[Gains] = []
        self._sweep: Sweep | None = None
        self._shot: Snapshot | None = None

    @property
    def groups(self) -> dict[str, tuple[str, ...]]:
        """The sliders, by title."""
        return GROUPS

    def held(self, name: str) -> float:
        """The present value of a slider."""
        return self.factors[name] if name in FACTORS else getattr(self.gains, name)

    def unit(self, name: str) -> str:
        """Its unit."""
        return GAIN_UNITS.get(name, "× nominal")

    def interval(self, name: str) -> tuple[float, float] | None:
        """Where it may move; None for around its value."""
        return FACTORS.get(name)

    def logarithmic(self, name: str) -> bool:
        """Whether it moves by factors, as a positive time constant does."""
        return name in TIME_CONSTANTS and self.held(name) > 0

    def move(self, name: str, value: float) -> None:
        """Changes one gain or factor."""
        (self.vary if name in FACTORS else self.set)(**{name: value})

    def restart(self) -> None:
        """Back to the gains where the exploration began."""
        self.set(**self.begun.as_dict())

    @property
    def snapshot(self) -> Snapshot:
        """Everything shown at the present gains and operating point."""
        if self._shot is None:
            self._sweep = self._sweep or Sweep(self.problem.setting)
            self._shot = snapshot(self.problem, self.gains, moved=self.moved, sweep=self._sweep)
        return self._shot

    def settle(self) -> tuple[list[Row], tuple[MarkedTable, ...]]:
        """Completes the present position: verdicts on reserves; the smallest figures, and the tables, read first."""
        _ = self.snapshot.reserve_verdicts
        return self.snapshot.first

    def set(self, **gains: float) -> None:
        """Changes some of the seventeen; `undo` goes back. The last one named is the one the root locus moves."""
        changed = Gains.from_mapping({**self.gains.as_dict(), **gains})
        if changed == self.gains:
            return
        self.past.append(self.gains)
        self.gains, self._shot = changed, None
        self.moved = next(reversed(gains), self.moved)

    def vary(self, **factors: float) -> None:
        """Changes the operating point: factors of mass, current force and gap force, 1 being nominal."""
        from workbench.physics.vehicle import varied

        for name in factors:
            if name not in FACTORS:
                raise unknown_name("factor", name, FACTORS)
        wanted = {**self.factors, **factors}
        problem = self.nominal
        if any(value != 1.0 for value in wanted.values()):
            problem = self.nominal.with_vehicle(varied(self.nominal.vehicle, **wanted))
        self.factors, self.problem, self._sweep, self._shot = wanted, problem, None, None

    def undo(self) -> None:
        """Back to the gains before the last change; nothing if there are none."""
        if self.past:
            self.gains, self._shot = self.past.pop(), None

    def optimise(self) -> str:
        """The best gains near the present ones, at the present operating point; says how good they are.

        Raises InfeasibleError, with the sentence that says what binds, and changes nothing.
        """
        from workbench.design.design import refine

        better = refine(self.problem, self.gains).gains
        self.past.append(self.gains)
        self.gains, self._shot = better, None
        return f"optimised: cost J = {self.snapshot.analysis.cost:.4g}"

    def pin(self, name: str = "") -> Pin:
        """Keeps the present design under a name; an old one of that name is replaced."""
        name = name.strip() or f"design {len(self.pins) + 1}"
        self.pins[name] = Pin(name, self.gains, dict(self.factors), self.snapshot)
        return self.pins[name]

    def design(self):
        """The present gains as a `Design` record, met or not."""
        from workbench.design.design import given

        return given(self.problem, self.gains, analysis=self.snapshot.analysis, solver="explorer")

    def write_table(self, path: Path | str) -> Path:
        """The present design as a gain table; at the nominal operating point only, of which the table speaks."""
        from workbench.handover.table.table import table_from_design

        if self.problem is not self.nominal:
            raise InputError(
                "a gain table must be of the nominal operating point; the explorer stands at another one. "
                "Set mass, current force and gap force back to 1."
            )
        table_from_design(self.design()).write(path)
        return Path(path)

    def to_dict(self) -> dict[str, Any]:
        """What `save` writes and `load` reads."""
        pins = [{"name": p.name, "gains": p.gains.as_dict(), "factors": dict(p.factors)} for p in self.pins.values()]
        return {
            "format": STATE, "problem": self.nominal.name, "gains": self.gains.as_dict(),
            "factors": dict(self.factors), "moved": self.moved, "pins": pins,
        }  # fmt: skip

    def load(self, path: Path | str) -> None:
        """Takes up a saved exploration of the same problem.

        Raises
        ------
        InputError
            If the file is not one, is of another problem, or holds gains or factors that cannot be; nothing changes.
        """
        document = self._saved(path, self.nominal.name)
        fresh = Session(self.nominal, Gains.from_mapping(_mapping(document, "gains", path)))
        for entry in document.get("pins", []):
            if not isinstance(entry, dict):
                raise InputError(
                    f"the pins of {path} must be objects with name, gains, factors; got {str(entry)[:40]}."
                )
            fresh.gains = Gains.from_mapping(_mapping(entry, "gains", path))
            fresh.vary(**_factors(entry, path))
            fresh.pin(str(entry.get("name", "")))
        fresh.gains = Gains.from_mapping(_mapping(document, "gains", path))
        fresh.vary(**_factors(document, path))
        moved = document.get("moved", self.moved)
        if moved not in GAIN_NAMES:
            raise unknown_name("gain", str(moved), GAIN_NAMES)
        self.gains, self.factors, self.problem, self.pins = fresh.gains, fresh.factors, fresh.problem, fresh.pins
        self.moved, self._sweep, self._shot, self.past = moved, None, None, []


def _mapping(document: Mapping, key: str, path) -> dict:
    found = document.get(key)
    if not isinstance(found, dict):
        raise InputError(f"{path} must hold {key} as an object of names and numbers; got {str(found)[:40]}.")
    return found


def _factors(document: Mapping, path) -> dict[str, float]:
    found = _mapping(document, "factors", path)
    for name, value in found.items():
        if not isinstance(value, int | float) or isinstance(value, bool) or not 0.1 <= value <= 10:
            raise InputError(f"factor {name} in {path} must be a number between 0.1 and 10; got {str(value)[:40]}.")
    return {name: float(value) for name, value in found.items()}

"""A control-design workbench: from a plant and what is asked of it to a gain table that carries its evidence.

    import workbench as wb

    problem = wb.load("revenue_vehicle")     a shipped name or a folder; also wb.Problem(models=…, structure=…, goals=…)
    found = wb.design(problem)               parameters with a verdict on every goal
    table = found.table()                    with proofs; wb.verify checks its file

These names are what the workbench promises; they load when first used, so that `import workbench` costs nothing.
"""

import sys
from importlib import import_module
from types import ModuleType

from workbench import exits

TYPE_CHECKING = False  # for type checkers, which read it as true; `typing` would be most of what an import costs
if TYPE_CHECKING:
    from workbench import goals as goals
    from workbench import plots as plots
    from workbench.control.structure.blocks import (
        gain,
        lead_lag,
        low_pass,
        low_pass_second,
        notch,
        pid,
        pid_matrix,
        pid_two_degrees,
        washout,
    )  # fmt: skip
    from workbench.control.structure.space import expression, modal_law, state_space, transfer_function
    from workbench.control.structure.structure import Structure
    from workbench.design.asked import analyse, margins, robust, simulate, trade_off
    from workbench.design.design import design
    from workbench.design.problem import Problem
    from workbench.design.scheduled import schedule_design as schedule
    from workbench.files.problem import load_problem as load
    from workbench.handover.table.table import read_table
    from workbench.lti.connect import connect
    from workbench.lti.make import ss, tf, zpk
    from workbench.lti.measured import frd
    from workbench.study.flights import fly

# name: the room and the name there
FACE = {
    "load": ("files.problem", "load_problem"),
    "Problem": ("design.problem", "Problem"),
    "Structure": ("control.structure.structure", "Structure"),
    "Parameter": ("control.structure.block", "Parameter"),
    "design": ("design.design", "design"),
    "robust": ("design.asked", "robust"),
    "schedule": ("design.scheduled", "schedule_design"),
    "trade_off": ("design.asked", "trade_off"),
    "analyse": ("design.asked", "analyse"),
    "margins": ("design.asked", "margins"),
    "simulate": ("design.asked", "simulate"),
    "fly": ("study.flights", "fly"),
    "verify": ("verify.check", "verify"),
    "complete": ("handover.complete", "complete"),
    "read_table": ("handover.table.table", "read_table"),
    "study": ("study.run", "study"),
    "new": ("files.new", "new"),
    **{name: ("lti.make", name) for name in ("tf", "ss", "zpk")},
    "frd": ("lti.measured", "frd"),
    "connect": ("lti.connect", "connect"),
    **{
        name: ("control.structure.blocks", name)
        for name in (
            "gain", "pid", "pid_matrix", "pid_two_degrees", "lead_lag", "low_pass", "low_pass_second", "notch",
            "washout",
        )
    },
    **{
        name: ("control.structure.space", name)
        for name in ("state_space", "transfer_function", "expression", "modal_law")
    },
}  # fmt: skip
ROOMS = ("goals", "plots")
__all__ = [*FACE, *ROOMS]  # pyright: ignore[reportUnsupportedDunderAll]

# door: the room and the function behind it
DOORS = {
    "table": ("handover.table.table", "table_of"),
    "export": ("handover.code.formats", "exported"),
    "plot": ("plots.goal", "plot_design"),
    "histories": ("plots.loop", "plot_simulation"),
}


def _found(place: tuple[str, str]):
    return getattr(import_module(f"{__name__}.{place[0]}"), place[1])


class _Room(ModuleType):
    """A package that carries the name of a verb: `workbench.design(problem)` is `workbench.design.design.design`."""

    def __call__(self, *arguments, **options):
        return _found(FACE[self.__name__.rpartition(".")[2]])(*arguments, **options)

    @property
    def __signature__(self):
        from inspect import signature

        return signature(_found(FACE[self.__name__.rpartition(".")[2]]))


class _Face(ModuleType):
    """The package itself: what it promises is found on demand, and packages that are verbs can be called."""

    def __getattr__(self, name: str):
        if name in ROOMS:
            return import_module(f"{__name__}.{name}")
        if name not in FACE:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        if FACE[name][0].partition(".")[0] == name:
            return import_module(f"{__name__}.{name}")  # which `__setattr__` makes callable
        value = _found(FACE[name])
        setattr(self, name, value)
        return value

    def __setattr__(self, name: str, value: object) -> None:
        if name in FACE and isinstance(value, ModuleType):
            value.__class__ = _Room
        super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *__all__})


for _door, _place in DOORS.items():
    exits.opened(_door, lambda place=_place: _found(place))
sys.modules[__name__].__class__ = _Face

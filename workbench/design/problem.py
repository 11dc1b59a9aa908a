"""A problem: models, a structure and goals.

    models (what is controlled) ──┐
    structure (what is tuned)   ──┼──► Problem ──design──► Design: parameters with a verdict on every goal
    goals (what must hold)      ──┘

Nothing here knows whether the plant flies. A vehicle is one maker of models, the modal law one structure, requirements
are goals; what only a vehicle has (setting, law, guideway) is asked of its maker and refused where there is none.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.analysis.setting import Setting
from workbench.control import Gains, ModalLaw
from workbench.control.loop import Subject
from workbench.control.structure.block import Block
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.design.effort import Effort
from workbench.design.models import Maker, VehicleModels, maker_of
from workbench.errors import InputError, unknown_name
from workbench.goals.goal import told_apart
from workbench.lti.model import Model
from workbench.lti.sums import terms
from workbench.result import Result, Row

if TYPE_CHECKING:
    from workbench.design.plan import Plan
    from workbench.design.variation import Variation
    from workbench.goals.goal import Goal
    from workbench.goals.ride.requirement import Requirement
    from workbench.physics.vehicle import Vehicle


@dataclass(frozen=True, kw_only=True, repr=False)
class Problem(Result):
    """Everything a design or an analysis starts from.

    Parameters
    ----------
    models : Model, several, or a maker of models
        What is controlled. A maker (`design.models`) has `.systems` and `.at(values)`.
    structure : Structure, Block or several blocks
        What is tuned. Of bare blocks, the signals that no model and no block makes are its references.
    goals : sequence of goals
        What must hold (hard) and what is made small (soft).
    name, title : for people
    approved : values last approved: `Gains` of a vehicle, else mapping of parameter to value
    sample_time : of the discrete controller [s], if it has one
    data_sha256 : of the data file;  sources : block name to source
    variation : `design.variation.Variation` that the parameters must bear
    plan : `design.plan.Plan` of a schedule
    effort : how hard a design looks where its caller does not say

    Raises
    ------
    InputError
        If a signal has no origin, models and structure do not close a loop, or a goal asks for what is not there.
    """

    models: Maker | Model | Sequence[Model]
    structure: Structure | Block | Sequence[Block]
    goals: Sequence[Any]
    name: str = "problem"
    title: str = ""
    approved: Gains | Mapping[str, float] | None = None
    sample_time: float | None = None
    data_sha256: str = ""
    sources: Mapping[str, str] = field(default_factory=dict)
    variation: "Variation | None" = None
    plan: "Plan | None" = None
    effort: Effort = field(default_factory=Effort)

    def __post_init__(self) -> None:
        object.__setattr__(self, "models", maker_of(self.models))
        object.__setattr__(self, "goals", tuple(self.goals))
        if not isinstance(self.structure, Structure):
            object.__setattr__(self, "structure", _structure(self.structure, self.systems))
        if isinstance(self.models, VehicleModels):
            for goal in self.goals:
                goal.check(self.name, self.setting)
        else:
            object.__setattr__(self, "goals", told_apart(self.goals))
            _ = self.loops  # refuses what does not fit together

    @property
    def systems(self) -> tuple[Model, ...]:
        """The linear models that are controlled."""
        return self.models.systems

    @cached_property
    def loops(self) -> tuple[Loop, ...]:
        """The structure around each model."""
        return tuple(Loop(model, self.structure) for model in self.systems)

    @property
    def requirements(self) -> tuple["Requirement", ...]:
        """The hard goals."""
        return tuple(goal for goal in self.goals if goal.hard)

    @property
    def own_sampling(self) -> tuple[tuple[float, float], ...]:
        """(sample time [s], 0 samples of delay) of a problem that has one: a case besides those always looked at."""
        return () if self.sample_time is None else ((self.sample_time, 0.0),)

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the free parameters, in the structure's order."""
        return tuple(p.name for p in self.structure.parameters if p.free)

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """Allowed interval of each free parameter."""
        return {p.name: (p.low, p.high) for p in self.structure.parameters if p.free}

    @property
    def fixed(self) -> dict[str, float]:
        """Value of each parameter that is not free."""
        return {p.name: p.value for p in self.structure.parameters if not p.free}

    def structure_at(self, values: Mapping[str, float]) -> Structure:
        """The structure at values of its parameters, those left out as they are; refused where it has no numbers."""
        structure = self.structure.with_values(values)
        with np.errstate(all="ignore"):
            sound = np.isfinite(structure.controller().stacked()).all()
        if not sound:
            shown = ", ".join(f"{name} = {value:g}" for name, value in structure.values().items())
            raise InputError(
                f"values must give a controller of finite numbers; {shown[:300]} do not: none may divide by 0."
            )
        return structure

    # --- what only a vehicle has

    @property
    def vehicle_models(self) -> VehicleModels:
        """The maker of a vehicle's models; refused where the plant is another."""
        if not isinstance(self.models, VehicleModels):
            raise InputError(
                f"this asks for a vehicle; problem {self.name!r} controls a plant of its own "
                f"({', '.join(m.name for m in self.systems)}). Take a problem with a vehicle."
            )
        return self.models

    @property
    def flies(self) -> bool:
        """Whether the models are a vehicle's."""
        return isinstance(self.models, VehicleModels)

    @property
    def setting(self) -> Setting:
        """A vehicle's plant, law and guideway at the operating point."""
        return self.vehicle_models.setting

    @property
    def vehicle(self) -> "Vehicle | None":
        """What the plant was linearised from."""
        return self.vehicle_models.vehicle

    @property
    def law(self) -> ModalLaw:
        """The control law on the vehicle's coil places."""
        return self.setting.law

    @property
    def gains(self) -> Gains | None:
        """A vehicle's gains last approved."""
        return self.approved if isinstance(self.approved, Gains) else None

    @property
    def subjects(self) -> tuple[Subject, ...]:
        """One linear model per group of motion."""
        return self.setting.subjects

    # --- the same problem, changed

    def with_fixed(self, values: Mapping[str, float]) -> "Problem":
        """The same problem with some parameters fixed."""
        known = {p.name for p in self.structure.parameters}
        for name in values:
            if name not in known:
                raise unknown_name("gain" if self.flies else "parameter", name, known)
        return replace(self, structure=self.structure.held(values)) if values else self

    def with_bounds(self, bounds: Mapping[str, tuple[float, float]]) -> "Problem":
        """The same problem with other bounds of free parameters."""
        structure = self.structure
        for name, interval in bounds.items():
            structure = structure.with_bounds(name, *interval)
        return replace(self, structure=structure)

    def with_models(self, models: Maker | Model | Sequence[Model]) -> "Problem":
        """The same problem for other models."""
        return replace(self, models=models)

    def with_setting(self, setting: Setting) -> "Problem":
        """The same problem of a vehicle in another setting, whatever its vehicle."""
        return replace(self, models=replace(self.vehicle_models, setting=setting))

    def with_vehicle(self, vehicle: "Vehicle") -> "Problem":
        """The same problem for another vehicle or operating point."""
        return replace(self, models=self.vehicle_models.with_vehicle(vehicle))

    def at(self, values: Mapping[str, float]) -> "Problem":
        """The same problem with other values of what its models are made of: a vehicle's speed, mass and so on."""
        return replace(self, models=self.models.at(values))

    def with_goals(self, goals: Sequence["Goal"]) -> "Problem":
        """The same problem with other goals."""
        return replace(self, goals=tuple(goals))

    def with_requirements(self, requirements: Sequence["Requirement"]) -> "Problem":
        """The same problem with other hard goals; the soft ones stay."""
        return self.with_goals((*requirements, *(goal for goal in self.goals if not goal.hard)))

    def check_one_way(self, cure: str) -> None:
        """Refuses a variation and a schedule together: a schedule is not designed for a variation.

        cure : what its caller may do to choose one
        """
        if self.variation is not None and self.plan is not None:
            raise InputError(
                f"a design takes a [variation] or a [schedule]; problem {self.name!r} describes both: {cure}."
            )

    def rows(self) -> list[Row]:
        names = self.setting.groups if self.flies else [model.name for model in self.systems]
        asked = [(f"{r.name} {r.sense}", r.limit, r.unit) for r in self.requirements] if self.flies else []
        return [
            ("problem", self.name, ""),
            ("title", self.title, ""),
            ("groups" if self.flies else "models", ", ".join(names), ""),
            ("free parameters", len(self.free), ""),
            *(asked or [("goal", goal.name, "hard" if goal.hard else "soft") for goal in self.goals]),
        ]


def _structure(given: Block | Sequence[Block], systems: Sequence[Model]) -> Structure:
    """The structure of bare blocks; what they read that no model and no block makes comes from outside."""
    blocks = (given,) if isinstance(given, Block) else tuple(given)
    made = {name for model in systems for name in (*model.inputs, *model.outputs)}
    made |= {name for block in blocks for name in block.outputs}
    read = dict.fromkeys(
        name for block in blocks for text in block.inputs for name in ([text] if text in made else terms(text))
    )
    outside = [name for name in read if name not in made]
    for name in outside:
        if len(name) > 1 and get_close_matches(name, made, n=1, cutoff=0.75):
            raise unknown_name("signal", name, made)
    if not any(name in made for name in read):
        raise InputError(
            f"a structure must read a signal that a model makes; it reads {', '.join(read)}, and there are "
            f"{', '.join(sorted(made))}. Mend the names."
        )
    return Structure(blocks, tuple(outside))

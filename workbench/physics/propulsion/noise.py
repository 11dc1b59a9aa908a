"""Noise of a propulsion made of several equal units: levels, sums, steps of technology, a budget against a limit.

    level of a unit ──► + 10 log n ──► energy sum over kinds ──► overall level ──► distance ──► margin to a limit
            └── − steps (quieter source, better treatment, cleaner inlet) ──► projection table

Levels are A-weighted sound pressure levels, dB(A), 50 feet from the vehicle unless said otherwise; different units are
uncorrelated, so energies add. The report gives its levels in figures (E-1, E-2, E-6, E-7) whose curves are lost; only
what its text says is used: 86 dB(A) a unit at full power with grade and headwind, 80 at cruise, and reductions that are
upper bounds ("up to"). The fan's last step, a cleaner inlet, has no number in the text; 63 dB(A) for two fans implies
5 dB. There is no law of noise against speed here, because the curve of Figure E-7 is lost. Source: report, Appendix E.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from workbench.errors import InputError, unknown_name
from workbench.physics.propulsion.quantity import count, not_negative, number, positive
from workbench.result import Result, Row

FIFTY_FEET = 15.24  # [m], where the report gives its levels
TODAY = "today"


def energy_sum(levels: Sequence):
    """Level [dB] of several uncorrelated sounds together, 10 log₁₀ Σ 10^(L/10); scalars, DM or SX, elementwise.

    Examples
    --------
    >>> print(f"{float(energy_sum([86.0] * 4)):.2f} dB")
    92.02 dB
    """
    return 10 * ca.log10(sum(10 ** (level / 10) for level in levels))


def of_units(level, units):
    """Level [dB] of equal uncorrelated units, L + 10 log₁₀ n, elementwise."""
    return level + 10 * ca.log10(units)


def at_distance(level, distance, reference=FIFTY_FEET):
    """Level [dB] at another distance [m] from a point source in the open: 6 dB less per doubling, elementwise.

    Valid far from the source compared with its size; absorption by the air and reflection by the ground are left out.
    The report gives levels at 50 feet only; the inverse-square law is ours.

    Examples
    --------
    >>> print(f"{float(at_distance(86.0, 30.48, 15.24)):.2f} dB")
    79.98 dB
    """
    return level - 20 * ca.log10(distance / reference)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Step(Result):
    """A step of technology and what it takes off one unit's level at most."""

    name: str
    reduction: float  # [dB]
    source: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "reduction", not_negative(f"reduction of step {self.name!r}", self.reduction, "dB"))

    def rows(self) -> list[Row]:
        return [(self.name, self.reduction, "dB")]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Source(Result):
    """Several equal units of one kind.

    `level` is that of one unit with its present treatment, which takes `treatment` off the bare unit: 20 dB for the
    fan's ducts, 13 dB for the engine's nozzle. That the printed 86 and 80 dB(A) include it is our reading.
    """

    name: str
    level: float  # of one unit, treated, at 50 feet [dB(A)]
    units: int
    treatment: float = 0.0  # [dB]
    steps: tuple[Step, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "level", number(f"level of the {self.name}", self.level, "dB(A)"))
        object.__setattr__(self, "treatment", not_negative(f"treatment of the {self.name}", self.treatment, "dB"))
        count(f"units of the {self.name}", self.units)

    @property
    def untreated_level(self) -> float:
        """Level of one bare unit at 50 feet [dB(A)]."""
        return self.level + self.treatment

    def level_after(self, technology: Sequence[str]) -> float:
        """Level of all units together [dB(A)] after the named steps; a step this kind does not have changes nothing."""
        reduction = sum(step.reduction for step in self.steps if step.name in technology)
        return float(of_units(self.level - reduction, self.units))

    def rows(self) -> list[Row]:
        return [
            ("level of one unit", self.level, "dB(A)"),
            ("units", self.units, ""),
            ("level of all units", self.level_after(()), "dB(A)"),
            ("level of one unit without treatment", self.untreated_level, "dB(A)"),
            *((f"{step.name} (up to)", -step.reduction, "dB") for step in self.steps),
        ]


QUIETER_SOURCE, BETTER_TREATMENT, CLEANER_INLET = "quieter source", "better treatment", "cleaner inlet"
FULL_POWER, CRUISE = 86.0, 80.0  # one unit with grade and headwind; at cruise without [dB(A)] (report, E.5)
FAN_STEPS = (
    Step(name=QUIETER_SOURCE, reduction=10.0, source="report, E.1: up to 10 dB under cruise conditions"),
    Step(name=BETTER_TREATMENT, reduction=5.0, source="report, E.3: another 5 dB"),
    Step(name=CLEANER_INLET, reduction=5.0, source="not printed; implied by 63 dB(A) for two fans (report, E.5)"),
)
ENGINE_STEPS = (
    Step(name=QUIETER_SOURCE, reduction=10.0, source="report, E.2: up to 10 dB"),
    Step(name=BETTER_TREATMENT, reduction=5.0, source="report, E.4: an additional 5 dB"),
)


def report_sources(
    *, fan_level: float = CRUISE, engine_level: float = CRUISE, fans: int = 2, engines: int = 2
) -> tuple[Source, Source]:
    """The report's fans and core engines, dB(A) a unit at 50 feet, with the treatment and steps of its text."""
    return (
        Source(name="fans", level=fan_level, units=fans, treatment=20.0, steps=FAN_STEPS),
        Source(name="engines", level=engine_level, units=engines, treatment=13.0, steps=ENGINE_STEPS),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Projection:
    """Levels after one more step of technology than the row before."""

    technology: str
    levels: tuple[float, ...]  # of each source, all units, at the distance asked for [dB(A)]
    overall: float  # [dB(A)]
    margin: float | None  # limit minus overall [dB]; None without a limit


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class NoiseBudget(Result):
    """Levels of every source, technology by technology, against a limit; the verdict is for one of them."""

    sources: tuple[Source, ...]
    distance: float  # [m]
    technology: str  # the last step taken for the verdict; earlier ones are included
    projections: tuple[Projection, ...]
    overall: float  # [dB(A)]
    limit: float | None  # [dB(A)]
    margin: float | None  # limit minus overall [dB]
    met: bool  # also without a limit

    def rows(self) -> list[Row]:
        here: list[Row] = [("distance", self.distance, "m"), ("technology", self.technology, "")]
        chosen = next(row for row in self.projections if row.technology == self.technology)
        here += [(source.name, level, "dB(A)") for source, level in zip(self.sources, chosen.levels, strict=True)]
        here.append(("overall", self.overall, "dB(A)"))
        if self.limit is not None:
            here += [("limit", self.limit, "dB(A)"), ("margin", self.margin, "dB"), ("limit met", self.met, "")]
        return here


def noise_budget(
    sources: Sequence[Source], *, distance: float = FIFTY_FEET, limit: float | None = None, technology: str = TODAY
) -> NoiseBudget:
    """The overall level after each step of technology, and whether the one asked for meets the limit.

    Parameters
    ----------
    sources : sequence of Source
        Steps are taken in the order of their first mention, by all sources that have them.
    distance : float
        From the vehicle [m].
    limit : float, optional
        Largest overall level at that distance [dB(A)].
    technology : str
        "today", or the last step taken.

    Raises InputError without sources and for a technology that no source names.
    """
    if not sources:
        raise InputError("a noise budget must have at least one source; got none. Give fans, engines or both.")
    where = positive("distance", distance, "m")
    bound = None if limit is None else number("limit", limit, "dB(A)")
    names = [TODAY, *dict.fromkeys(step.name for source in sources for step in source.steps)]
    if technology not in names:
        raise unknown_name("technology", technology, names)
    projections = []
    for taken in range(len(names)):
        levels = tuple(float(at_distance(source.level_after(names[1 : taken + 1]), where)) for source in sources)
        overall = float(energy_sum(levels))
        margin = None if bound is None else bound - overall
        projections.append(Projection(technology=names[taken], levels=levels, overall=overall, margin=margin))
    chosen = projections[names.index(technology)]
    return NoiseBudget(
        sources=tuple(sources),
        distance=where,
        technology=technology,
        projections=tuple(projections),
        overall=chosen.overall,
        limit=bound,
        margin=chosen.margin,
        met=chosen.margin is None or chosen.margin >= 0,
    )

"""The gain table: what a design hands over, and what someone else can check.

    Design --table_from_design--> GainTable --write--> JSON
    JSON --read_table--> GainTable --> Gains, law, discrete law, plant

Numbers that a proof starts from (gains, law, plant) are decimal strings: the digits printed, each of which `float`
reads back as the same double. The digest is the SHA-256 of the canonical JSON (sorted keys, no spaces, UTF-8) of
everything else, so a changed digit is noticed; promises say what a re-signed table would still have to keep, and
`workbench.verify` proves them again from these numbers and those of the certificate.
Published schema: gain_table.schema.json, beside this file.
"""

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, Field, JsonValue, ValidationError, model_validator

from workbench.control import GAIN_UNITS, Gains, ModalLaw
from workbench.control.discrete import DiscreteLaw, discretise
from workbench.control.law import Actuator
from workbench.control.schedule import Schedule
from workbench.errors import InputError
from workbench.files.digest import check_digest, digest_of
from workbench.handover.table.certificate import certificate_of, plant_part
from workbench.handover.table.schema import (
    CertificatePart,
    Decimal,
    LawPart,
    Name,
    PlantPart,
    Promise,
    RequirementRecord,
    SchedulePart,
    Sha256,
    Text,
    Undecided,
    Versions,
    versions,
)
from workbench.handover.table.signed import SignedTable
from workbench.lti import Plant
from workbench.machine.reading import read_mapping
from workbench.result import Row

if TYPE_CHECKING:
    from workbench.handover.table.plant import PlantTable

T = TypeVar("T", bound=BaseModel)
FORMAT = "maglev-workbench gain table"
VERSION = 1  # of vehicles
INVARIANCE = (
    "Two directions of the seventeen parameters change nothing: vertical filter gains × λ with K_heave, K_pitch / λ, "
    "and lateral filter gains × μ with K_sway, K_yaw / μ, K_roll following (Gains.rescaled)."
)
INVARIANCE_WITH_ACTUATORS = (
    "What changes nothing among the seventeen parameters is removed by fixing {references} (ModalLaw.references)."
)


class GainTable(SignedTable):
    """The gains of a design with their evidence; see the module's map and each block."""

    format: Literal["maglev-workbench gain table"]
    version: Literal[1]
    problem: Name
    title: Text
    data_sha256: Sha256
    created: Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}T\d{2}:\d{2}:\d{2}Z$")]
    versions: Versions
    seed: int
    solver: Name
    starts: Annotated[int, Field(ge=0)]
    gains: Annotated[dict[Name, Decimal], Field(max_length=17)]
    units: Annotated[dict[Name, Text], Field(max_length=17)]
    invariance: Annotated[str, Field(max_length=1000)]
    law: LawPart
    plant: PlantPart | None
    certificate: CertificatePart | None = None  # tables before it lack it
    schedule: SchedulePart | None = None
    measured: Annotated[dict[Name, JsonValue], Field(max_length=200)]
    requirements: Annotated[list[RequirementRecord], Field(max_length=200)]
    promises: Annotated[list[Promise], Field(max_length=500)]
    undecided: Annotated[list[Undecided], Field(max_length=500, default_factory=list)]  # tables before it lack it
    robustness: Annotated[dict[Name, JsonValue], Field(max_length=500)]
    digest: Sha256

    @model_validator(mode="after")
    def whole(self) -> "GainTable":
        """The seventeen gains in their units, a law that can tell the motions apart, a plant that fits together."""
        if self.units != GAIN_UNITS:
            raise ValueError(f"units must be those of the seventeen gains, {GAIN_UNITS}; got {str(self.units)[:120]}")
        for part in (self.to_gains, self.to_law, self.to_plant):
            part()  # refuses what makes no sense
        return self

    def to_gains(self) -> Gains:
        """The gains as doubles."""
        return Gains.from_mapping({name: float(text) for name, text in self.gains.items()})

    def to_law(self) -> ModalLaw:
        """The control law's structure: commands from sensors, without the problem."""
        actuators = tuple(Actuator(a.name, a.signal, float(a.lever)) for a in self.law.actuators)
        positions = tuple((float(x), float(y)) for x, y in self.law.positions_m)
        return ModalLaw(positions, float(self.law.depth_m), actuators)

    def to_discrete(self) -> DiscreteLaw:
        """The law at the table's sample time."""
        return discretise(self.to_law(), self.to_gains(), float(self.law.sample_time_s))

    def to_plant(self) -> Plant | None:
        """The vehicle without control, if the table holds it."""
        p = self.plant
        if p is None:
            return None
        matrices = {k: [[float(x) for x in row] for row in getattr(p, k)] for k in "ABCD"}
        return Plant(**matrices, states=tuple(p.states), inputs=tuple(p.inputs), outputs=tuple(p.outputs))

    def to_schedule(self) -> Schedule | None:
        """The gains over speed, if the table holds them."""
        return None if self.schedule is None else Schedule.from_dict(self.schedule.model_dump())

    def rows(self) -> list[Row]:
        return [
            ("problem", self.problem, ""),
            ("created", self.created, ""),
            ("requirements met", all(r.met for r in self.requirements), ""),
            *((f"{r.name} {r.sense} {r.limit:g}", r.value, r.unit) for r in self.requirements),
            *((name, text, GAIN_UNITS[name]) for name, text in self.gains.items()),
            ("digest", self.digest, "SHA-256"),
        ]


def table_from_design(
    design, robustness: dict[str, Any] | None = None, *, created: datetime | None = None
) -> GainTable:
    """The gain table of a verified design.

    Parameters
    ----------
    design : workbench.design.design.Design
    robustness : what more is known, in JSON's types; goes into the table as it is
    created : time of the table; now if left out
    """
    from workbench.handover.table.promise import promises, unproved
    from workbench.result import plain

    problem, gains = design.problem, design.gains
    measured = design.analysis.to_dict()
    del measured["gains"]  # stand in the table once, as decimals
    document = {
        "format": FORMAT, "version": VERSION, "problem": problem.name, "title": problem.title,
        "data_sha256": problem.data_sha256,
        "created": (created or datetime.now(UTC)).astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        "versions": versions(), "seed": design.seed, "solver": design.solver, "starts": len(design.starts),
        "gains": {name: repr(value) for name, value in gains.as_dict().items()}, "units": dict(GAIN_UNITS),
        "invariance": _invariance(problem, gains),
        "law": law_part(problem.law, problem.sample_time),
        "plant": plant_part(problem.setting.plant, problem.law.positions, problem.setting.sets),
        "certificate": certificate_of(problem), "schedule": None,
        "measured": measured, "requirements": [v.to_dict() for v in design.requirements],
        "promises": [], "undecided": [], "robustness": plain(dict(robustness or {})),
    }  # fmt: skip
    document["promises"] = promises(design, document)
    document["undecided"] = unproved(design)
    document["digest"] = digest_of(document)
    return _validated(document, "the design's table", GainTable)


def table_of(design) -> "GainTable | PlantTable":
    """The gain table of a design: of a vehicle, or of any plant.

    design : workbench.design.record.Design
    """
    from workbench.handover.table.plant import plant_table

    return table_from_design(design) if design.problem.flies else plant_table(design)


def read_table(path: Path) -> "GainTable | PlantTable":
    """The table in a file: `GainTable` of a vehicle (version 1), `PlantTable` of any plant (version 2).

    Raises
    ------
    InputError
        If the file is not readable JSON, not a gain table of this version, changed since it was signed, or has an
        entry that is missing, unknown or not usable; the sentence names it.
    """
    document = read_mapping(Path(path))
    given = {key: str(document.get(key))[:60] for key in ("format", "version", "digest")}
    if document.get("format") != FORMAT:
        raise InputError(
            f"{path} must be a gain table, of format {FORMAT!r}; got format {given['format']!r}. "
            "Give the JSON that 'workbench design' wrote."
        )
    from workbench.handover.table.plant import VERSION as PLANTS
    from workbench.handover.table.plant import PlantTable

    known: dict[Any, type[GainTable] | type[PlantTable]] = {VERSION: GainTable, PLANTS: PlantTable}
    version = document.get("version")
    if isinstance(version, bool) or not isinstance(version, int) or version not in known:
        raise InputError(
            f"{path} must be a gain table of version {VERSION} or {PLANTS}; got {given['version']!r}. "
            "Use the workbench that wrote it."
        )
    check_digest(document, Path(path))
    return _validated(document, str(path), known[version])


def schema() -> dict[str, Any]:
    """The JSON schema of a gain table."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **GainTable.model_json_schema()}


def _validated(document: dict[str, Any], place: str, part: type[T]) -> T:
    try:
        return part.model_validate_json(json.dumps(document))
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        key = ".".join(str(part) for part in first["loc"]) or "the table as a whole"
        words = {"extra_forbidden": "is not known; remove it", "missing": "is missing; add it"}
        said = words.get(
            first["type"],
            f"is not usable: {first['msg'].removeprefix('Value error, ').rstrip('.')}; got {str(first['input'])[:60]}",
        )
        raise InputError(f"{place}: {key} {said}.") from error


def _invariance(problem, gains: Gains) -> str:
    """Which directions change nothing, and how they were removed."""
    law = problem.law
    words = INVARIANCE_WITH_ACTUATORS.format(references=" and ".join(law.references)) if law.split else INVARIANCE
    fixed = [f"{n} = {gains.as_dict()[n]:g}" for n in law.references if n in problem.fixed and problem.free]
    return f"{words} Fixed here: {', '.join(fixed) or 'none of them'}."


def law_part(law: ModalLaw, sample_time: float) -> dict[str, Any]:
    """The law part of a gain table."""
    return {
        "positions_m": [[repr(float(x)), repr(float(y))] for x, y in law.positions],
        "depth_m": repr(float(law.depth)),
        "actuators": [{"name": a.name, "signal": a.signal, "lever": repr(float(a.lever))} for a in law.actuators],
        "sample_time_s": repr(float(sample_time)),
    }

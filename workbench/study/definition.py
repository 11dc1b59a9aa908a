"""What a study is: a problem, parameters with their distributions, how they are sampled, what is recorded and asked.

STUDY.toml --export.study_file--> Study --sampling--> rows of parameter values

Everything that rows depend on is in these records and in the problem's files; `identity` is the hash of both.
"""

import hashlib
import json
import math
from dataclasses import asdict, dataclass, field

from workbench.control.gains import GAIN_NAMES
from workbench.control.schedule import Schedule
from workbench.errors import InputError, unknown_name
from workbench.goals.verdict import CLOSE_ENOUGH
from workbench.result import Result, Row, figure

TASKS = ("analyse", "design", "pareto")
SAMPLINGS = ("grid", "latin_hypercube", "monte_carlo", "sobol", "list")
DISTRIBUTIONS = ("uniform", "log_uniform", "normal", "values")
# name in a study file: argument of `vehicle.varied`
VEHICLE_FACTORS = {
    "mass": "mass", "inertia.roll": "roll_inertia", "inertia.pitch": "pitch_inertia", "inertia.yaw": "yaw_inertia",
    "current_force": "current_force", "gap_force": "gap_force",
}  # fmt: skip
SENSOR_SCALES = ("sensor_scale", "sensor_scale.vertical", "sensor_scale.lateral")
MOST_ROWS = 10_000_000  # a row is some hundred bytes; beyond, the table no longer fits in memory
MOST_PARAMETERS = 60


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One parameter and how its values are spread.

    name : a gain, a factor, `speed`, or the dotted path of a number in the problem's data
    distribution : "uniform" or "log_uniform" over [low, high]; "normal" with mean and deviation, truncated to
        [low, high]; "values", each as likely as the others (or, in a grid and a list, as they stand)
    levels : of a grid over a range
    """

    name: str
    distribution: str
    low: float = 0.0
    high: float = 0.0
    mean: float = 0.0
    deviation: float = 0.0
    values: tuple[float, ...] = ()
    levels: int = 0

    def __post_init__(self) -> None:
        where = f"parameter {self.name!r}"
        if self.distribution not in DISTRIBUTIONS:
            raise unknown_name("distribution", self.distribution, DISTRIBUTIONS)
        if self.distribution == "values":
            if not self.values:
                raise InputError(f"{where} must have at least one value; got none. Give values = [1.0, 2.0].")
            return
        if not self.low < self.high:
            raise InputError(
                f"{where} must have a rising range; got [{self.low}, {self.high}]. Give the lower end first."
            )
        if self.distribution == "log_uniform" and self.low <= 0:
            raise InputError(f"{where} must have a positive range to be log-uniform; it starts at {self.low}.")
        if self.distribution == "normal" and not self.deviation > 0:
            raise InputError(f"{where} must have a positive deviation; got {self.deviation}.")
        if self.distribution == "normal" and not (
            self.mean > self.low - 6 * self.deviation and self.mean < self.high + 6 * self.deviation
        ):
            raise InputError(
                f"{where} must have its mean within six deviations of its range; got mean {self.mean}, "
                f"range [{self.low}, {self.high}]. Move one of them."
            )

    @property
    def kind(self) -> str:
        """ "gain", "factor", "sensor", "speed" or "data"."""
        if self.name in GAIN_NAMES:
            return "gain"
        if self.name in VEHICLE_FACTORS:
            return "factor"
        if self.name in SENSOR_SCALES:
            return "sensor"
        return "speed" if self.name == "speed" else "data"


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """What a row must keep of a recorded quantity, not to count as failing."""

    quantity: str
    sense: str  # "<=" or ">="
    value: float

    def kept(self, value: float | None) -> bool:
        """Whether a value keeps it, or stands at it to nine digits, as a design's may; None does not."""
        if value is None:
            return False
        room = CLOSE_ENOUGH * abs(self.value)
        return value <= self.value + room if self.sense == "<=" else value >= self.value - room

    def __str__(self) -> str:
        return f"{self.quantity} {self.sense} {self.value:g}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep:
    """The limits of one requirement, or of one goal of a plant of one's own, along which a Pareto front is followed.

    limits : in SI units, in the goal's own;  sense : of the limit, as the problem has it
    """

    requirement: str
    limits: tuple[float, ...]
    sense: str = "<="

    def __post_init__(self) -> None:
        if not self.limits or len(set(self.limits)) < len(self.limits) or min(self.limits) <= 0:
            raise InputError(
                f"the sweep of {self.requirement!r} must have distinct positive limits; got {list(self.limits)[:8]}."
            )

    @property
    def order(self) -> tuple[float, ...]:
        """The limits from the loosest."""
        return tuple(sorted(self.limits, reverse=self.sense == "<="))


@dataclass(frozen=True, kw_only=True, repr=False)
class Study(Result):
    """A study as its file describes it.

    problem : name or folder;  task : one of `TASKS`;  count, seed : of the sampling;  starts : of each design, 0 to
    refine the given gains;  gains : name to value, where they are not the problem's approved ones;  schedule : theirs
    over speed, where they have one
    quantities : recorded, as dotted paths in the JSON of `analyse`; the task's usual ones if empty
    limits : the problem's requirements if empty;  sweeps : of task "pareto";  confidence : of every interval
    """

    problem: str
    task: str = "analyse"
    sampling: str = "latin_hypercube"
    count: int = 0
    seed: int = 0
    parameters: tuple[Parameter, ...] = ()
    quantities: tuple[str, ...] = ()
    limits: tuple[Limit, ...] = ()
    sweeps: tuple[Sweep, ...] = ()
    gains: dict[str, float] | None = None
    schedule: Schedule | None = None
    starts: int = 4
    output: str = "parquet"
    confidence: float = 0.95
    _names: tuple[str, ...] = field(init=False, compare=False)

    def __post_init__(self) -> None:
        for kind, given, known in (("task", self.task, TASKS), ("sampling", self.sampling, SAMPLINGS)):
            if given not in known:
                raise unknown_name(kind, given, known)
        names = tuple(p.name for p in self.parameters)
        object.__setattr__(self, "_names", names)
        for kind, given in (("parameter", names), ("quantity", self.quantities)):
            twice = [n for n in given if given.count(n) > 1]
            if twice:
                raise InputError(f"a study must name each {kind} once; got {twice[0]!r} twice. Drop one of them.")
        if not 0 < self.confidence < 1:
            raise InputError(f"confidence must lie between 0 and 1; got {self.confidence}. Give 0.95.")
        if self.task == "pareto":
            self._check_sweeps()
        else:
            self._check_sampling()
        if self.rows_planned > MOST_ROWS:
            raise InputError(
                f"a study has at most {MOST_ROWS} rows; this one asks for {self.rows_planned}. Sample fewer."
            )

    def _check_sweeps(self) -> None:
        if not self.sweeps or self.parameters:
            raise InputError("a study of task 'pareto' must have [[pareto]] sweeps and no parameters; mend the file.")
        names = [s.requirement for s in self.sweeps]
        if len(set(names)) < len(names):
            raise InputError(f"each requirement must be swept once; got {names}. Join the limits of the doubled one.")

    def _check_sampling(self) -> None:
        if self.sweeps:
            raise InputError(f"[[pareto]] sweeps belong to task 'pareto'; got task {self.task!r}. Change one of them.")
        if not 1 <= len(self.parameters) <= MOST_PARAMETERS:
            raise InputError(
                f"a study must have 1 to {MOST_PARAMETERS} parameters; got {len(self.parameters)}. "
                "Add [[parameter]] tables."
            )
        drawn = self.sampling in ("latin_hypercube", "monte_carlo", "sobol")
        if drawn and self.count < 1:
            raise InputError(f"sampling {self.sampling!r} must have a count of at least 1; got {self.count}.")
        for p in self.parameters:
            if self.sampling == "list" and p.distribution != "values":
                raise InputError(f"every parameter of a list must give values; {p.name!r} gives a range.")
            if self.sampling == "grid" and p.distribution != "values" and p.levels < 2:
                raise InputError(
                    f"parameter {p.name!r} of a grid must give values, or a range with levels of 2 or more."
                )
            if self.sampling != "grid" and p.levels:
                raise InputError(
                    f"levels must stand in a grid alone; {p.name!r} of a {self.sampling} gives {p.levels}."
                )
            if self.task == "design" and p.kind == "sensor":
                raise InputError(
                    f"a design cannot vary {p.name!r}, which scales the gains it chooses; analyse instead."
                )
        if not drawn and self.count:
            raise InputError(
                f"the rows of a {self.sampling} must follow from its parameters; got count = {self.count}. "
                "Leave it out, or draw a sample."
            )
        if self.sampling == "list" and len({len(p.values) for p in self.parameters}) > 1:
            counts = ", ".join(f"{p.name} {len(p.values)}" for p in self.parameters)
            raise InputError(f"every parameter of a list must have as many values as the others; got {counts}.")
        scales = {p.name for p in self.parameters if p.kind == "sensor"}
        if "sensor_scale" in scales and len(scales) > 1:
            raise InputError("sensor_scale scales both directions; give it alone, or the vertical and lateral ones.")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self._names

    @property
    def rows_planned(self) -> int:
        """How many rows the table will have."""
        if self.task == "pareto":
            return sum(len(s.limits) for s in self.sweeps)
        if self.sampling == "grid":
            return math.prod(len(p.values) or p.levels for p in self.parameters)
        if self.sampling == "list":
            return len(self.parameters[0].values)
        return self.count * (len(self.parameters) + 2) if self.sampling == "sobol" else self.count

    def definition(self) -> dict:
        """What the rows depend on, in JSON's types; the form of the output is not part of it."""
        document = asdict(self)
        for name in ("output", "confidence", "limits", "gains", "schedule", "problem", "_names"):
            del document[name]  # of the output's form, or in the identity by content
        for sweep in document["sweeps"]:
            del sweep["sense"]  # the problem says it
        return document

    def rows(self) -> list[Row]:
        return [
            ("problem", self.problem, ""),
            ("task", self.task, ""),
            ("sampling", self.sampling, ""),
            ("rows", self.rows_planned, ""),
            *((p.name, spread(p), "") for p in self.parameters),
        ]


def spread(p: Parameter) -> str:
    """A parameter's distribution in words."""
    if p.distribution == "values":
        shown = ", ".join(figure(v) for v in p.values[:6])
        return f"{shown}, … ({len(p.values)} values)" if len(p.values) > 6 else shown
    mean = f" {figure(p.mean)} ± {figure(p.deviation)} in" if p.distribution == "normal" else ""
    return f"{p.distribution.replace('_', '-')}{mean} [{figure(p.low)}, {figure(p.high)}]"


def sha256(document) -> str:
    """Of the canonical JSON (sorted keys, no spaces) of a document."""
    text = json.dumps(document, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()

"""What a proof needs of a gain table of version 2, in exact rationals: models, blocks with their parameters, promises.

document --table_of--> Table: every part checked for type, shape and size; one sentence names what is not usable
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from flint import fmpq, fmpq_mat

from workbench.verify.exact.failure import NotProved, TableError
from workbench.verify.exact.system import System
from workbench.verify.reading import as_printed, decimal, entries_of, keyed, mapping, matrix_of, optional, text_of

MOST_MODELS, MOST_BLOCKS, MOST_SIGNALS, MOST_STATES, MOST_PROMISES = 50, 100, 60, 60, 300
MOST_PARAMETERS = 1000
KEYS = (
    "format", "version", "problem", "title", "data_sha256", "created", "versions", "seed", "solver", "starts", "models",
    "structure", "measured", "requirements", "promises", "undecided", "digest",
)  # fmt: skip
SUBJECT = ("inputs", "outputs", "openings", "points", "models", "band", "scaled")
NAMED = SUBJECT[:5]
Scaled = tuple[tuple[str, fmpq], ...]


@dataclass(frozen=True, slots=True)
class Line:
    """A dead time between an output of the model's matrices and an input of theirs."""

    source: str
    sink: str
    dead_time: fmpq


@dataclass(frozen=True, slots=True)
class Model:
    """A linear model with dead times; x[k+1] = A x[k] + B u[k] where it has a sample time."""

    name: str
    system: System
    lines: tuple[Line, ...]
    sample_time: fmpq | None

    @property
    def inputs(self) -> tuple[str, ...]:
        """The signals that come from outside, not out of a dead time."""
        return tuple(u for u in self.system.inputs if u not in {x.sink for x in self.lines})

    @property
    def outputs(self) -> tuple[str, ...]:
        """The signals that are seen outside, not led into a dead time."""
        return tuple(y for y in self.system.outputs if y not in {x.source for x in self.lines})

    def changed(self, scaled: Scaled) -> "Model":
        """The model with factors on some of its inputs and outputs."""
        factors, system = dict(scaled), self.system
        for name in factors:
            if name not in (*self.inputs, *self.outputs):
                raise NotProved(f"{name[:60]!r} is neither input nor output of model {self.name[:60]!r}")
        B, C, D = fmpq_mat(system.B), fmpq_mat(system.C), fmpq_mat(system.D)
        for j, name in enumerate(system.inputs):
            for M in (B, D):
                for i in range(M.nrows()):
                    M[i, j] = M[i, j] * factors.get(name, 1)
        for i, name in enumerate(system.outputs):
            for M in (C, D):
                for j in range(M.ncols()):
                    M[i, j] = M[i, j] * factors.get(name, 1)
        return replace(self, system=replace(system, B=B, C=C, D=D))


@dataclass(frozen=True, slots=True)
class Block:
    """A controller block: its kind, the signed sums it reads, the signals it makes, its parameters by slot."""

    kind: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    options: Mapping[str, Any]
    parameters: Mapping[str, fmpq]


@dataclass(frozen=True, slots=True)
class Subject:
    """Which part of which loops a promise speaks of; no models: all of them; no band: every frequency.

    scaled : inputs and outputs of the models with factors on them: the loops are those of plants so changed
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    openings: tuple[str, ...]
    points: tuple[str, ...]
    models: tuple[str, ...]
    band: tuple[fmpq, fmpq | None] | None
    scaled: Scaled = ()

    def words(self) -> str:
        """The subject in a phrase."""
        parts = [f"{', '.join(self.inputs)} → {', '.join(self.outputs)}"] if self.inputs or self.outputs else []
        parts += [f"at {', '.join(self.points)}"] if self.points else []
        parts += [f"with {', '.join(self.openings)} open"] if self.openings else []
        parts += [f"with {name} times {float(factor):g}" for name, factor in self.scaled]
        if self.band is not None:
            low, high = self.band
            parts.append(f"from {float(low):g} to {'inf' if high is None else f'{float(high):g}'} rad/s")
        parts += [f"of {', '.join(self.models)}"] if self.models else []
        return " ".join(parts)


@dataclass(frozen=True, slots=True)
class Promise:
    """A quantity of a kind keeps a limit on a subject."""

    kind: str
    sense: str
    limit: fmpq
    subject: Subject

    @property
    def name(self) -> str:
        """Kind and subject in words."""
        return " ".join(part for part in (self.kind, self.subject.words()) if part)


@dataclass(frozen=True, slots=True)
class Table:
    """The numbers of a table; `document` holds what nobody proves as well."""

    models: tuple[Model, ...]
    references: tuple[str, ...]
    blocks: tuple[Block, ...]
    promises: tuple[Promise, ...]
    digest: str
    document: Mapping[str, Any]

    @property
    def sample_time(self) -> fmpq | None:
        """Of all models."""
        return self.models[0].sample_time


def table_of(document: Mapping[str, Any]) -> Table:
    """The parts a proof rests on; raises TableError with the place of what is not usable."""
    keyed(document, "the table", KEYS)
    models = tuple(
        _model(x, f"models.{i}") for i, x in enumerate(entries_of(document["models"], "models", MOST_MODELS, 1))
    )
    _distinct([m.name for m in models], "models")
    if any(m.sample_time != models[0].sample_time for m in models):
        raise TableError("the models of a table must have one sample time; they do not. Get the table again.")
    structure = keyed(document["structure"], "structure", ("references", "blocks"))
    blocks = tuple(
        _block(x, f"structure.blocks.{i}")
        for i, x in enumerate(entries_of(structure["blocks"], "structure.blocks", MOST_BLOCKS, 1))
    )
    _shared(structure["blocks"])
    promises = tuple(
        _promise(x, f"promises.{i}") for i, x in enumerate(entries_of(document["promises"], "promises", MOST_PROMISES))
    )
    known = {m.name for m in models}
    for p in promises:
        for name in p.subject.models:
            if name not in known:
                raise TableError(f"{p.name!r} must speak of a model of the table; {name[:40]!r} is none. Mend it.")
    for part in ("requirements", "undecided"):
        for i, entry in enumerate(entries_of(document[part], part, MOST_PROMISES)):
            mapping(entry, f"{part}.{i}")
    mapping(document["measured"], "measured")
    return Table(
        models, _names(structure["references"], "structure.references"), blocks, promises,
        text_of(document["digest"], "digest"), document,
    )  # fmt: skip


def _model(value: Any, place: str) -> Model:
    keys = ("name", "sample_time_s", "states", "inputs", "outputs", "A", "B", "C", "D", "lines")
    given = keyed(value, place, keys)
    x, u, y = (
        _names(given[kind], f"{place}.{kind}", MOST_STATES if kind == "states" else MOST_SIGNALS)
        for kind in ("states", "inputs", "outputs")
    )
    shapes = {"A": (len(x), len(x)), "B": (len(x), len(u)), "C": (len(y), len(x)), "D": (len(y), len(u))}
    A, B, C, D = (matrix_of(given[key], f"{place}.{key}", *shape) for key, shape in shapes.items())
    step = optional(given["sample_time_s"], lambda text: _positive(text, f"{place}.sample_time_s"))
    lines = tuple(
        _line(one, f"{place}.lines.{i}", step)
        for i, one in enumerate(entries_of(given["lines"], f"{place}.lines", MOST_SIGNALS))
    )
    model = Model(text_of(given["name"], f"{place}.name"), System(A, B, C, D, x, u, y), lines, step)
    for kind, ends in (("inputs", [e.sink for e in lines]), ("outputs", [e.source for e in lines])):
        model.system.index(kind, ends)
        _distinct(ends, f"{place}.lines")
    return model


def _line(value: Any, place: str, step: fmpq | None) -> Line:
    given = keyed(value, place, ("source", "sink", "dead_time_s"))
    time = _positive(given["dead_time_s"], f"{place}.dead_time_s")
    if step is not None and (time / step).q != 1:
        raise TableError(
            f"{place}.dead_time_s must be whole sample times of {float(step):g} s; got {float(time):g} s. Mend it."
        )
    return Line(text_of(given["source"], f"{place}.source"), text_of(given["sink"], f"{place}.sink"), time)


def _block(value: Any, place: str) -> Block:
    given = keyed(value, place, ("kind", "inputs", "outputs", "options", "parameters"))
    parameters = {
        text_of(slot, f"{place}.parameters"): decimal(
            keyed(one, f"{place}.parameters.{slot[:40]}", ("name", "value"))["value"],
            f"{place}.parameters.{slot[:40]}.value",
        )
        for slot, one in mapping(given["parameters"], f"{place}.parameters").items()
    }
    if len(parameters) > MOST_PARAMETERS:
        raise TableError(f"{place} must have at most {MOST_PARAMETERS} parameters; it has more. Get the table again.")
    return Block(
        text_of(given["kind"], f"{place}.kind"), _names(given["inputs"], f"{place}.inputs", distinct=False),
        _names(given["outputs"], f"{place}.outputs"), mapping(given["options"], f"{place}.options"), parameters,
    )  # fmt: skip


def _shared(blocks: list[Any]) -> None:
    """A parameter that several blocks share has one value."""
    values: dict[str, fmpq] = {}
    for i, block in enumerate(blocks):
        own: set[str] = set()
        for slot, one in block["parameters"].items():
            place = f"structure.blocks.{i}.parameters.{slot[:40]}"
            name = text_of(one["name"], f"{place}.name")
            value = decimal(one["value"], place)
            if name in own or values.setdefault(name, value) != value:
                raise TableError(f"{place} must have the one value of {name[:40]!r}; it has another. Mend it there.")
            own.add(name)


def _promise(value: Any, place: str) -> Promise:
    given = keyed(value, place, ("kind", "sense", "limit", "subject"))
    if given["sense"] not in ("<=", ">="):
        raise TableError(f"{place}.sense must be '<=' or '>='; got {str(given['sense'])[:20]!r}. Mend it there.")
    subject = keyed(given["subject"], f"{place}.subject", (), SUBJECT)
    names = {key: _names(subject.get(key, []), f"{place}.subject.{key}", distinct=False) for key in NAMED}
    band = optional(subject.get("band"), lambda ends: _band(ends, f"{place}.subject.band"))
    return Promise(
        text_of(given["kind"], f"{place}.kind"), given["sense"], as_printed(given["limit"], f"{place}.limit"),
        Subject(**names, band=band, scaled=_scaled(subject.get("scaled", {}), f"{place}.subject.scaled")),
    )  # fmt: skip


def _scaled(value: Any, place: str) -> Scaled:
    factors = mapping(value, place)
    if len(factors) > MOST_SIGNALS:
        raise TableError(f"{place} must name at most {MOST_SIGNALS} signals; it names more. Get the table again.")
    return tuple((text_of(name, place), as_printed(factor, f"{place}.{name[:40]}")) for name, factor in factors.items())


def _band(value: Any, place: str) -> tuple[fmpq, fmpq | None]:
    ends = entries_of(value, place, 2, 2)
    low, high = as_printed(ends[0], place), optional(ends[1], lambda end: as_printed(end, place))
    if low < 0 or (high is not None and high <= low):
        raise TableError(f"{place} must rise from zero or more; got {ends!r}. Mend it there.")
    return low, high


def _positive(text: Any, place: str) -> fmpq:
    value = decimal(text, place)
    if value <= 0:
        raise TableError(f"{place} must be positive [s]; got {text!r}. Mend it there.")
    return value


def _names(value: Any, place: str, most: int = MOST_SIGNALS, *, distinct: bool = True) -> tuple[str, ...]:
    found = tuple(text_of(name, f"{place}.{i}") for i, name in enumerate(entries_of(value, place, most)))
    if distinct:
        _distinct(found, place)
    return found


def _distinct(names, place: str) -> None:
    names = list(names)
    if len(set(names)) < len(names) or not all(names):
        raise TableError(f"{place} must have distinct names; they repeat or are empty. Get the table again.")

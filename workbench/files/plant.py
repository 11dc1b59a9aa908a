"""The plants that a data file can state: matrices, transfer functions, poles and zeros, lags, files of matrices.

[[model]] kind, inputs, outputs, … --schema--> record --.model(folder)--> lti.model.Model, dead times as lines
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from workbench.errors import InputError
from workbench.files.block import Finite, NotNegative, Positive
from workbench.files.matrix import read_matrices, read_response
from workbench.files.table import MOST, Above, FromZero, Name, Names, Number, Table, Text
from workbench.lti.connect import connect
from workbench.lti.make import second_order, tf, zpk
from workbench.lti.measured import frd
from workbench.lti.model import DelayLine, Model
from workbench.lti.plant import Plant

MOST_ROOTS = 40  # of each kind in an entry
MOST_ENTRIES = 10_000
HIGHEST = 12  # degree of a polynomial; a higher one loses its roots in the rounding of its coefficients
Row = Annotated[tuple[Number, ...], Field(max_length=2 * MOST)]
Matrix = Annotated[tuple[Row, ...], Field(max_length=2 * MOST)]
Polynomial = Annotated[tuple[Number, ...], Field(min_length=1, max_length=HIGHEST + 1)]
Root = Finite | tuple[Finite, NotNegative]  # real, or real and imaginary part of a conjugate pair
Roots = Annotated[tuple[Root, ...], Field(max_length=MOST_ROOTS)]
Count = Annotated[int, Field(strict=True, ge=0, le=MOST_ROOTS)]
FileName = Annotated[str, Field(min_length=1, max_length=200)]
DeadTimes = dict[Name, FromZero]


class PlantTable(Table):
    """What every model states: its name, its signals, dead times at them, its sample time."""

    name: Name = "model"
    inputs: Annotated[Names, Field(min_length=1)]
    outputs: Annotated[Names, Field(min_length=1)]
    input_dead_time_s: DeadTimes = Field(default={}, max_length=MOST)
    output_dead_time_s: DeadTimes = Field(default={}, max_length=MOST)
    sample_time_s: Above | None = None
    pade_order: Annotated[int, Field(strict=True, ge=1, le=12)] = 4
    source: Text | None = None

    def model(self, folder: Path) -> Model:
        """The model; files lie in the folder."""
        raise NotImplementedError

    def files(self) -> tuple[str, ...]:
        """Names of the files beside data.toml that it reads."""
        return ()

    def _with_ends(self, plant: Plant, lines: Sequence[DelayLine] = ()) -> Model:
        return Model(
            self.name, plant, input_delay=self.input_dead_time_s, output_delay=self.output_dead_time_s,
            sample_time=self.sample_time_s, lines=tuple(lines), pade_order=self.pade_order,
        )  # fmt: skip

    def _with_matrices(self, A, B, C, D, states: Sequence[str] = (), lines: Sequence[DelayLine] = ()) -> Model:
        states = tuple(states) or tuple(f"x{k + 1}" for k in range(len(A)))
        inputs = (*self.inputs, *(line.sink for line in lines))
        outputs = (*self.outputs, *(line.source for line in lines))
        plant = Plant(A=A, B=B, C=C, D=D, states=states, inputs=inputs, outputs=outputs)
        return self._with_ends(plant, lines)


class LineTable(Table):
    """A dead time inside: its output is a further row of C and D, its input a further column of B and D."""

    output: Name
    input: Name
    dead_time_s: Above


class MatricesTable(PlantTable):
    """dx/dt = A x + B u, y = C x + D u (sampled: x[k+1] = A x[k] + B u[k])."""

    kind: Literal["matrices"]
    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix = ()
    states: Names = ()
    line: Annotated[tuple[LineTable, ...], Field(max_length=MOST)] = ()

    def model(self, folder: Path) -> Model:
        n, m, p = len(self.A), len(self.inputs) + len(self.line), len(self.outputs) + len(self.line)
        D = self.D or ((0.0,) * m,) * p
        found = {}
        for key, given, shape in (
            ("A", self.A, (n, n)),
            ("B", self.B, (n, m)),
            ("C", self.C, (p, n)),
            ("D", D, (p, m)),
        ):
            widths = {len(row) for row in given}
            if len(given) != shape[0] or widths - {shape[1]}:
                raise InputError(
                    f"matrix {key} of model {self.name!r} must have {shape[0]} rows of {shape[1]} numbers for {n} "
                    f"states, {m} inputs and {p} outputs; got {len(given)} rows of {sorted(widths)}."
                )
            found[key] = np.array(given, float).reshape(shape)
        lines = [DelayLine(line.output, line.input, line.dead_time_s) for line in self.line]
        return self._with_matrices(**found, states=self.states, lines=lines)


class Entry(Table):
    """One entry of a matrix of transfer functions; its signals may be left out where there is one of each."""

    input: Name | None = None
    output: Name | None = None
    dead_time_s: FromZero = 0.0


class TransferEntry(Entry):
    """Coefficients in falling powers of s [1/s], of z if sampled."""

    numerator: Polynomial
    denominator: Polynomial

    def fraction(self) -> tuple[list[float], list[float]]:
        """Numerator and denominator."""
        return list(self.numerator), list(self.denominator)


class LagEntry(Entry):
    """gain/(time constant s + 1)."""

    gain: Number
    time_constant_s: FromZero

    def fraction(self) -> tuple[list[float], list[float]]:
        """Numerator and denominator."""
        return [self.gain], [self.time_constant_s, 1.0]


class PairTable(Table):
    """s² + 2 damping ω s + ω² with ω the natural frequency."""

    natural_frequency_rad_s: Positive
    damping: Finite

    def roots(self) -> tuple[complex, complex]:
        """Both."""
        return second_order(self.natural_frequency_rad_s, self.damping)


Pairs = Annotated[tuple[PairTable, ...], Field(max_length=MOST_ROOTS)]


class RootsEntry(Entry):
    """Poles and zeros, integrators and terms of second order.

    gain times the product of (s − zero) over that of (s − pole); or static_gain, where each of these but integrators
    and differentiators is divided by what it is at s = 0. Sampled: of z, and z = 1 is rest.
    """

    gain: Number | None = None
    static_gain: Number | None = None
    zeros_rad_s: Roots = ()
    poles_rad_s: Roots = ()
    zeros_z: Roots = ()
    poles_z: Roots = ()
    integrators: Count = 0
    differentiators: Count = 0
    zero_pairs: Pairs = ()
    pole_pairs: Pairs = ()

    @model_validator(mode="after")
    def one_gain(self) -> "RootsEntry":
        """One gain."""
        if (self.gain is None) == (self.static_gain is None):
            raise ValueError("an entry of poles and zeros must have a gain or a static_gain, one of them")
        return self

    def roots(self, sampled: bool) -> tuple[list[complex], list[complex], float]:
        """Zeros, poles, and the gain of the highest powers."""
        foreign = "rad_s" if sampled else "z"
        strange = [f"zeros_{foreign}", f"poles_{foreign}", *(("zero_pairs", "pole_pairs") if sampled else ())]
        if given := next((key for key in strange if getattr(self, key)), ""):
            time, end = ("sampled", "z") if sampled else ("continuous", "rad_s")
            raise InputError(f"a {time} model must have zeros_{end} and poles_{end}; got {given}. Convert them.")
        zeros = _each(self.zeros_z if sampled else self.zeros_rad_s, self.zero_pairs)
        poles = _each(self.poles_z if sampled else self.poles_rad_s, self.pole_pairs)
        rest, gain = float(sampled), self.gain
        if gain is None:
            below, above = (float(np.prod([rest - root for root in roots]).real) for roots in (zeros, poles))
            if 0 in (below, above):
                raise InputError("a static_gain must meet no pole or zero at rest; got one. Say integrators instead.")
            gain = (self.static_gain or 0.0) * above / below
        return [*zeros, *[rest] * self.differentiators], [*poles, *[rest] * self.integrators], gain


def _each(roots: Sequence[float | tuple[float, float]], pairs: Sequence[PairTable]) -> list[complex]:
    """Every root: real ones, conjugate pairs, terms of second order."""
    found: list[complex] = []
    for root in roots:
        found += [complex(*root), complex(root[0], -root[1])] if isinstance(root, tuple) else [complex(root)]
    return found + [root for pair in pairs for root in pair.roots()]


class EntriesTable(PlantTable):
    """A matrix of transfer functions; an entry that is not listed is zero."""

    entry: Annotated[tuple[Entry, ...], Field(min_length=1, max_length=MOST)]

    def placed(self) -> dict[tuple[int, int], Entry]:
        """Entries by row and column."""
        found: dict[tuple[int, int], Entry] = {}
        for entry in self.entry:
            place = self._place("output", entry.output), self._place("input", entry.input)
            if place in found:
                raise InputError(
                    f"each entry of model {self.name!r} must be given once; {self.outputs[place[0]]!r} from "
                    f"{self.inputs[place[1]]!r} is given twice."
                )
            found[place] = entry
        return found

    def _place(self, kind: str, name: str | None) -> int:
        names = self.inputs if kind == "input" else self.outputs
        if name is None and len(names) == 1:
            return 0
        if name not in names:
            raise InputError(
                f"each entry of a model must name its {kind}, one of {', '.join(names)[:200]}; got {name!r}."
            )
        return names.index(name)

    def _ended(self, made: Model) -> Model:
        """The model with the dead times at its signals."""
        return self._with_ends(made.plant, made.lines) if self.input_dead_time_s or self.output_dead_time_s else made


class FractionsTable(EntriesTable):
    """Entries with numerator and denominator."""

    entry: Annotated[tuple[TransferEntry | LagEntry, ...], Field(min_length=1, max_length=MOST)]
    minimal: Annotated[bool, Field(strict=True)] = False  # whether roots that cancel are taken out

    def model(self, folder: Path) -> Model:
        """The model, dead times common to a column or row at its signal."""
        p, m = len(self.outputs), len(self.inputs)
        if p * m > MOST_ENTRIES:
            raise InputError(f"a model must have at most {MOST_ENTRIES} entries; got {p} × {m}. State it as matrices.")
        num: list[list[list[float]]] = [[[0.0] for _ in range(m)] for _ in range(p)]
        den: list[list[list[float]]] = [[[1.0] for _ in range(m)] for _ in range(p)]
        dead = np.zeros((p, m))
        for (i, j), entry in self.placed().items():
            num[i][j], den[i][j] = entry.fraction()
            dead[i, j] = entry.dead_time_s
        return self._ended(tf(
            num, den, input=self.inputs, output=self.outputs, dead_time=dead, sample_time=self.sample_time_s,
            name=self.name, minimal=self.minimal, pade_order=self.pade_order,
        ))  # fmt: skip


class TransferTable(FractionsTable):
    """numerator/denominator of each entry."""

    kind: Literal["transfer_function"]
    entry: Annotated[tuple[TransferEntry, ...], Field(min_length=1, max_length=MOST)]


class LagTable(FractionsTable):
    """A lag of first order in each entry, in continuous time."""

    kind: Literal["first_order"]
    sample_time_s: None = None
    entry: Annotated[tuple[LagEntry, ...], Field(min_length=1, max_length=MOST)]


class RootsTable(EntriesTable):
    """Poles and zeros of each entry."""

    kind: Literal["zero_pole_gain"]
    entry: Annotated[tuple[RootsEntry, ...], Field(min_length=1, max_length=MOST)]

    def model(self, folder: Path) -> Model:
        """The model: each entry by itself, those of an output added up."""
        placed = self.placed()
        parts, sums = [], {}
        for (i, j), entry in placed.items():
            zeros, poles, gain = entry.roots(self.sample_time_s is not None)
            own = f"{self.outputs[i]} by {self.inputs[j]}"
            sums[self.outputs[i]] = f"{sums[self.outputs[i]]} + {own}" if self.outputs[i] in sums else own
            parts.append(zpk(
                zeros, poles, gain, input=self.inputs[j], output=own, dead_time=entry.dead_time_s,
                sample_time=self.sample_time_s, name=own,
            ))  # fmt: skip
        for kind, names, axis in (("output", self.outputs, 0), ("input", self.inputs, 1)):
            for index, name in enumerate(names):
                if index not in {place[axis] for place in placed}:
                    raise InputError(f"each {kind} of a model must have an entry; {name!r} has none. Add one.")
        joined = connect(parts, inputs=self.inputs, outputs={y: sums[y] for y in self.outputs}, name=self.name)
        return self._ended(replace(joined, pade_order=self.pade_order))


class FileTable(PlantTable):
    """A .mat file with A, B, C, D, or a CSV file with the rows of [[A, B], [C, D]]."""

    kind: Literal["file"]
    file: FileName
    states: Names = ()

    def files(self) -> tuple[str, ...]:
        """The one with the matrices."""
        return (self.file,)

    def model(self, folder: Path) -> Model:
        """The model of the file's matrices."""
        matrices = read_matrices(folder, self.file, len(self.inputs), len(self.outputs))
        return self._with_matrices(*matrices, states=self.states)


class MeasuredEntry(Entry):
    """A measured response: a .csv file with frequency_hz and real, imaginary; or magnitude(_db), phase_deg."""

    file: FileName
    dead_time_s: None = None


class MeasuredTable(EntriesTable):
    """A model fitted to measured frequency responses, all at the same frequencies; an entry not listed is zero.

    order : poles beside the integrators; the least that comes within the tolerance if left out
    tolerance : largest relative error at a measured point;  integrators, dead_time_s : of every entry, known beforehand
    stable : whether the model must be
    """

    kind: Literal["frequency_response"]
    entry: Annotated[tuple[MeasuredEntry, ...], Field(min_length=1, max_length=20)]
    order: Annotated[int, Field(strict=True, ge=1, le=24)] | None = None
    tolerance: Positive = 1e-3
    integrators: Annotated[int, Field(strict=True, ge=0, le=4)] = 0
    dead_time_s: FromZero = 0.0
    stable: Annotated[bool, Field(strict=True)] = False

    def files(self) -> tuple[str, ...]:
        """One for each entry."""
        return tuple(entry.file for entry in self.entry)

    def model(self, folder: Path) -> Model:
        """The fitted model, its error below the tolerance."""
        read = {place: read_response(folder, entry.file) for place, entry in self.placed().items()}
        frequency = next(iter(read.values()))[0]
        values = np.zeros((len(frequency), len(self.outputs), len(self.inputs)), complex)
        for (i, j), (own, response) in read.items():
            if not np.array_equal(own, frequency):
                raise InputError("entries of a model must be measured at the same frequencies; got others. Cut them.")
            values[:, i, j] = response
        measured = frd(
            frequency, values, input=self.inputs, output=self.outputs, sample_time=self.sample_time_s, name=self.name
        )
        fit = measured.fitted(
            self.order, tolerance=self.tolerance, integrators=self.integrators, dead_time=self.dead_time_s,
            stable=self.stable,
        )  # fmt: skip
        return self._ended(replace(fit.model, pade_order=self.pade_order))


PlantBlock = Annotated[
    MatricesTable | TransferTable | RootsTable | LagTable | FileTable | MeasuredTable, Field(discriminator="kind")
]

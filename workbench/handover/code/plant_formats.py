"""A table of any plant (format version 2) in the formats others read: JSON as it is, CSV, MATLAB, C.

    csv   a row of names, a row of units, the values as in the table
    mat   parameters        values by name (a name that MATLAB cannot bear is written with underscores)
          discrete          A, B, C, D, Ts, inputs, outputs of the sampled controller, for 'Discrete State-Space'
          continuous        A, B, C, D, inputs, outputs before sampling, where the table is of a continuous one
          model_1 …         name, A, B, C, D, states, inputs, outputs, Ts (0: continuous), sources, sinks, dead_times
          check, provenance as of a vehicle's table
    c     `c_structure`

What goes into a controller is checked first in the sampled loop with the table's models (`plant_check`). Where no
sample time is known the longest of 1, 2, 5 · 10^k s is taken at which the sampled loop keeps what the table promises.
"""

import csv
import math
import re
from dataclasses import replace
from io import BytesIO, StringIO
from typing import Any

import numpy as np

from workbench.control.structure.registry import make_block
from workbench.errors import InfeasibleError, InputError
from workbench.goals.promise import Promise, Subject
from workbench.handover.code.c_header import PREFIX
from workbench.handover.code.c_structure import structure_header
from workbench.handover.code.digital import DigitalCheck
from workbench.handover.code.matlab import cells, check_variables
from workbench.handover.code.plant_check import plant_check
from workbench.handover.code.program import program, signals_of
from workbench.handover.table.plant import PlantTable, PromisePart

STEPS = (5.0, 2.0, 1.0)
TRIED = 12  # sample times, four to a decade at most
SLOWEST = 6  # poles of a loop with dead time that count as its own; the others are the dead time's
MOST_SAMPLES = 200  # of a dead time in the search for a sample time
BESIDE_FASTEST = 0.3  # of the fastest pole's time: where the search for a sample time begins


def promise_of(part: PromisePart) -> Promise:
    """A table's promise as the goals make it."""
    own = part.subject.model_dump(exclude_defaults=True)
    low, high = own.pop("band", (0.0, None)) or (0.0, None)
    return Promise(part.kind, part.sense, part.limit, Subject(**own, band=(low or 0.0, high or math.inf)))


def checked(table: PlantTable, sample_time: float | None, computing_delay: float) -> DigitalCheck:
    """The check at the table's, the given or a chosen sample time; see `plant_check`."""
    models, structure, promises = table.to_models(), table.to_structure(), [*map(promise_of, table.promises)]
    if sample_time is None and table.sample_time is None and structure.sample_time is None:
        return _chosen(models, structure, promises, computing_delay)
    return plant_check(models, structure, promises, sample_time=sample_time, computing_delay=computing_delay)


def _chosen(models, structure, promises, computing_delay: float) -> DigitalCheck:
    """The check at the longest sample time of 1, 2, 5 · 10^k s that keeps every promise."""
    from workbench.control.structure.loop import Loop

    K = structure.controller()
    poles = [p for model in models for p in Loop(model, structure).poles(K)]
    slow = sorted((p for p in poles if np.isfinite(p)), key=lambda p: -p.real)[:SLOWEST]
    lags = [*K.poles(), *(p for model in models for p in model.plant.poles())]
    fastest = float(np.abs([*lags, *(slow if any(m.delayed for m in models) else poles)]).max(initial=0.0)) or 1.0
    longest = max((x.dead_time for model in models for x in model.lines), default=0.0)
    exponent = math.floor(math.log10(BESIDE_FASTEST / fastest))
    steps = [
        m * 10.0**k
        for k in range(exponent, exponent - TRIED, -1)
        for m in STEPS
        if longest / MOST_SAMPLES <= m * 10.0**k <= 1 / fastest
    ] or [longest / MOST_SAMPLES]
    refused: InputError | InfeasibleError | None = None
    for T in (float(f"{step:.0e}") for step in steps[:TRIED]):
        try:
            check = plant_check(models, structure, promises, sample_time=T, computing_delay=computing_delay)
        except InfeasibleError as error:
            refused = error
            continue
        if not check.broken:
            return replace(check, chosen=True)
        refused = InfeasibleError(f"at {1e3 * T:g} ms: {'; '.join(map(str, check.broken))}")
    raise InfeasibleError(
        f"no sample time down to {1e3 * steps[:TRIED][-1]:g} ms keeps what the table promises with "
        f"{1e3 * computing_delay:g} ms of computing ({refused}). Give one (--sample-time-ms) and accept what it breaks "
        "(--accept), or design with a reserve."
    )


def plant_csv(table: PlantTable) -> str:
    """Names, units and values in three rows, as the table prints them."""
    stream = StringIO()
    writer, units = csv.writer(stream, lineterminator="\n"), _units(table)
    decimals = _decimals(table)
    writer.writerow(decimals)
    writer.writerow(units.get(name) or "1" for name in decimals)
    writer.writerow(decimals.values())
    return stream.getvalue()


def plant_header(
    table: PlantTable, check: DigitalCheck | None, sample_time: float | None = None, prefix: str = PREFIX
) -> str:
    """The C header; see `c_structure`."""
    return structure_header(
        _program(table, check, sample_time), problem=table.problem, title=table.title, created=table.created,
        version=table.versions.workbench, digest=table.digest, data_sha256=table.data_sha256 or "none",
        parameters=_decimals(table), check=check, prefix=prefix,
    )  # fmt: skip


def plant_mat(table: PlantTable, check: DigitalCheck | None, sample_time: float | None = None) -> bytes:
    """The MATLAB 5 file."""
    from scipy.io import savemat

    run, structure, models = _program(table, check, sample_time), table.to_structure(), table.to_models()
    names = {"inputs": cells(run.inputs), "outputs": cells(run.outputs)}
    variables: dict[str, Any] = {
        "parameters": {_word(name): value for name, value in table.values().items()},
        "discrete": {"A": run.A, "B": run.B, "C": run.C, "D": run.D, "Ts": run.sample_time, **names},
        "provenance": {
            "problem": table.problem, "title": table.title, "created": table.created, "digest": table.digest,
            "data_sha256": table.data_sha256, "versions": table.versions.model_dump(),
        },
    }  # fmt: skip
    if structure.sample_time is None:
        _, _, K = signals_of(structure, models)
        variables["continuous"] = {name: getattr(K, name) for name in "ABCD"} | names
    for number, (part, model) in enumerate(zip(table.models, models, strict=True), 1):
        plant = model.plant
        variables[f"model_{number}"] = {
            "name": part.name, **{name: getattr(plant, name) for name in "ABCD"}, "Ts": model.sample_time or 0.0,
            **{kind: cells(getattr(plant, kind)) for kind in ("states", "inputs", "outputs")},
            "sources": cells(x.source for x in model.lines), "sinks": cells(x.sink for x in model.lines),
            "dead_times": np.array([x.dead_time for x in model.lines]),
        }  # fmt: skip
    if check is not None:
        variables["check"] = check_variables(check)
    stream = BytesIO()
    savemat(stream, variables, long_field_names=True, oned_as="column")
    return stream.getvalue()


def _program(table: PlantTable, check: DigitalCheck | None, sample_time: float | None):
    T = sample_time if check is None else check.worst()["sample_time"]
    structure = table.to_structure()
    return program(structure, table.to_models(), T if structure.sample_time is None else None)


def _decimals(table: PlantTable) -> dict[str, str]:
    return {p.name: p.value for block in table.structure.blocks for p in block.parameters.values()}


def _units(table: PlantTable) -> dict[str, str]:
    """Of each parameter, as its block's kind has it."""
    found = {}
    for part in table.structure.blocks:
        values = {slot: float(p.value) for slot, p in part.parameters.items()}
        block = make_block(part.kind, part.inputs, part.outputs, part.options, values)
        for slot, parameter in zip(block.slots, block.parameters, strict=True):
            if slot in part.parameters:
                found[part.parameters[slot].name] = parameter.unit
    return found


def _word(name: str) -> str:
    """A field name that MATLAB bears."""
    word = re.sub(r"[^A-Za-z0-9_]", "_", name)[:60]
    return word if word[:1].isalpha() else f"p_{word}"

"""A gain table as a MATLAB file: gains, discrete filters and law matrices under names ready for Simulink.

    gains        K_h … K_yaw, as numbers
    filters      names, numerator, denominator (rows for 'Discrete Filter'), direct, memory, advance
    discrete     A, B, C, D, Ts of the whole sampled law, for 'Discrete State-Space'
    continuous   A, B, C, D of the law before sampling, for 'State-Space'
    law          measurement, resolution, positions, depth, sensors, commands
    plant        A, B, C, D, states, inputs, outputs, where the table holds it
    schedule     names, coefficients (powers rising), centre, scale, range; at: the speed of everything else
    check        figures of the sampled loop with that plant, and of single precision (`export.digital`)
    provenance   problem, title, created, digest, data_sha256, versions

Each is a struct. Commands are law.resolution times the five filtered channels; those are filters times law.measurement
times the sensors, gaps and accelerations added.
"""

from io import BytesIO
from typing import Any

import numpy as np

from workbench.handover.code.digital import DigitalCheck
from workbench.handover.table.table import GainTable


def mat_bytes(table: GainTable, check: DigitalCheck | None = None) -> bytes:
    """The MATLAB 5 file, with the check of the sampled loop if there is one. Raises InputError where the law cannot run
    at the table's sample time."""
    from scipy.io import savemat

    stream = BytesIO()
    savemat(stream, mat_variables(table, check), long_field_names=True, oned_as="column")
    return stream.getvalue()


def mat_variables(table: GainTable, check: DigitalCheck | None = None) -> dict[str, dict[str, Any]]:
    """Variable name to struct, as the module's map lists them."""
    law, gains, sampled = table.to_law(), table.to_gains(), table.to_discrete()
    numerator, denominator = sampled.transfer_functions()
    discrete = dict(zip("ABCD", sampled.state_space(), strict=True)) | {"Ts": sampled.sample_time}
    variables: dict[str, dict[str, Any]] = {
        "gains": dict(gains.as_dict()),
        "filters": {
            "names": cells(sampled.channels), "numerator": numerator, "denominator": denominator,
            "advance": sampled.advance, "direct": sampled.direct, "memory": sampled.memory,
        },
        "discrete": discrete,
        "continuous": dict(zip("ABCD", law.numeric(gains), strict=True)),
        "law": {
            "measurement": sampled.measurement, "resolution": sampled.resolution,
            "positions": np.array(law.positions), "depth": law.depth,
            "sensors": cells(law.sensors), "commands": cells(law.commands),
        },
        "provenance": {
            "problem": table.problem, "title": table.title, "created": table.created, "digest": table.digest,
            "data_sha256": table.data_sha256, "versions": table.versions.model_dump(),
        },
    }  # fmt: skip
    plant = table.to_plant()
    if plant is not None:
        names = {kind: cells(getattr(plant, kind)) for kind in ("states", "inputs", "outputs")}
        variables["plant"] = {k: getattr(plant, k) for k in "ABCD"} | names
    schedule = table.to_schedule()
    if schedule is not None:
        variables["schedule"] = {
            "names": cells(schedule.coefficients), "coefficients": np.array([*schedule.coefficients.values()]),
            "centre": schedule.centre, "scale": schedule.scale, "range": np.array(schedule.range),
            "at": np.nan if (at := schedule.speed_of(gains)) is None else at,
        }  # fmt: skip
    if check is not None:
        variables["check"] = check_variables(check)
    return variables


def check_variables(check: DigitalCheck) -> dict[str, Any]:
    """The struct of a check of the sampled loop."""
    promises = {
        "name": cells(p.name for p in check.promises), "sense": cells(p.sense for p in check.promises),
        "limit": np.array([p.limit for p in check.promises]), "value": np.array([p.value for p in check.promises]),
    }  # fmt: skip
    return {**check.worst(), "poles": check.poles(), "groups": cells(check.groups), "promises": promises}


def cells(names) -> np.ndarray:
    """A column of a MATLAB cell array of text."""
    texts = [str(name) for name in names]
    cells = np.empty((len(texts), 1), dtype=object)
    cells[:, 0] = texts
    return cells

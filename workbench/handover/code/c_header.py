"""The control law as one C99 header: no dynamic memory, no library, single or double precision.

    GainTable --discretise, check--> coefficients --> wb_law.h:  wb_init(&state);  wb_step(&state, sensors, commands)
    with a schedule: the polynomials of the gains instead (`export.c_law`), and  wb_set_speed(&state, speed)

One step takes the sensors at t = kT and gives the commands at once. Numbers are printed so that the compiler reads the
same doubles; -DWB_FLOAT turns every literal and variable into single precision.
"""

import re

from workbench.control import GAIN_UNITS
from workbench.control.law import CHANNELS, VERTICAL_CHANNELS
from workbench.errors import InputError
from workbench.handover.code.c_law import c_template, fixed_parts, matrix, real, scheduled_parts
from workbench.handover.code.digital import DigitalCheck
from workbench.handover.table.table import GainTable
from workbench.result import figure

WORD = re.compile(r"[A-Za-z][A-Za-z0-9]{0,30}")
PREFIX = "wb"  # of every name in a header
SENSOR_UNITS = {"gap": "m", "gap_lateral": "m", "acceleration_z": "m/s^2", "acceleration_y": "m/s^2"}


def c_header(table: GainTable, check: DigitalCheck | None = None, prefix: str = PREFIX) -> str:
    """The header's text, with the check of the sampled loop if there is one. Raises InputError where the law cannot run
    at the table's sample time, of a schedule at any speed of its range."""
    law, discrete, schedule = table.to_law(), table.to_discrete(), table.to_schedule()
    parts = fixed_parts(discrete) if schedule is None else scheduled_parts(law, schedule, table.to_gains(), discrete)
    n = law.count
    gains = [f" *   {name:<9} = {text:<12} {_ascii_unit(GAIN_UNITS[name])}" for name, text in table.gains.items()]
    order = [f" *   {kind}_1 ... {kind}_{n} [{unit}]" for kind, unit in SENSOR_UNITS.items()]
    sets = [f" *   {i + 1}: x = {x:g} m forward, y = {y:g} m to the right" for i, (x, y) in enumerate(law.positions)]
    commands = [f" *   command_1 ... command_{n}: control current over main-coil current of each coil set [1]"]
    commands += [
        f" *   {', '.join(f'command_{comment(name)}' for name in a.both)}: for {a.signal}, over rated current [1]"
        for a in law.actuators
    ]
    text = c_template("modal_law.h").format(
        title=comment(table.title), problem=comment(table.problem), created=table.created, digest=table.digest,
        data=table.data_sha256, version=comment(table.versions.workbench), count=n, sensors=4 * n,
        gains="\n".join(gains), order="\n".join(order), sets="\n".join(sets),
        command_count=len(law.commands), commands="\n".join(commands),
        check=checked_lines(check, parts.place),
        sample=real(discrete.sample_time), step_error=f"{discrete.command_step_bound().max():.3g}",
        vertical=matrix(discrete.measurement[:VERTICAL_CHANNELS, :n]),
        lateral=matrix(discrete.measurement[VERTICAL_CHANNELS:5, n : 2 * n]),
        place=parts.place, use=parts.use, state=parts.state, law=parts.law, owner=parts.owner,
        vertical_count=VERTICAL_CHANNELS, lateral_count=5 - VERTICAL_CHANNELS, channels=", ".join(CHANNELS),
    )  # fmt: skip
    return with_prefix(text, prefix)


def check_prefix(prefix: str) -> str:
    """The prefix, if it can begin the names of C."""
    if not WORD.fullmatch(prefix):
        raise InputError(
            f"a prefix must be a letter and up to thirty letters and digits; got {prefix[:40]!r}. Write pitch, for "
            "instance."
        )
    return prefix


def with_prefix(text: str, prefix: str) -> str:
    """The text of a header with another word in place of "wb" in every name."""
    if check_prefix(prefix) == PREFIX:
        return text
    return re.sub(r"\bWB_", f"{prefix.upper()}_", re.sub(r"\bwb_", f"{prefix}_", text))


def checked_lines(check: DigitalCheck | None, place: str) -> str:
    """Comment lines on the sampled loop."""
    if check is None:
        return " * The table holds no plant for this law: the sampled loop was not checked."
    plant = "vehicle" if check.what == "motions" else check.what
    rows = [
        f" *   {comment(f'{name}: {figure(value)} {unit}'.replace('→', 'to'))}".rstrip()
        for name, value, unit in check.rows()
    ]
    return "\n".join(
        [f" * Sampled loop with the table's {plant}{place}, exact between the samples, and single precision:", *rows]
    )


def comment(text: str) -> str:
    """Text that cannot leave a comment or a string: ASCII without stars, quotes, backslashes, question marks."""
    return re.sub(r"[^ A-Za-z0-9.,:;()\[\]_+=<>/-]", "_", text)


def _ascii_unit(unit: str) -> str:
    return unit.replace("²", "^2")

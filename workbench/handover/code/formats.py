"""One gain table in the formats others read: JSON as it is, CSV, MATLAB, C; of a vehicle here, of any plant beside.

    csv   a header row of names, a header row of units, the values as in the table: pandas.read_csv(…, header=[0, 1]);
          of a schedule a first column of speeds and a row every `SPEED_STEP`
    mat   `matlab`;   c   `c_header`;   json   the table's own file;   of any plant: `plant_formats`

What goes into a controller (mat, c) is checked first in the sampled loop with the table's vehicle (`digital`) or models
(`plant_check`), and refused where that breaks what the table promises.
"""

import csv
import os
from io import StringIO
from pathlib import Path

from workbench.control import GAIN_NAMES, GAIN_UNITS
from workbench.errors import unknown_name
from workbench.handover.code.c_header import PREFIX, c_header, check_prefix
from workbench.handover.code.digital import DigitalCheck, digital_check, refuse_broken, with_sample_time
from workbench.handover.code.matlab import mat_bytes
from workbench.handover.code.plant_formats import checked, plant_csv, plant_header, plant_mat
from workbench.handover.table.plant import PlantTable
from workbench.handover.table.table import GainTable
from workbench.lti.hold import InsideError
from workbench.machine.writing import place_of, write_bytes


def csv_text(table: GainTable) -> str:
    """The seventeen parameters in one row under their names and their units; of a schedule, one row per speed.

    Examples
    --------
    >>> from workbench.files.problem import shipped_problems
    >>> from workbench.handover.table.table import read_table
    >>> table = read_table(shipped_problems()["heave"] / "approved.json")
    >>> print(csv_text(table).splitlines()[1])
    1/m,s/m,s,1/m,s/m,s,s²/m,s/m,s,s²/m,s/m,s,1,1,1,1,1
    """
    stream = StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    schedule = table.to_schedule()
    leading = [] if schedule is None else [("speed", "m/s")]
    writer.writerow([*(name for name, _ in leading), *GAIN_NAMES])
    writer.writerow([*(unit for _, unit in leading), *(GAIN_UNITS[name] for name in GAIN_NAMES)])
    if schedule is None:
        writer.writerow(table.gains[name] for name in GAIN_NAMES)
    else:
        writer.writerows([v, *schedule.gains_at(v).as_dict().values()] for v in schedule.grid(SPEED_STEP))
    return stream.getvalue()


ENDINGS = {"csv": ".csv", "json": ".json", "mat": ".mat", "c": ".h"}
FORMATS = tuple(ENDINGS)
DIGITAL = ("mat", "c")  # what a controller runs, and so is checked as one runs it
SPEED_STEP = 1.0  # [m/s] between the rows of a schedule's CSV


def suffix(format: str) -> str:
    """The ending of a file in a format.

    Examples
    --------
    >>> suffix("c"), suffix("mat")
    ('.h', '.mat')
    >>> suffix("excel")
    Traceback (most recent call last):
        ...
    workbench.errors.InputError: unknown format 'excel'; Known: c, csv, json, mat.
    """
    if format not in ENDINGS:
        raise unknown_name("format", str(format), ENDINGS)
    return ENDINGS[format]


def check_of(
    table: GainTable | PlantTable, *, sample_time: float | None = None, computing_delay: float = 0.0,
    accept: bool = False,
) -> DigitalCheck | None:  # fmt: skip
    """The sampled loop of a table's controller as it is to run; None where there is nothing to check it with.

    Parameters as of `render`.

    Raises
    ------
    InfeasibleError
        If a sampled loop is unstable.
    InputError
        If the controller cannot run at the sample time, or the loop cannot be checked and `accept` is not set.
    """
    if isinstance(table, GainTable):
        return digital_check(_timed(table, sample_time), computing_delay)
    try:
        return checked(table, sample_time, computing_delay)
    except InsideError:
        if not accept:
            raise
        return None


def render(
    table: GainTable | PlantTable, format: str, *, sample_time: float | None = None, computing_delay: float = 0.0,
    accept: bool = False, prefix: str = PREFIX, check: DigitalCheck | None = None,
) -> bytes:  # fmt: skip
    """A table in the named format: "csv", "json", "mat" or "c".

    sample_time : of the controller [s], "mat" and "c"; the table's if left out, and chosen where it has none
    computing_delay : from sampling the sensors to the new commands [s], in the check of "mat" and "c"
    accept : take a controller whose sampled loop breaks promises of the table, or cannot be checked
    prefix : in place of "wb" in every name of the C header
    check : `check_of` this table so, where it is at hand already

    Raises
    ------
    InputError
        If the format is not one of them, or the law cannot run at the sample time ("mat" and "c").
    InfeasibleError
        If the sampled loop is unstable or breaks what the table promises ("mat" and "c").
    """
    suffix(format)
    check_prefix(prefix)
    if format in DIGITAL:
        if check is None:
            check = check_of(table, sample_time=sample_time, computing_delay=computing_delay, accept=accept)
        if check is not None:
            refuse_broken(check, accept=accept)
    if format == "json":
        return table.text().encode("utf-8")
    of = _vehicle if isinstance(table, GainTable) else _plant
    content = of(table, format, sample_time, prefix, check)
    return content if isinstance(content, bytes) else content.encode("utf-8")


def exported(
    table: GainTable | PlantTable, format: str, path: Path | str, *, sample_time: float | None = None,
    computing_delay: float = 0.0, accept: bool = False, prefix: str = PREFIX,
) -> Path:  # fmt: skip
    """Writes a table in the named format, as `render` makes it; returns the path.

    path : the file; or a folder, told by `place_of`, for one called gains
    """
    content = render(
        table, format, sample_time=sample_time, computing_delay=computing_delay, accept=accept, prefix=prefix
    )
    place = place_of(os.fspath(path), "gains", suffix(format))
    write_bytes(place, content)
    return place


def _timed(table: GainTable, sample_time: float | None) -> GainTable:
    return table if sample_time is None else with_sample_time(table, sample_time)


def _vehicle(table: GainTable, format: str, sample_time: float | None, prefix: str, check) -> str | bytes:
    if format == "csv":
        return csv_text(table)
    timed = _timed(table, sample_time)
    return mat_bytes(timed, check) if format == "mat" else c_header(timed, check, prefix)


def _plant(table: PlantTable, format: str, sample_time: float | None, prefix: str, check) -> str | bytes:
    if format == "csv":
        return plant_csv(table)
    if format == "mat":
        return plant_mat(table, check, sample_time)
    return plant_header(table, check, sample_time, prefix)

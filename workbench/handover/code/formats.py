"""One gain table in the formats others read: JSON as it is, CSV, MATLAB, C.

    csv   a header row of names, a header row of units, the values as in the table: pandas.read_csv(…, header=[0, 1]);
          of a schedule a first column of speeds and a row every `SPEED_STEP`
    mat   `export.matlab`;   c   `export.c_header`;   json   the table's own file

What goes into a controller (mat, c) is checked first in the sampled loop with the table's vehicle (`export.digital`),
and refused where that breaks what the table promises.
"""

import csv
from collections.abc import Callable
from io import StringIO
from pathlib import Path

from workbench.control import GAIN_NAMES, GAIN_UNITS
from workbench.errors import unknown_name
from workbench.handover.code.c_header import c_header
from workbench.handover.code.digital import DigitalCheck, exportable
from workbench.handover.code.matlab import mat_bytes
from workbench.handover.table.table import GainTable, table_json
from workbench.machine.writing import write_bytes


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


_WRITERS: dict[str, tuple[str, Callable[[GainTable, DigitalCheck | None], str | bytes]]] = {
    "csv": (".csv", lambda table, check: csv_text(table)),
    "json": (".json", lambda table, check: table_json(table)),
    "mat": (".mat", mat_bytes),
    "c": (".h", c_header),
}
FORMATS = tuple(_WRITERS)
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
    return _writer(format)[0]


def render(
    table: GainTable, format: str, *, computing_delay: float = 0.0, accept: bool = False,
    check: DigitalCheck | None = None,
) -> bytes:  # fmt: skip
    """A table in the named format: "csv", "json", "mat" or "c".

    computing_delay : from sampling the sensors to the new commands [s], in the check of "mat" and "c"
    accept : take a controller whose sampled loop breaks promises of the table
    check : of this table at this delay, where it is at hand already

    Raises
    ------
    InputError
        If the format is not one of them, or the law cannot run at the table's sample time ("mat" and "c").
    InfeasibleError
        If the sampled loop with the table's vehicle is unstable or breaks what the table promises ("mat" and "c").
    """
    writer = _writer(format)[1]
    checked = exportable(table, computing_delay, accept=accept, check=check) if format in DIGITAL else None
    content = writer(table, checked)
    return content if isinstance(content, bytes) else content.encode("utf-8")


def exported(table: GainTable, format: str, path: Path | str, *, computing_delay: float, accept: bool) -> Path:
    """Writes a table in the named format, as `render` makes it; returns the path."""
    write_bytes(Path(path), render(table, format, computing_delay=computing_delay, accept=accept))
    return Path(path)


def _writer(format: str) -> tuple[str, Callable[[GainTable, DigitalCheck | None], str | bytes]]:
    if format not in _WRITERS:
        raise unknown_name("format", str(format), _WRITERS)
    return _WRITERS[format]

"""How results show themselves: a short repr, a bounded HTML table, a dictionary, a data frame.

A result is a frozen dataclass that names its most telling figures in `rows()`; everything else follows from the fields.
"""

import dataclasses
from html import escape
from typing import Any

import numpy as np

from workbench.machine.terminal import printable

MAX_ROWS = 40  # of an HTML table; the rest is counted, not shown

Row = tuple[str, Any, str]  # name, value, unit


def plain(value: Any) -> Any:
    """The same value in JSON's types: arrays become lists, complex numbers [re, im], NaN and infinity None.

    A field whose metadata say "absent" is left out where it stands at its default.

    Examples
    --------
    >>> plain({"value": np.float64(0.5), "pole": -1 + 2j, "missing": np.nan})
    {'value': 0.5, 'pole': [-1.0, 2.0], 'missing': None}
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        shown = {f: getattr(value, f.name) for f in dataclasses.fields(value) if not f.name.startswith("_")}
        return {f.name: plain(v) for f, v in shown.items() if not (f.metadata.get("absent") and v == f.default)}
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, complex):
        return [plain(value.real), plain(value.imag)]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


def figure(value: Any) -> str:
    """A value in at most four significant digits.

    Examples
    --------
    >>> figure(0.123456), figure(True), figure(None)
    ('0.1235', 'yes', '–')
    """
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "–"}[value]
    if isinstance(value, float | np.floating):
        return f"{value:.4g}"
    return str(value)


class Result:
    """The displays of a result; the dataclass that carries this defines `rows()`."""

    def rows(self) -> list[Row]:
        """The figures worth a glance: (name, value, unit)."""
        raise TypeError(f"{type(self).__name__} must define rows()")  # a defect of ours, not of the input

    def to_dict(self) -> dict[str, Any]:
        """Every field, in JSON's types."""
        return plain(self)

    def to_frame(self):
        """`rows()` as a pandas.DataFrame with columns quantity, value, unit."""
        import pandas as pd

        return pd.DataFrame(self.rows(), columns=["quantity", "value", "unit"])

    def __repr__(self) -> str:
        body = ", ".join(f"{name} {figure(value)} {unit}".rstrip() for name, value, unit in self.rows()[:6])
        return printable(f"<{type(self).__name__}: {body}>")  # a name may come from anybody's file

    def _repr_html_(self) -> str:
        rows = self.rows()
        cells = "".join(
            f"<tr><td>{escape(name)}</td><td style='text-align:right'>{escape(figure(value))}</td>"
            f"<td>{escape(unit)}</td></tr>"
            for name, value, unit in rows[:MAX_ROWS]
        )
        more = f"<tr><td colspan=3>… {len(rows) - MAX_ROWS} more</td></tr>" if len(rows) > MAX_ROWS else ""
        return f"<table><caption>{escape(type(self).__name__)}</caption>{cells}{more}</table>"

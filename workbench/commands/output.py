"""What a command prints: one JSON document with --json, otherwise tables that fit the terminal, and lines.

Names and titles come from files: every text passes `printable` here, so that none of them steers the terminal.
"""

import json
import sys
from collections.abc import Iterable
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from workbench.machine.terminal import printable
from workbench.result import Row, figure, plain

NAMED = 30  # characters of a row's name that are not folded
PADDING = 3  # of a column, the edges' share with it

if TYPE_CHECKING:
    from workbench.analysis.first_tables import Cell, MarkedTable


def emit_json(document: Any) -> None:
    """The document on stdout and nothing else; strict JSON, so NaN and infinity are null."""
    text = json.dumps(plain(document), indent=1, allow_nan=False, ensure_ascii=False)
    if not text.replace("\n", "").isprintable():
        text = "".join(c if c == "\n" or c.isprintable() else json.dumps(c)[1:-1] for c in text)
    sys.stdout.write(text + "\n")


def say(text: str) -> None:
    """A line or several on stdout."""
    sys.stdout.write(printable(text, keep="\n") + "\n")


def tell(text: str) -> None:
    """A line on stderr."""
    sys.stderr.write(printable(text) + "\n")


def emit_rows(title: str, rows: Iterable[Row]) -> None:
    """A three-column table: quantity, value, unit."""
    emit_table(title, ("quantity", "value", "unit"), [(name, figure(value), unit) for name, value, unit in rows])


def emit_table(title: str, columns: Iterable[str], rows: Iterable[Iterable["str | Cell"]], *, stderr=False) -> None:
    """A table of strings and marked cells; on stderr where stdout carries content."""
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    def shown(cell: "str | Cell") -> Text:
        if isinstance(cell, str):
            return Text(printable(cell))
        return Text(printable(cell.marked), " ".join(["bold"] * cell.worst + ["red"] * cell.bad))

    console = Console(markup=False, highlight=False, stderr=stderr)
    table = Table(title=printable(title), title_justify="left", box=box.SIMPLE_HEAD, title_style="bold")
    heads, cells = [printable(column) for column in columns], [[shown(cell) for cell in row] for row in rows]
    longest = [max((len(row[k]) for row in cells), default=0) for k in range(len(heads))]
    if sum(map(max, zip(map(len, heads), longest, strict=True))) + PADDING * len(heads) > console.width:
        heads[1:] = [head.replace(" ", "\n") for head in heads[1:]]  # heads give way before names and digits do
    for number, head in enumerate(heads):
        fixed = number == 0 and longest[0] <= NAMED
        table.add_column(head, justify="left" if number == 0 else "right", overflow="fold", no_wrap=fixed)
    for row in cells:
        table.add_row(*row)
    console.print(table)


def emit_first(tables: Iterable["MarkedTable"]) -> None:
    """The tables that are read first; ▸ stands at the worst of a column."""
    for table in tables:
        emit_table(" ".join(filter(None, (f"{table.title}.", table.words))), table.columns, table.rows)


@contextmanager
def progress(quiet: bool):
    """A function (description, total) -> step(note) that shows bars on a terminal's stderr, and nothing elsewhere."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True, quiet=quiet or not sys.stderr.isatty())
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[note]}"),
    )
    with Progress(*columns, console=console, transient=True) as bars:

        def show(description: str, total: int):
            task = bars.add_task(printable(description), total=total, note="")
            return lambda note: bars.update(task, advance=1, note=printable(note))

        yield show

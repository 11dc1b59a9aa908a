"""What a command prints: one JSON document with --json, otherwise tables that fit the terminal, and lines.

Names and titles come from files: every text passes `printable` here, so that none of them steers the terminal.
"""

import json
import sys
from collections.abc import Iterable
from contextlib import contextmanager
from typing import Any

from workbench.machine.terminal import printable
from workbench.result import Row, figure, plain


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


def emit_table(title: str, columns: Iterable[str], rows: Iterable[Iterable[str]], *, stderr: bool = False) -> None:
    """A table of strings; on stderr where stdout carries content."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(title=printable(title), title_justify="left", box=box.SIMPLE_HEAD, title_style="bold")
    for number, column in enumerate(columns):
        table.add_column(printable(column), justify="left" if number == 0 else "right", overflow="fold")
    for row in rows:
        table.add_row(*map(printable, row))
    Console(markup=False, highlight=False, stderr=stderr).print(table)


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

"""What `workbench simulate` does with a vehicle: hours of nonlinear flight over drawn guideways."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from workbench.commands.output import emit_json, emit_rows, emit_table, progress, say, tell
from workbench.errors import BudgetEnded, InputError
from workbench.machine.budget import Deadline
from workbench.machine.interrupts import word
from workbench.machine.supervision import finishing
from workbench.machine.terminal import printable

if TYPE_CHECKING:
    from workbench.control import Gains
    from workbench.design.problem import Problem
    from workbench.simulation.flown import Flights

PICTURE, REPORT = "flights.png", "report.html"


@dataclass(frozen=True, kw_only=True)
class Asked:
    """The options that speak of flights, None where left out; `names` as a terminal knows them."""

    hours: float | None
    seeds: int | None
    seed: int | None
    law: str | None
    integration_step_ms: float | None
    factor: float | None
    workers: int | None
    scheduler: str | None
    fresh: bool

    @property
    def given(self) -> list[str]:
        """Names of those that are there."""
        return [
            name.replace("_", "-") for name in self.__dataclass_fields__ if getattr(self, name) not in (None, False)
        ]

    def order(self, usual: int) -> int | None:
        """Of the expansion of the force law; None for the exact one."""
        if self.law is None or self.law == "exact":
            return None if self.law else usual
        if not self.law.isdecimal():
            raise InputError(f"--law must be an order of expansion, 1 … 5, or exact; got {self.law[:40]!r}.")
        return int(self.law)


def simulate_flights(
    loaded: "Problem", gains: Path | None, asked: Asked, out: str | None, deadline: Deadline, json: bool
) -> None:
    """Flies, shows and keeps; what an interrupt or a budget leaves is shown too.

    out : folder that keeps finished flights, a picture and a report; the same words go on from there
    """
    from workbench.files.gains import read_gains
    from workbench.study.flights import ORDER, fly

    if asked.workers is not None and asked.scheduler is not None:
        raise InputError("--workers are of this machine, --scheduler has workers of its own; give one of them.")
    chosen = None if gains is None else read_gains(gains, speed=loaded.setting.speed)
    folder = None if out is None else Path(out)
    last: list[Flights] = []
    try:
        with progress(json) as show:
            bar = []

            def on_flown(flown: "Flights") -> None:
                if not bar:
                    bar.append(show("flights", flown.planned))
                for _ in range(flown.flights - (last[0].flights if last else 0)):
                    bar[0](f"{flown.hours:.3g} h, {flown.contacts} contacts")
                last[:] = [flown]

            fly(
                loaded, chosen, hours=1.0 if asked.hours is None else asked.hours, seeds=asked.seeds or 16,
                seed=asked.seed or 0, order=asked.order(ORDER), factor=1.0 if asked.factor is None else asked.factor,
                step=None if asked.integration_step_ms is None else asked.integration_step_ms / 1000,
                workers=asked.workers or os.cpu_count() or 1, scheduler=asked.scheduler, folder=folder,
                fresh=asked.fresh, on_flown=on_flown, deadline=deadline,
            )  # fmt: skip
    except KeyboardInterrupt:
        _shown(last, loaded, folder, json)
        typer.echo(printable(f"{word()} with {_kept(last, out)}"), err=True)
        raise typer.Exit(130) from None
    except BudgetEnded:
        _shown(last, loaded, folder, json)
        raise BudgetEnded(f"the budget of {deadline.budget:.4g} s ended with {_kept(last, out)}") from None
    finishing()
    report = None if folder is None or not last else _reported(last[0], loaded, chosen, folder / REPORT)
    _shown(last, loaded, folder, json, report)


def _kept(last: "list[Flights]", out: str | None) -> str:
    done = f"{last[0].flights} of {last[0].planned} flights" if last else "no flight"
    more = "give --out FOLDER to keep them" if out is None else "the same command goes on from there"
    return f"{done} finished; {more}."


def _reported(flown: "Flights", loaded: "Problem", chosen: "Gains | None", file: Path) -> Path:
    """Writes the report of the gains flown, with their flights."""
    from workbench.design.record import given
    from workbench.handover.report.report import report_html
    from workbench.machine.writing import write_text

    gains = chosen or loaded.gains
    assert gains is not None  # they were flown
    write_text(file, report_html(given(loaded, gains), flights=flown))
    return file


def _shown(
    last: "list[Flights]", loaded: "Problem", folder: Path | None, json: bool, report: Path | None = None
) -> None:
    if not last:
        return
    flown = last[0]
    picture = None if folder is None or not flown.figures else folder / PICTURE
    if picture is not None:
        _draw(flown, picture)
    written = {name: str(file) for name, file in (("picture", picture), ("report", report)) if file is not None}
    if json:
        emit_json(flown.to_dict() | written)
        return
    emit_rows(f"{loaded.title or loaded.name}: nonlinear flight", flown.rows())
    if flown.figures:
        emit_table(*flown.table())
    if flown.warning is not None:
        tell(f"warning: {flown.warning}")
    for name, file in written.items():
        say(f"{name:7} {file}")


def _draw(flown: "Flights", picture: Path) -> None:
    from io import BytesIO

    import matplotlib

    from workbench.machine.writing import write_bytes

    matplotlib.use("Agg")
    from workbench.plots.flown import plot_flown

    stream = BytesIO()
    plot_flown(flown).figure.savefig(stream, format="png", dpi=120)
    write_bytes(picture, stream.getvalue())

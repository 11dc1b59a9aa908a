"""From a problem to everything that leaves the house: design, robustness, trade-off, table, proofs, report.

    problem --design: one set of gains, for many models, or over speeds--> cases, curve --> table --proofs--> report
                                                                             `-- a folder: both files, or neither

What a vehicle alone has (robustness cases, a trade-off of its cost, boxes) is left out for a plant of one's own.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

from workbench.design.design import design, method_of
from workbench.design.plant_analysis import analysis_of
from workbench.design.problem import Problem
from workbench.design.record import Design, Start
from workbench.design.robust import ROUNDS as ROBUST_ROUNDS
from workbench.design.robust import RobustDesign, robust_design
from workbench.design.robustness import Case, robustness
from workbench.design.scheduled import ROUNDS as SCHEDULE_ROUNDS
from workbench.design.scheduled import ScheduledDesign, schedule_design
from workbench.design.starts import STARTS
from workbench.design.tradeoff import TradeOff, trade_off
from workbench.design.valley import in_valley
from workbench.design.variation import STANDARD_BOX, Variation
from workbench.errors import InputError
from workbench.goals.ride.requirement import boxed
from workbench.handover.report.plant import plant_report
from workbench.handover.report.report import report_html
from workbench.handover.report.schedule import with_schedule
from workbench.handover.table.plant import PlantTable
from workbench.handover.table.promise import certified
from workbench.handover.table.schema import SchedulePart
from workbench.handover.table.table import GainTable, table_from_design, table_of
from workbench.machine.budget import NEVER, Deadline, keeping
from workbench.machine.interrupts import received
from workbench.machine.supervision import attempted, finishing
from workbench.machine.writing import check_file, check_folder, write_text
from workbench.result import Result, Row

SWEPT = "peak sensitivity"
TRADE_OFF = (1.4, 1.2, 1.0, 0.95, 0.9)  # multiples of the wanted peak sensitivity
TABLE, REPORT = "gains.json", "report.html"

Show = Callable[[str, int], Callable[[str], object]]  # (what is done, steps) -> what is called after each step


def silent(what: str, steps: int) -> Callable[[str], object]:
    """Shows nothing."""
    return lambda note: None


@dataclass(frozen=True, kw_only=True, repr=False)
class Completed(Result):
    """A design with everything that is handed over.

    design : at the problem's own operating point;  evidence : itself, or the design for many models or over speeds
    cases : robustness of a vehicle;  curve : its cost over the allowed peak sensitivity, where it was swept
    table : signed;  report : HTML;  left_out : what the time did not suffice for
    hurried : whether starts were cut short;  written : the files, where a folder was given
    """

    design: Design
    evidence: Design | RobustDesign | ScheduledDesign
    cases: tuple[Case, ...]
    curve: TradeOff | None
    table: GainTable | PlantTable
    report: str
    left_out: tuple[str, ...]
    hurried: bool
    written: tuple[Path, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """The evidence, the cases of a vehicle, and where the files are."""
        cases = {"robustness": [c.to_dict() for c in self.cases]} if self.design.problem.flies else {}
        places = dict(zip(("table", "report"), map(str, self.written), strict=False))
        return {**self.evidence.to_dict(), **cases, **places}

    def rows(self) -> list[Row]:
        return [*self.design.rows(), ("digest of the table", self.table.digest, "SHA-256")]


def complete(
    problem: Problem,
    out: Path | str | None = None,
    *,
    starts: int | None = None,
    seed: int | None = None,
    method: str | None = None,
    valley: str | None = None,
    robust: bool | None = None,
    over_speeds: bool | None = None,
    sweep: bool | None = None,
    boxes: bool = True,
    workers: int = 1,
    deadline: Deadline = NEVER,
    show: Show = silent,
) -> Completed:
    """Designs, judges, proves and reports; writes table and report into a folder, both or neither.

    Parameters
    ----------
    out : folder; nothing is written if left out
    starts, seed, method, valley : as of `design`; the problem's `effort` says what is left out, the deadline too
    robust : gains for every vehicle of the problem's variation, else of the standard box; by the problem if left out
    over_speeds : gains that are polynomials of the speed, by the problem's plan; by the problem if left out
    sweep : the cost of a vehicle over the allowed peak sensitivity; if left out where it is limited, for one set of
        gains for one vehicle that asks for no reserves
    boxes : prove what holds over the standard box and over the speeds of a schedule
    workers : processes; a script that asks for more than one needs the usual `if __name__ == "__main__"`
    deadline : the best design verified by then is kept; sweep and boxes are left out where they would take too long
    show : told what is done, for progress

    Raises
    ------
    InfeasibleError
        If the goals cannot be met together.
    InputError
        If the problem cannot be designed so, or the folder cannot be written to.
    """
    problem = problem if valley is None else in_valley(problem, valley)
    way = _way(problem, robust, over_speeds)
    how = method_of(problem, method)
    sweepable = problem.flies and way == "one" and any(r.name == SWEPT for r in problem.requirements)
    if sweep and not sweepable:
        raise InputError(
            f"--trade-off sweeps a limit of {SWEPT!r} for one set of gains for one vehicle at one speed; "
            f"{problem.name!r} is asked for something else. Leave it out."
        )
    folder = None if out is None else Path(out)
    if folder is not None:
        check_folder(folder)
        for name in (TABLE, REPORT):
            check_file(folder / name)
    effort = problem.effort.said(starts, seed)
    if math.isinf(deadline.budget):
        deadline = Deadline.after(effort.budget)
    problem = replace(problem, effort=replace(effort, budget=None))  # what is said here, and the deadline
    count = STARTS if effort.starts is None and problem.flies else effort.starts
    options = {"starts": count, "seed": effort.seed, "workers": workers}
    solving = _time_to_solve(deadline)
    with keeping(solving):
        evidence = _designed(problem, way, how, options, show)
    found = evidence.design if isinstance(evidence, RobustDesign) else evidence
    found = found.cruise if isinstance(found, ScheduledDesign) else found
    hurried = problem.flies and (len(found.starts) < (count or 0) or solving.expired or received() is not None)
    left_out: list[str] = []
    cases = robustness(problem, found.gains) if problem.flies else ()
    curve = None
    usual = not any(r.beside for r in problem.requirements)  # with reserves every limit costs a design of its own
    if sweepable and (sweep or (sweep is None and usual)):
        curve, whole = attempted(lambda: _curve(problem, found, options, show), None, _time_for_extras(deadline))
        left_out += [] if whole else ["the trade-off"]
    kept = {c.name: c.to_dict() for c in cases}
    kept |= _worst(evidence)
    table: GainTable | PlantTable = table_of(found) if not problem.flies else _vehicle_table(evidence, found, kept)
    if boxes and isinstance(table, GainTable):
        plain = table
        table, whole = attempted(lambda: _proved(plain, problem, show), plain, _time_for_extras(deadline))
        left_out += [] if whole else ["proofs over boxes"]
    if problem.flies:
        report = report_html(found, trade_off=curve, robustness=kept, table=table)
        report = with_schedule(report, evidence) if isinstance(evidence, ScheduledDesign) else report
    else:
        whole_analysis, whole = attempted(lambda: analysis_of(found), None, _time_for_extras(deadline))
        left_out += [] if whole else ["margins"]
        report = plant_report(whole_analysis or analysis_of(found, margins=False), table=table)
    done = Completed(
        design=found, evidence=evidence, cases=cases, curve=curve, table=table, report=report,
        left_out=tuple(left_out), hurried=hurried,
        written=() if folder is None else (folder / TABLE, folder / REPORT),
    )  # fmt: skip
    if folder is not None:
        finishing()
        write_text(folder / REPORT, report)  # both are complete before either is written
        table.write(folder / TABLE)
    return done


def _way(problem: Problem, robust: bool | None, over_speeds: bool | None) -> str:
    """ "many" models, over "speeds", or "one" set of gains."""
    if (robust or over_speeds) and not problem.flies:
        raise InputError(
            f"{problem.name!r} controls a plant of its own, with no box of vehicles and no speeds. Leave that out."
        )
    if robust is None and over_speeds is None:
        problem.check_one_way(
            "say --robust for one set of gains that bears the variation, or --no-robust for the schedule"
        )
    if robust or (robust is None and problem.variation is not None):
        return "many"
    return "speeds" if problem.plan is not None and over_speeds is not False else "one"


def _designed(problem: Problem, way: str, how: str, options: dict[str, Any], show: Show):
    """The design in one of the three ways."""
    step = show("starts", options["starts"] or 1)

    def on_start(start: Start) -> None:
        step(f"cost {start.cost:.4g}")

    if way == "one":
        return design(problem, **options, method=how, on_start=on_start)
    what = ("worst models", ROBUST_ROUNDS) if way == "many" else ("dense check", SCHEDULE_ROUNDS)
    rounds = show(*what)
    told = {"on_start": on_start, "on_round": lambda n, words: rounds(words[:60])}
    if way == "many":
        return robust_design(problem, problem.variation or Variation(box=STANDARD_BOX), solver=how, **options, **told)
    return schedule_design(problem, solver=how, **options, **told)


def _curve(problem: Problem, found: Design, options: dict[str, Any], show: Show) -> TradeOff:
    """Cost against allowed peak sensitivity, in the design's valley and in those of an eighth of its starts."""
    wanted = next(r.limit for r in problem.requirements if r.name == SWEPT)
    step = show("trade-off", len(TRADE_OFF))
    return trade_off(
        problem, SWEPT, [wanted * f for f in TRADE_OFF], start=found.gains, starts=max(2, options["starts"] // 8),
        seed=options["seed"], workers=options["workers"], on_limit=lambda limit, cost: step(f"at {limit:.3g}"),
    )  # fmt: skip


def _worst(evidence) -> dict[str, Any]:
    """What a gain table keeps of the worst of many models."""
    found = {}
    for worst in evidence.worst if isinstance(evidence, RobustDesign) else ():
        v = worst.verdict
        record = {"limit": v.limit, "value": v.value, "met": v.met, "where": v.where, **worst.values}
        found[f"worst {v.name} of many models"] = record
    return found


def _vehicle_table(evidence, found: Design, kept: dict[str, Any]) -> GainTable:
    """The signed table of a vehicle's design, with its schedule where there is one."""
    table = table_from_design(found, robustness=kept)
    if isinstance(evidence, ScheduledDesign):
        table = table.model_copy(update={"schedule": SchedulePart(**evidence.schedule.to_dict())})
    return table.signed()


def _proved(table: GainTable, problem: Problem, show: Show) -> GainTable:
    """The table with its promises over the standard box and over the speeds of its schedule."""
    count = sum(boxed(p.name) for p in table.promises) * (1 if table.schedule is None else 2)
    step, began = show("proofs over boxes", count), perf_counter()
    return certified(
        table, problem, on_promise=lambda name, words: step(f"{perf_counter() - began:.0f} s, {name}: {words}"[:90])
    )


def _time_to_solve(deadline: Deadline) -> Deadline:
    """The part of a budget for finding gains: the rest is for table and report, thrice what starting has taken."""
    left = max(deadline.remaining, 1e-9)
    started_in = 0.0 if math.isinf(left) else deadline.budget - left
    return deadline.share(min(max(1 - 3 * started_in / left, 0.5), 0.7))


def _time_for_extras(deadline: Deadline) -> Deadline:
    """Until when something may be done that can be left out; nothing at all after an interrupt."""
    return Deadline(0.0, 0.0) if received() else deadline.share(0.4)

"""`workbench design`: gains that meet a problem's requirements, verified, with table and report."""

import math
import os
from pathlib import Path
from typing import Annotated

import typer

from workbench.commands.analyse import Budget, Name, Speed
from workbench.commands.problems import Json

SWEPT = "peak sensitivity"
TRADE_OFF = (1.4, 1.2, 1.0, 0.95, 0.9)  # multiples of the wanted peak sensitivity


def design(
    problem: Name,
    out: Annotated[Path, typer.Option(help="Folder for gain table and report.")] = Path("results"),
    starts: Annotated[int | None, typer.Option(help="Seeded starts of the optimiser; 16 if left out.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the random starts; 0 if left out.", min=0)] = None,
    fix: Annotated[str, typer.Option(help="Parameters held at given values: tau_h=0.637,K_zddot=0")] = "",
    solver: Annotated[str, typer.Option(help="slsqp or ipopt; restriction for a tuning problem.")] = "slsqp",
    trade_off: Annotated[
        bool | None,
        typer.Option(
            help="Sweep the cost against the allowed peak sensitivity for the report; if left out, for one set of "
            "gains for one vehicle that has such a limit."
        ),
    ] = None,
    robust: Annotated[
        bool | None,
        typer.Option(
            help="Keep damping, decay, sensitivity and delay margin for every vehicle of a box, found by searching its "
            "worst ones: the data's [variation] and [[model]] blocks, else the standard box (mass ±15 %, centre of "
            "gravity ±0.5 m, inertias ±10 %, current force ±10 %, gap force ±8 %). By the data if left out."
        ),
    ] = None,
    speed: Speed = None,
    boxes: Annotated[
        bool | None,
        typer.Option(
            help="Prove what holds for every vehicle of the standard box (mass ±15 %, inertias ±10 %, current force "
            "±10 %, gap force ±8 %) and at every speed of a schedule, for the gain table; done if left out."
        ),
    ] = None,
    budget_seconds: Budget = None,
    json: Json = False,
) -> None:
    """Optimises, verifies, writes the gain table and the report.

    A problem with a [schedule] gets gains that are polynomials of the speed, checked over its whole range; its
    requirements hold at cruise. With --speed, or --robust, one set of gains for one speed instead. A tuning problem
    (kind = "tuning") takes --solver slsqp or restriction.

    With --budget-seconds, or interrupted, it keeps the best design that is verified by then, if there is one; trade-off
    and proofs over boxes are left out where they would take too long.
    """
    from workbench.machine.supervision import attempted, finishing, supervised

    deadline = supervised(budget_seconds, "the design")

    from workbench.commands.output import emit_json, emit_rows, emit_table, progress, say, tell
    from workbench.commands.tuning_design import design_tuning
    from workbench.design.design import design as solve
    from workbench.design.robustness import robustness
    from workbench.errors import InputError
    from workbench.files.problem import load_problem, tuning_folder
    from workbench.handover.report.report import report_html
    from workbench.handover.report.schedule import with_schedule
    from workbench.handover.table.schema import SchedulePart
    from workbench.handover.table.table import signed, table_from_design, table_json
    from workbench.machine.budget import keeping
    from workbench.machine.interrupts import received, word
    from workbench.machine.writing import check_file, check_folder, write_text
    from workbench.physics.vehicle import varied
    from workbench.result import figure

    plant_alone = tuning_folder(problem)
    if plant_alone is not None:
        asked = {"starts": starts is not None, "seed": seed is not None, "fix": fix, "trade-off": trade_off,
                 "robust": robust, "speed": speed is not None, "boxes": boxes}  # fmt: skip
        unused = next((name for name, there in asked.items() if there), None)
        if unused is not None:
            raise InputError(
                f"{problem!r} has no vehicle and no random starts; --{unused} is not for it. Leave it out."
            )
        return design_tuning(plant_alone, out, solver=solver, json=json, deadline=deadline)
    loaded = load_problem(problem, speed=speed).with_fixed(parse_fixed(fix))
    if robust is None and speed is None:
        loaded.check_one_way(
            "say --robust for one set of gains that bears the variation, or --no-robust for the schedule"
        )
    for_many = robust or (robust is None and loaded.variation is not None)
    over_speeds = not for_many and loaded.plan is not None and speed is None
    sweepable = not for_many and not over_speeds and any(r.name == SWEPT for r in loaded.requirements)
    if trade_off and not sweepable:
        raise InputError(
            f"--trade-off sweeps a limit of {SWEPT!r} for one set of gains for one vehicle at one speed; "
            f"{problem!r} is asked for something else. Leave it out."
        )
    starts, seed = 16 if starts is None else starts, seed or 0
    check_folder(out)
    for name in ("gains.json", "report.html"):
        check_file(out / name)
    scheduled = borne = None
    with progress(json) as show:
        step = show("starts", starts)
        options = {"starts": starts, "seed": seed, "solver": solver, "workers": os.cpu_count() or 1}
        solving = _time_to_solve(deadline)
        with keeping(solving):
            if for_many:
                borne = _robust(loaded, options, lambda s: step(f"cost {s.cost:.4g}"), show)
                result = borne.design
            elif over_speeds:
                scheduled = _scheduled(loaded, options, lambda s: step(f"cost {s.cost:.4g}"), show)
                result = scheduled.cruise
            else:
                own = {key: value for key, value in options.items() if key != "solver"}
                result = solve(loaded, method=solver, **own, on_start=lambda s: step(f"cost {s.cost:.4g}"))
        cases = robustness(loaded, result.gains, varied)
        left_out = []
        extras = _time_for_extras(deadline)
        curve = None
        if sweepable and trade_off is not False:
            curve, whole = attempted(lambda: _curve(loaded, result.gains, options, show), None, extras)
            left_out += [] if whole else ["the trade-off"]
        kept = {c.name: c.to_dict() for c in cases}
        more = {} if borne is None else {f"worst {w.verdict.name} of many models": _worst(w) for w in borne.worst}
        table = table_from_design(result, robustness=kept | more)
        if scheduled is not None:
            table = table.model_copy(update={"schedule": SchedulePart(**scheduled.schedule.to_dict())})
        plain = table = signed(table)
        if boxes is not False:
            table, whole = attempted(lambda: _proved(plain, loaded, show), plain, _time_for_extras(deadline))
            left_out += [] if whole else ["proofs over boxes"]
    evidence = scheduled or borne or result
    page = report_html(result, trade_off=curve, robustness=kept | more, table=table)
    page = page if scheduled is None else with_schedule(page, scheduled)
    path, report = out / "gains.json", out / "report.html"
    finishing()
    write_text(report, page)  # both are complete before either is written
    write_text(path, table_json(table))
    if len(result.starts) < starts or solving.expired or received():
        why = "the budget ended" if received() is None else word()
        tell(f"{why} after {len(result.starts)} of {starts} starts; {path} holds the best design verified by then.")
    if left_out:
        tell(f"left out for want of time: {', '.join(left_out)}.")
    if json:
        places = {"table": str(path), "report": str(report)}
        emit_json({**evidence.to_dict(), "robustness": [c.to_dict() for c in cases], **places})
        return
    emit_rows(loaded.title, result.gains.rows())
    emit_table(
        f"Requirements{_where(scheduled)}: cost J = {result.analysis.cost:.4g}",
        ("requirement", "limit", "value", "met", "where"),
        [
            (v.name, f"{v.sense} {v.limit:g} {v.unit}", figure(v.value), figure(v.met), v.where)
            for v in result.requirements
        ],
    )  # fmt: skip
    if scheduled is not None:
        _print_schedule(scheduled)
    if borne is not None:
        _print_worst(borne)
    emit_table(
        "Robustness", ("case", "stable", "damping", *(f"peak sensitivity, {g}" for g in cases[0].peak_sensitivity)),
        [(c.name, figure(c.stable), figure(c.damping), *map(figure, c.peak_sensitivity.values())) for c in cases],
    )  # fmt: skip
    if boxes is not False:
        _print_boxes(table)
    say(f"gain table  {path}\nreport      {report}")


def _time_to_solve(deadline):
    """The part of a budget for finding gains: the rest is for table and report, thrice what starting has taken."""
    left = max(deadline.remaining, 1e-9)
    started_in = 0.0 if math.isinf(left) else deadline.budget - left
    return deadline.share(min(max(1 - 3 * started_in / left, 0.5), 0.7))


def _time_for_extras(deadline):
    """Until when something may be done that can be left out; nothing at all after an interrupt."""
    from workbench.machine.budget import Deadline
    from workbench.machine.interrupts import received

    return Deadline(0.0, 0.0) if received() else deadline.share(0.4)


def _robust(problem, options, on_start, show):
    """Gains for many models: the data's variation, or the standard box."""
    from workbench.design.model import STANDARD_BOX, Variation
    from workbench.design.robust import ROUNDS, robust_design

    step = show("worst models", ROUNDS)
    variation = problem.variation or Variation(box=STANDARD_BOX)
    return robust_design(problem, variation, **options, on_start=on_start, on_round=lambda n, words: step(words[:60]))


def _scheduled(problem, options, on_start, show):
    """A schedule over the range that the data ask for."""
    from workbench.design.scheduled import ROUNDS, schedule_design

    step = show("dense check", ROUNDS)
    return schedule_design(problem, **options, on_start=on_start, on_round=lambda n, words: step(words[:60]))


def _proved(table, problem, show):
    """The table with its promises over the standard box and over the speeds of its schedule."""
    from time import perf_counter

    from workbench.goals.ride.requirement import boxed
    from workbench.handover.table.promise import certified

    count = sum(boxed(p.name) for p in table.promises) * (1 if table.schedule is None else 2)
    step, began = show("proofs over boxes", count), perf_counter()
    return certified(
        table, problem, on_promise=lambda name, words: step(f"{perf_counter() - began:.0f} s, {name}: {words}"[:90])
    )


def _print_boxes(table) -> None:
    """What is promised over boxes and speeds, and what is not."""
    from workbench.commands.output import emit_table
    from workbench.result import figure

    rows = [
        (_box(p.box), p.name, f"{p.sense} {p.limit:g}", figure(p.enclosure[0]), figure(p.enclosure[1]))
        for p in table.promises
        if p.box
    ]
    if rows:
        emit_table("Proved for every vehicle of a box", ("box", "worst", "promised", "from", "to"), rows)
    if table.undecided:
        emit_table(
            "Asked of the box as well, and not promised there",
            ("box", "limit", "open share", "because"),
            [(_box(u.box), f"{u.name} {u.sense} {u.limit:g}", f"{u.share:.0%}", u.reason) for u in table.undecided],
        )


def _box(box) -> str:
    """A box in few words."""
    if set(box) == {"speed"}:
        return "{:g} … {:g} m/s".format(*box["speed"])
    return ", ".join(f"{name} {low:g} … {high:g}" for name, (low, high) in box.items()) if len(box) < 3 else "standard"


def _where(scheduled) -> str:
    return "" if scheduled is None else f" at {scheduled.problem.setting.speed:g} m/s"


def _print_schedule(scheduled) -> None:
    """Polynomials and the worst margins over the range."""
    from workbench.commands.output import emit_table
    from workbench.control.gains import GAIN_UNITS
    from workbench.result import figure

    s = scheduled.schedule
    emit_table(
        f"Schedule: polynomials of t = (v − {s.centre:g} m/s) / {s.scale:g} m/s, {s.range[0]:g} … {s.range[1]:g} m/s",
        ("gain", *(f"t^{k}" for k in range(s.degree + 1)), "unit"),
        [(name, *(f"{c:.6g}" for c in s.coefficients[name]), unit) for name, unit in GAIN_UNITS.items()],
    )
    emit_table(
        f"Margins at {len(scheduled.margins[0].speed)} speeds, tuned at {len(s.points)}",
        ("margin", "limit", "worst", "at [m/s]", "met"),
        [
            (m.name, f"{m.sense} {m.limit:g} {m.unit}", figure(m.worst[0]), figure(m.worst[1]), figure(m.met))
            for m in scheduled.margins
        ],
    )


def _worst(worst) -> dict:
    """What a gain table keeps of a worst model."""
    v = worst.verdict
    return {"limit": v.limit, "value": v.value, "met": v.met, "where": v.where, **worst.values}


def _print_worst(borne) -> None:
    """The worst model of each requirement, and what bearing them costs."""
    from workbench.commands.output import emit_table
    from workbench.design.model import sentence
    from workbench.result import figure

    cost = figure(borne.nominal_cost)
    emit_table(
        f"Worst of {borne.looked_at} models, designed for {len(borne.visited)}; J of the nominal vehicle alone {cost}",
        ("requirement", "limit", "worst", "met", "model"),
        [
            (v.name, f"{v.sense} {v.limit:g} {v.unit}", figure(v.value), figure(v.met), sentence(w.values))
            for w in borne.worst
            for v in [w.verdict]
        ],
    )


def _curve(problem, gains, options, show):
    """Cost against allowed peak sensitivity; a quarter of the design's starts at each limit."""
    from workbench.design.tradeoff import trade_off

    wanted = next(r.limit for r in problem.requirements if r.name == SWEPT)
    step = show("trade-off", len(TRADE_OFF))
    return trade_off(
        problem,
        SWEPT,
        [wanted * f for f in TRADE_OFF],
        start=gains,
        starts=max(2, options["starts"] // 4),
        seed=options["seed"],
        workers=options["workers"],
        on_limit=lambda limit, cost: step(f"at {limit:.3g}"),
    )


def parse_fixed(text: str) -> dict[str, float]:
    """'tau_h=0.637,K_zddot=0' as a mapping of checked values."""
    from workbench.control.gains import TIME_CONSTANTS, checked_gain
    from workbench.errors import InputError

    out: dict[str, float] = {}
    for part in filter(None, (p.strip() for p in text.split(","))):
        name, _, value = (side.strip() for side in part.partition("="))
        try:
            number = float(value)
        except ValueError as error:
            pairs = "name=number pairs such as tau_h=0.637,K_zddot=0"
            raise InputError(f"--fix takes {pairs}; got {part[:60]!r}.") from error
        if name in out:
            raise InputError(f"--fix must name a parameter once; got {name} twice. Drop one of them.")
        out[name] = checked_gain(name, number)
        if name in TIME_CONSTANTS and out[name] == 0:
            raise InputError(
                f"{name} must be positive in a design; got 0. To do without the filter, fix its rate gain at 0."
            )
    return out

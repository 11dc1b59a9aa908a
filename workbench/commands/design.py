"""`workbench design`: gains that meet a problem's requirements, verified, with table and report."""

from pathlib import Path
from typing import Annotated

import typer

from workbench.commands.analyse import Budget, Name, Speed
from workbench.commands.problems import Json


def design(
    problem: Name,
    out: Annotated[Path, typer.Option(help="Folder for gain table and report.")] = Path("results"),
    starts: Annotated[
        int | None,
        typer.Option(help="Seeded starts of the optimiser; as the data say, else 16, of a plant of one's own 4."),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the random starts; as the data say, else 0.", min=0)] = None,
    valley: Annotated[
        str | None,
        typer.Option(
            help="mirrored or conventional: which way the lateral signals act on sway and roll; whichever is "
            "cheaper if left out."
        ),
    ] = None,
    fix: Annotated[str, typer.Option(help="Parameters held at given values: tau_h=0.637,K_zddot=0")] = "",
    solver: Annotated[
        str | None, typer.Option(help="slsqp, ipopt, nonsmooth or restriction; as the goals say if left out.")
    ] = None,
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
    requirements hold at cruise. With --speed, or --robust, one set of gains for one speed instead.

    With --budget-seconds, or interrupted, it keeps the best design that is verified by then, if there is one; trade-off
    and proofs over boxes are left out where they would take too long.
    """
    from workbench.machine.supervision import supervised

    deadline = supervised(budget_seconds, "the design")

    import os

    from workbench.commands.output import emit_json, progress, tell
    from workbench.errors import InputError
    from workbench.files.problem import load_problem
    from workbench.handover.complete import complete
    from workbench.machine.interrupts import received, word

    loaded = load_problem(problem, speed=speed)
    loaded = loaded.with_fixed(parse_fixed(fix, vehicle=loaded.flies))
    if boxes and not loaded.flies:
        raise InputError(f"{problem!r} controls a plant of its own, with no box of vehicles; leave --boxes out.")
    with progress(json) as show:
        done = complete(
            loaded, out, starts=starts, seed=seed, method=solver, robust=robust, valley=valley,
            over_speeds=False if speed is not None else None, sweep=trade_off, boxes=boxes is not False,
            workers=os.cpu_count() or 1, deadline=deadline, show=show,
        )  # fmt: skip
    if done.hurried:
        why = "the budget ended" if received() is None else word()
        of = f"{len(done.design.starts)} of {starts or loaded.effort.starts or 16} starts"
        tell(f"{why} after {of}; {done.written[0]} holds the best design verified by then.")
    if done.left_out:
        tell(f"left out for want of time: {', '.join(done.left_out)}.")
    if json:
        emit_json(done.to_dict())
        return
    _print(done, boxes is not False)


def _print(done, boxes: bool) -> None:
    """The design for a person."""
    from workbench.commands.output import emit_rows, emit_table, say
    from workbench.design.robust import RobustDesign
    from workbench.design.scheduled import ScheduledDesign
    from workbench.handover.table.table import GainTable
    from workbench.result import figure

    found, evidence = done.design, done.evidence
    rows = [(p.name, found.values[p.name], p.unit) for p in found.structure.parameters]
    emit_rows(found.problem.title or found.problem.name, rows)
    scheduled = evidence if isinstance(evidence, ScheduledDesign) else None
    cost = "" if found.analysis is None else f": cost J = {found.analysis.cost:.4g}"
    emit_table(
        f"{'Requirements' if found.problem.flies else 'Goals'}{_where(scheduled)}{cost}",
        ("requirement", "limit", "value", "met", "where"),
        [
            (v.name, f"{v.sense} {v.limit:g} {v.unit}", figure(v.value), figure(v.met), v.where)
            for v in found.verdicts
        ],
    )  # fmt: skip
    if found.valley is not None:
        say(f"Valley: {found.valley.sentence}")
    if found.multipliers is not None:
        _print_multipliers(found.multipliers)
    if scheduled is not None:
        _print_schedule(scheduled)
    if isinstance(evidence, RobustDesign):
        _print_worst(evidence)
    if done.cases:
        emit_table(
            "Robustness",
            ("case", "stable", "damping", *(f"peak sensitivity, {g}" for g in done.cases[0].peak_sensitivity)),
            [
                (c.name, figure(c.stable), figure(c.damping), *map(figure, c.peak_sensitivity.values()))
                for c in done.cases
            ],
        )
    if boxes and isinstance(done.table, GainTable):
        _print_boxes(done.table)
    say("gain table  {}\nreport      {}".format(*done.written))


def _print_multipliers(found) -> None:
    """What the limits cost."""
    from workbench.commands.output import emit_table
    from workbench.result import figure

    emit_table(
        f"What the limits cost (limits and bounds leave {found.unexplained:.1%} of the gradient of log J)",
        ("requirement", "limit", "J\u00a0for\u00a01\u00a0%", "J\u00a0for\u00a0a\u00a0unit", "at"),
        [(m.name, f"{m.limit:g} {m.unit}", figure(m.per_percent), figure(m.per_unit), m.where) for m in found.each],
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


def _print_worst(borne) -> None:
    """The worst model of each requirement, and what bearing them costs."""
    from workbench.commands.output import emit_table
    from workbench.design.variation import sentence
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


def parse_fixed(text: str, *, vehicle: bool) -> dict[str, float]:
    """'tau_h=0.637,K_zddot=0' as a mapping of values, checked as a vehicle's gains where they are."""
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
        out[name] = checked_gain(name, number) if vehicle else number
        if vehicle and name in TIME_CONSTANTS and out[name] == 0:
            raise InputError(
                f"{name} must be positive in a design; got 0. To do without the filter, fix its rate gain at 0."
            )
    return out

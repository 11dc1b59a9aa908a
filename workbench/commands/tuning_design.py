"""What `workbench design` does with a tuning problem: a law affine in its gains, limits of S, T and Q."""

from pathlib import Path

SOLVING = 0.7  # of a budget's rest; the best gains seen by then are judged
MOST_STEPS = 25  # of either solver, for the progress bar


def design_tuning(folder: Path, out: Path, *, solver: str, json: bool, deadline) -> None:
    """Tunes, judges the rounded gains at every frequency, writes the table; refuses gains that miss a limit."""
    import hashlib
    from dataclasses import replace
    from datetime import UTC, datetime
    from json import dumps
    from time import perf_counter

    from workbench.commands.output import emit_json, emit_rows, emit_table, progress, say
    from workbench.convex.pid_problem import verified
    from workbench.convex.restriction import restriction
    from workbench.convex.smooth_tuner import smooth_tuning
    from workbench.errors import InfeasibleError, unknown_name
    from workbench.files.tuning_problem import load_tuning_problem
    from workbench.handover.table.tuning import DIGITS, requirements, tuning_table
    from workbench.machine.supervision import finishing
    from workbench.machine.writing import check_file, check_folder, write_text
    from workbench.result import figure

    solvers = {"slsqp": smooth_tuning, "restriction": restriction}
    if solver not in solvers:
        raise unknown_name("solver of a tuning problem", solver, solvers)
    problem = load_tuning_problem(folder)
    check_folder(out)
    check_file(out / "gains.json")
    begin = perf_counter()
    seconds = min(60.0, SOLVING * deadline.remaining)
    with progress(json) as show:
        step = show("steps", MOST_STEPS)
        found = solvers[solver](problem, seconds=seconds, on_progress=lambda _, value: step(f"objective {value:.5g}"))
    rounded = [float(f"{value:.{DIGITS}g}") for value in found.gains.values()]
    kept = verified(
        problem, rounded, history=found.history, solves=found.solves, frequencies=found.frequencies,
        seconds=lambda: perf_counter() - begin, outcome=found.outcome,
    )  # fmt: skip
    judged = requirements(problem, kept)
    missed = [r for r in judged if not r["met"]]
    if missed or not kept.stable:
        sentence = "{name} must be <= {limit:g}; best found {value:.6g} ({where})"
        words = "; ".join(sentence.format(**r) for r in missed)
        if not kept.stable:
            beyond = problem.unstable_poles(rounded)
            left = f"leave {beyond} that are not" if beyond > 0 else "leave poles too near the axis to decide"
            words = f"every pole must be stable; the best gains found {left}"
        raise InfeasibleError(
            f"the limits of {problem.name!r} cannot be met together: {words}. "
            "Raise one of them, or free more places of the controller."
        )
    created = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    sha256 = hashlib.sha256((folder / "data.toml").read_bytes()).hexdigest()
    table = tuning_table(problem, replace(kept, history=()), sha256, created)
    path = out / "gains.json"
    finishing()
    write_text(path, dumps(table, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
    if json:
        emit_json({**table, "seconds": kept.seconds, "table": str(path)})
        return
    emit_rows(problem.title, kept.rows())
    emit_table(
        f"Limits: objective {kept.objective:.6g}", ("limit", "at most", "value", "met", "where"),
        [(r["name"], f"{r['limit']:g}", f"{r['value']:.6g}", figure(r["met"]), r["where"]) for r in judged],
    )  # fmt: skip
    say(f"gain table  {path}")

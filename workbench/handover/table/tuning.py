"""The table of a tuning problem: gains as decimals, what they reach, and how that was found.

PidTuning --tuning_table--> mapping --JSON--> gains.json
"""

from typing import Any

from workbench.convex.pid_problem import PidProblem, PidTuning
from workbench.handover.table.table import digest_of
from workbench.result import plain

FORMAT = "maglev-workbench tuned gains"
VERSION = 1
DIGITS = 6  # significant digits of a gain as printed; the rounded gains are what is judged


def tuning_table(problem: PidProblem, found: PidTuning, data_sha256: str, created: str) -> dict[str, Any]:
    """The table as JSON's types, signed by its SHA-256."""
    document: dict[str, Any] = {
        "format": FORMAT, "version": VERSION, "problem": problem.name, "title": problem.title,
        "data_sha256": data_sha256, "created": created,
        "gains": {name: repr(value) for name, value in found.gains.items()},
        "objective": found.objective, "stable": found.stable,
        "requirements": requirements(problem, found), "outcome": found.outcome, "sources": dict(problem.sources),
    }  # fmt: skip
    document = plain(document)
    document["digest"] = digest_of(document)
    return document


def requirements(problem: PidProblem, found: PidTuning) -> list[dict[str, Any]]:
    """One record per limit, in the shape of the vehicle's requirements."""
    out = []
    everywhere = "bounded at every frequency" if found.within_limits else f"not bounded near {found.undecided}"
    for name, limit in problem.limits.items():
        value, omega = found.peaks[name]
        met = found.stable and value <= limit and found.within_limits
        out.append(
            {
                "name": f"largest {name}", "sense": "<=", "limit": limit, "value": value, "unit": "1",
                "met": bool(met), "where": f"{omega:.4g} rad/min; {everywhere}",
            }
        )  # fmt: skip
    return out

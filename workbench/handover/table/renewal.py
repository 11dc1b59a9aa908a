"""Approved gain tables written anew with the same gains: when what a table must hold has changed, not the design.

    python -m workbench.handover.table.renewal PROBLEM …

    approved.json --gains, schedule, provenance--> certified table

Figures, promises and certificate are computed again from the problem; gains and schedule stay digit for digit.
"""

import sys
from pathlib import Path


def renewed(problem, document: dict):
    """A certified table of the gains (and the schedule) in a document.

    Parameters
    ----------
    problem : workbench.design.problem.Problem
    document : of the old table, as read from JSON

    Returns
    -------
    workbench.handover.table.table.GainTable
    """
    from workbench.control import Gains
    from workbench.design.record import given
    from workbench.design.robustness import robustness
    from workbench.handover.table.promise import certified
    from workbench.handover.table.schema import SchedulePart
    from workbench.handover.table.table import table_from_design

    gains = Gains.from_mapping({name: float(text) for name, text in document["gains"].items()})
    design = given(problem, gains, seed=document["seed"], solver=document["solver"])
    cases = {case.name: case.to_dict() for case in robustness(problem, gains)}
    kept = {name: value for name, value in document["robustness"].items() if name not in cases}
    table = table_from_design(design, robustness=cases | kept)
    schedule = document["schedule"] and {k: v for k, v in document["schedule"].items() if k != "forces"}
    changes = {"starts": document["starts"], "gains": document["gains"]}
    if schedule:
        changes["schedule"] = SchedulePart(**schedule)
    return certified(table.model_copy(update=changes).signed(), problem)


def main(names: list[str]) -> None:
    """Renews the approved tables of problems in place."""
    from workbench.files.problem import load_problem, shipped_problems
    from workbench.machine.reading import read_mapping

    for name in names:
        path = Path(shipped_problems()[name]) / "approved.json"
        renewed(load_problem(name), read_mapping(path)).write(path)


if __name__ == "__main__":
    main(sys.argv[1:])

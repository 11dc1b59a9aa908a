"""What a gain table promises: each requirement with an interval that holds its value, and how that was found.

    the table's decimals --workbench.verify--> enclosure in ball arithmetic, rounded outward --> promise
    no proof             --floating point----> the value alone, or the bracket of its algorithm

The prover is the one that `workbench verify` runs: from the decimals as printed, nothing else. A method that starts
with "ball arithmetic" is a proof; "floating point" is not, and the word stands in the table.
"""

import math
from typing import Any

from workbench.design.requirement import Verdict

ANALYSIS = "floating point: figure of the analysis"
HAMILTONIAN = "floating point: Hamiltonian eigenvalues, bracket"
BOXED = ("damping ratio", "decay rate", "peak sensitivity")
SLACK = 1e-12  # relative, outward: so that another version's enclosure, as narrow as ours, still fits in


def promises(design, document: dict[str, Any]) -> list[dict[str, Any]]:
    """One promise per verdict with a value: {name, sense, limit, enclosure, method, box}.

    document : the table's content so far, with gains, law, plant and certificate
    """
    from workbench.verify.prover import Prover
    from workbench.verify.table import table_of

    prover = Prover(table_of({**document, "promises": [], "digest": ""}))
    out = []
    for v in design.requirements:
        if v.value is not None:
            name, enclosure, method = _enclosed(v, v.value, design.analysis, prover)
            promise = {"name": name, "sense": v.sense, "limit": v.limit, "enclosure": list(enclosure)}
            out.append({**promise, "method": method, "box": {}})
    return out


def _enclosed(v: Verdict, value: float, analysis, prover) -> tuple[str, tuple[float, float], str]:
    """Name, interval and method of one verdict's promise; the peak sensitivity's name carries its group."""
    from workbench.verify.check import outward
    from workbench.verify.failure import NotProved
    from workbench.verify.reading import number

    group = v.where.split(",")[0] if v.name == "peak sensitivity" else ""
    name = f"{v.name}, {group}" if group else v.name
    try:
        *ends, method = prover.enclosure(name, number(value, name))
    except NotProved:
        if group:
            peak = analysis.peak_sensitivity[group]
            return name, (peak.lower, peak.upper), HAMILTONIAN
        return name, (value, value), ANALYSIS
    low, high = outward(*ends)
    return name, (low - SLACK * abs(low), math.nextafter(high + SLACK * abs(high), math.inf)), method


def with_box(table, box: dict[str, tuple[float, float]]):
    """The table, signed, with promises besides of what holds over a box: damping, decay and peak sensitivity.

    Parameters
    ----------
    table : workbench.export.table.GainTable
    box : name of a factor (`workbench.verify.loop.FACTORS`: "mass", "inertia", "current_force", "gap_force", …) to its
        [lowest, highest] value, 1 = as printed

    Each worst value over the box is enclosed to 0.2 %. The promised limit is the nominal one where it holds over the
    whole box, else what is proved, rounded to three digits on the safe side; a quantity for which nothing is proved
    gets no promise. Some seconds for four factors.
    """
    from workbench.export.table import GainTable, signed
    from workbench.verify.check import outward
    from workbench.verify.failure import NotProved
    from workbench.verify.prover import Prover
    from workbench.verify.reading import as_printed, number
    from workbench.verify.table import table_of
    from workbench.verify.uncertain import attained, interval_holds, worst_over_box

    document = table.to_dict()
    prover = Prover(table_of(document))
    exact = {name: (as_printed(low, name), as_printed(high, name)) for name, (low, high) in box.items()}
    found = []
    for promise in document["promises"]:
        if promise["box"] or promise["name"].split(",")[0] not in BOXED:
            continue
        try:
            loops = prover.uncertain(promise["name"], exact)
            low, high, method = worst_over_box(loops, promise["name"])
            wanted, upper = number(promise["limit"], "limit"), promise["sense"] == "<="
            reached = attained(loops, promise["name"])  # at a corner, where the checker looks again
            low, high = (reached, high) if upper else (low, reached)
            nearer = (low, wanted) if upper else (wanted, high)
            if low <= wanted <= high and interval_holds(loops, promise["name"], *nearer):
                low, high = nearer  # the limit lay within the enclosure: asked again, exactly there
        except NotProved:
            continue
        low, high = outward(low, high)
        kept = high <= promise["limit"] if upper else low >= promise["limit"]
        limit = promise["limit"] if kept else _safe(high, 1) if upper else _safe(low, -1)
        intervals = {name: [float(a), float(b)] for name, (a, b) in box.items()}
        found.append({**promise, "limit": limit, "enclosure": [low, high], "method": method, "box": intervals})
    document["promises"] += found
    return signed(GainTable.model_validate(document))


def with_schedule(table, forces: dict[str, Any]):
    """The table of a schedule, signed, with the coil forces over its speeds and what is proved over all of them.

    Parameters
    ----------
    table : workbench.export.table.GainTable
        With a schedule, and the vehicle in its certificate.
    forces : the dictionary of `workbench.design.speed_family.force_family(problem, range)`

    Damping, decay and peak sensitivity of the groups at every steady speed, promised as `with_box` does. About ten
    seconds for quadratic gains.
    """
    from workbench.export.table import GainTable

    document = table.to_dict()
    document["schedule"]["forces"] = forces
    low, high = (float(v) for v in document["schedule"]["range"])
    return with_box(GainTable.model_validate(document), {"speed": (low, high)})


def _safe(value: float, side: int) -> float:
    """Three digits of a value, not below it (side 1) or not above it (−1)."""
    step = 10.0 ** (math.floor(math.log10(abs(value))) - 2)
    return float(f"{(math.ceil if side > 0 else math.floor)(value / step) * step:.3g}")

"""What a gain table promises: each requirement with an interval that holds its value, and how that was found.

    the table's decimals --workbench.verify--> enclosure in ball arithmetic, rounded outward --> promise
    no proof             --floating point----> the value alone, or the bracket of its algorithm
    boxes of factors, ranges of speed --same prover--> the worst value --> promise, and what share stays undecided

The prover is the one that `workbench verify` runs: from the decimals as printed, nothing else. A method that starts
with "ball arithmetic" is a proof; "floating point" is not, and the word stands in the table.
"""

import math
from collections.abc import Callable
from typing import Any

from workbench.goals.ride.delay_margin import PatternDelayMargin
from workbench.goals.ride.peak_sensitivity import PeakSensitivity
from workbench.goals.ride.requirement import boxed, required_kinds, requirement

ANALYSIS = "floating point: figure of the analysis"
HAMILTONIAN = "floating point: Hamiltonian eigenvalues, bracket"
UNPROVABLE = "the checker has no proof of this quantity over a box"
NO_PROOF = "the checker has no proof of this quantity; the value is that of the analysis"
OnPromise = Callable[[str, str], None]
SLACK = 1e-12  # relative, outward: so that another version's enclosure, as narrow as ours, still fits in


def promises(design, document: dict[str, Any]) -> list[dict[str, Any]]:
    """One promise per verdict with a value: {name, sense, limit, enclosure, method, box}; the uniform delay last.

    document : the table's content so far, with gains, law, plant and certificate
    """
    from workbench.verify.vehicle.prover import Prover
    from workbench.verify.vehicle.table import table_of

    prover = Prover(table_of({**document, "promises": [], "digest": ""}))
    out = []
    for v in design.requirements:
        if v.value is not None and v.name in required_kinds():  # of the others the checker has no proof: stated alone
            name = requirement(v.name, v.limit).promised_name(v)
            enclosure, method = _enclosed(name, v.value, design.analysis, prover)
            promise = {"name": name, "sense": v.sense, "limit": v.limit, "enclosure": list(enclosure)}
            out.append({**promise, "method": method, "box": {}, "at": {}})
    delay = PatternDelayMargin.kind
    asked = [v.limit for v in design.requirements if v.name == delay and v.value is not None]
    return out + [promise for limit in asked for promise in _uniform(limit, prover)]


def unproved(design) -> list[dict[str, Any]]:
    """What the design keeps and the checker has no proof of: said to be undecided, never promised."""
    return [
        {"name": v.name, "sense": v.sense, "limit": v.limit, "box": {}, "share": 1.0, "reason": NO_PROOF}
        for v in design.requirements
        if v.name not in required_kinds()
    ]


def _uniform(limit: float, prover) -> list[dict[str, Any]]:
    """The delay that all commands bear at once, beside the required one of each current pattern.

    Promised to the same limit where it is kept, else to what is proved.
    """
    from workbench.verify.check import outward
    from workbench.verify.exact.failure import NotProved
    from workbench.verify.vehicle.kind import UNIFORM

    try:
        *ends, method = prover.enclosure(UNIFORM)
    except NotProved:
        return []  # unlimited, or not to be told: nothing is promised of it
    low, high = _outside(*outward(*ends))
    own = limit if low >= limit else _safe(low, -1) if low > 0 else 0.0
    promise = {"name": UNIFORM, "sense": ">=", "limit": own, "enclosure": [low, high], "method": method}
    return [{**promise, "box": {}, "at": {}}] if own > 0 else []


def _outside(low: float, high: float) -> tuple[float, float]:
    """A little more than an enclosure."""
    return low - SLACK * abs(low), math.nextafter(high + SLACK * abs(high), math.inf)


def _enclosed(name: str, value: float, analysis, prover) -> tuple[tuple[float, float], str]:
    """Interval and method of one value's promise; without a proof a peak's own bracket, else the value."""
    from workbench.verify.check import outward
    from workbench.verify.exact.failure import NotProved
    from workbench.verify.reading import number

    try:
        *ends, method = prover.enclosure(name, number(value, name))
    except NotProved:
        for group, peak in analysis.peak_sensitivity.items():
            if name == f"{PeakSensitivity.kind}, {group}":
                return (peak.lower, peak.upper), HAMILTONIAN
        return (value, value), ANALYSIS
    return _outside(*outward(*ends)), method


def certified(table, problem, *, on_promise: OnPromise | None = None):
    """The table, signed, with what is proved over the standard box, and over every speed of its schedule if it has one.

    Parameters
    ----------
    table : workbench.handover.table.table.GainTable
    problem : workbench.design.problem.Problem
        Whose design it is; asked for the coil forces over the speeds of a schedule.
    on_promise : called with the name of each quantity and what became of it

    The box is the problem's variation if it has one, else `design.variation.STANDARD_BOX`, both as far as the checker
    knows their factors (not the centre of gravity): mass ±15 %, each inertia ±10 %, current force ±10 %, gap force ±8
    %. What the problem asks of its whole variation, or of every speed, and nobody can prove there, the table says is
    undecided.
    """
    from workbench.design.variation import STANDARD_BOX
    from workbench.handover.table.agreement import varied_box
    from workbench.handover.table.certificate import speed_forces
    from workbench.verify.vehicle.loop import FACTORS

    asked = varied_box(problem.variation) if problem.variation else dict(STANDARD_BOX.intervals)
    box = {name: (low, high) for name, (low, high) in asked.items() if name in FACTORS}
    if box:
        table = with_box(table, box, on_promise=on_promise)
    if problem.variation is not None:
        unknown = [name for name in asked if name not in box]
        reason = f"the checker has no proof over {', '.join(unknown)}" if unknown else UNPROVABLE
        table = with_undecided(table, problem.variation.asked(problem), asked, reason)
    if table.schedule is None:
        return table
    low, high = (float(v) for v in table.schedule.range)
    table = with_schedule(table, speed_forces(problem, (low, high)), on_promise=on_promise)
    asked = problem.plan.requirements if problem.plan else ()
    return with_undecided(table, asked, {"speed": (low, high)}, UNPROVABLE)


def with_undecided(table, requirements, box: dict[str, tuple[float, float]], reason: str):
    """The table, signed, saying of each requirement that is not promised over a box that it is undecided there."""
    from workbench.handover.table.table import GainTable
    from workbench.verify.vehicle.kind import promised_names

    document = table.to_dict()
    intervals = {name: [float(a), float(b)] for name, (a, b) in box.items()}
    groups = table.certificate.groups if table.certificate else ()
    for r in requirements:
        for name in promised_names(r.name, groups):
            asked = {"name": name, "sense": r.sense, "limit": r.limit, "box": intervals}
            said = [{k: one[k] for k in asked} for one in (*document["promises"], *document["undecided"])]
            if asked not in said:
                document["undecided"].append({**asked, "share": 1.0, "reason": reason})
    return GainTable.model_validate(document).signed()


def with_box(table, box: dict[str, tuple[float, float]], *, on_promise: OnPromise | None = None, method: str = ""):
    """The table, signed, with promises besides of what holds over a box: damping, decay and peak sensitivity.

    Parameters
    ----------
    table : workbench.handover.table.table.GainTable
    box : name of a factor (`workbench.verify.vehicle.loop.FACTORS`: "mass", "inertia", "current_force", …) to its
        [lowest, highest] value, 1 = as printed
    on_promise : called with the name of each quantity and what became of it
    method : words that are added to the method of each promise

    Each worst value over the box is enclosed to 0.2 %. The promised limit is the nominal one where it holds over the
    whole box, else what is proved, rounded to three digits on the safe side; then, and where nothing is proved, the
    table says under `undecided` on what share of the box the nominal limit stays open, and why.
    """
    from workbench.handover.table.table import GainTable
    from workbench.verify.vehicle.prover import Prover
    from workbench.verify.vehicle.table import table_of

    document = table.to_dict()
    prover = Prover(table_of(document))
    intervals = {name: [float(a), float(b)] for name, (a, b) in box.items()}
    for promise in list(document["promises"]):
        if promise["box"] or not boxed(promise["name"]):
            continue
        asked = {k: promise[k] for k in ("name", "sense", "limit")} | {"box": intervals}
        found, left = _over_box(prover, promise, box)
        if found:
            words = found["method"] if not method else f"{found['method']}; {method}"
            document["promises"].append({**asked, **found, "method": words})
        if left:
            document["undecided"].append({**asked, **left})
        if on_promise:
            on_promise(promise["name"], _words(found, left))
    return GainTable.model_validate(document).signed()


def _over_box(prover, promise: dict[str, Any], box) -> tuple[dict[str, Any] | None, dict[str, Any] | None]:
    """What is promised of a quantity over a box, and what stays undecided; at least one of them."""
    from workbench.verify.check import outward
    from workbench.verify.exact.failure import NotProved
    from workbench.verify.reading import as_printed, number
    from workbench.verify.vehicle.uncertain import attained, interval_holds, open_share, worst_over_box

    name, upper = promise["name"], promise["sense"] == "<="
    wanted = number(promise["limit"], "limit")
    try:
        loops = prover.uncertain(name, {k: (as_printed(low, k), as_printed(high, k)) for k, (low, high) in box.items()})
    except NotProved as error:
        return None, {"share": 1.0, "reason": str(error)}
    try:
        worst = worst_over_box(loops, name)
        at = {k: float(v) for k, v in worst.at.items()}  # where the checker looks again
        exact = {k: as_printed(v, k) for k, v in at.items()}
        reached = attained(loops, name, exact)
        if reached is None:
            raise NotProved("the member that attains the worst value could not be printed as decimals")
        low, high = (reached, worst.high) if upper else (worst.low, reached)
        nearer = (low, wanted) if upper else (wanted, high)
        if low <= wanted <= high and interval_holds(loops, name, *nearer, exact):
            low, high = nearer  # the limit lay within the enclosure: asked again, exactly there
    except NotProved as error:
        return None, {"share": _share(open_share, loops, name, wanted), "reason": str(error)}
    low, high = outward(low, high)
    kept = high <= promise["limit"] if upper else low >= promise["limit"]
    limit = promise["limit"] if kept else _safe(high, 1) if upper else _safe(low, -1)
    found = {"limit": limit, "enclosure": [low, high], "method": worst.method, "at": at}
    if kept:
        return found, None
    place = ", ".join(f"{k} {v:.4g}" for k, v in at.items())
    reason = f"the member at {place} attains {float(reached):.4g}"
    return found, {"share": _share(open_share, loops, name, wanted), "reason": reason}


def _share(open_share, loops, name: str, wanted) -> float:
    """The open share of a limit, two digits, rounded up."""
    from workbench.verify.exact.failure import NotProved

    try:
        return min(math.ceil(100 * open_share(loops, name, wanted)) / 100, 1.0)
    except NotProved:
        return 1.0


def _words(found: dict[str, Any] | None, left: dict[str, Any] | None) -> str:
    """What became of one quantity, in a few words."""
    if found is None:
        return f"nothing proved: {left['reason']}" if left else ""
    return "holds" if left is None else f"{found['limit']:.4g} instead"


def with_schedule(table, forces: dict[str, Any], *, on_promise: OnPromise | None = None):
    """The table of a schedule, signed, with the coil forces over its speeds and what is proved over all of them.

    Parameters
    ----------
    table : workbench.handover.table.table.GainTable
        With a schedule, and the vehicle in its certificate.
    forces : as of `workbench.handover.table.certificate.speed_forces`
    on_promise : as for `with_box`

    Damping, decay and peak sensitivity of the groups at every steady speed, promised as `with_box` does. The proof is
    about the printed polynomials of the forces; how far the coils' own forces lie from them, as measured, stands in
    each promise's method, and `workbench verify --problem` measures it again.
    """
    from workbench.handover.table.table import GainTable

    document = table.to_dict()
    document["schedule"]["forces"] = forces
    low, high = (float(v) for v in document["schedule"]["range"])
    error = max(forces["relative_error"].values(), default=0.0)
    words = f"coil forces as the printed polynomials, within {_safe(error, 1):.3g} of the problem's" if error else ""
    return with_box(GainTable.model_validate(document), {"speed": (low, high)}, on_promise=on_promise, method=words)


def _safe(value: float, side: int) -> float:
    """Three digits of a value, not below it (side 1) or not above it (−1)."""
    step = 10.0 ** (math.floor(math.log10(abs(value))) - 2)
    return float(f"{(math.ceil if side > 0 else math.floor)(value / step) * step:.3g}")

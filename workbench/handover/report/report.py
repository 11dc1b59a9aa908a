"""The report of a design: one HTML file that needs nothing else, for screen, phone and paper.

    Design (, trade-off, robustness) --> margins and failures, requirements, gains, roots, trade-off, spectra, Nyquist,
                                        robustness, provenance

Figures are inline SVG with their numbers folded beneath; nothing is fetched, and the page forbids itself to try.
"""

from collections.abc import Mapping
from datetime import datetime
from html import escape
from typing import Any

from workbench.analysis.first_tables import first_rows, first_tables
from workbench.analysis.reserves import Reserves
from workbench.analysis.reserves import reserves as find_reserves
from workbench.control import GAIN_UNITS
from workbench.design.design import Design
from workbench.design.tradeoff import TradeOff
from workbench.design.verdict import nominal_limits
from workbench.errors import InputError
from workbench.handover.report.figures import nyquist_figures, root_figures, spectrum_figures, trade_off_figures
from workbench.handover.report.page import figures, head, page, provenance, requirement_table, when
from workbench.handover.report.style import first_blocks, table_block
from workbench.handover.table.table import GainTable
from workbench.result import figure as digits
from workbench.simulation.flown import Flights

UNSTABLE = "The loop is unstable under these gains: it has no stationary response, and no spectra or margins."
UNFILTERED = "A gap's rate is taken without a filter: the loop has roots, but no responses, spectra or margins."


def report_html(
    design: Design,
    *,
    trade_off: TradeOff | None = None,
    robustness: Mapping[str, Any] | None = None,
    table: GainTable | None = None,
    reserves: Reserves | None = None,
    flights: Flights | None = None,
    created: datetime | None = None,
) -> str:
    """The report's text.

    Parameters
    ----------
    trade_off : `design.tradeoff.trade_off` of this problem, for its section
    robustness : case to figures (mappings may nest), or name to value, for its section
    table : the gain table of this design; its digest and versions are shown
    reserves : of these gains, if they are at hand already
    flights : hours of nonlinear flight with these gains, `study.flights.fly`, for their section
    created : time shown; the table's, or now, if left out
    """
    if table is not None and table.to_gains() != design.gains:
        raise InputError("the gain table must hold the design's gains; it holds others. Make both from one design.")
    responds = design.flown.cost is not None
    why_not = UNFILTERED if design.flown.stable else UNSTABLE
    kept = reserves_of(design) if reserves is None else reserves
    sections = [
        (
            "Margins and failures",
            first_blocks(first_tables(kept, design.flown.nonlinear, nominal_limits(design.problem))),
        ),
        ("Requirements", requirement_table(design.requirements)),
        ("What the limits cost", _multipliers(design)),
        ("Gains", _gains(design)),
        ("Roots", figures(root_figures(design))),
        ("Trade-off", figures(trade_off_figures(design, trade_off))),
        ("Ride, strokes and currents", _ride(design) if responds else f"<p>{why_not}</p>"),
        ("Flights", "" if flights is None else _flights(flights)),
        ("Spectra", figures(spectrum_figures(design)) if responds else ""),
        ("Loops", figures(nyquist_figures(design)) if responds else ""),
        ("Robustness", _robustness(robustness or {})),
        ("Provenance", provenance(design, table, "cost J")),
    ]
    return page(design.problem.title, _header(design, kept, when(table, created)), sections)


def reserves_of(design: Design) -> Reserves:
    """What a vehicle's design keeps in reserve, sampled at the problem's own time too."""
    return find_reserves(design.problem.setting, design.gains, sampled=design.problem.own_sampling)


def _flights(flown: Flights) -> str:
    """Contacts per hour, and each figure of the nonlinear ride beside the linear one."""
    title, columns, rows = flown.table()
    facts = [(name, digits(value), unit) for name, value, unit in flown.rows()]
    warning = "" if flown.warning is None else f"<p>{escape(flown.warning)}</p>"
    return table_block(("quantity", "value", "unit"), facts) + table_block(columns, rows, caption=title) + warning


def _header(design: Design, reserves: Reserves, time: str) -> str:
    a, met = design.flown, [v.met for v in design.requirements]
    word, kind = (f"✓ all {len(met)} requirements met", "met") if met else ("no requirements", "")
    if not all(met):
        word, kind = f"✗ {met.count(False)} of {len(met)} requirements missed", "missed"
    peaks = [p.upper for p in a.peak_sensitivity.values() if p is not None]
    gaps = [v for v in a.rms["gap"].values() if v is not None]
    first = first_rows(reserves, a.nonlinear)
    tiles = [
        ("ride cost J", digits(a.cost), "10⁻⁴ g²"),
        ("smallest damping ratio", digits(a.damping), ""),
        ("slowest decay", digits(a.decay), "1/s"),
        ("peak sensitivity", digits(max(peaks) if peaks else None), ""),
        ("largest rms gap change", digits(1e3 * max(gaps) if gaps else None), "mm"),
        ("sum of mean square currents", digits(a.sum_alpha_squared), ""),
        *((name, digits(value), "" if unit == "1" else unit) for name, value, unit in first),
    ]
    return head(design.problem, time, word, kind, tiles)


def _multipliers(design: Design) -> str:
    found = design.multipliers
    if found is None:
        return ""
    rows = [[m.name, f"{m.limit:g} {m.unit}", digits(m.per_percent), digits(m.per_unit), m.where] for m in found.each]
    note = f"Rises of J for a stricter limit, to first order; {found.unexplained:.1%} of the gradient is left over."
    return (
        f"{table_block(['requirement', 'limit', 'J for 1 % of it', 'J for a unit', 'at'], rows)}"
        f'<p class="quiet">{escape(note)}</p>'
    )


def _gains(design: Design) -> str:
    problem, values = design.problem, design.gains.as_dict()
    rows = []
    for name, unit in GAIN_UNITS.items():
        low_high = problem.bounds.get(name)
        chosen = "fixed" if low_high is None else f"{low_high[0]:g} … {low_high[1]:g}"
        rows.append([name, repr(values[name]), unit, chosen])
    references = problem.law.references
    fixed = [n for n in references if n in problem.fixed and problem.free]
    note = "One direction" if len(references) == 1 else "Two directions"
    note += " of the seventeen that change nothing: " + (f"removed by fixing {', '.join(fixed)}." if fixed else "kept.")
    valley = f"<p>Valley: {escape(design.valley.sentence)}</p>" if design.valley else ""
    sampled = f" Digital form: Tustin's rule at {1e3 * (problem.sample_time or 0.0):g} ms."
    gains = table_block(["gain", "value", "unit", "chosen within"], rows)
    return f'{gains}{valley}<p class="quiet">{escape(note + sampled)}</p>'


def _ride(design: Design) -> str:
    a = design.flown
    quantities = {
        "vertical acceleration": ("acceleration_z", "mm/s²"), "vertical, Wk-weighted": ("weighted_z", "mm/s²"),
        "lateral acceleration": ("acceleration_y", "mm/s²"), "lateral, Wd-weighted": ("weighted_y", "mm/s²"),
        "gap change": ("gap", "mm"), "lateral gap change": ("gap_lateral", "mm"),
        "control current": ("current", "10⁻³"),
    }  # fmt: skip
    places = list(dict.fromkeys(place for q, _ in quantities.values() for place in a.rms.get(q, {})))
    rows = []
    for label, (quantity, unit) in quantities.items():
        values = [a.rms.get(quantity, {}).get(place) for place in places]
        if any(v is not None for v in values):
            rows.append([label, *(digits(None if v is None else 1e3 * v) for v in values), unit])
    power = [
        [f"control power, {name.replace('_', ' ')}", "–" if value is None else f"{value:,.0f}", "W"]
        for name, value in a.control_power_w.items()
    ]
    motor = [] if a.motor is None else [[name, digits(value), unit] for name, value, unit in a.motor.rows()]
    tables = [
        (["rms of", *places, "unit"], rows),
        (["mean", "value", "unit"], power),
        (["motor", "value", "unit"], motor),
    ]
    return "".join(table_block(columns, cells) for columns, cells in tables if cells)


def _robustness(cases: Mapping[str, Any]) -> str:
    """Cases as rows where they are mappings; single values as name and value."""
    whole = {name: flat for name, figures in cases.items() if (flat := _flat(figures))}
    listed = {
        str(item.get("name", k + 1)): _flat(item)
        for v in cases.values()
        if isinstance(v, list | tuple)
        for k, item in enumerate(v)
        if isinstance(item, Mapping)
    }
    out = ""
    for group in (whole, listed):
        columns = list(dict.fromkeys(key for flat in group.values() for key in flat if key != "name"))
        rows = [[name, *(digits(flat.get(c)) for c in columns)] for name, flat in group.items()]
        out += table_block(["case", *columns], rows) if rows else ""
    single = [[str(n), digits(v)] for n, v in cases.items() if not isinstance(v, Mapping | list | tuple)]
    return out + (table_block(["figure", "value"], single) if single else "")


def _flat(figures: Any, before: str = "") -> dict[str, Any]:
    """A nested mapping as one level: "peak sensitivity, heave pitch" to value."""
    out: dict[str, Any] = {}
    for key, value in figures.items() if isinstance(figures, Mapping) else ():
        name = f"{before}, {key}" if before else str(key)
        out |= _flat(value, name) if isinstance(value, Mapping) else {name.replace("_", " "): value}
    return out

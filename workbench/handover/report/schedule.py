"""The section of a report that shows a gain schedule: parameters and margins over the speed, with their numbers.

ScheduledDesign --schedule_section--> <section>   --into the page of the cruise design--> report
"""

from html import escape

import numpy as np

from workbench.control.gains import GAIN_NAMES, GAIN_UNITS
from workbench.design.scheduled import ScheduledDesign
from workbench.errors import InputError
from workbench.handover.report.style import figure_block, svg_figure, table_block
from workbench.plots.schedule import PARTS, plot_margins_over_speed, plot_scheduled_gains
from workbench.result import figure

LISTED = 14  # speeds in the folded tables


def with_schedule(page: str, scheduled: ScheduledDesign) -> str:
    """The report's page of the cruise design with the schedule's section ahead of the others."""
    head, found, rest = page.partition("<main>")
    if not found:
        raise InputError("a schedule's section goes into the page of report_html; the given text has no <main>.")
    return head + found + schedule_section(scheduled) + rest


def schedule_section(scheduled: ScheduledDesign) -> str:
    """The section's HTML."""
    s, margins = scheduled.schedule, scheduled.margins
    speeds = np.linspace(*s.range, LISTED)
    rows = [[f"{v:.4g}", *(figure(float(x)) for x in s.table([v])[0])] for v in speeds]
    blocks = []
    for part, (title, _, names) in PARTS.items():
        own = [GAIN_NAMES.index(n) for n in names]
        blocks.append(
            figure_block(
                svg_figure(lambda ax, p=part: plot_scheduled_gains(s, p, ax=ax), f"schedule-{part[:4]}", title),
                f"{title}: polynomials of degree {s.degree} in the speed, as printed in the gain table.",
                ["speed [m/s]", *(f"{n} [{GAIN_UNITS[n]}]" for n in names)],
                [[row[0], *(row[1 + k] for k in own)] for row in rows],
            )
        )
    chosen = np.linspace(0, len(margins[0].speed) - 1, LISTED).round().astype(int)
    picture = figure_block(
        svg_figure(lambda ax: plot_margins_over_speed(margins, ax=ax), "schedule-margins", "Margins over speed"),
        "Margins over their limits at every speed of the check; above 1 is met.",
        ["speed [m/s]", *(f"{m.name} [{m.unit}]" for m in margins)],
        [[f"{margins[0].speed[k]:.4g}", *(figure(float(m.value[k])) for m in margins)] for k in chosen],
        f"{LISTED} of {len(margins[0].speed)} speeds",
    )
    worst = [
        [m.name, f"{'≤' if m.sense == '<=' else '≥'} {m.limit:g} {m.unit}", figure(m.worst[0]), f"{m.worst[1]:.4g}",
         "met" if m.met else "missed"]
        for m in margins
    ]  # fmt: skip
    table = table_block(["margin", "asked at every speed", "worst", "at [m/s]", ""], worst)
    single = scheduled.single_cost
    words = (
        f"Checked at {len(margins[0].speed)} speeds from {s.range[0]:g} to {s.range[1]:g} m/s; "
        f"tuned at {len(s.points)}. "
        f"Requirements and figures below are those at cruise, {scheduled.problem.setting.speed:g} m/s."
    )
    if single is not None and scheduled.cruise.flown.cost is not None:
        more = 100 * (scheduled.cruise.flown.cost / single - 1)
        words += f" The cost there is {more:.2g} % above that of the best gains for cruise alone."
    return (
        f"<section><h2>Schedule over speed</h2><p>{escape(words)}</p>{table}"
        f'<div class="figures">{picture}{"".join(blocks)}</div></section>'
    )

"""The report of a plant of one's own: one HTML file, like a vehicle's.

PlantAnalysis (, table) --> margins and failures, goals, parameters, poles, margins, step responses, loops, proofs,
                           provenance
"""

from collections.abc import Callable, Sequence
from datetime import datetime
from html import escape
from typing import Any

import numpy as np

from workbench.analysis.first_tables import first_tables
from workbench.control.structure.loop import Loop
from workbench.design.plant_analysis import PlantAnalysis
from workbench.design.plant_curves import StepCurve, open_loop, step_curve
from workbench.errors import InputError
from workbench.handover.report.page import figures, head, page, provenance, requirement_table, when
from workbench.handover.report.style import FRAME, figure_block, first_blocks, svg_figure, table_block
from workbench.handover.table.plant import PlantTable
from workbench.plots.loop import plot_bode, plot_poles, plot_steps
from workbench.plots.nyquist import plot_nyquist
from workbench.result import figure as digits

ROWS = 25  # of the table behind a picture
MOST = 12  # pictures of one sort; the rest is counted
UNSTABLE = "A loop is unstable at these values: it has no margins and no responses."
UPPER, LOWER = (0.15, 0.56, 0.83, 0.36), (0.15, 0.12, 0.83, 0.36)  # of the two axes of a Bode diagram


def plant_report(analysis: PlantAnalysis, *, table: PlantTable | None = None, created: datetime | None = None) -> str:
    """The report's text.

    table : the gain table of these values; its promises, digest and versions are shown
    created : time shown; the table's, or now, if left out

    Raises InputError for a table of other values.
    """
    design = analysis.design
    if table is not None and table.values() != dict(design.values):
        raise InputError("the gain table must hold the design's values; it holds others. Make both from one design.")
    first = () if analysis.reserves is None else first_tables(analysis.reserves)
    sections = [
        ("Margins and failures", first_blocks(first)),
        ("Goals", requirement_table(design.verdicts)),
        ("Parameters", _parameters(analysis)),
        ("Poles", _poles(analysis)),
        ("Margins", _margins(analysis)),
        ("Step responses", _figures(analysis, _steps) if analysis.stable else ""),
        ("Loops", _figures(analysis, _loops) if analysis.margins is not None else ""),
        ("Proofs", "" if table is None else _proofs(table)),
        ("Provenance", provenance(design, table, "largest soft goal")),
    ]
    return page(design.problem.title or design.problem.name, _header(analysis, when(table, created)), sections)


def _header(analysis: PlantAnalysis, time: str) -> str:
    design = analysis.design
    missed = [v for v in design.verdicts if not v.met]
    word, kind = "✓ all goals met" if design.verdicts else "no goals", "met" if design.verdicts else ""
    if missed:
        word, kind = f"✗ {len(missed)} of {len(design.verdicts)} goals missed", "missed"
    if not analysis.stable:
        word, kind = "✗ unstable", "missed"
    tiles = [
        ("smallest damping ratio", digits(min(loop.damping for loop in analysis.loops)), ""),
        ("slowest decay", digits(min(loop.decay for loop in analysis.loops)), "1/s"),
    ]
    if analysis.margins is not None:
        single = analysis.margins.single
        tiles += [
            ("peak sensitivity", digits(max(m.peak_sensitivity.upper for m in single)), ""),
            ("smallest phase margin", digits(float(np.degrees(min(m.channel.phase for m in single)))), "°"),
            ("smallest delay margin", digits(1e3 * min(m.channel.delay for m in single)), "ms"),
            ("smallest disk margin", digits(min(m.disk.lower for m in single)), ""),
        ]
    return head(design.problem, time, word, kind, tiles)


def _parameters(analysis: PlantAnalysis) -> str:
    design = analysis.design
    rows = [
        [p.name, repr(design.values[p.name]), p.unit, f"{p.low:g} … {p.high:g}" if p.free else "fixed"]
        for p in design.problem.structure.parameters
    ]
    blocks = [
        [block.kind or "expression", ", ".join(block.inputs), ", ".join(block.outputs)]
        for block in design.problem.structure.blocks
    ]
    return table_block(["block", "reads", "makes"], blocks) + table_block(
        ["parameter", "value", "unit", "chosen within"], rows
    )


def _poles(analysis: PlantAnalysis) -> str:
    out = []
    for number, loop in enumerate(analysis.loops):
        poles = loop.continuous
        svg = svg_figure(
            lambda ax, p=poles, d=loop.damping: plot_poles(p, damping=d, ax=ax), f"poles-{number}",
            f"Poles of {loop.model}", size=(5.4, 4.0),
        )  # fmt: skip
        caption = f"Poles of the closed loop of {loop.model}; dashed: the least damping among them."
        out.append(figure_block(svg, caption, list(loop.columns()), [list(row) for row in loop.table()]))
    return figures(out)


def _margins(analysis: PlantAnalysis) -> str:
    if analysis.margins is None:
        return f"<p>{'Margins were left out for want of time.' if analysis.stable else UNSTABLE}</p>"
    heads, rows = analysis.margins.table()
    return table_block(list(heads), [list(row) for row in rows], caption="One signal broken at a time, and all at once")


def _figures(analysis: PlantAnalysis, make: Callable[[PlantAnalysis, Loop, int], Sequence[str]]) -> str:
    blocks = [b for k, loop in enumerate(analysis.design.problem.loops) for b in make(analysis, loop, k)]
    more = f'<p class="quiet">{len(blocks) - MOST} more are not shown.</p>' if len(blocks) > MOST else ""
    return figures(blocks[:MOST]) + more


def _steps(analysis: PlantAnalysis, loop: Loop, number: int) -> list[str]:
    """One picture for what is measured and one for what is commanded, of every signal from outside."""
    K, out = analysis.design.structure.controller(), []
    for k, source in enumerate(loop.exogenous):
        for what, seen in (("measured", loop.model.outputs), ("commanded", loop.commands)):
            try:
                curve = step_curve(loop, K, source, seen)
            except InputError as error:
                out.append(f"<p>Step at {escape(source)}: {escape(str(error))}</p>")
                continue
            svg = svg_figure(
                lambda ax, c=curve: plot_steps(c, ax=ax), f"step-{number}-{k}-{what}", f"Step at {source}, {what}"
            )
            caption = f"What is {what} after a unit step at {source}, all loops closed."
            out.append(figure_block(svg, caption, *_step_table(curve)))
    return out


def _step_table(curve: StepCurve) -> tuple[list[str], list[list[str]]]:
    chosen = np.unique(np.linspace(0, len(curve.time) - 1, ROWS).astype(int))
    rows = [[digits(float(curve.time[k])), *(digits(float(v)) for v in curve.values[k])] for k in chosen]
    return ["time [s]", *curve.outputs], rows


def _loops(analysis: PlantAnalysis, loop: Loop, number: int) -> list[str]:
    """Bode and Nyquist diagram at every command and measurement."""
    K, out = analysis.design.structure.controller(), []
    single = () if analysis.margins is None else analysis.margins.single
    margins = {m.channel.channel: m for m in single if m.model == loop.name}
    for k, point in enumerate(loop.analysis_points):
        curve, margin = open_loop(loop, K, point), margins[point]
        found = margin.channel
        gains = [w for w in (found.gain_up_frequency, found.gain_down_frequency) if w]
        phases = [found.phase_frequency] if found.phase_frequency else []
        bode = svg_figure(
            lambda ax, c=curve, g=gains, p=phases: _bode(ax, c, g, p), f"bode-{number}-{k}", f"Bode diagram at {point}",
            size=(5.4, 4.6), frame=UPPER,
        )  # fmt: skip
        words = (
            f"Gain from {digits(found.gain_down)} to {digits(found.gain_up)}, phase "
            f"{digits(float(np.degrees(found.phase)))}°, dead time {digits(1e3 * found.delay)} ms more."
        )
        out.append(figure_block(bode, f"Loop at {point}, the others closed. {words}", *_loop_table(curve)))
        peak = margin.peak_sensitivity.upper
        nyquist = svg_figure(
            lambda ax, c=curve, m=peak: plot_nyquist([c], peak_sensitivity=m, ax=ax), f"nyquist-{number}-{k}",
            f"Nyquist curve at {point}", size=(5.4, 4.4), frame=FRAME,
        )  # fmt: skip
        out.append(
            f"<figure>{nyquist}<figcaption>Circle of radius 1/{digits(peak)}, the largest sensitivity at "
            f"{escape(point)}.</figcaption></figure>"
        )
    return out


def _bode(ax: Any, curve, gains, phases) -> None:
    below = ax.figure.add_axes(LOWER, sharex=ax)
    plot_bode(curve, gain_frequencies=gains, phase_frequencies=phases, axes=(ax, below))


def _loop_table(curve) -> tuple[list[str], list[list[str]]]:
    chosen = np.unique(np.linspace(0, len(curve.loop) - 1, ROWS).astype(int))
    rows = [
        [digits(float(curve.frequency_hz[k])), digits(float(abs(curve.loop[k]))),
         digits(float(np.degrees(np.angle(curve.loop[k]))))]
        for k in chosen
    ]  # fmt: skip
    return ["frequency [Hz]", "|L|", "phase [°]"], rows


def _proofs(table: PlantTable) -> str:
    proved = [[p.kind, _subject(p), f"{p.sense} {p.limit:g}"] for p in table.promises]
    open_ones = [[u.name, f"{u.sense} {u.limit:g}", u.reason] for u in table.undecided]
    text = table_block(["proved", "of", "limit"], proved) if proved else "<p>Nothing is proved.</p>"
    return text + (table_block(["not proved", "limit", "why"], open_ones) if open_ones else "")


def _subject(promise) -> str:
    own = promise.subject.model_dump(exclude_defaults=True)
    return "; ".join(f"{key} {', '.join(map(str, value))}" for key, value in own.items()) or "every loop"

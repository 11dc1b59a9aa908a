"""The figures of a design's report, each with the numbers behind it.

    Design --analysis, spectra, loops--> plots --> <figure> with caption and folded table

What the analysis has no figure of (the lateral gap of a problem without sway, say) is not drawn either.
"""

from collections.abc import Callable, Sequence
from html import escape
from typing import Any

import numpy as np

from workbench.analysis.comfort import Mask, worst_ratio
from workbench.analysis.comfort_summary import mask_for
from workbench.analysis.loop_curve import LoopCurve, loop_curves
from workbench.analysis.spectra import Spectra, response_spectra
from workbench.constants import GRAVITY
from workbench.control import GAIN_UNITS
from workbench.design.design import Design
from workbench.design.tradeoff import TradeOff
from workbench.goals.ride.damping_ratio import DampingRatio
from workbench.goals.ride.decay_rate import DecayRate
from workbench.goals.ride.peak_sensitivity import PeakSensitivity
from workbench.handover.report.style import figure_block, svg_figure, table_block
from workbench.plots.design import plot_roots
from workbench.plots.nyquist import plot_nyquist
from workbench.plots.spectra import plot_acceleration, plot_current, plot_gap
from workbench.plots.tradeoff import plot_tradeoff
from workbench.result import figure as digits

ROWS = 31  # of the table behind a spectrum
LISTED_HZ = (0.05, 50.0)  # of the table behind a Nyquist picture


def root_figures(design: Design) -> list[str]:
    """The root map with what the requirements ask of it, and the modes beside it."""
    modes = design.flown.modes
    limit = {v.name: v.limit for v in design.requirements}
    svg = svg_figure(
        lambda ax: plot_roots(modes, damping=limit.get(DampingRatio.kind), decay=limit.get(DecayRate.kind), ax=ax),
        "roots", "Roots of the closed loop in the complex plane", size=(5.4, 4.2),
    )  # fmt: skip
    rows = [
        [m.name, digits(m.frequency_hz), digits(m.damping), digits(m.pole.real), digits(m.pole.imag * m.oscillates)]
        for m in modes
    ]
    columns = ["mode", "frequency [Hz]", "damping", "Re s [1/s]", "Im s [rad/s]"]
    caption = "Every eigenvalue of vehicle, filters and current loops; shaded where roots may not lie."
    return [
        f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>",
        table_block(columns, rows, caption="Modes"),
    ]


def spectrum_figures(design: Design) -> list[str]:
    """Accelerations against the comfort boundary, gaps and currents: those the analysis has figures of."""
    spectra = response_spectra(design.problem.setting, design.gains)
    sets = "at the foremost and hindmost coil sets."
    vertical, lateral = (mask_for(direction) for direction in ("vertical", "lateral"))
    pictures: dict[str, tuple[Callable[[Any], Any], str, str]] = {
        "acceleration_z": (
            lambda ax: plot_acceleration(spectra, "vertical", masks=[vertical], ax=ax),
            "g²/Hz", _against(spectra, "acceleration_z", vertical),
        ),
        "acceleration_y": (
            lambda ax: plot_acceleration(spectra, "lateral", masks=[lateral], ax=ax),
            "g²/Hz", _against(spectra, "acceleration_y", lateral),
        ),
        "gap": (lambda ax: plot_gap(spectra, "vertical", ax=ax), "m²/Hz", f"Change of the vertical gap {sets}"),
        "gap_lateral": (lambda ax: plot_gap(spectra, "lateral", ax=ax), "m²/Hz", f"Change of the lateral gap {sets}"),
        "current": (lambda ax: plot_current(spectra, ax=ax), "1/Hz", f"Control current over main-coil current {sets}"),
    }  # fmt: skip
    measured = design.flown.rms
    return [
        _spectrum(spectra, quantity, draw, caption, unit)
        for quantity, (draw, unit, caption) in pictures.items()
        if any(value is not None for value in measured[quantity].values())
    ]


def nyquist_figures(design: Design) -> list[str]:
    """One picture per group of motion, with the circle of the required peak sensitivity, else of the measured one."""
    asked = {v.limit for v in design.requirements if v.name == PeakSensitivity.kind}
    curves = loop_curves(design.problem.setting, design.gains)
    out = []
    for group in dict.fromkeys(c.group for c in curves):
        own = [c for c in curves if c.group == group]
        peak = design.flown.peak_sensitivity.get("heave_pitch" if group == "heave" else group)
        limit = min(asked) if asked else None if peak is None else peak.upper
        svg = svg_figure(
            lambda ax, c=own, m=limit: plot_nyquist(c, peak_sensitivity=m, ax=ax), f"nyquist-{group.replace('_', '-')}",
            f"Nyquist curves of {group}", size=(5.4, 4.4),
        )  # fmt: skip
        caption = "One current pattern broken, the group's others closed; fainter for negative frequencies."
        if peak is not None:
            at = digits(float(np.round(peak.frequency / (2 * np.pi), 9)))  # the static gain's frequency is a rounding
            caption += (
                f" Circle of radius 1/{digits(limit)} around −1; peak sensitivity {digits(peak.value)} at {at} Hz."
            )
        out.append(figure_block(svg, caption, *_loop_table(own)))
    return out


def trade_off_figures(design: Design, curve: TradeOff | None) -> list[str]:
    """The trade-off with this design on it, where it has been computed."""
    if curve is None or all(cost is None for cost in curve.costs):
        return []
    own = [v for v in design.requirements if v.name == curve.quantity and v.value is not None]
    chosen = (own[0].limit, design.flown.cost) if own and design.flown.cost is not None else None
    svg = svg_figure(
        lambda ax: plot_tradeoff(curve, chosen=chosen, link="#pick-{}", ax=ax),
        "trade-off",
        f"Ride cost over the limit of {curve.quantity}",
    )
    picks = [
        (k, limit, cost, gains)
        for k, (limit, cost, gains) in enumerate(zip(curve.limits, curve.costs, curve.gains, strict=True))
        if cost is not None and gains is not None
    ]
    for k, limit, cost, _ in picks:
        link = f'<a xlink:href="#trade-off-pick-{k}">'
        words = f"{curve.quantity} at {digits(limit)}: cost {digits(cost)}"
        svg = svg.replace(link, f"{link}<title>{escape(words)}</title>")
    rows = [
        [digits(limit), "no design found" if cost is None else digits(cost)]
        for limit, cost in zip(curve.limits, curve.costs, strict=True)
    ]
    caption = f"Least ride cost found for each limit of '{curve.quantity}', every other requirement as it is."
    return [
        figure_block(svg, caption, [f"limit [{curve.unit}]", "cost J"], rows),
        *([_picks(curve, picks)] if picks else []),
    ]


def _picks(curve: TradeOff, picks) -> str:
    """The gains behind each point of a trade-off, shown when the point is picked: a link's target, without a script."""
    unit = "" if curve.unit == "1" else f" {curve.unit}"
    links = " · ".join(f'<a href="#trade-off-pick-{k}">{digits(limit)}{unit}</a>' for k, limit, _, _ in picks)
    shown = "".join(
        f'<div class="pick" id="trade-off-pick-{k}" tabindex="-1">'
        f"<h3>{escape(curve.quantity)} at {digits(limit)}{unit}: cost J = {digits(cost)}</h3>"
        + table_block(["gain", "value", "unit"], [[n, repr(v), GAIN_UNITS[n]] for n, v in gains.as_dict().items()])
        + "</div>"
        for k, limit, cost, gains in picks
    )
    return f'<div class="picks"><p class="quiet">Pick a point, or a limit, to see its gains: {links}</p>{shown}</div>'


def _spectrum(spectra: Spectra, quantity: str, draw: Callable[[Any], Any], caption: str, unit: str) -> str:
    factor = GRAVITY**-2 if unit == "g²/Hz" else 1.0
    values = {place: factor * density for place, density in spectra.of(quantity).items()}
    svg = svg_figure(draw, quantity.replace("_", "-"), f"Power spectral density of {quantity}")
    f = spectra.frequency_hz
    chosen = np.linspace(0, len(f) - 1, ROWS).round().astype(int)
    rows = [[digits(float(f[k])), *(digits(float(v[k])) for v in values.values())] for k in chosen]
    columns = ["frequency [Hz]", *(f"{place} [{unit}]" for place in values)]
    return figure_block(svg, caption, columns, rows, f"{ROWS} of {len(f)} frequencies")


def _against(spectra: Spectra, quantity: str, mask: Mask) -> str:
    """Caption of an acceleration: how it stands to the boundary, and how far the boundary can be trusted."""
    worst = {
        place: worst_ratio((spectra.frequency_hz, density), mask)
        for place, density in spectra.of(quantity).items()
        if density.any()
    }
    if not worst:
        return "This problem does not look at this direction."
    place, found = max(worst.items(), key=lambda item: item[1].ratio)
    trust = "" if mask.verified else " The boundary's numbers were not checked against the standard's text."
    kept, at = "inside" if found.met else "outside", digits(found.frequency_hz)
    return (
        f"Densities are {kept} the boundary of {mask.name}: largest ratio {digits(found.ratio)} at {at} Hz ({place}), "
        f"from {digits(found.low_hz)} to {digits(found.high_hz)} Hz.{trust}"
    )


def _loop_table(curves: Sequence[LoopCurve]) -> tuple[list[str], list[list[str]], str]:
    f = curves[0].frequency_hz
    inside = np.flatnonzero((f >= LISTED_HZ[0]) & (f <= LISTED_HZ[1]))
    chosen = inside[np.linspace(0, len(inside) - 1, ROWS).round().astype(int)]
    columns = ["frequency [Hz]", *(f"{part} L, {c.name}" for c in curves for part in ("Re", "Im"))]
    rows = [
        [digits(float(f[k])), *(digits(float(x)) for c in curves for x in (c.loop[k].real, c.loop[k].imag))]
        for k in chosen
    ]
    return columns, rows, f"{ROWS} of {len(f)} frequencies"

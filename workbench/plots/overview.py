"""A design on one page: roots, Nyquist curves of the tightest group, ride against a boundary, trade-off."""

from workbench.analysis.comfort_summary import mask_for
from workbench.analysis.loop_curve import loop_curves
from workbench.analysis.spectra import response_spectra
from workbench.design.design import Design
from workbench.design.tradeoff import TradeOff
from workbench.goals.ride.damping_ratio import DampingRatio
from workbench.goals.ride.decay_rate import DecayRate
from workbench.goals.ride.peak_sensitivity import PeakSensitivity
from workbench.plots.design import plot_roots
from workbench.plots.nyquist import plot_nyquist
from workbench.plots.spectra import plot_acceleration
from workbench.plots.tradeoff import plot_tradeoff


def plot_overview(design: Design, curve: TradeOff | None = None):
    """Four pictures of a design, the trade-off in place of the vertical spectrum where given; returns the Figure."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 9), layout="constrained")
    axes = figure.subplots(2, 2)
    limits = {r.name: r.limit for r in design.problem.requirements}
    setting, gains = design.problem.setting, design.gains
    plot_roots(
        design.flown.modes, damping=limits.get(DampingRatio.kind), decay=limits.get(DecayRate.kind), ax=axes[0, 0]
    )
    peaks = {group: peak.value for group, peak in design.flown.peak_sensitivity.items() if peak is not None}
    tightest = max(peaks, key=lambda group: peaks[group])
    curves = [c for c in loop_curves(setting, gains) if c.group == tightest or len(peaks) == 1]
    plot_nyquist(curves, peak_sensitivity=limits.get(PeakSensitivity.kind), ax=axes[0, 1])
    spectra = response_spectra(setting, gains)
    plot_acceleration(spectra, "lateral", masks=[mask_for("lateral")], ax=axes[1, 0])
    if curve is None:
        plot_acceleration(spectra, "vertical", masks=[mask_for("vertical")], ax=axes[1, 1])
    else:
        wanted = limits[curve.quantity]
        plot_tradeoff(curve, chosen=(wanted, design.flown.cost), ax=axes[1, 1])
    figure.suptitle(f"{design.problem.title}: cost J = {design.flown.cost:.4g}")
    return figure

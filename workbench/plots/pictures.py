"""Every picture by its name; importing this loads them all."""

from workbench.plots.design import plot_roots
from workbench.plots.flown import plot_flown
from workbench.plots.forces import plot_coefficient, plot_lift, plot_pair, plot_speed
from workbench.plots.goal import plot_design, plot_goals
from workbench.plots.locus import plot_locus, plot_study
from workbench.plots.motor import plot_authority, plot_efficiency, plot_figure, plot_ripple
from workbench.plots.nyquist import plot_nyquist
from workbench.plots.overview import plot_overview
from workbench.plots.propulsion import plot_drag, plot_power, plot_schedule
from workbench.plots.ride import plot_acceleration_psd, plot_roughness, plot_third_octaves
from workbench.plots.schedule import plot_margins_over_speed, plot_scheduled_gains
from workbench.plots.spectra import plot_acceleration, plot_current, plot_gap
from workbench.plots.tradeoff import plot_tradeoff

__all__ = [
    "plot_acceleration", "plot_acceleration_psd", "plot_authority", "plot_coefficient", "plot_current", "plot_design",
    "plot_drag", "plot_efficiency", "plot_figure", "plot_flown", "plot_gap", "plot_goals", "plot_lift", "plot_locus",
    "plot_margins_over_speed", "plot_nyquist", "plot_overview", "plot_pair", "plot_power", "plot_ripple",
    "plot_roots", "plot_roughness", "plot_schedule", "plot_scheduled_gains", "plot_speed", "plot_study",
    "plot_third_octaves", "plot_tradeoff",
]  # fmt: skip

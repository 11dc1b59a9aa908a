"""Figures A-2 to A-9 of the report: what a coil feels, against speed, height, wall gap, roll and control current.

    speed_curves, corner_curves, pair_curves, lift_curves   numbers, as records of arrays
    plot_speed, plot_coefficient, plot_pair, plot_lift      Axes in, Axes out

The report's figures lost their axes; the ranges are ours. Coefficients are per ampere-turn squared at infinite speed,
[N/kA²] and [N m/kA²]; Figure A-9 holds f_L/f_L∞ = 0.8380 at every height, which the report does not say it did.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from workbench.errors import unknown_name
from workbench.physics.coils import REPORT_PLATE, Conductor, WireLoop, plane_forces
from workbench.physics.forces.corner import pair_coefficients
from workbench.physics.forces.energy import REPORT_COILS, CoilSet
from workbench.physics.forces.operating import REPORT_GAP, REPORT_SPEED, law_at

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COEFFICIENTS = {
    "lift": (0, "lift coefficient [N/kA²]"),
    "lateral": (1, "lateral force coefficient [N/kA²]"),
    "moment": (2, "roll moment coefficient [N m/kA²]"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedCurves:
    """Figure A-2. speed : (n,) [m/s]; lift, drag : (n,) [N/kA²]; lift_to_drag, lift_ratio : (n,) [1]."""

    speed: np.ndarray
    lift: np.ndarray
    drag: np.ndarray
    lift_to_drag: np.ndarray
    lift_ratio: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class Curves:
    """One quantity over an abscissa, a curve per parameter value.

    abscissa : (n,); parameter : (m,); values : (m, n); the names carry symbol and unit.
    """

    abscissa: np.ndarray
    parameter: np.ndarray
    values: np.ndarray
    abscissa_name: str
    parameter_name: str
    values_name: str


def speed_curves(
    speeds=None, gap: float = REPORT_GAP, coils: CoilSet = REPORT_COILS, conductor: Conductor = REPORT_PLATE
) -> SpeedCurves:
    """Lift and drag of the main coil over an endless plate against speed (Figure A-2).

    Parameters
    ----------
    speeds : (n,) array_like, optional
        [m/s], positive; 1 … 150 m/s when left out.
    gap : float
        Height [m].
    """
    speeds = np.geomspace(1.0, 150.0, 40) if speeds is None else np.asarray(speeds, dtype=float)
    found = [plane_forces(coils.width, coils.length, gap, float(v), conductor, accuracy=1e-6) for v in speeds]
    return SpeedCurves(
        speed=speeds,
        lift=np.array([1e6 * f.lift for f in found]),
        drag=np.array([1e6 * f.drag for f in found]),
        lift_to_drag=np.array([f.lift_to_drag for f in found]),
        lift_ratio=np.array([f.lift_ratio for f in found]),
    )


def corner_curves(quantity: str, heights=None, gaps_lateral=None, roll: float = 0.0) -> Curves:
    """Coefficient of one coil over the L-corner against height, a curve per wall gap (Figures A-3 to A-5).

    Parameters
    ----------
    quantity : "lift", "lateral" or "moment"
    heights, gaps_lateral : (n,) and (m,) array_like, optional
        h and h' [m].
    roll : float
        [rad].
    """
    return pair_curves(quantity, 0.0, heights, gaps_lateral, roll)


def pair_curves(quantity: str, separation: float, heights=None, gaps_lateral=None, roll: float = 0.0) -> Curves:
    """Coefficient of one coil in the images of an equal second one (Figures A-6 to A-8).

    Parameters
    ----------
    separation : float
        d [m]: the second coil is d below the first, above if negative, the first itself if zero.
    quantity, heights, gaps_lateral, roll
        As in `corner_curves`; the pose is the first coil's.
    """
    if quantity not in COEFFICIENTS:
        raise unknown_name("coefficient", str(quantity), COEFFICIENTS)
    heights = (
        np.linspace(max(0.15, 0.05 + separation), 0.5, 36) if heights is None else np.asarray(heights, dtype=float)
    )
    gaps = np.array([0.2, 0.3, 0.4, 0.6]) if gaps_lateral is None else np.asarray(gaps_lateral, dtype=float)
    index, name = COEFFICIENTS[quantity]
    coil = WireLoop.rectangle(REPORT_COILS.width, REPORT_COILS.length)
    other = coil.placed((0.0, 0.0, -separation))
    values = pair_coefficients(coil, other, REPORT_COILS.width, heights[None, :], gaps[:, None], roll)[index]
    return Curves(
        abscissa=heights,
        parameter=gaps,
        values=1e6 * values,
        abscissa_name="height h [m]",
        parameter_name="h' [m]",
        values_name=name,
    )


def lift_curves(heights=None, alphas=None) -> Curves:
    """Lift of one coil set at 134 m/s against height, a curve per control current (Figure A-9).

    Parameters
    ----------
    heights : (n,) array_like, optional
        h [m].
    alphas : (m,) array_like, optional
        Control current over main-coil current [1].
    """
    heights = np.linspace(0.18, 0.5, 33) if heights is None else np.asarray(heights, dtype=float)
    alphas = np.linspace(-0.3, 0.3, 7) if alphas is None else np.asarray(alphas, dtype=float)
    law = law_at(REPORT_SPEED, REPORT_GAP, REPORT_GAP, "report")
    lift, _, _ = law.forces(heights[None, :] - REPORT_GAP, 0.0, 0.0, alphas[:, None])
    return Curves(
        abscissa=heights,
        parameter=alphas,
        values=lift,
        abscissa_name="height h [m]",
        parameter_name="α",
        values_name="lift per coil set [N]",
    )


def plot_speed(curves: SpeedCurves, *, ax: "Axes | None" = None) -> "Axes":
    """Lift and drag coefficients against speed; lift over drag on a second ordinate (Figure A-2)."""
    ax = _axes(ax)
    ax.plot(curves.speed, curves.lift, label="lift")
    ax.plot(curves.speed, curves.drag, label="drag")
    ax.set(xlabel="speed [m/s]", ylabel="coefficient [N/kA²]", title="Coil over an endless plate (Figure A-2)")
    ax.set_xlim(left=0)
    ax.set_ylim(bottom=0)
    right = ax.twinx()
    right.plot(curves.speed, curves.lift_to_drag, color="C2", linestyle="--", label="lift over drag")
    right.set_ylabel("lift over drag")
    right.set_ylim(bottom=0)
    lines = [*ax.get_lines(), *right.get_lines()]
    ax.legend(lines, [str(line.get_label()) for line in lines], loc="center right")
    ax.grid(alpha=0.3)
    return ax


def plot_coefficient(curves: Curves, *, ax: "Axes | None" = None, title: str = "") -> "Axes":
    """A family of curves with its legend (Figures A-3 to A-8)."""
    ax = _axes(ax)
    for value, line in zip(curves.parameter, curves.values, strict=True):
        ax.plot(curves.abscissa, line, label=f"{value:g}")
    ax.set(xlabel=curves.abscissa_name, ylabel=curves.values_name, title=title)
    ax.legend(title=curves.parameter_name)
    ax.grid(alpha=0.3)
    return ax


def plot_pair(quantity: str, *, separation: float = 0.1, ax: "Axes | None" = None) -> "Axes":
    """A coefficient at h' = 0.3 m in the images of the coil itself, and of a second one `separation` [m] away."""
    ax = _axes(ax)
    for d, label in (
        (0.0, "of itself"),
        (separation, f"of one {separation:g} m below"),
        (-separation, f"of one {separation:g} m above"),
    ):
        curves = pair_curves(quantity, d, gaps_lateral=[REPORT_GAP])
        ax.plot(curves.abscissa, curves.values[0], label=label)
    ax.set(
        xlabel="height h [m]",
        ylabel=COEFFICIENTS[quantity][1],
        title="Coil pair over the L-corner (Figures A-6 to A-8)",
    )
    ax.legend(title="images")
    ax.grid(alpha=0.3)
    return ax


def plot_lift(curves: Curves, *, weight_share: float | None = None, ax: "Axes | None" = None) -> "Axes":
    """Lift of a coil set against height (Figure A-9), with the weight one set carries [N] if given."""
    ax = plot_coefficient(curves, ax=ax, title="Lift of one coil set at 134 m/s (Figure A-9)")
    if weight_share is not None:
        ax.axhline(weight_share, color="0.4", linestyle=":", label="a quarter of the weight")
        ax.legend(title=curves.parameter_name)
    ax.set_ylim(bottom=0)
    return ax


def _axes(ax: "Axes | None") -> "Axes":
    import matplotlib.pyplot as plt

    return plt.subplots(layout="constrained")[1] if ax is None else ax

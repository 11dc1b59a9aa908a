"""Picture of a design's roots with the region they must stay in."""

from collections.abc import Sequence

import numpy as np

from workbench.analysis.mode import Mode

MARKS = {"heave": "o", "pitch": "s", "sway": "^", "roll": "D", "yaw": "v", "filter": "x"}
COLOURS = (0, 1, 2, 4, 5, 0)  # of the cycle; the fourth, red, marks limits, and filters have a mark of their own
NEAR = 2.5  # stable roots are drawn up to this many times the largest oscillation; the others are counted


def plot_roots(modes: Sequence[Mode], *, damping: float | None = None, decay: float | None = None, ax=None):
    """Roots in the upper half plane by name of mode, with the least damping and decay asked for; returns the Axes.

    damping : ratio; decay : [1/s]; roots may not lie where it is shaded
    Stable roots far beyond the oscillations are counted in the label below; an unstable one is drawn wherever it is.
    """
    if ax is None:
        import matplotlib.pyplot as plt

        ax = plt.subplots()[1]
    reach = _reach(modes)
    shown = [m for m in modes if m.pole.real >= 0 or abs(m.pole) <= reach]
    for number, name in zip(COLOURS, dict.fromkeys(m.name for m in modes), strict=False):
        poles = np.array([m.pole for m in shown if m.name == name])
        if len(poles):
            ax.plot(poles.real, poles.imag, MARKS.get(name, "o"), color=f"C{number}", mfc="none", label=name)
    inside = [m.pole for m in shown]
    top = 1.4 * max((p.imag for p in inside), default=1.0) or 1.0  # room for the legend
    left = 1.1 * min((p.real for p in inside), default=-1.0)
    right = max(0.08 * abs(left), 1.15 * max((p.real for p in inside), default=0.0))
    height = np.linspace(0.0, top, 101)
    edge = np.full_like(height, right)
    if damping is not None and 0 < damping < 1:
        ray = -height * damping / np.sqrt(1 - damping**2)
        edge = np.minimum(edge, ray)
        ax.plot(ray, height, "--", color="C3", lw=1, label=f"damping {damping:g}")
    if decay is not None:
        edge = np.minimum(edge, -decay)
        ax.axvline(-decay, color="C3", ls=":", lw=1, label=f"decay {decay:g} 1/s")
    ax.fill_betweenx(height, edge, right, color="C3", alpha=0.12, lw=0)
    ax.axvline(0.0, color=ax.spines["left"].get_edgecolor(), lw=0.6)
    far = len(modes) - len(shown)
    label = "Re s [1/s]" + (f"   ({far} stable roots beyond {reach:.3g} rad/s not shown)" if far else "")
    ax.set(xlim=(left, right), ylim=(0 - 0.03 * top, top), xlabel=label, ylabel="Im s [rad/s]", title="Roots")
    ax.grid(True, lw=0.5, alpha=0.4)
    ax.legend(frameon=False, loc="upper left", ncols=2)
    return ax


def _reach(modes: Sequence[Mode]) -> float:
    """Modulus up to which roots are drawn."""
    sizes = np.sort([abs(m.pole) for m in modes])
    if len(sizes) == 0:
        return 1.0
    slow = [abs(m.pole) for m in modes if m.oscillates and m.damping < 0.85]  # what the picture is about
    return float(NEAR * max(slow)) if slow else float(sizes[len(sizes) // 2])

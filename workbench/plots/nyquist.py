"""Picture of Nyquist curves, and the circle that a peak sensitivity keeps clear."""

from collections.abc import Sequence

import numpy as np

from workbench.analysis.loop_curve import LoopCurve

WINDOW = 3.5  # half the width of the picture, around −1


def plot_nyquist(curves: Sequence[LoopCurve], *, peak_sensitivity: float | None = None, ax=None):
    """Curves of one group, fainter for negative frequencies, with −1 and the circle; returns the Axes.

    peak_sensitivity : M; the circle around −1 has the radius 1/M
    """
    if ax is None:
        import matplotlib.pyplot as plt

        ax = plt.subplots()[1]
    for number, curve in enumerate(curves):
        ax.plot(curve.loop.real, curve.loop.imag, color=f"C{number}", label=curve.name)
        ax.plot(curve.loop.real, -curve.loop.imag, color=f"C{number}", lw=0.7, alpha=0.4)
    ax.plot([-1], [0], "+", color="C3", ms=9)
    if peak_sensitivity is not None:
        angle = np.linspace(0, 2 * np.pi, 181)
        r = 1 / peak_sensitivity
        ax.plot(
            -1 + r * np.cos(angle), r * np.sin(angle), "--", color="C3", label=f"sensitivity {peak_sensitivity:.4g}"
        )
    ax.set_aspect("equal", adjustable="box")
    half = WINDOW * 0.75
    ax.set(xlim=(-1 - WINDOW, -1 + WINDOW), ylim=(-half, half), xlabel="Re L [1]", ylabel="Im L [1]")
    ax.set_title(f"Loops of {curves[0].group.replace('_', ', ')}" if curves else "Loops")
    ax.grid(True, lw=0.5, alpha=0.4)
    ax.legend(frameon=False, loc="lower left")
    return ax

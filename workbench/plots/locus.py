"""Pictures of root loci and of the report's Figures C-1 and C-2."""

import numpy as np

from workbench.control.loop.locus import Locus, ParameterStudy


def plot_locus(locus: Locus, *, ax=None):
    """Roots in the complex plane, first value marked by crosses, last by circles; returns the Axes."""
    import matplotlib.pyplot as plt

    ax = plt.subplots()[1] if ax is None else ax
    for branch in locus.roots.T:
        ax.plot(branch.real, branch.imag, lw=1, color="tab:blue")
    ax.plot(locus.roots[0].real, locus.roots[0].imag, "x", color="tab:gray", label=f"{locus.values[0]:.3g}")
    ax.plot(
        locus.roots[-1].real, locus.roots[-1].imag, "o", mfc="none", color="tab:red", label=f"{locus.values[-1]:.3g}"
    )
    ax.axvline(0.0, color="black", lw=0.5)
    ax.axhline(0.0, color="black", lw=0.5)
    ax.set(xlabel="Re s [rad/s]", ylabel="Im s [rad/s]", title=f"{locus.part}: roots over {' = '.join(locus.names)}")
    ax.legend(title=" = ".join(locus.names))
    return ax


def plot_study(study: ParameterStudy, *, ax=None):
    """Damping ratio over frequency of every oscillating root, as in Figures C-1 and C-2; returns the Axes.

    One colour per value of the second gain; larger marks for larger values of the first.
    """
    import matplotlib.pyplot as plt

    ax = plt.subplots()[1] if ax is None else ax
    sizes = np.linspace(4, 30, len(study.first))
    colours = plt.get_cmap("viridis")(np.linspace(0.0, 0.9, len(study.second)))
    for j, value in enumerate(study.second):
        marks = [(*mode, size) for i, size in enumerate(sizes) for mode in study.modes(i, j)]
        if marks:
            frequency, damping, size = np.array(marks).T
            ax.scatter(frequency, damping, s=size, color=colours[j], label=f"{value:.3g}")
    first = " = ".join(study.first_names)
    ax.set(xlabel="undamped frequency [Hz]", ylabel="damping ratio [1]")
    ax.set_title(f"{study.part}: {first} from {study.first[0]:.3g} to {study.first[-1]:.3g} (larger marks)")
    ax.legend(title=" = ".join(study.second_names))
    return ax

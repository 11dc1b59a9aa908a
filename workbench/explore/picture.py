"""The explorer's picture: six panels that are drawn once and then only change their lines.

    Snapshot --set data of lines--> restored background + lines --> PNG

Redrawing axes with logarithmic ticks takes a quarter of a second; a background that is kept, and lines drawn over it,
a tenth of that. Axes move only when a curve leaves them.
"""

from io import BytesIO

import numpy as np

from workbench.analysis.comfort_summary import mask_for
from workbench.constants import GRAVITY
from workbench.explore.snapshot import Snapshot

SIZE = (11.4, 6.4)  # inches, at
DPI = 84
DECADES = 5.0  # of density shown below the highest value
FRAMES = {
    "locus": "roots, and as {moved} moves ±50 %", "nyquist": "loops, one pattern broken",
    "acceleration_z": "vertical acceleration [g²/Hz]", "acceleration_y": "lateral acceleration [g²/Hz]",
    "gap": "gap changes [m²/Hz]", "current": "currents over main current [1/Hz]",
}  # fmt: skip


class Picture:
    """The figure of one problem; `png(snapshot, pinned)` is the picture of a position of the sliders."""

    def __init__(self) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.figure = Figure(figsize=SIZE, dpi=DPI, facecolor="white")  # notebooks make it transparent
        self.canvas = FigureCanvasAgg(self.figure)
        axes = self.figure.subplots(2, 3)
        self.figure.subplots_adjust(left=0.055, right=0.985, bottom=0.085, top=0.94, wspace=0.24, hspace=0.34)
        self.axes = dict(zip(FRAMES, axes.ravel(), strict=True))
        self._lines: dict[tuple[str, str], object] = {}
        self._background = None
        for name, ax in self.axes.items():
            ax.set_title(FRAMES[name].format(moved="a gain"), fontsize=9)
            ax.tick_params(labelsize=8)
            ax.grid(True, lw=0.4, alpha=0.5)
        for name in ("acceleration_z", "acceleration_y", "gap", "current"):
            self.axes[name].set(xscale="log", yscale="log", xlim=(0.03, 30.0))
            self.axes[name].set_xlabel("frequency [Hz]", fontsize=8)
        for name, direction in (("acceleration_z", "vertical"), ("acceleration_y", "lateral")):
            mask = mask_for(direction)
            self.axes[name].plot(mask.frequency_hz, mask.g2_per_hz, color="C3", lw=1.2, label="comfort boundary")
        ring = np.exp(1j * np.linspace(0, 2 * np.pi, 181)) / 2 - 1
        self.axes["nyquist"].plot(ring.real, ring.imag, color="C3", lw=1, label="sensitivity 2")
        self.axes["nyquist"].plot([-1], [0], "+", color="C3")
        self.axes["nyquist"].set(xlim=(-4, 2), ylim=(-3, 3), aspect="equal")
        self.axes["locus"].axvline(0.0, color="black", lw=0.6)

    def png(self, now: Snapshot, pinned: Snapshot | None = None) -> bytes:
        """The picture as PNG; the pinned design's curves are dashed behind."""
        wanted = _curves(now)
        if pinned is not None:
            wanted |= {(frame, f"pinned {label}"): xy for (frame, label), xy in _curves(pinned).items()}
        fresh = self._place(wanted)
        titles = {"locus": FRAMES["locus"].format(moved=now.moved)}
        for frame, text in titles.items():
            if self.axes[frame].get_title() != text:
                self.axes[frame].set_title(text, fontsize=9)
                fresh = True
        if fresh or self._background is None:
            self._legends()
            self.canvas.draw()
            self._background = self.canvas.copy_from_bbox(self.figure.bbox)
        self.canvas.restore_region(self._background)
        for line in self._lines.values():
            if line.axes.get_visible():
                line.axes.draw_artist(line)
        stream = BytesIO()
        _image(self.canvas).save(stream, format="png", compress_level=1)
        return stream.getvalue()

    def _place(self, wanted) -> bool:
        """Puts curves into lines; whether the background must be drawn anew."""
        fresh = wanted.keys() != self._lines.keys()
        for key in [k for k in self._lines if k not in wanted]:
            self._lines.pop(key).remove()
        for key, (x, y) in wanted.items():
            if key not in self._lines:
                self._lines[key] = self.axes[key[0]].plot(x, y, animated=True, **_style(*key))[0]
            else:
                self._lines[key].set_data(x, y)
        for frame, ax in self.axes.items():
            ax.set_visible(any(f == frame for f, _ in wanted))
        for frame in ("locus", "acceleration_z", "acceleration_y", "gap", "current"):
            mine = {label: xy for (f, label), xy in wanted.items() if f == frame and not label.startswith("sweep")}
            fresh |= bool(mine) and self._fit(frame, mine)
        return fresh

    def _fit(self, frame: str, curves) -> bool:
        """Moves a frame's limits if the curves leave them or have shrunk to less than a third; whether it did."""
        ax = self.axes[frame]
        if frame == "locus":
            reach = _reach(np.concatenate([x + 1j * y for x, y in curves.values()]))
            left, right = ax.get_xlim()
            if 0.5 * -left <= reach <= -left and right > 0:
                return False
            ax.set(xlim=(-1.3 * reach, 0.3 * reach), ylim=(-0.04 * reach, 1.3 * reach))
            return True
        top = np.log10(max(float(y.max()) for _, y in curves.values()))
        if frame.startswith("acceleration"):
            top = max(top, np.log10(ax.lines[0].get_ydata().max()))
        if np.log10(ax.get_ylim()[1]) - 1.5 <= top <= np.log10(ax.get_ylim()[1]):
            return False
        ax.set_ylim(10 ** (top + 0.5 - DECADES), 10 ** (top + 0.5))
        return True

    def _legends(self) -> None:
        for frame, ax in self.axes.items():
            named = [line for line in ax.lines if not line.get_label().startswith("_")]
            if named and frame != "locus":
                place = "upper right" if frame == "nyquist" else "lower left"
                ax.legend(handles=named, fontsize=6, frameon=frame == "nyquist", framealpha=0.7, loc=place)


def _curves(shot: Snapshot):
    """(frame, label) to x and y."""
    poles = shot.analysis.poles[shot.analysis.poles.imag >= -1e-9]
    swept = shot.locus[shot.locus.imag >= -1e-9]
    out = {("locus", "sweep"): (swept.real, swept.imag), ("locus", "roots"): (poles.real, poles.imag)}
    for curve in shot.loops:
        out["nyquist", f"{curve.group.replace('_', '/')}: {curve.name.removeprefix('front and rear ')}"] = (
            curve.loop.real,
            curve.loop.imag,
        )
    if shot.spectra is not None:
        f = shot.spectra.frequency_hz
        for (quantity, place), density in shot.spectra.density.items():
            frame = "gap" if quantity == "gap_lateral" else quantity
            label = f"lateral {place}" if quantity == "gap_lateral" else place
            scale = GRAVITY**-2 if quantity.startswith("acceleration") else 1.0
            if density.max() > 0:
                out[frame, label] = (f, np.maximum(density * scale, 1e-300))
    return out


def _style(frame: str, label: str) -> dict:
    """How a line is drawn."""
    if label.startswith("pinned "):
        label = label.removeprefix("pinned ")
        kept = _style(frame, label)
        return {**kept, "label": f"_{label}", "alpha": 0.45, "ls": "--" if kept.get("ls") != "" else "", "zorder": 1}
    if frame == "locus":
        if label == "sweep":
            return {"ls": "", "marker": ".", "ms": 2.5, "color": "0.6", "label": "_sweep"}
        return {"ls": "", "marker": "x", "ms": 6, "mew": 1.6, "color": "C0", "label": "_roots"}
    order = ["cg", "front", "rear", "lateral front", "lateral rear"]
    colour = {"color": f"C{(0, 1, 2, 4, 5)[order.index(label)]}"} if label in order else {}
    return {"lw": 1.3, "label": label, **colour}


def _reach(poles: np.ndarray) -> float:
    """How far the picture of the roots goes: to the fastest oscillation."""
    oscillating = poles[poles.imag > 0.5 * np.abs(poles)]
    return float(np.abs(oscillating if len(oscillating) else poles).max()) or 1.0


def _image(canvas):
    from PIL import Image

    return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")

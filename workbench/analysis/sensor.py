"""What sensor errors do to the gaps: a constant bias of the accelerometers, white noise of all sensors.

bias --DC gain, worst signs--> static gap change;   noise --Lyapunov equation--> rms gap and current
"""

import numpy as np

from workbench.analysis.setting import Setting
from workbench.control.loop import Subject
from workbench.lti import Plant
from workbench.lti.signals import numbered
from workbench.lti.variance import stationary

Loops = list[tuple[Subject, Plant]]


def static_errors(setting: Setting, loops: Loops) -> dict[str, float | None]:
    """Largest static change of a gap over all signs of the biases [m]: sum of absolute DC gains × bias."""
    n = setting.law.count
    sensors = [f"error_{name}" for name in numbered("acceleration_z", n) + numbered("acceleration_y", n)]
    out: dict[str, float | None] = {}
    for kind in ("gap", "gap_lateral"):
        if _absent(kind, loops):
            out[kind] = None
            continue
        total = np.zeros((n, 2 * n))
        for _, closed in loops:
            seen = closed.select(inputs=sensors, outputs=numbered(kind, n))
            total += seen.D - seen.C @ np.linalg.solve(seen.A, seen.B)
        out[kind] = float(np.abs(total).sum(axis=1).max() * setting.accelerometer_bias)
    return out


def noise_rms(setting: Setting, loops: Loops) -> dict[str, float | None]:
    """Rms of gap, gap_lateral [m] and current [1] at the worst coil set from white sensor noise alone.

    None where the figure is infinite: without current-loop lag white noise passes straight to the currents.
    """
    n = setting.law.count
    gap, acceleration = setting.sensor_noise
    # a one-sided density S per hertz is white noise of two-sided intensity S²/2
    density = np.repeat([gap, gap, acceleration, acceleration], n) / np.sqrt(2.0)
    inputs = [f"error_{name}" for name in setting.law.sensors]
    squares = {kind: np.zeros(n) for kind in ("gap", "gap_lateral", "current")}
    for _, closed in loops:
        seen = closed.select(inputs=inputs)
        B = seen.B * density
        state = stationary(seen.A, B, correlation=np.eye(len(density))) if B.any() else None
        for kind, total in squares.items():
            rows = seen.index("outputs", numbered(kind, n))
            direct = (seen.D[rows] * density).any()
            total += np.inf if direct else 0.0 if state is None else state.mean_squares(seen.C[rows])[0]
    rms = {kind: float(np.sqrt(max(total.max(), 0.0))) for kind, total in squares.items()}
    return {kind: None if _absent(kind, loops) or np.isinf(value) else value for kind, value in rms.items()}


def _absent(kind: str, loops: Loops) -> bool:
    """Whether no group moves sideways, so that the lateral gap is the guideway's own deviation."""
    return kind == "gap_lateral" and all("Y" not in s.coordinates for s, _ in loops)

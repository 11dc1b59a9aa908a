"""Tables that are straight lines on log-log paper: y = y_k (x/x_k)^m_k between two neighbouring points.

    points --LogLog--> value(x)        elementwise
                   --> integral(a, b)  exact, segment by segment

Spectra and comfort boundaries are read from diagrams with two logarithmic axes; this is the curve a ruler draws there.
Beyond the first and last point the end segments continue; whoever owns the table decides whether that may be asked.
"""

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from workbench.errors import InputError


@dataclass(frozen=True, slots=True)
class LogLog:
    """A piecewise power law through points.

    Parameters
    ----------
    x : (k,) positive, strictly increasing, k ≥ 2
    y : (k,) positive

    Raises
    ------
    InputError
        If the points do not describe such a curve.
    """

    x: tuple[float, ...]
    y: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "x", tuple(float(value) for value in self.x))
        object.__setattr__(self, "y", tuple(float(value) for value in self.y))
        if len(self.x) != len(self.y) or len(self.x) < 2:
            raise InputError(
                f"a log-log table needs as many values as points, and at least two; got {len(self.x)} points and "
                f"{len(self.y)} values. Give one value per point."
            )
        if not all(0 < low < high < np.inf for low, high in zip(self.x, self.x[1:], strict=False)):
            raise InputError(
                f"the points of a log-log table must be positive, finite and increasing; got {_short(self.x)}. "
                "Sort them and drop repeats and zero."
            )
        if not all(0 < value < np.inf for value in self.y):
            raise InputError(
                f"the values of a log-log table must be positive and finite; got {_short(self.y)}. "
                "A zero has no logarithm: leave the point out or give a small value."
            )

    def value(self, x):
        """The curve at x, elementwise (scalar, array, DM or SX); beyond the ends the end segments continue."""
        if isinstance(x, ca.SX | ca.MX | ca.DM):
            return _curve(self.x, self.y)(x)
        points = np.asarray(x, float)
        numbers = np.array(_curve(self.x, self.y)(points.reshape(1, -1))).reshape(points.shape)
        return float(numbers) if points.ndim == 0 else numbers

    def integral(self, low: float, high: float) -> float:
        """∫ y dx from low to high, exactly, 0 < low ≤ high."""
        edges = np.array([low, *(point for point in self.x if low < point < high), high])
        left, right = edges[:-1], edges[1:]
        slope = np.diff(np.log(self.y)) / np.diff(np.log(self.x))
        segment = np.clip(np.searchsorted(self.x, np.sqrt(left * right)) - 1, 0, len(slope) - 1)
        span = np.log(right / left)
        power = (
            slope[segment] + 1
        ) * span  # ∫ = y_left left (e^power - 1)/(slope + 1) = y_left left span expm1(power)/power
        growth = np.divide(np.expm1(power), power, out=np.ones_like(power), where=power != 0)
        return float(np.sum(self.value(left) * left * span * growth))


@lru_cache(maxsize=64)
def _curve(x: tuple[float, ...], y: tuple[float, ...]) -> ca.Function:
    point = ca.SX.sym("x")
    return ca.Function("log_log", [point], [ca.exp(ca.pw_lin(ca.log(point), np.log(x), np.log(y)))])


def _short(values: tuple[float, ...]) -> str:
    shown = ", ".join(f"{value:g}" for value in values[:6])
    return f"({shown}, …)" if len(values) > 6 else f"({shown})"

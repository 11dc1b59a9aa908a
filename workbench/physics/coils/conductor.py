"""A conducting plate passed at constant speed: how much of a plane wave of flux it throws back.

    kx, ky, speed, Conductor  -->  reflection  -->  (Re R, Im R);  R = 1: perfect conductor, R = 0: nothing there

The wave exp(i(kx x + ky y) - k z), k² = kx² + ky², moves along x. Re R lifts, Im R drags. All formulas elementwise for
numbers or SX; complex numbers are pairs of reals, so that CasADi can differentiate them.
"""

import math
from dataclasses import dataclass

import casadi as ca

from workbench.constants import MU_0
from workbench.errors import InputError, unknown_name

COPPER_STANDARD = 58.0e6  # 100 % IACS [S/m]
MODELS = ("thin", "slab", "half_space")


@dataclass(frozen=True, slots=True, kw_only=True)
class Conductor:
    """A plate of uniform conductivity, not magnetic, without edges.

    Parameters
    ----------
    thickness : float
        [m]; not used by the half space.
    conductivity : float
        [S/m].
    model : "thin", "slab" or "half_space"
        Sheet of negligible thickness with the same surface conductance; plate of its thickness; plate without a bottom.
    """

    thickness: float
    conductivity: float
    model: str = "slab"

    def __post_init__(self) -> None:
        if self.model not in MODELS:
            raise unknown_name("conductor model", str(self.model), MODELS)
        for name, unit in (("thickness", "m"), ("conductivity", "S/m")):
            value = getattr(self, name)
            if not 0 < value < math.inf:
                raise InputError(
                    f"the guideway's {name} must be positive and finite; got {value!r} {unit}. "
                    "The report's plate is 0.0254 m of aluminium 1100-H14, 3.4e7 S/m."
                )

    @property
    def characteristic_speed(self) -> float:
        """w = 2/(μ0 σ t) [m/s]: the speed at which flux sinks into the thin sheet; its lift-to-drag ratio is v/w."""
        return 2 / (MU_0 * self.conductivity * self.thickness)


REPORT_PLATE = Conductor(thickness=0.0254, conductivity=0.59 * COPPER_STANDARD)
"""2.54 cm of aluminium 1100-H14 (report, A.3), 59 % IACS (handbook value of 1100; the report prints "
"no conductivity)."""


def reflection(kx, ky, speed, thickness, conductivity, model: str):
    """Reflection coefficient R of the plate for one plane wave.

    Parameters
    ----------
    kx, ky : scalar, DM or SX, elementwise
        Wave numbers along and across the track [1/m]; kx > 0.
    speed, thickness, conductivity : same
        [m/s], [m], [S/m].
    model : str
        One of MODELS.

    Returns
    -------
    (same, same)
        Re R and Im R [1].

    Source: J. R. Reitz, J. Appl. Phys. 41 (1970) 2067 (thin sheet); J. R. Reitz, L. C. Davis, J. Appl. Phys. 43 (1972)
    1547 (slab), here from the continuity of flux and field at both faces.
    """
    if model == "thin":
        return _thin(kx, ky, speed, 2 / (MU_0 * conductivity * thickness))
    k2 = kx**2 + ky**2
    s = MU_0 * conductivity * speed * kx  # b² = k² + i s inside the metal
    b_re = ca.sqrt((ca.sqrt(k2**2 + s**2) + k2) / 2)
    b = b_re, s / (2 * b_re)
    k = ca.sqrt(k2)
    plus = b[0] + k, b[1]  # b + k; b - k = i s/(b + k) without cancellation
    minus = _quotient((0.0, s), plus)
    if model == "half_space":
        return _quotient(minus, plus)
    decay = ca.exp(-2 * b[0] * thickness)
    echo = decay * ca.cos(2 * b[1] * thickness), -decay * ca.sin(2 * b[1] * thickness)
    above = _product((0.0, s), (1 - echo[0], -echo[1]))
    first, second = _product(plus, plus), _product(_product(minus, minus), echo)
    return _quotient(above, (first[0] - second[0], first[1] - second[1]))


def _thin(kx, ky, speed, w):
    """R = kx v / (kx v - i k w)."""
    wave, sink = kx * speed, ca.sqrt(kx**2 + ky**2) * w
    size = wave**2 + sink**2
    return wave**2 / size, wave * sink / size


def _product(a, b):
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def _quotient(a, b):
    size = b[0] ** 2 + b[1] ** 2
    return (a[0] * b[0] + a[1] * b[1]) / size, (a[1] * b[0] - a[0] * b[1]) / size

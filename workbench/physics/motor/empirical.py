"""The report's empirical expressions for forces and torques, fitted to our amplitudes, with their true errors.

    amplitude over gap      ~  F_1 e^{−αy + βy²}            least squares of the logarithm over 15 … 45 cm
    amplitude over lateral  ~  c_1 x + c_3 x³  or  c_0 + c_2 x² + c_4 x⁴   through x = 0, 10 and 20 cm

The polynomials have as many constants as the report has points, so they pass through them whatever the motor does; only
the error between the points says anything, and that is what is given here. Source: report, Appendix F, 5.4.1.
"""

from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.physics.motor.pose import COMPONENTS, amplitudes
from workbench.physics.motor.winding import REPORT_GAP
from workbench.result import Result, Row

GAPS = np.linspace(0.15, 0.45, 61)  # [m], 5 mm apart
OFFSETS = np.linspace(0.0, 0.20, 41)  # [m], 5 mm apart
ODD = ("F_x", "T_y", "T_z")  # of the lateral displacement; the others are even


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Fit(Result):
    """A fitted expression and how far it is from the amplitudes it stands for.

    component : F_x … T_z
    constants : of the expression, in the order of the module's head (F_1, α, β; c_1, c_3; c_0, c_2, c_4), SI units
    worst : largest error over the range, relative to the amplitude at the same place
    worst_without_square : the same of the pure exponential F_0 e^{−γy}; NaN for the lateral expressions
    """

    component: str
    constants: tuple[float, ...]
    worst: float
    worst_without_square: float

    def rows(self) -> list[Row]:
        constants = [(f"constant {i + 1} of {self.component}", value, "") for i, value in enumerate(self.constants)]
        return [*constants, ("worst error", self.worst, ""), ("worst error of e^-γy", self.worst_without_square, "")]


def fit_over_gap(component: str, lateral: float = 0.0) -> Fit:
    """F_1 e^{−αy + βy²} for the amplitudes at y = 15 … 45 cm, at lateral displacement x [m].

    Raises
    ------
    InputError
        If the component is unknown or vanishes there by symmetry.

    Source: report, Appendix F, 5.4.1, first part.
    """
    index = _index(component)
    values = _over(1, GAPS, (lateral, 0.0))[:, index]
    if not np.all(values > 1e-9 * values.max()) or (component in ODD and lateral == 0.0):
        raise InputError(f"{component} vanishes at x = {lateral!r} m by symmetry; fit it beside the centre line.")
    beta, slope, constant = np.polyfit(GAPS, np.log(values), 2)
    fitted = np.exp(np.polyval((beta, slope, constant), GAPS))
    pure = np.exp(np.polyval(np.polyfit(GAPS, np.log(values), 1), GAPS))
    return Fit(
        component=component,
        constants=(float(np.exp(constant)), float(-slope), float(beta)),
        worst=float(np.max(np.abs(fitted / values - 1))),
        worst_without_square=float(np.max(np.abs(pure / values - 1))),
    )


def fit_over_lateral(component: str, gap: float = REPORT_GAP) -> Fit:
    """Odd or even polynomial through the amplitudes at x = 0, 10 and 20 cm, at a gap y [m].

    Source: report, Appendix F, 5.4.1, second part.
    """
    values = _over(0, OFFSETS, (gap, 0.0))[:, _index(component)]
    powers = (1, 3) if component in ODD else (0, 2, 4)
    through = [len(OFFSETS) // 2, len(OFFSETS) - 1] if component in ODD else [0, len(OFFSETS) // 2, len(OFFSETS) - 1]
    design = OFFSETS[:, None] ** np.array(powers)
    constants = np.linalg.solve(design[through], values[through])
    return Fit(
        component=component,
        constants=tuple(constants.tolist()),
        worst=float(np.max(np.abs(design[1:] @ constants / values[1:] - 1))),
        worst_without_square=float("nan"),
    )


def _over(axis: int, values: np.ndarray, others: tuple[float, float]) -> np.ndarray:
    """(k, 6) amplitudes with x or y swept; `others` are y (or x) and z."""
    poses = np.zeros((len(values), 6))
    poses[:, axis], poses[:, 1 - axis], poses[:, 2] = values, *others
    return amplitudes(poses)


def _index(component: str) -> int:
    if component not in COMPONENTS:
        raise InputError(f"the component must be one of {', '.join(COMPONENTS)}; got {component!r}. Use one of them.")
    return COMPONENTS.index(component)

"""What single precision does to a sampled law: coefficients that are rounded, and filters that stop moving.

coefficients as the C compiler rounds them --difference of the two laws, loop closed--> how much more would be borne
s⁺ = s + a (u − s) in single precision     --increments below half a unit--> how near to u the filter comes
"""

from dataclasses import dataclass, replace

import numpy as np

from workbench.analysis.sampled import closed_map, moving
from workbench.control.discrete import DiscreteLaw
from workbench.errors import InputError
from workbench.lti import Plant
from workbench.lti.join import difference, series
from workbench.lti.measure import sampled_peak
from workbench.lti.realisation import Realisation
from workbench.result import Result, Row

COEFFICIENTS = ("measurement", "resolution", "advance", "direct", "memory")
HALF_UNIT = 2.0**-24  # relative rounding of single precision


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class SinglePrecision(Result):
    """Figures of a law whose coefficients and arithmetic are single precision.

    coefficient_error : largest relative rounding of a coefficient
    margin : how many times the rounding of the coefficients may be multiplied, in any direction of the commands, before
        the small-gain theorem no longer guarantees stability
    dead_band : largest relative distance at which a low-pass stops before a constant signal
    """

    coefficient_error: float
    margin: float
    dead_band: float

    def rows(self) -> list[Row]:
        return [
            ("largest rounding of a coefficient", self.coefficient_error, "relative"),
            ("quantisation margin", self.margin, "times that rounding"),
            ("dead band of the slowest filter", self.dead_band, "relative"),
        ]


def single_precision(
    plant: Plant, law: DiscreteLaw, commands, sensors, *, computing_delay: float = 0.0
) -> SinglePrecision:
    """What is left of a stable sampled loop's margins when its law runs in single precision.

    Parameters as of `sampled_loop`. The margin is 1/‖ΔK M‖∞ with ΔK the difference of the two laws and M the closed
    loop from command errors to sensors.

    Raises
    ------
    InputError
        If the loop is unstable in double precision already.
    """
    rounded = replace(law, **{name: _rounded(getattr(law, name)) for name in COEFFICIENTS})
    A, B, C, D = closed_map(plant, law, commands, sensors, computing_delay)
    if np.abs(np.linalg.eigvals(A)).max() >= 1:
        raise InputError(
            "the sampled loop must be stable before its rounding is asked for; it is unstable at "
            f"{1e3 * law.sample_time:g} ms with {1e3 * computing_delay:g} ms of computing. Sample faster."
        )
    change = difference(Realisation(*moving(rounded)), Realisation(*moving(law)))
    effect_of = series(change, Realisation(A, B, C, D))
    # the gain attained: the two laws cancel to eight digits, which leaves the bracket's upper end a hundred times wider
    effect = sampled_peak(*effect_of, law.sample_time).value
    slow = law.advance[law.advance > 0]
    return SinglePrecision(
        coefficient_error=max(_error(getattr(law, n), getattr(rounded, n)) for n in COEFFICIENTS),
        margin=float("inf") if effect == 0 else 1 / effect,
        dead_band=float(HALF_UNIT / slow.min()) if len(slow) else 0.0,
    )


def _rounded(values: np.ndarray) -> np.ndarray:
    return values.astype(np.float32).astype(float)


def _error(exact: np.ndarray, rounded: np.ndarray) -> float:
    size = np.abs(exact)
    return float(np.max(np.abs(rounded - exact)[size > 0] / size[size > 0], initial=0.0))

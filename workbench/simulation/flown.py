"""What many flights over drawn guideways say: contacts per hour, and every figure of the ride beside the linear one.

Flight … --sums over guideways--> ratio of rms values with its standard error;  contacts, hours --> Poisson interval
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.analysis.response import COST_SCALE
from workbench.constants import GRAVITY
from workbench.result import Result, Row
from workbench.simulation.history import Contact
from workbench.simulation.reading import UNITS

COST_UNIT = "10⁻⁴ g²"
STILL = 1e-20  # of the largest mean square of its unit: rounding where a guideway does not move this way
TAIL = 0.025  # on either side of an interval of 95 %
WORDS = {
    "acceleration_z": "vertical ride", "acceleration_y": "lateral ride", "gap": "vertical gap",
    "gap_lateral": "lateral gap", "current": "current", "cost": "ride cost J",
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightFigure:
    """One figure of the ride, about rest: rms, or the cost J, a mean square.

    quantity, place : as in `Analysis.rms`, or "cost" and nothing;  linear, nonlinear : on the same guideways
    ratio : nonlinear over linear;  standard_error : of the ratio, from the scatter between flights
    """

    quantity: str
    place: str
    unit: str
    linear: float
    nonlinear: float
    ratio: float
    standard_error: float

    @property
    def name(self) -> str:
        """In words."""
        return WORDS[self.quantity] + (f", {self.place}" if self.place else "")


@dataclass(frozen=True, slots=True, kw_only=True)
class Rate:
    """Events per hour with the 95 % interval of a Poisson process (Garwood's, exact)."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, count: int, hours: float) -> "Rate":
        """So many in so many hours; nothing is known without hours."""
        from scipy.special import gammaincinv

        if not hours > 0:
            return cls(value=np.nan, low=0.0, high=np.inf)
        low = float(gammaincinv(count, TAIL)) if count else 0.0
        return cls(value=count / hours, low=low / hours, high=float(gammaincinv(count + 1, 1 - TAIL)) / hours)


@dataclass(frozen=True, slots=True, kw_only=True)
class Touch:
    """The first contact of a flight: its number, and where."""

    flight: int
    contact: Contact


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Flights(Result):
    """Flights of the nonlinear vehicle over drawn guideways, beside the linear one on the same.

    hours : flown, warm-up left out;  contacts : in them;  contacts_per_hour : with its interval
    figures : over the flights without a contact;  touches : the first contact of each of the others
    flights, planned : finished and asked for;  duration : of each [s];  seeds, seed, factor : of the guideways
    force_law : in words;  speed [m/s];  step [s];  spacing : between the points of a guideway [m]
    fastest_pole : |λ| of the linear loop [1/s];  warning : a sentence where the step is coarse for it
    """

    hours: float
    contacts: int
    contacts_per_hour: Rate
    figures: tuple[FlightFigure, ...]
    touches: tuple[Touch, ...]
    flights: int
    planned: int
    duration: float
    seeds: int
    seed: int
    factor: float
    force_law: str
    speed: float
    step: float
    spacing: float
    fastest_pole: float
    warning: str | None = None

    @property
    def finished(self) -> bool:
        """Whether all that was asked for is flown."""
        return self.flights == self.planned

    def figure(self, quantity: str, place: str = "") -> FlightFigure:
        """One of the figures."""
        return next(f for f in self.figures if (f.quantity, f.place) == (quantity, place))

    def rows(self) -> list[Row]:
        rate = self.contacts_per_hour
        rows: list[Row] = [
            ("flown", self.hours, "h"),
            ("contacts", self.contacts, ""),
            ("contacts per hour", f"{rate.value:.3g} ({rate.low:.3g} … {rate.high:.3g})", "1/h, 95 %"),
            ("flights", f"{self.flights} of {self.planned}", ""),
            ("flights with a contact", len(self.touches), ""),
            ("force law", self.force_law, ""),
            ("integration step", 1e3 * self.step, "ms"),
        ]
        return rows

    def table(self) -> tuple[str, tuple[str, ...], list[tuple[str, ...]]]:
        """Title, columns and rows of the figures."""
        shown = [
            (f.name, f"{f.linear:.4g}", f"{f.nonlinear:.4g}", f"{f.ratio:.4f} ± {f.standard_error:.4f}", f.unit)
            for f in self.figures
        ]
        return "Nonlinear over linear", ("figure", "linear", "nonlinear", "ratio", "unit"), shown


def ride_figures(
    names: Sequence[tuple[str, str]], seconds: np.ndarray, linear: np.ndarray, nonlinear: np.ndarray
) -> tuple[FlightFigure, ...]:
    """The cost and the figures of flights without contact.

    Parameters
    ----------
    names : quantity and place of each series
    seconds : (k,);  linear, nonlinear : (k, 1 + s) ∫ square dt, of the weighted accelerations together first
    """
    if not len(seconds) or not seconds.sum() > 0:
        return ()
    with np.errstate(invalid="ignore", divide="ignore"):  # where a guideway does not move this way
        share = nonlinear.sum(axis=0) / linear.sum(axis=0)
        scatter = (nonlinear - share * linear) / linear.mean(axis=0)
    error = scatter.std(axis=0, ddof=1) / np.sqrt(len(scatter)) if len(scatter) > 1 else np.full_like(share, np.nan)
    one, other = linear.sum(axis=0) / seconds.sum(), nonlinear.sum(axis=0) / seconds.sum()
    root = np.sqrt(share)
    cost = FlightFigure(
        quantity="cost", place="", unit=COST_UNIT, linear=float(COST_SCALE * one[0] / GRAVITY**2),
        nonlinear=float(COST_SCALE * other[0] / GRAVITY**2), ratio=float(share[0]), standard_error=float(error[0]),
    )  # fmt: skip
    largest = {
        u: max((one[k] for k, (q, _) in enumerate(names, 1) if UNITS[q] == u), default=0.0) for u in UNITS.values()
    }
    rest = (
        FlightFigure(
            quantity=quantity, place=place, unit=UNITS[quantity], linear=float(np.sqrt(one[k])),
            nonlinear=float(np.sqrt(other[k])), ratio=float(root[k]), standard_error=float(error[k] / (2 * root[k])),
        )
        for k, (quantity, place) in enumerate(names, 1)
        if one[k] > STILL * largest[UNITS[quantity]]
    )  # fmt: skip
    return (cost, *rest)

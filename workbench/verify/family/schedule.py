"""Gain schedules: stability, damping, decay and peak sensitivity at every speed of a range, not at points of it.

    gains(v) polynomial, plant(v, θ) polynomial --> closed loop polynomial in v --one exact interpolation--> families
      --zero exclusion, positivity, cut in speed--> proofs for every constant speed (and every θ of a box)

A time constant τ(v) divides: multiply by its powers (`multiplier`). Degrees of 20 to 30 in speed are common and
harmless: interpolation is exact, and on short pieces of speed all but the lowest orders vanish.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from flint import fmpq, fmpq_mat, fmpq_poly

from workbench.verify.exact.sensitivity import roots_from_zero
from workbench.verify.family.polynomial import ParameterBox, Point, rational
from workbench.verify.family.sensitivity import SensitivityFamily, sensitivity_family

ZERO = fmpq(0)
Gains = Mapping[str, fmpq]
ScheduledLoop = Callable[[fmpq, Gains, Point], tuple[fmpq_mat, fmpq_mat, fmpq_mat]]


@dataclass(frozen=True, slots=True)
class GainSchedule:
    """Gains as polynomials of one variable: Σ c_k ((v - centre)/scale)^k on a range of v."""

    variable: str
    lower: fmpq
    upper: fmpq
    centre: fmpq
    scale: fmpq
    coefficients: Mapping[str, tuple[fmpq, ...]]

    def __post_init__(self) -> None:
        if not self.lower < self.upper or self.scale == 0 or not all(self.coefficients.values()):
            raise ValueError(
                f"a schedule must have a range that rises, a scale other than zero and coefficients for every gain; "
                f"got {self.lower} to {self.upper}, scale {self.scale}. Mend its numbers."
            )

    def at(self, value: object) -> dict[str, fmpq]:
        """The gains at one value of the variable, exact."""
        t = (rational(value) - self.centre) / self.scale
        gains = {}
        for name, coefficients in self.coefficients.items():
            total = fmpq(0)
            for c in reversed(coefficients):
                total = total * t + c
            gains[name] = total
        return gains

    def largest(self, name: str) -> fmpq:
        """A bound on the size of a polynomial anywhere in the range."""
        reach = max(abs((end - self.centre) / self.scale) for end in (self.lower, self.upper))
        return sum((abs(c) * reach**k for k, c in enumerate(self.coefficients[name])), fmpq(0))

    def lower_bound(self, name: str, low: fmpq, high: fmpq) -> fmpq:
        """A positive number that a polynomial is proved to stay above on a part of the range; 0 if none is found."""
        start = min(self.at(low)[name], self.at(high)[name])
        for k in range(40):
            bound = start * fmpq(9, 10) ** (k + 1)
            if bound > 0 and self.never_zero(name, low, high, bound):
                return bound
        return fmpq(0)

    def never_zero(self, name: str, low: fmpq, high: fmpq, above: fmpq = ZERO) -> bool:
        """Whether a polynomial is proved to stay above a number on a part of the range."""
        p = fmpq_poly(list(self.coefficients[name])) - above
        start, end = ((v - self.centre) / self.scale for v in (low, high))
        # t = (start + end x)/(1 + x) takes x in [0, ∞) over the part; powers of 1 + x do not change the sign
        over = fmpq_poly([0])
        for k, c in enumerate(p.coeffs()):
            over += c * fmpq_poly([start, end]) ** k * fmpq_poly([1, 1]) ** (p.degree() - k)
        return p(start) > 0 and p(end) > 0 and roots_from_zero(over) == 0


def schedule_family(
    loop: ScheduledLoop,
    schedule: GainSchedule,
    degree: int,
    *,
    box: ParameterBox | None = None,
    degrees: Sequence[int] = (),
    multiplier: Callable[[fmpq, Gains, Point], fmpq] | None = None,
    lengths: Sequence[fmpq] = (),
) -> SensitivityFamily:
    """The closed loop under a schedule as one family: the variable first, then the parameters of a box.

    loop : (variable, gains, θ) -> (A, B, C) with S = I + C (sI - A)⁻¹ B;  θ is () without a box
    degree : bound on the degree of multiplier · det(sI - A), and of its rank-one updates, in the variable
    degrees : bounds for the parameters of the box
    """
    names, lower, upper = (box.names, box.lower, box.upper) if box else ((), (), ())
    whole = ParameterBox((schedule.variable, *names), (schedule.lower, *lower), (schedule.upper, *upper))

    def at(theta: Point) -> tuple[fmpq_mat, fmpq_mat, fmpq_mat]:
        return loop(theta[0], schedule.at(theta[0]), theta[1:])

    def factor(theta: Point) -> fmpq:
        return multiplier(theta[0], schedule.at(theta[0]), theta[1:]) if multiplier else fmpq(1)

    return sensitivity_family(at, whole, (degree, *degrees), factor, lengths)

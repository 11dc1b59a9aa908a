"""Proofs over a box of parameters: stability, damping, decay and peak sensitivity of every member of a family.

    Family --zero exclusion--> prove_hurwitz, prove_damping, prove_decay --bisection--> largest_damping, largest_decay
    SensitivityFamily --positivity--> prove_peak_sensitivity --bisection--> smallest_peak

A proof covers parameters that are constant in time, anywhere in the box. What stays undecided is said as the share of
the box; a member that breaks the claim is named when one is found, and ends the search unless it is to be thorough
(about the share that stays open). Proofs rest on the degree bounds given to the family.
"""

from collections.abc import Callable
from fractions import Fraction
from math import inf, nextafter
from time import perf_counter

from flint import arb, fmpq

from workbench.verify.family import exclusion
from workbench.verify.family import sensitivity as box_sensitivity
from workbench.verify.family.enclosure import Enclosure as Enclosure
from workbench.verify.family.enclosure import Proof as Proof
from workbench.verify.family.enclosure import enclosed, sampled
from workbench.verify.family.polynomial import Family, ParameterBox, Point, rational
from workbench.verify.family.search import Piece, Search, search
from workbench.verify.family.sensitivity import SensitivityFamily, excess_form, peak_at
from workbench.verify.family.share import Shares, corners, middle, shares, volume

MOST_PIECES = 4000
BUDGET = 20.0  # s
NOT_AT_ALL = fmpq(0)
MEMBERS = 100  # exact checks of single members that an incomplete proof may spend


def prove_hurwitz(family: Family, *, most: int = MOST_PIECES, budget: float = BUDGET, thorough: bool = False) -> Proof:
    """Every root of every member has a negative real part."""
    return _prove_region(family, fmpq(0), fmpq(0), most, budget, thorough)


def prove_damping(
    family: Family, zeta: object, *, most: int = MOST_PIECES, budget: float = BUDGET, thorough: bool = False
) -> Proof:
    """Every root s of every member has -Re s > ζ|s|; 0 <= ζ < 1."""
    z = rational(zeta)
    if not 0 <= z < 1:
        raise ValueError(f"a damping ratio to prove must lie in 0 … 1; got {float(z):g}. Ask for less than 1.")
    return _prove_region(family, z, fmpq(0), most, budget, thorough)


def prove_decay(
    family: Family, sigma: object, *, most: int = MOST_PIECES, budget: float = BUDGET, thorough: bool = False
) -> Proof:
    """Every root of every member has a real part below -σ [1/s]."""
    return _prove_region(family, fmpq(0), rational(sigma), most, budget, thorough)


def prove_peak_sensitivity(
    family: SensitivityFamily,
    gamma: object,
    *,
    stable: Proof | None = None,
    most: int = MOST_PIECES,
    budget: float = BUDGET,
    thorough: bool = False,
) -> Proof:
    """Every member is stable and its largest singular value of S stays below γ > 1 at every frequency.

    stable : a proof of stability of the same family made before; made here if left out
    """
    begin, g = perf_counter(), rational(gamma)
    if not g > 1:
        raise ValueError(f"a peak sensitivity to prove must exceed 1, its value at infinity; got {float(g):g}.")
    stable = prove_hurwitz(family.p, most=most, budget=budget) if stable is None else stable
    if not stable.proved:
        return Proof(
            proved=False, undecided=1.0, pieces=stable.pieces, detail=f"stability comes first: {stable.detail}",
            counterexample=stable.counterexample,
        )  # fmt: skip
    judge = box_sensitivity.positive_or_open if thorough else box_sensitivity.positive
    found = search((excess_form(family, g),), judge, most=most, deadline=begin + budget)
    counterexample = None
    if found.refuted:
        at = corners(family.box, found.left[0].place[:-1])[:9]
        counterexample = max(at, key=lambda v: float(peak_at(family, v)[0].mid()))
    return _proof(found, float(sum(map(volume, _cut(found, family.box).open))), counterexample)


def largest_damping(
    family: Family, *, tolerance: float = 1e-3, budget: float = BUDGET, prove: Callable[..., Proof] = prove_damping
) -> Enclosure:
    """The worst damping ratio over the box, enclosed: proved from below, attained by a member from above."""
    return _worst(family, exclusion.damping, prove, tolerance, budget)


def largest_decay(
    family: Family, *, tolerance: float = 1e-3, budget: float = BUDGET, prove: Callable[..., Proof] = prove_decay
) -> Enclosure:
    """The worst decay rate over the box [1/s], enclosed as `largest_damping`."""
    return _worst(family, exclusion.decay, prove, tolerance, budget)


def smallest_peak(
    family: SensitivityFamily, *, tolerance: float = 5e-3, budget: float = BUDGET, grown: fmpq = NOT_AT_ALL
) -> Enclosure:
    """The worst peak sensitivity over the box, enclosed: attained by a member from below, proved from above.

    grown : what is added to every member's peak, as by an error of the model

    Raises ValueError if stability is not proved.
    """
    end = perf_counter() + budget
    stable = prove_hurwitz(family.p, budget=budget)
    if not stable.proved:
        raise ValueError(f"a peak exists only where every member is stable; {stable.detail}. Take a smaller box.")

    def peak(theta: Point) -> float:
        return nextafter(float(peak_at(family, theta)[0].lower()), 0.0)

    def attempt(bound: float) -> Proof:
        left = max(end - perf_counter(), 0.1)
        return prove_peak_sensitivity(family, rational(bound) - grown, stable=stable, budget=left)

    return enclosed(sampled(family.p, peak, budget), attempt, peak, 1, tolerance, end)


def _worst(
    family: Family, measure: Callable[..., arb], prove: Callable[..., Proof], tolerance: float, budget: float
) -> Enclosure:
    end = perf_counter() + budget

    def value(theta: Point) -> float:
        return nextafter(float(measure(family.at(theta)).upper()), inf)

    def attempt(bound: float) -> Proof:
        return prove(family, rational(bound), budget=max(end - perf_counter(), 0.1))

    start = sampled(family, value, budget)
    if min(start)[0] <= 0:
        return Enclosure(low=-inf, high=min(start)[0], at=min(start)[1], proof=None)
    return enclosed(start, attempt, value, -1, tolerance, end)


def _prove_region(family: Family, zeta: fmpq, sigma: fmpq, most: int, budget: float, thorough: bool) -> Proof:
    begin = perf_counter()
    box = family.box
    centre = exclusion.inside(family.at(box.centre), zeta, sigma)
    if centre is not True:
        return Proof(
            proved=False, undecided=1.0, pieces=0, counterexample=box.centre if centre is False else None,
            detail="the centre of the box breaks the claim" if centre is False else "the centre is too close to call",
        )  # fmt: skip
    met: list[Point] = []

    def doubt(piece: Piece) -> bool:
        for theta in corners(box, piece.place[:-1])[:8]:
            if exclusion.inside(family.at(theta), zeta, sigma) is False:
                met.append(theta)
                return True
        return False

    forms = exclusion.ray_forms(family, zeta, sigma)
    found = search(forms, exclusion.excluded, most=most, deadline=begin + budget, doubt=None if thorough else doubt)
    # Free cells may lie beyond a crossing: each needs a member of its own that keeps the claim.
    free = Fraction(0) if found.left else Fraction(1)
    for cell in _cut(found, box).free[:MEMBERS] if found.left else ():
        if exclusion.inside(family.at(middle(box, cell)), zeta, sigma):
            free += volume(cell)
    return _proof(found, float(1 - free), met[0] if met else None)


def _cut(found: Search, box: ParameterBox) -> Shares:
    return shares([piece.place[:-1] for piece in found.left], len(box.names))


def _proof(found: Search, share: float, counterexample: Point | None) -> Proof:
    if not found.left:
        detail = f"proved on {found.pieces} pieces"
    elif found.refuted:
        detail = f"false at a member met after {found.pieces} pieces"
    else:
        detail = f"{100 * share:.3g} % of the box undecided after {found.pieces} pieces"
    return Proof(
        proved=not found.left, undecided=share, pieces=found.pieces, detail=detail, counterexample=counterexample
    )

"""What is known of a claim over a box, and how a worst value is enclosed between a proof and a member that attains it.

members sampled --worst--> attained;   bound near it --attempt--> Proof | member beyond it (attained anew) | farther
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from math import inf
from time import perf_counter

from flint import fmpq

from workbench.verify.exact.deadline import check
from workbench.verify.family.form import PACKED
from workbench.verify.family.polynomial import Family, Point

STEPS = 12  # of a search for the best provable value


@dataclass(frozen=True, slots=True, kw_only=True)
class Proof:
    """How far a claim about a box is proved.

    undecided : share of the box on which the claim is not proved (0 if proved), never too small
    pieces : work done
    counterexample : a point of the box at which the claim is false, if one was met
    """

    proved: bool
    undecided: float
    pieces: int
    detail: str
    counterexample: Point | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Enclosure:
    """The worst value over a box lies in [low, high]; one end is proved for all members, the other attained at `at`."""

    low: float
    high: float
    at: Point
    proof: Proof | None


def enclosed(
    start: Sequence[tuple[float, Point]],
    attempt: Callable[[float], Proof],
    value: Callable[[Point], float],
    side: int,
    tolerance: float,
    end: float,
) -> Enclosure:
    """Approach the attained value (side -1: from below, +1: from above) until a bound within the tolerance is proved.

    A member that refutes an attempt becomes the attained value: the worst need not be a corner.
    """
    attained, at = (min if side < 0 else max)(start, key=lambda pair: pair[0])
    distance, failed = tolerance, 0.0
    best: tuple[float, Proof] | None = None
    for _ in range(STEPS):
        check()
        bound = max(attained * (1 + side * min(distance, 1.0)), 0.0)
        proof = attempt(bound)
        if proof.proved:
            best = (bound, proof)
        elif proof.counterexample is not None and side * (value(proof.counterexample) - attained) > 0:
            attained, at = value(proof.counterexample), proof.counterexample
            failed, distance = 0.0, tolerance
            continue
        else:
            failed = distance
        reached = abs(best[0] / attained - 1) if best else None
        if perf_counter() > end or (reached is not None and reached - failed <= 1.01 * tolerance):
            break
        distance = (failed + reached) / 2 if reached is not None else 4 * distance
    bound = best[0] if best else side * inf
    low, high = sorted((bound, attained))
    return Enclosure(low=low, high=high, at=at, proof=best[1] if best else None)


def sampled(family: Family, value: Callable[[Point], float], budget: float) -> list[tuple[float, Point]]:
    """Values at centre and corners, then between the ends of axes of high degree (speed); a quarter of the budget."""
    sides = []
    for degree, low, high in zip(family.degrees, family.box.lower, family.box.upper, strict=True):
        steps = degree if degree > PACKED else 1
        sides.append([low + fmpq(k, steps) * (high - low) for k in range(steps + 1)])
    members = dict.fromkeys([family.box.centre, *family.box.vertices(), *product(*sides)])
    until, found = perf_counter() + budget / 4, []
    for theta in members:
        check()
        found.append((value(theta), theta))
        if perf_counter() > until:
            break
    return found

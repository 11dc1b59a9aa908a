"""How large a box a claim survives: the box scaled about its centre until the claim is no longer proved.

scale --scaled box--> family --prove--> Proof;   bisection --> largest proved scale, and why the next one fails
"""

from collections.abc import Callable
from dataclasses import dataclass

from flint import fmpq

from workbench.verify.family.box import Proof
from workbench.verify.family.polynomial import rational


@dataclass(frozen=True, slots=True)
class Reach:
    """scale : the largest proved, 0 if none was;  proof : of it;  beyond : the failed attempt closest to it, if any."""

    scale: fmpq
    proof: Proof | None
    beyond: Proof | None


def largest_scale(prove: Callable[[fmpq], Proof], *, most: object = 1, steps: int = 6) -> Reach:
    """The largest scale in (0, most] at which a claim is proved, to most/2**steps.

    prove : scale -> Proof over the box scaled by it. A claim proved on a box holds on every smaller one.
    """
    low, high = fmpq(0), rational(most)
    proof = prove(high)
    if proof.proved:
        return Reach(high, proof, None)
    best, beyond = None, proof
    for _ in range(steps):
        middle = (low + high) / 2
        proof = prove(middle)
        if proof.proved:
            low, best = middle, proof
        else:
            high, beyond = middle, proof
    return Reach(low, best, beyond)

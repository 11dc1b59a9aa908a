"""What becomes of a table: one finding for each promise, and the report of all.

A promise holds if it is proved; proved otherwise it fails; without a proof it is listed with the reason.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from time import perf_counter

from flint import fmpq

from workbench.verify.exact.deadline import OutOfTime, check
from workbench.verify.exact.failure import NotProved, TableError
from workbench.verify.vehicle.table import Undecided


@dataclass(frozen=True, slots=True)
class Finding:
    """One promise: what was claimed, what is proved, and whether it holds; `reason` says why not."""

    name: str
    sense: str
    limit: float
    claimed: tuple[float, float] | None  # None: the promise is its limit alone
    proved: tuple[float, float] | None
    method: str
    box: Mapping[str, tuple[float, float]]
    holds: bool
    reason: str
    seconds: float
    decided: bool = True

    @property
    def verdict(self) -> str:
        """ "proved", "fails" (proved to be otherwise), "not proved", or "undecided" where the budget ended first."""
        if self.holds:
            return "proved"
        if not self.decided:
            return "undecided"
        return "not proved" if self.proved is None else "fails"


@dataclass(frozen=True, slots=True)
class Report:
    """What became of a table.

    faults : one sentence for each thing that does not hold
    plant_follows : whether the printed plant is that of the vehicle beside it; None if no vehicle stands there
    undecided : what the table itself says it does not promise over a box; nothing is proved of that
    coupling : largest part of the plant that the groups leave out, relative: zero, or the table does not hold
    not_promised : quantities, motions, plants and speeds that the table promises nothing of
    stated : figures that the author states and nobody proved, by their place in the table
    """

    problem: str
    digest: str
    digest_ok: bool
    plant_follows: bool | None
    coupling: float
    findings: tuple[Finding, ...]
    faults: tuple[str, ...]
    undecided: tuple[Undecided, ...] = ()
    not_promised: tuple[str, ...] = ()
    stated: tuple[str, ...] = ()

    @property
    def proved(self) -> bool:
        """Whether everything holds: digest, plant, and every requirement promised and proved."""
        return not self.faults


@dataclass(frozen=True, slots=True)
class Attempt:
    """What an attempt to prove something came to: why it does not hold, or nothing; whether it was decided; seconds."""

    reason: str
    decided: bool
    seconds: float


def attempted(prove: Callable[[], str]) -> Attempt:
    """Runs a proof, which answers why the promise does not hold; what ends it early is a reason too."""
    begun, decided = perf_counter(), True
    try:
        check()
        reason = prove()
    except OutOfTime as error:
        reason, decided = f"is undecided: {error}", False
    except NotProved as error:
        reason = f"is not proved: {error}"
    except (ZeroDivisionError, ValueError, OverflowError) as error:
        if isinstance(error, TableError):
            raise
        reason = f"is not proved: the numbers leave no room for a proof ({error})"
    return Attempt(reason, decided, perf_counter() - begun)


def digest_faults(stated: str, digest: str) -> list[str]:
    """What a digest that is not the content's says."""
    if stated == digest:
        return []
    return [
        f"the digest must be the SHA-256 of the content; the table says {stated[:12]}…, the content gives "
        f"{digest[:12]}…: it was changed after it was signed"
    ]


def outward(low: fmpq, high: fmpq) -> tuple[float, float]:
    """The narrowest two doubles with the interval between them."""
    below, above = float(low), float(high)
    while fmpq(*below.as_integer_ratio()) > low:
        below = math.nextafter(below, -math.inf)
    while fmpq(*above.as_integer_ratio()) < high:
        above = math.nextafter(above, math.inf)
    return below, above

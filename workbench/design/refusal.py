"""The refusal of a design: which requirement binds, where, and by how much, whichever way an optimiser ended.

what was looked at: (analysis, verdicts) of each --the one that misses least--> sentence
"""

from collections.abc import Sequence

from workbench.analysis.analysis import Analysis
from workbench.errors import InfeasibleError
from workbench.goals.ride.decay_rate import DecayRate
from workbench.goals.verdict import Verdict, shortfall

NAMED = 4  # requirements at most in one sentence


def refusal(name: str, looked_at: Sequence[tuple[Analysis, Sequence[Verdict]]]) -> InfeasibleError:
    """What misses at the gains whose largest relative miss is smallest; stability itself where nothing is stable.

    looked_at : at least one, each unstable or with a requirement that is not met
    """
    stable = [missed(verdicts) for analysis, verdicts in looked_at if analysis.stable]
    if stable:
        binding = min(stable, key=lambda found: miss(found[0]))
        cure = "relax one of them, widen a bound or free another gain."
    else:
        nearest = max((analysis for analysis, _ in looked_at), key=lambda a: a.decay)
        worst = max(nearest.modes, key=lambda m: m.pole.real)
        binding = [unstable(nearest.decay, f"{worst.name}, {worst.frequency_hz:.3g} Hz")]
        cure = "try more --starts, widen a bound, or give --fix values that stabilise."
    return InfeasibleError(
        f"the requirements of {name!r} cannot be met together: {in_words(binding)}. "
        f"{'These bind' if len(binding) > 1 else 'This binds'} at the best compromise found; {cure}"
    )


def missed(verdicts: Sequence[Verdict]) -> list[Verdict]:
    """Those not met, the largest relative miss first."""
    return sorted((v for v in verdicts if not v.met), key=lambda v: -miss(v))


def miss(verdict: Verdict) -> float:
    """By which fraction of its limit a verdict misses; infinite without a value."""
    if verdict.value is None:
        return float("inf")
    return shortfall(verdict.sense, verdict.limit, verdict.value)


def in_words(verdicts: Sequence[Verdict], place: str = "") -> str:
    """What misses, where and by how much, the first few; all of them at a place, such as a model or a speed."""
    return "; ".join(_words(v, place) for v in verdicts[:NAMED])


def _words(v: Verdict, place: str) -> str:
    relative = f", a miss of {100 * miss(v):.2g} %" if v.value is not None and v.limit != 0 else ""
    return v.sentence() + (f" at {place}" if place else "") + relative


def unstable(decay: float, where: str) -> Verdict:
    """The verdict that every root must decay, of a loop in which one does not; decay : of the slowest [1/s]."""
    return Verdict(
        name=DecayRate.kind, sense=DecayRate.sense, limit=0.0, value=decay, unit=DecayRate.unit, met=False, where=where
    )

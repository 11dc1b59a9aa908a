"""The two valleys of a vehicle's law: which way its lateral signals act on sway and roll.

K_sway, K_yaw of opposite signs: mirrored; of one sign: conventional

Yaw must be held either way, so where K_yaw is negative the lateral filters are reversed too, and with them what they do
to sway and roll: there the roll channel carries these motions instead.  Source: guide, Definitions: Invariance (no
rescaling of the seventeen parameters changes the sign of K_sway K_yaw).
"""

from dataclasses import dataclass

from workbench.control import Gains
from workbench.design.problem import Problem
from workbench.errors import InputError, unknown_name

CONVENTIONAL, MIRRORED = "conventional", "mirrored"
VALLEYS = (CONVENTIONAL, MIRRORED)
SENTENCES = {
    CONVENTIONAL: "lateral gaps and accelerations hold sway, roll and yaw alike (K_sway and K_yaw of one sign)",
    MIRRORED: "the lateral filters are reversed: K_yaw, reversed with them, holds yaw as before, and the roll channel "
    "holds sway and roll against them (K_sway and K_yaw of opposite signs)",
}


@dataclass(frozen=True, slots=True)
class Valley:
    """On which side of the lateral signals gains lie: a word and a sentence."""

    word: str

    @property
    def sentence(self) -> str:
        """What the word means, for people."""
        return f"{self.word}: {SENTENCES[self.word]}."


def valley_of(problem: Problem, gains: Gains) -> Valley | None:
    """The valley of a vehicle's gains; None where its law steers no yaw, or by no sway."""
    sign = gains.K_sway * gains.K_yaw
    if sign == 0 or not {"sway_roll_yaw", "all"} & set(problem.setting.groups):
        return None
    return Valley(MIRRORED if sign < 0 else CONVENTIONAL)


def in_valley(problem: Problem, word: str) -> Problem:
    """The problem with K_yaw bound to one side; refused where that does not say which valley is meant."""
    if word not in VALLEYS:
        raise unknown_name("valley", word, VALLEYS)
    if not problem.flies or "K_yaw" not in problem.free or problem.fixed.get("K_sway", 0.0) == 0:
        raise InputError(
            f"a valley is chosen by the sign of a free K_yaw beside a fixed K_sway; {problem.name!r} has not both. "
            "Leave the valley out, or choose by [bounds]."
        )
    low, high = problem.bounds["K_yaw"]
    positive = (word == CONVENTIONAL) == (problem.fixed["K_sway"] > 0)
    side = (max(low, 0.0), high) if positive else (low, min(high, 0.0))
    if side[0] >= side[1]:
        raise InputError(f"the {word} valley needs a K_yaw that its bounds {[low, high]} leave out. Widen [bounds].")
    return problem.with_bounds({"K_yaw": side})

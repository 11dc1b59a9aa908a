"""Mean squares of many small closed loops at once, under shaped noise that arrives at two places.

    stack of loops (b, n, n) --`lti.modal`--> poles and residues --partial fractions--> mean squares, closed form

A mean square needs no Lyapunov equation: ∫ e^{μ_i t} e^{μ_j t} dt = −1/(μ_i + μ_j). Where eigenvectors are nearly
parallel the terms of a sum far outgrow the sum. `MeanSquares.growth` is their ratio; a caller takes another route where
it is large.

Shapes: b loops, n states, z outputs, t types of noise.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from workbench.lti.modal import Fractions


class MeanSquares(NamedTuple):
    """E[y²] (b, z, t), and how far the terms outgrow the sum, (b,): its square times 1e-16 is what may be lost."""

    value: np.ndarray
    growth: np.ndarray


@dataclass(frozen=True, slots=True)
class Excited:
    """Outputs of loops under noises that arrive at the front and, a delay later, at the rear.

    poles : (b, n);  front, rear : (b, n, t) modes per noise;  outputs : (b, z, n) per mode
    direct_front, direct_rear : (b, z, t);  delay [s]
    """

    poles: np.ndarray
    front: np.ndarray
    rear: np.ndarray
    outputs: np.ndarray
    direct_front: np.ndarray
    direct_rear: np.ndarray
    delay: float

    def mean_squares(self, shaping: Fractions, weight: Fractions | None) -> MeanSquares:
        """Under white noise of unit two-sided intensity through `shaping`, felt through `weight`."""
        b, n = self.poles.shape
        extra = shaping.poles if weight is None else np.concatenate([shaping.poles, weight.poles])
        mu = np.concatenate([self.poles, np.broadcast_to(extra, (b, len(extra)))], axis=1)
        at_loop = shaping(self.poles) * (1.0 if weight is None else weight(self.poles))
        if weight is None:
            at_extra = shaping.residues
        else:
            at_extra = np.concatenate(
                [shaping.residues * weight(shaping.poles), shaping(weight.poles) * weight.residues]
            )
        inverse = 1 / (extra[None, :, None] - self.poles[:, None, :])  # (b, e, n)

        def fractions(modes: np.ndarray, direct: np.ndarray) -> np.ndarray:
            """Residues (b, z·t, poles) of the whole chain."""
            z, t = self.outputs.shape[1], modes.shape[2]
            own = self.outputs[:, :, None, :] * modes.transpose(0, 2, 1)[:, None]  # (b, z, t, n)
            own = own.reshape(b, z * t, n)
            elsewhere = own @ inverse.transpose(0, 2, 1) + direct.reshape(b, z * t, 1)
            return np.concatenate([own * at_loop[:, None, :], elsewhere * at_extra], axis=2)

        first, second = fractions(self.front, self.direct_front), fractions(self.rear, self.direct_rear)
        overlap = -1 / (mu[:, :, None] + mu[:, None, :])
        both = np.concatenate([first, second], axis=1) @ overlap
        rows = first.shape[1]
        terms = first * both[:, :rows] + (second + 2 * first * np.exp(mu * self.delay)[:, None]) * both[:, rows:]
        value = terms.sum(axis=2).real
        size = np.maximum(np.abs(terms).sum(axis=2), 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            growth = np.where(size > 0, size / np.abs(value), 1.0).max(axis=1)
        return MeanSquares(value.reshape(b, -1, self.front.shape[2]), growth)

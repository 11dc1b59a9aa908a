"""Damping of a loop with one dead time in one of its commands, with exact derivatives: what steers a delay margin.

    A, commands c(θ) --dead time as a Padé fraction in command i--> eigenvalues --> smallest damping ratios, gradients

A loop bears every dead time below the first that brings a root to the axis. At the dead time asked for, the smallest
damping ratio is positive where that margin is not used up, so it says on which side of its limit the margin lies, and
how far. The fraction of order 6 is right to 3e-7 rad at a turn of 3 rad and to 2e-3 rad at a whole turn: it steers;
`analysis.margin`, which knows no fraction, judges.
"""

import numpy as np

from workbench.goals.ride.damping_ratio import damping_slope
from workbench.lti.eigen import eigen

ORDER = 6


def dead_time(order: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(A, B, C) of the Padé fraction 1 + C (s − A)⁻¹ B of e^{−s}, of even order.

    A ladder: e^{−s} = (1 − Y)/(1 + Y) with Y = tanh(s/2) = 1/(2/s + 1/(6/s + 1/(10/s + …))), cut after `order` steps,
    whose numbers are small where those of a companion form are faculties. States are charges (even) and flows (odd)
    in turn. Source: Lambert's continued fraction of tanh.
    """
    k = np.arange(order)
    flow, later = (k % 2 == 1).astype(float), k[None, :] > k[:, None]
    charge = 1.0 - flow
    weight = 2.0 * (2 * k + 1)
    into_charges = charge[:, None] * flow[None, :] * later
    into_flows = -flow[:, None] * (charge[None, :] * ~later + flow[None, :])  # what is left of the input, 1 − Σ flows
    return weight[:, None] * (into_charges + into_flows), weight * flow, -2.0 * flow


class Delayed:
    """The loop x' = A(θ) x = (A0 + Σ_i b_i c_i(θ)) x with a dead time between one command c_i x and its input b_i."""

    def __init__(self, inputs: np.ndarray) -> None:
        """inputs : (n, k) columns b_i, in the states of A."""
        self._inputs = inputs
        self._fraction = dead_time(ORDER)

    def damping(self, A, A_slope, commands, commands_slope, delay: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        """The `count` smallest damping ratios with each command delayed in turn, (k count,) and derivatives (…, p).

        A : (n, n);  commands : (k, n);  slopes : (entries column by column, p);  delay : [s], positive
        """
        D, B, C = self._fraction
        D, B = D / delay, B / delay
        n, k = len(A), len(commands)
        ratios, slopes = [], []
        for i in range(k):
            whole = np.block([[A, np.outer(self._inputs[:, i], C)], [np.outer(B, commands[i]), D]])
            values, left, right = eigen(whole)
            ratio = np.where(values.imag >= 0, -values.real / np.abs(values), np.inf)
            worst = np.argsort(ratio)[:count]
            left = left[:, worst].T.conj()
            right = right[:n, worst].T
            products = right[:, :, None] * left[:, None, :n]
            by_A = products.reshape(len(worst), -1) @ A_slope
            by_c = (left[:, n:] @ B)[:, None] * (right @ commands_slope[i::k])
            ratios.append(ratio[worst])
            slopes.append(damping_slope(values[worst], by_A + by_c))
        return np.concatenate(ratios), np.concatenate(slopes)

"""Damping of a loop with one dead time in one of its commands, with exact derivatives: what steers a delay margin.

    A, commands c(θ) --dead time as a Padé fraction in command i--> eigenvalues --> smallest damping ratios, gradients

A loop bears every dead time below the first that brings a root to the axis. At the dead time asked for, the smallest
damping ratio is positive where that margin is not used up, so it says on which side of its limit the margin lies, and
how far. The fraction of order 6 is right to 3e-7 rad at a turn of 3 rad and to 2e-3 rad at a whole turn: it steers;
`analysis.margin`, which knows no fraction, judges.
"""

import numpy as np

from workbench.goals.ride.damping_ratio import damping_slope
from workbench.lti.delay import pade
from workbench.lti.eigen import eigen
from workbench.lti.join import beside, wired
from workbench.lti.realisation import Realisation

ORDER = 6


class Delayed:
    """The loop x' = A(θ) x = (A0 + Σ_i b_i c_i(θ)) x with a dead time between one command c_i x and its input b_i."""

    def __init__(self, inputs: np.ndarray) -> None:
        """inputs : (n, k) columns b_i, in the states of A."""
        self._inputs = inputs

    def damping(self, A, A_slope, commands, commands_slope, delay: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        """The `count` smallest damping ratios with each command delayed in turn, (k count,) and derivatives (…, p).

        A : (n, n);  commands : (k, n);  slopes : (entries column by column, p);  delay : [s], positive
        """
        n, k = len(A), len(commands)
        fraction, one = pade(delay, ORDER), np.ones((1, 1))
        B = fraction.B[:, 0]
        late = fraction._replace(D=0 * one)  # what passes at once is in A already
        ratios, slopes = [], []
        swap, none = np.eye(2)[::-1], np.zeros((2, 1))
        for i in range(k):
            loop = Realisation(A, self._inputs[:, i : i + 1], commands[i : i + 1], 0 * one)
            values, left, right = eigen(wired(beside(loop, late), swap, none, none.T, 0 * one).A)
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

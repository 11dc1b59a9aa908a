"""Loops with dead times whose unstable poles are known another way: by Lambert's function, by Walton and Marshall."""

import numpy as np

from workbench.control.structure.blocks import gain
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.lti import Plant
from workbench.lti.model import DelayLine, Model


def late_loop(plant: Plant, k: float, dead_time: float) -> Loop:
    """Negative feedback k around a plant of one input and output, late by a dead time (0: none)."""
    return Loop(Model("late", plant, {plant.inputs[0]: dead_time}), Structure(gain("-y1", plant.inputs[0], k)))


def companion(numerator, denominator) -> Plant:
    """numerator/denominator, strictly proper, in companion form."""
    lead, n = denominator[0], len(denominator) - 1
    A = np.eye(n, k=1)
    A[-1] = -np.asarray(denominator[1:], float)[::-1] / lead
    C = np.zeros((1, n))
    C[0, : len(numerator)] = np.asarray(numerator, float)[::-1] / lead
    return Plant.from_matrices(A, np.eye(n, 1, k=1 - n), C)


def unstable_by_crossings(numerator, denominator, dead_time: float) -> int:
    """Unstable roots of P(s) + Q(s) e^(−sT), deg Q < deg P, by following them from T = 0.

    A pair crosses the axis at ω > 0 with |P| = |Q| for every T with P + Q e^(−jωT) = 0, to the right if
    d(|P|² − |Q|²)/dω > 0 there, else to the left. Source: Walton & Marshall, IEE Proc. D 134 (1987) 101.
    """
    P, Q = np.asarray(denominator, float), np.asarray(numerator, float)
    count = int(np.sum(np.roots(np.polyadd(P, Q)).real > 0))
    gap = np.polysub(_square(P), _square(Q))
    for root in np.roots(gap):
        if abs(root.imag) < 1e-9 * abs(root) and root.real > 0:
            omega = np.sqrt(root.real)
            first = np.angle(-np.polyval(Q, 1j * omega) / np.polyval(P, 1j * omega)) % (2 * np.pi) / omega
            times = int(np.floor((dead_time - first) * omega / (2 * np.pi))) + 1 if dead_time > first else 0
            count += 2 * times * int(np.sign(np.polyval(np.polyder(gap), root.real)))
    return count


def _square(P: np.ndarray) -> np.ndarray:
    """|P(jω)|² as a polynomial in ω²."""
    turned = P * 1j ** np.arange(len(P) - 1, -1, -1)
    return np.polymul(turned, turned.conj()).real[::2]


def predicted_loop(k: float, dead_time: float, assumed: float) -> Loop:
    """Smith's predictor around e^(−sT)/(s + 1): the measurement plus the model's output less that output made late.

    1 + k (1 + e^(−sT) − e^(−s·assumed))/(s + 1): with the right dead time 1 + k/(s + 1).
    """
    plant = Plant(
        A=-np.eye(2), B=np.array([[1.0, 0, 0], [1.0, 0, 0]]),
        C=np.array([[1.0, 0], [0, 1.0], [0, 1.0]]), D=np.array([[0, 0, 0], [0, 0, 0], [0, 1.0, -1.0]]),
        states=("x", "xm"), inputs=("u", "late y", "late ym"), outputs=("y", "ym", "e"),
    )  # fmt: skip
    lines = (DelayLine("y", "late y", dead_time), DelayLine("ym", "late ym", assumed))
    return Loop(Model("predicted", plant, lines=lines), Structure(gain("-e", "u", k)))

"""A simply supported span of the guideway: its lowest modes of bending.

    beam (length, stiffness, mass per length) ──► shapes sin(kπx/L), masses μL/2, frequencies (kπ/L)² √(EI/μ)

A load p(x) moves mode k by  M (q̈ + 2ζω q̇ + ω² q) = ∫ p sin(kπx/L) dx;  deflection w(x) = Σ q_k sin(kπx/L), down.
Source: Frýba, Vibration of Solids and Structures under Moving Loads (1999), ch. 1 and 6.
"""

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.errors import InputError


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """A beam of Euler and Bernoulli on two hinges.

    Parameters
    ----------
    length : float
        [m]
    bending_stiffness : float
        EI [N m²].
    mass_per_length : float
        μ [kg/m].
    damping : float
        Ratio of every mode [1].
    modes : int
        How many are kept.
    """

    length: float
    bending_stiffness: float
    mass_per_length: float
    damping: float = 0.005
    modes: int = 3

    def __post_init__(self) -> None:
        for name, unit in (("length", "m"), ("bending_stiffness", "N m²"), ("mass_per_length", "kg/m")):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(f"Span.{name} must be positive and finite; got {getattr(self, name)!r} {unit}.")
        if not 0 <= self.damping < 1:
            raise InputError(f"Span.damping must be a ratio of 0 or more, below 1; got {self.damping!r}.")
        if self.modes < 1:
            raise InputError(f"Span.modes must be 1 or more; got {self.modes!r}. Three hold 99.8 % of a deflection.")

    @property
    def modal_mass(self) -> float:
        """Of every mode, μL/2 [kg]."""
        return self.mass_per_length * self.length / 2

    @property
    def frequencies(self) -> np.ndarray:
        """ω_k (modes,) [rad/s]."""
        k = np.arange(1, self.modes + 1)
        return (k * np.pi / self.length) ** 2 * math.sqrt(self.bending_stiffness / self.mass_per_length)

    def shapes(self, place):
        """sin(kπx/L) as a column (modes,) at a place x [m], number or symbol; zero beyond the supports is the caller's
        affair.
        """
        return ca.vertcat(*(ca.sin(k * ca.pi * place / self.length) for k in range(1, self.modes + 1)))

    def acceleration(self, q, rate, force, place):
        """q̈ (modes,) [m/s²] under a force down [N] at a place; q, rate : (modes,)."""
        omega = ca.DM(self.frequencies)
        return force * self.shapes(place) / self.modal_mass - 2 * self.damping * omega * rate - omega**2 * q

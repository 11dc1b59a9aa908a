"""What one can ask of a system alone, dead times and sampling exact.

lined system --poles-----------> located, and counted on the right
             --unstable_poles--> counted
             --abscissa--------> located and counted
             --peak------------> sup σ_max(G), a certified bracket: Hamiltonian, or branch and bound with dead times
             --rms-------------> outputs under white noise: Lyapunov, or the method of steps with dead times
             --margins---------> of the negative feedback around it, channel by channel
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from workbench.errors import InputError
from workbench.lti import count, roots
from workbench.lti.bilinear import in_w_plane, unwarped
from workbench.lti.delay import LinedSystem, rational
from workbench.lti.energy import energy_by_doubling
from workbench.lti.grid import seeds
from workbench.lti.march import Lined, step_pieces
from workbench.lti.margin import ChannelMargins, sensitivity
from workbench.lti.margin import margins as margins_of
from workbench.lti.norm import Peak, h2_norm, peak_gain
from workbench.lti.peak_bound import CLOSE, bracket, farther
from workbench.lti.peak_ceiling import Panels, enclosure, gain_ceiling
from workbench.lti.peak_search import local_peaks
from workbench.lti.realisation import Realisation
from workbench.lti.weight import profile_of

TINY = float(np.finfo(float).tiny)  # |z| of a pole that ends within a sample


def delayed(system: LinedSystem) -> bool:
    """Whether the system has dead times that no finite number of states holds."""
    return system.sample_time is None and len(system.dead_times) > 0


def poles(system: LinedSystem) -> np.ndarray:
    """Poles (k,), nothing cancelled; in z if sampled.

    With dead times, of infinitely many, those that collocation locates, the rightmost among them: as many on the right
    of the axis as the argument principle counts there.

    Raises InputError where that cannot be had.
    """
    if not delayed(system):
        return np.linalg.eigvals(rational(system, 1).A)
    found = roots.spectrum(system.A, system.late())
    right = count.unstable_poles(system.A, system.late())
    if int(np.sum(found.real >= -roots.SAME * np.abs(found))) < right:
        raise InputError(
            f"the poles right of the axis must be located as they are counted; of {right} counted "
            f"{int(np.sum(found.real >= 0))} were found. Shorten the dead times beside the fastest pole."
        )
    return found


def unstable_poles(system: LinedSystem) -> int:
    """How many poles are on or beyond the stability limit."""
    if delayed(system):
        return count.unstable_poles(system.A, system.late())
    return beyond(poles(system), system.sample_time)


def abscissa(system: LinedSystem) -> float:
    """Largest real part of the poles [1/s], of log(z)/h if sampled; −∞ without any."""
    if delayed(system):
        return roots.abscissa(system.A, system.late())
    return rightmost(poles(system), system.sample_time)


def beyond(poles: np.ndarray, sample_time: float | None) -> int:
    """How many of some poles (k,), in z if sampled, are on or beyond the stability limit."""
    return int(np.sum(poles.real >= 0 if sample_time is None else np.abs(poles) >= 1))


def rightmost(poles: np.ndarray, sample_time: float | None) -> float:
    """Largest real part [1/s], of log(z)/h if sampled; −∞ of none."""
    h = sample_time
    return float((poles.real if h is None else np.log(np.maximum(np.abs(poles), TINY)) / h).max(initial=-np.inf))


def peak(system: LinedSystem) -> Peak:
    """The H∞ norm of a stable system, between a gain attained and one that is exceeded nowhere.

    Raises InputError if the system is unstable.
    """
    _stable(system, "peak")
    if not delayed(system):
        flat, h = rational(system, 1), system.sample_time
        return peak_gain(*flat) if h is None else sampled_peak(*flat, h)
    matrices, late = Realisation(system.A, system.B, system.C, system.D), system.late()
    ceiling = gain_ceiling(enclosure(matrices, late), None, None, profile_of("limit", 1.0), 1, None)

    def size(omega: np.ndarray) -> np.ndarray:
        return np.linalg.svd(system.response(omega), compute_uv=False)[:, 0]

    grid = seeds(roots.spectrum(system.A, late), np.zeros(0), (0.0, math.inf))
    grid = grid[np.isfinite(grid)]
    longest = float(system.dead_times.max())
    grid, rest = farther(grid, longest, local_peaks(size, grid)[0][1], lambda start: ceiling.beyond(start, start))
    found = bracket(size, lambda low, high: ceiling.above(Panels(low, high, low, high)), grid, CLOSE, rest)
    return Peak(value=found.value, frequency=found.frequency, lower=found.value, upper=found.upper, rounding=0.0)


def sampled_peak(A, B, C, D, sample_time: float) -> Peak:
    """The largest gain of a stable sampled system over all frequencies up to half the sampling rate.

    The bilinear map takes the unit circle to the imaginary axis and keeps the gain, so the certified bracket of the
    continuous case holds.
    """
    system = in_w_plane(Realisation(*(np.asarray(M, float) for M in (A, B, C, D))), sample_time)
    if system is None:
        raise InputError("a sampled system must have no pole at z = −1, its stability limit; it has. Stabilise it.")
    found = peak_gain(*system)
    return replace(found, frequency=float(unwarped(found.frequency, sample_time)))


def rms(system: LinedSystem) -> float:
    """The H₂ norm: rms of all outputs together under unit white noise at every input, of variance 1/h if sampled.

    Unit two-sided intensity: density 1 per hertz from −∞ to ∞. Raises InputError if the system is unstable or noise
    passes straight through.
    """
    _stable(system, "rms under white noise")
    if delayed(system):
        whole = Lined(system.A, system.B, system.C, system.D, system.late())
        if whole.straight():
            raise InputError("white noise must not pass straight to an output, where it is infinite. Add a filter.")
        return math.sqrt(step_pieces(whole).energy(0))
    A, B, C, D = rational(system, 1)
    if system.sample_time is not None:
        square = energy_by_doubling(A, B, C, sampled=True) + float(np.sum(D**2))
        return math.sqrt(square / system.sample_time)
    if D.any():
        raise InputError("white noise must not pass straight to an output, where it is infinite. Add a filter.")
    return h2_norm(A, B, C)


def margins(system: LinedSystem, channels: Sequence[str] | None = None) -> ChannelMargins:
    """Margins of the loop that negative feedback around the system closes; continuous and without dead times.

    Raises InputError otherwise, and if the closed loop is unstable.
    """
    if delayed(system) or system.sample_time is not None:
        raise InputError(
            "margins of a system alone are computed for continuous ones without dead times; ask a loop for others, "
            "which `goals.Margins` and `goals.DelayMargin` judge."
        )
    return margins_of(*sensitivity(*rational(system, 1)), channels=channels)


def _stable(system: LinedSystem, what: str) -> None:
    unstable = unstable_poles(system)
    if unstable:
        raise InputError(
            f"the {what} of a system exists if it is stable; this one has {unstable} poles on or beyond the stability "
            "limit. Close a loop around it first."
        )

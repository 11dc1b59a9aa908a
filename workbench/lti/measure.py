"""What one can ask of a system alone, dead times and sampling exact.

lined system --poles-----------> located, and counted on the right
             --unstable_poles--> counted
             --abscissa--------> located and counted
"""

import numpy as np

from workbench.errors import InputError
from workbench.lti import count, roots
from workbench.lti.delay import LinedSystem, rational

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
    found = poles(system)
    return int(np.sum(found.real >= 0 if system.sample_time is None else np.abs(found) >= 1))


def abscissa(system: LinedSystem) -> float:
    """Largest real part of the poles [1/s], of log(z)/h if sampled; −∞ without any."""
    if delayed(system):
        return roots.abscissa(system.A, system.late())
    found, h = poles(system), system.sample_time
    return float((found.real if h is None else np.log(np.maximum(np.abs(found), TINY)) / h).max(initial=-np.inf))

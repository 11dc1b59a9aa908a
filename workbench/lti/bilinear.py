"""Between samples and time by s = (2/h)(z − 1)/(z + 1): the unit circle becomes the axis, every response is kept.

    sampled system --in_w_plane--> continuous system with the same gains, at ω --warped--> (2/h) tan(ωh/2)
    continuous filter --tustin---> sampled system

Both keep the Gramians too: √h stands beside B and C.
"""

import math

import numpy as np

from workbench.lti.realisation import Realisation, balanced


def warped(omega, sample_time: float) -> np.ndarray:
    """(2/h) tan(ωh/2) of (k,) [rad/s], infinite at and beyond π/h."""
    angle = np.asarray(omega, float) * sample_time / 2
    inside = angle < math.pi / 2 * (1 - 1e-14)
    return np.where(inside, np.tan(np.where(inside, angle, 0.0)), math.inf) * (2 / sample_time)


def unwarped(omega, sample_time: float) -> np.ndarray:
    """(2/h) atan(ωh/2): the true frequency of one in the w plane, π/h of infinity."""
    return 2 / sample_time * np.arctan(np.asarray(omega, float) * sample_time / 2)


def in_w_plane(system: Realisation, sample_time: float) -> Realisation | None:
    """The continuous system with the same response at s = (2/h)(z − 1)/(z + 1); None with a pole at z = −1.

    The states are balanced first; then I + A of a loop without a pole on the circle is as regular as that pole is far.
    """
    A, B, C, D = balanced(*system)
    eye = np.eye(len(A))
    try:
        inverse = np.linalg.inv(eye + A)
    except np.linalg.LinAlgError:
        return None
    root = 2 / math.sqrt(sample_time)
    return Realisation(
        (2 / sample_time) * inverse @ (A - eye), root * inverse @ B, root * C @ inverse, D - C @ inverse @ B
    )


def tustin(system: Realisation, sample_time: float) -> Realisation:
    """A continuous system sampled by Tustin's rule, without prewarping; no pole at 2/h."""
    A, B, C, D = system
    half = A * (sample_time / 2)
    inverse = np.linalg.inv(np.eye(len(A)) - half)
    root = math.sqrt(sample_time)
    return Realisation(
        inverse @ (np.eye(len(A)) + half), root * inverse @ B, root * C @ inverse,
        D + C @ inverse @ B * (sample_time / 2),
    )  # fmt: skip

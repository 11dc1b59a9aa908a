"""Field of a loop and the force of one loop on another, by Biot–Savart and Lorentz: an oracle independent of
inductance.

    WireLoop, current  -->  magnetic_field at points  -->  I ds × B summed along the other loop  -->  force, torque

Numbers only (NumPy); the closed-form field of each straight filament, Gauss quadrature along the loop that feels it.
"""

import numpy as np

from workbench.errors import InputError
from workbench.physics.coils.inductance import NEUMANN, gauss_nodes
from workbench.physics.coils.loop import WireLoop


def magnetic_field(loop: WireLoop, current: float, points) -> np.ndarray:
    """Flux density of a loop.

    Parameters
    ----------
    loop : WireLoop
        Numeric.
    current : float
        Ampere-turns [A].
    points : (k, 3) array_like
        Places off the filaments [m].

    Returns
    -------
    (k, 3) ndarray
        B [T].

    Source: Biot–Savart for a straight filament, B = μ0 I/4π · a×b (|a|+|b|) / (|a||b| (|a||b| + a·b)), with a and b
    from its start and end to the point.

    Examples
    --------
    >>> field = magnetic_field(WireLoop.rectangle(2.0, 2.0), 1000.0, [[0.0, 0.0, 0.0]])
    >>> print(f"{field[0, 2]:.4e} T")  # 2 sqrt(2) mu_0 I / (pi a) at the centre of a square of side a
    5.6569e-04 T
    """
    start, side = _arrays(loop)
    points = np.atleast_2d(np.asarray(points, dtype=float))
    a = points[:, None, :] - start
    b = a - side
    size_a, size_b = np.linalg.norm(a, axis=-1), np.linalg.norm(b, axis=-1)
    product = size_a * size_b
    factor = (size_a + size_b) / (product * (product + np.sum(a * b, axis=-1)))
    return NEUMANN * current * np.sum(np.cross(a, b) * factor[..., None], axis=1)


def lorentz_force(
    loop_a: WireLoop,
    current_a: float,
    loop_b: WireLoop,
    current_b: float,
    about=(0.0, 0.0, 0.0),
    order: int = 32,
    panels: int = 4,
) -> tuple[np.ndarray, np.ndarray]:
    """Force and torque on `loop_b` in the field of `loop_a`.

    Parameters
    ----------
    loop_a, loop_b : WireLoop
        Numeric.
    current_a, current_b : float
        Ampere-turns [A].
    about : (3,) array_like
        Point about which the torque is taken [m].
    order, panels : int
        Gauss points per panel and panels per side of `loop_b`.

    Returns
    -------
    force, torque : (3,) ndarray each
        [N] and [N m].
    """
    start, side = _arrays(loop_b)
    t, weight = np.array(gauss_nodes(order, panels)).T
    points = (start[:, None, :] + t[:, None] * side[:, None, :]).reshape(-1, 3)
    element = (weight[:, None] * side[:, None, :]).reshape(-1, 3)
    pull = current_b * np.cross(element, magnetic_field(loop_a, current_a, points))
    return pull.sum(axis=0), np.cross(points - np.asarray(about, dtype=float), pull).sum(axis=0)


def _arrays(loop: WireLoop) -> tuple[np.ndarray, np.ndarray]:
    if not loop.numeric:
        raise InputError(
            "the Lorentz sum needs a loop of numbers; got symbols. Use mutual_inductance and its gradient for symbols."
        )
    return np.array(loop.vertices), np.array(loop.sides)

"""A stabilising start: parameters for which every model's loop is stable.

    loops, structure --stabilise--> Stabilised: theta, its decay;  or a refusal that names the eigenvalue that remained

The largest real part of the closed loops' eigenvalues (for discrete loops log|z|/h, the real part of the continuous
eigenvalue it samples) is minimised by the nonsmooth solver from the structure's start and from random ones.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from workbench.control.structure.block import Controller
from workbench.control.structure.channel import Channel
from workbench.control.structure.loop import Loop
from workbench.control.structure.modes import Modes, eigenvalues
from workbench.control.structure.structure import Structure
from workbench.errors import InfeasibleError, InputError
from workbench.lti.algebraic import IllPosedError
from workbench.result import Result, Row
from workbench.solve.nonsmooth import minimise

FURTHER = 12  # eigenvalues beside the rightmost that are pieces of the function
ZERO = 1e-300  # modulus below which a discrete eigenvalue counts as settled at once
RELATIVE_MARGIN = 1e-6  # default margin, over the fastest pole of the start
ZERO_START = 1.0  # typical size of a parameter that starts at zero


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Stabilised(Result):
    """Parameters that stabilise every loop."""

    theta: np.ndarray  # (n,) free parameters
    abscissa: float  # [1/s] largest real part, below −margin
    margin: float
    starts: int  # used up
    seconds: float

    def rows(self) -> list[Row]:
        """Decay, starts, time."""
        return [
            ("largest real part", self.abscissa, "1/s"),
            ("starts used", self.starts, ""),
            ("time", self.seconds, "s"),
        ]


class Abscissa:
    """theta → the rightmost eigenvalues of all loops [1/s], each with its gradient."""

    def __init__(self, loops: Sequence[Loop], structure: Structure) -> None:
        self._structure = structure
        self._loops = [(loop, loop.channel((), ()), loop.sample_time) for loop in loops]

    def __call__(self, theta: np.ndarray) -> list[tuple[float, np.ndarray]]:
        """Pieces (value, gradient (n,)), none where matrices are infinite or an algebraic loop has no solution."""
        K = self._structure.controller(theta)
        pieces = []
        for _, channel, h in self._loops:
            poles, pull = _modes(channel, K)
            if not np.isfinite(poles).all():
                return []
            keep = np.flatnonzero((poles.imag >= 0) & ((np.abs(poles) >= ZERO) | (h is None)))
            size = _size(poles[keep], h)
            for i in np.argsort(-size)[: FURTHER + 1]:
                k = int(keep[i])
                G = pull(k, 1.0 if h is None else 1 / (poles[k] * h))
                pieces.append((float(size[i]), self._structure.pullback(theta, G)))
        return pieces or [(-math.inf, np.zeros(len(theta)))]

    def value(self, theta: np.ndarray) -> float:
        """The largest alone [1/s], infinite where the loop has no finite matrices or an algebraic loop no solution."""
        return self.worst(theta)[0]

    def worst(self, theta: np.ndarray) -> tuple[float, complex, str]:
        """(largest real part [1/s], the eigenvalue, its model)."""
        K = self._structure.controller(theta)
        found = (-math.inf, complex(-math.inf), "")
        for loop, channel, h in self._loops:
            try:
                values = channel.poles(K)
            except (IllPosedError, np.linalg.LinAlgError):  # the latter for matrices that are not finite
                return math.inf, complex(math.inf), loop.name
            size = _size(values, h)
            if len(values) and size.max() > found[0]:
                k = int(np.argmax(size))
                found = (float(size[k]), complex(values[k]), loop.name)
        return found


def _modes(channel: Channel, K: Controller) -> Modes:
    """The closed loop's poles, infinite where an algebraic loop has no solution: outside the domain."""
    try:
        return channel.modes(K)
    except IllPosedError:
        return eigenvalues(np.full((1, 1), np.inf), lambda GA: K)


def _size(values: np.ndarray, h: float | None) -> np.ndarray:
    """Real part of a continuous eigenvalue, log|z|/h of a discrete one [1/s]."""
    return values.real if h is None else np.log(np.maximum(np.abs(values), ZERO)) / h


def parameter_scale(structure: Structure) -> np.ndarray:
    """Typical size (n,) of each free parameter: its start, else a quarter of its range, else 1."""
    start, box = structure.start, structure.bounds
    width = box[:, 1] - box[:, 0]
    other = np.where(np.isfinite(width) & (width > 0), width / 4, ZERO_START)
    size = np.where(start != 0, np.abs(start), other)
    return np.where(np.isfinite(width) & (width > 0), np.minimum(size, width), size)


def random_start(structure: Structure, centre: np.ndarray, generator: np.random.Generator) -> np.ndarray:
    """A random point of the box: every parameter scattered around the centre by up to three of its sizes."""
    size = parameter_scale(structure) * 10 ** generator.uniform(-1, 0.5)
    box = structure.bounds
    return np.clip(centre + size * generator.normal(size=len(centre)), box[:, 0], box[:, 1])


def stabilise(
    loops: Sequence[Loop], structure: Structure, *, margin: float | None = None, start=None, starts: int = 6,
    seed: int = 0, budget_seconds: float = 20.0,
    on_step: Callable[[np.ndarray, float], bool | None] | None = None,
) -> Stabilised:  # fmt: skip
    """Free parameters for which every loop's eigenvalues lie left of −margin.

    Parameters
    ----------
    loops : one per model, all with this structure
    structure : Structure
    margin : float
        Decay wanted [1/s]; 1e-6 of the fastest pole at the start if left out.
    start : (n,), optional
        The structure's own start if left out.
    starts, seed, budget_seconds : int, int, float
        The first start is `start`, the others random around it within the bounds.
    on_step : (theta, value) → bool, optional
        Called after every step; True gives up.

    Raises
    ------
    InputError
        If there is nothing to tune and the loop is unstable, or the start has the wrong size.
    InfeasibleError
        If no start gets there; names the eigenvalue that remained and its model.
    """
    begun = perf_counter()
    centre = structure.start if start is None else np.asarray(start, float).ravel()
    if centre.shape != structure.start.shape:
        raise InputError(
            f"start must hold {len(structure.start)} numbers ({', '.join(structure.names)}); got {len(centre)}."
        )
    if starts < 1:
        raise InputError(f"starts must be at least 1; got {starts!r}. Four is usual.")
    measure = Abscissa(loops, structure)
    if margin is None:
        K = structure.controller(centre)
        fastest = max(
            (float(np.abs(loop.poles(K)).max(initial=0.0)) for loop in loops if loop.sample_time is None), default=0.0
        )
        margin = RELATIVE_MARGIN * fastest
    generator = np.random.default_rng(seed)
    best, least, used = centre, math.inf, 0
    for k in range(starts):
        left = budget_seconds - (perf_counter() - begun)
        if k and left <= 0:
            break
        theta, used = (centre if k == 0 else random_start(structure, centre, generator)), k + 1
        value = measure.value(theta)
        if len(theta) and math.isfinite(value) and value >= -margin:
            found = minimise(
                measure, theta, bounds=structure.bounds, scale=parameter_scale(structure), stop_below=-margin,
                tolerance=1e-6, evaluations=3000, seed=seed, on_step=on_step,
                budget_seconds=max(left / (starts - k), 1e-2),
            )  # fmt: skip
            theta, value = found.x, measure.value(found.x)
        if value < least:
            best, least = theta, value
        if least < -margin:
            return Stabilised(theta=best, abscissa=least, margin=margin, starts=used, seconds=perf_counter() - begun)
        if len(theta) == 0:
            break
    value, pole, model = measure.worst(best)
    shown = f"{pole.real:.4g} ± {abs(pole.imag):.4g}j" if abs(pole.imag) > 0 else f"{pole.real:.4g}"
    raise InfeasibleError(
        f"every loop must be stable with {margin:.3g} 1/s to spare; the best of {used} starts leaves the eigenvalue "
        f"{shown} of {model!r} ({value:.4g} 1/s). Free a parameter, widen bounds, or give the controller more states."
    )

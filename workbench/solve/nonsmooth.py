"""Minimising a maximum of pieces with exact gradients, infinite outside its domain.

    function(x) -> pieces (value, gradient)  --minimise-->  Minimum: x, value, how stationary

Two phases. Descent: each step minimises the largest of the linearised pieces plus a quadratic whose matrix is learnt by
BFGS, over the box; then a line search that ends in a weak Wolfe point. The quadratic learns the curvature of the convex
combination of pieces the step was made of, so kinks between known pieces cost nothing; with a single piece this is
BFGS as Lewis and Overton use it, which learns kinks as large curvature. Polish: gradients collected within a
shrinking radius, those met before first and random ones after; their smallest convex combination gives either a
descent direction or the certificate.

Bounds are part of the step's model: points never leave the box, and no variable is transformed.

Source: Lewis & Overton, Math. Program. 141 (2013) 135; Burke, Lewis & Overton, SIAM J. Optim. 15 (2005) 751;
Curtis, Mitchell & Overton, Optim. Methods Softw. 32 (2017) 148.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from workbench.errors import InputError
from workbench.result import Result, Row
from workbench.solve.direction import shortest, simplex_direction
from workbench.solve.memory import Curvature, Memory, Point

Pieces = Sequence[tuple[float, np.ndarray]]
Function = Callable[[np.ndarray], Pieces]

ARMIJO, WOLFE = 1e-4, 0.5  # weak Wolfe constants of Lewis & Overton
TRIES = 40  # halvings and doublings of one line search
ENOUGH = 5  # tries after which any decrease will do
STALLS = 3  # steps in a row below the tolerance that end a descent
WORTHWHILE = 100  # tolerances gained since the metric was new for which a descent is repeated with a new one
FARTHEST = 30.0  # length of a step, relative to 1 + |x| in the solver's units: beyond, a line search tells nothing
NOTHING = 1e-12  # of the first value: what is that small counts as zero
RADII = (1e-3, 1e-5)  # of the polish, relative to 1 + |x| in the solver's units
POLISHES = 5  # steps of one radius


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Minimum(Result):
    """Where the solver stopped, and how close to stationary that is.

    `stationarity` is the norm of the smallest convex combination of gradients at points within `radius` of x (pull of
    the bounds counted in), in units of value per scaled variable: zero at an exactly stationary point, as radius → 0.
    """

    x: np.ndarray  # (n,)
    value: float
    stationarity: float
    radius: float
    evaluations: int
    steps: int
    seconds: float
    message: str  # why it stopped

    def rows(self) -> list[Row]:
        """Value, certificate, cost."""
        return [
            ("value", self.value, ""),
            ("stationarity", self.stationarity, ""),
            ("radius", self.radius, ""),
            ("evaluations", self.evaluations, ""),
            ("time", self.seconds, "s"),
            ("stopped", self.message, ""),
        ]


class _Stop(Exception):
    """Ends the run from inside an evaluation; carries the reason."""


def minimise(
    function: Function,
    x0,
    *,
    bounds=None,
    scale=None,
    metric=None,
    tolerance: float = 1e-7,
    size: float | None = None,
    stop_below: float = -math.inf,
    budget_seconds: float = 60.0,
    evaluations: int = 20_000,
    polish: bool = True,
    seed: int = 0,
    on_step: Callable[[np.ndarray, float], bool | None] | None = None,
) -> Minimum:
    """A local minimum of a maximum of pieces.

    Parameters
    ----------
    function : x (n,) → list of (value, gradient (n,))
        At least the largest piece; others near the largest make steps better. Outside the domain: an empty list or a
        value of +inf.
    x0 : (n,)
        Inside the domain; clipped to the bounds.
    bounds : (n, 2), optional
        Lowest and highest value, infinite where there is none.
    scale : (n,), optional
        Typical sizes of the variables; 1 if left out.
    metric : (n, n), optional
        A factor L of a first guess L L' of the inverse Hessian, in the units of x and up to a multiple; the scale's
        own diag(scale) if left out. Where variables act together, as gains on nearly parallel signals do, a good guess
        saves hundreds of steps.
    tolerance : float
        Decrease per step, relative to `size`, below which descent has ended.
    size : float, optional
        What a decrease is relative to; |value| if left out, so that the value's unit does not matter. 1 for logarithms.
    stop_below : float
        Ends as soon as a value below this is met.
    budget_seconds, evaluations : float, int
        Whichever is used up first ends the run; the best point so far is returned.
    polish : bool
        Whether the second phase follows; without it the certificate uses only the gradients at hand.
    seed : int
        Of the random points of the polish; nothing else is random.
    on_step : (x, value) → bool, optional
        Called after each step; True ends the run.

    Raises
    ------
    InputError
        If x0 is outside the domain, or sizes or bounds do not fit.
    """
    start = np.asarray(x0, float).ravel()
    box = _box(bounds, len(start))
    units = np.ones(len(start)) if scale is None else np.asarray(scale, float).ravel()
    if units.shape != start.shape or not np.all(units > 0):
        raise InputError(f"scale must hold {len(start)} positive sizes; got {units.tolist()}. Give one per variable.")
    start = np.clip(start, box[:, 0], box[:, 1])
    shape = np.diag(units) if metric is None else np.asarray(metric, float)
    if shape.shape != (len(units), len(units)) or not np.all(np.isfinite(shape)) or not shape.any():
        raise InputError(
            f"metric must be a finite, nonzero matrix of shape {(len(units), len(units))}; got {shape.shape}. Mend it."
        )
    shape = shape / units[:, None]
    solver = _Solver(
        function, units, box / units[:, None], shape, size, stop_below, budget_seconds, evaluations, on_step
    )
    first = solver.begin(start / units)
    if not math.isfinite(first.value):
        raise InputError(
            f"the start must lie in the function's domain; its value is {first.value}. Stabilise first, or move it."
        )
    try:
        message = solver.descend(tolerance)
        generator = np.random.default_rng(seed)
        while polish and solver.polish(tolerance, generator):
            message = solver.descend(tolerance)
    except _Stop as reason:
        message = str(reason)
    return solver.result(message)


def _box(bounds, n: int) -> np.ndarray:
    box = np.tile([-np.inf, np.inf], (n, 1)) if bounds is None else np.asarray(bounds, float)
    if box.shape != (n, 2) or not np.all(box[:, 0] <= box[:, 1]):
        raise InputError(
            f"bounds must be {n} pairs (low, high) with low <= high; got {str(box.tolist())[:80]}. Mend them."
        )
    return box


class _Solver:
    """One run: the points evaluated, the best of them, the metric."""

    def __init__(self, function, units, box, shape, size, stop_below, budget, evaluations, on_step) -> None:
        self._function, self._units, self._box, self._shape, self._given_size = function, units, box, shape, size
        self._stop_below, self._deadline, self._limit = stop_below, perf_counter() + budget, evaluations
        self._on_step, self._started = on_step, perf_counter()
        self._count, self._steps = 0, 0
        self._memory = Memory(len(units))
        self._radius = RADII[0]
        self._here: Point
        self._first: Point

    # evaluations

    def begin(self, x: np.ndarray) -> Point:
        self._here = self._first = self._point(x)
        self._curvature = Curvature(len(x), self._shape)
        return self._here

    def _point(self, x: np.ndarray) -> Point:
        """The function at x in the solver's units, largest piece first; remembered."""
        if self._count >= self._limit:
            raise _Stop("the evaluations are used up")
        if perf_counter() > self._deadline and self._count:
            raise _Stop("the time is used up")
        self._count += 1
        x = np.clip(x, self._box[:, 0], self._box[:, 1])
        pieces = [
            (float(value), np.asarray(gradient, float) * self._units)
            for value, gradient in self._function(x * self._units)
            if math.isfinite(value) and np.all(np.isfinite(gradient))
        ]
        point = Point.of(x, pieces)
        self._memory.add(point)
        return point

    def _move(self, point: Point) -> None:
        """Makes an accepted point the current one and tells whoever listens."""
        self._here = point
        self._steps += 1
        if self._on_step is not None and self._on_step(point.x * self._units, point.value):
            raise _Stop("stopped by the caller")
        if point.value < self._stop_below:
            raise _Stop("the wanted value is reached")

    def _size(self) -> float:
        """What a decrease is relative to; see `minimise`."""
        if self._given_size is not None:
            return self._given_size
        return max(abs(self._here.value), NOTHING * abs(self._first.value)) or 1.0

    def _room(self) -> tuple[np.ndarray, np.ndarray]:
        return self._box[:, 0] - self._here.x, self._box[:, 1] - self._here.x

    # phase one

    def descend(self, tolerance: float) -> str:
        """Model steps with a line search until nothing is gained."""
        if self._here.value < self._stop_below:
            raise _Stop("the wanted value is reached")
        stalled, reason, since = 0, "", self._here.value
        while True:
            here = self._here
            size = self._size()
            found = self._direction(here)
            point = None
            if -found.slope <= 1e-3 * tolerance * size:
                reason = "no descent direction is left"
            else:
                point = self._search(found.step, found.slope)
                reason = "the line search found no decrease"
            if point is not None:
                gain = here.value - point.value
                self._curvature.learn(here, point, found.weights)
                self._move(point)
                stalled = stalled + 1 if gain <= tolerance * size else 0
                if stalled < STALLS:
                    continue
                reason = "steps gain less than the tolerance"
            if self._curvature.blank or since - self._here.value <= WORTHWHILE * tolerance * size:
                return reason
            self._curvature.forget()  # a metric that learnt kinks as curvature may be what ended it
            stalled, since = 0, self._here.value

    def _direction(self, here: Point):
        low, high = self._room()
        gradients, gaps = here.gradients, here.gaps
        cuts = self._memory.cuts(here)
        if cuts is not None:
            gradients, gaps = np.vstack([gradients, cuts[0]]), np.r_[gaps, cuts[1]]
        return simplex_direction(gradients, gaps, self._curvature.factor(here), low, high)

    def _search(self, step: np.ndarray, slope: float) -> Point | None:
        """A point with enough decrease and, unless box or tries end it, a flatter slope; None if no decrease."""
        here = self._here
        low, high = self._room()
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = np.where(step > 0, high / step, np.where(step < 0, low / step, np.inf))
        length = float(np.linalg.norm(step)) or 1.0
        farthest = min(float(np.min(reach)), FARTHEST * (1 + float(np.linalg.norm(here.x))) / length)
        near, far, t = 0.0, math.inf, min(1.0, farthest) if farthest > 0 else 1.0
        best: Point | None = None
        for k in range(TRIES):
            point = self._point(here.x + t * step)
            if not point.value <= here.value + ARMIJO * t * slope or point.value >= here.value:
                far = t
            else:
                best = point
                if point.gradients[0] @ step >= WOLFE * slope or t >= farthest:
                    return point
                near = t
            if math.isfinite(far):
                t = (near + far) / 2 if near > 0 else far * (0.5 if k < 2 else 0.2)
            else:
                t = min((2 if k == 0 else 5) * t, farthest)
            if best is not None and (k >= ENOUGH or far - near < 1e-3 * far):
                return best
        return best

    # phase two

    def polish(self, tolerance: float, generator: np.random.Generator) -> bool:
        """Steps along smallest convex combinations of gradients collected within shrinking radii.

        True as soon as a step has gained enough for another descent to be worth while.
        """
        for radius in RADII:
            self._radius = radius
            for _ in range(POLISHES):
                gradients = self._collected(radius, generator, len(self._here.x) + 1)
                low, high = self._room()
                size = self._size()
                found = simplex_direction(
                    gradients, np.zeros(len(gradients)), self._curvature.factor(self._here), low, high
                )
                if -found.slope <= 1e-3 * tolerance * size:
                    break
                before = self._here.value
                point = self._search(found.step, found.slope)
                if point is None:
                    break
                self._move(point)
                if before - point.value > WORTHWHILE * tolerance * size:
                    return True
        return False

    def _collected(self, radius: float, generator: np.random.Generator, wanted: int) -> np.ndarray:
        """Gradients at points within the radius, new random ones until there are enough."""
        here = self._here
        length = radius * (1 + float(np.linalg.norm(here.x)))
        found = self._memory.within(here, length)
        while len(found) < wanted + len(here.gradients):
            offset = generator.normal(size=len(here.x))
            offset *= length * generator.random() ** (1 / len(here.x)) / np.linalg.norm(offset)
            point = self._point(here.x + offset)
            if math.isfinite(point.value):
                found.append(point.gradients[0])
            else:
                length /= 2  # the edge of the domain is closer than that
                if length < 1e-14:
                    break
        return np.array(found)

    def result(self, message: str) -> Minimum:
        here = self._here
        length = self._radius * (1 + float(np.linalg.norm(here.x)))
        norm, _ = shortest(np.array(self._memory.within(here, length)), *self._room())
        return Minimum(
            x=here.x * self._units, value=here.value, stationarity=norm, radius=length, evaluations=self._count,
            steps=self._steps, seconds=perf_counter() - self._started, message=message,
        )  # fmt: skip

"""What a nonsmooth run remembers: the points it evaluated, and the curvature it has learnt.

pieces --Point--> Memory --cuts, within--> gradients of nearby points
two points and a convex combination --Curvature.learn--> metric of the next step
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

KEPT = 100  # points remembered


@dataclass(frozen=True, slots=True)
class Point:
    """The function at x: value, and per piece the gradient and how far it lies below the largest (which is first)."""

    x: np.ndarray
    value: float
    gradients: np.ndarray  # (k, n); k = 0 outside the domain
    gaps: np.ndarray  # (k,)

    @classmethod
    def of(cls, x: np.ndarray, pieces: list[tuple[float, np.ndarray]]) -> "Point":
        """The point of a list of pieces, in any order; empty means outside the domain."""
        if not pieces:
            return cls(x, math.inf, np.zeros((0, len(x))), np.zeros(0))
        order = sorted(range(len(pieces)), key=lambda k: -pieces[k][0])
        value = pieces[order[0]][0]
        gradients = np.array([pieces[k][1] for k in order]).reshape(len(order), len(x))
        return cls(x, value, gradients, np.array([value - pieces[k][0] for k in order]))


class Memory:
    """The last points evaluated."""

    def __init__(self, size: int) -> None:
        self._points: deque[Point] = deque(maxlen=max(KEPT, 4 * size))

    def add(self, point: Point) -> None:
        if math.isfinite(point.value):
            self._points.append(point)

    def within(self, here: Point, radius: float) -> list[np.ndarray]:
        """Gradients of the pieces that are largest here or, to first order, somewhere within the radius; then of the
        largest piece at each remembered point within it."""
        first = here.gradients[0]
        reach = radius * np.linalg.norm(here.gradients - first, axis=1)  # how much a piece can gain on the largest
        found = list(here.gradients[here.gaps <= reach])
        for point in self._points:
            if point is not here and float(np.linalg.norm(point.x - here.x)) <= radius:
                found.append(point.gradients[0])
        return found

    def cuts(self, here: Point, last: int = 3) -> tuple[np.ndarray, np.ndarray] | None:
        """Largest pieces of the last few points as linear pieces at x, with gaps made safe for nonconvex functions."""
        gradients, gaps = [], []
        for point in list(self._points)[-last - 1 :]:
            if point is here or point.x is here.x:
                continue
            offset = here.x - point.x
            predicted = point.value + float(point.gradients[0] @ offset)
            gap = abs(here.value - predicted)
            gradients.append(point.gradients[0])
            gaps.append(gap)
        return (np.array(gradients), np.array(gaps)) if gradients else None


class Curvature:
    """The inverse Hessian W = L L' of the combination of pieces, by damped BFGS from a first guess of its shape."""

    def __init__(self, size: int, shape: np.ndarray | None = None) -> None:
        self._size = size
        self._shape = np.eye(size) if shape is None else shape  # (n, n), a factor L of the guess up to a multiple
        self._inverse: np.ndarray | None = None
        self._factor: np.ndarray | None = None

    def forget(self) -> None:
        """Back to the first guess."""
        self._inverse = self._factor = None

    def factor(self, here: Point) -> np.ndarray:
        """L (n, n); before anything is learnt, such that a step along the largest gradient has the length of 0.1."""
        if self._inverse is None:
            length = float(np.linalg.norm(self._shape @ (self._shape.T @ here.gradients[0])))
            return self._shape * math.sqrt(FIRST_STEP * (1 + float(np.linalg.norm(here.x))) / (length or 1.0))
        if self._factor is None:
            values, vectors = np.linalg.eigh(self._inverse)
            if not values[-1] > 0:
                self.forget()
                return self.factor(here)
            self._factor = vectors * np.sqrt(np.maximum(values, FLATTEST * values[-1]))
        return self._factor

    @property
    def blank(self) -> bool:
        """Whether nothing has been learnt since the start or `forget`."""
        return self._inverse is None

    def learn(self, before: Point, after: Point, weights: np.ndarray) -> None:
        """One update from the step between two points, with gradients of the same combination of pieces at both."""
        step = after.x - before.x
        change = _change(before, after, weights)
        product = float(step @ change)
        if product <= 1e-3 * float(np.linalg.norm(step) * np.linalg.norm(change)):
            change = after.gradients[0] - before.gradients[0]  # Wolfe's condition makes this one usable
            product = float(step @ change)
        if self._inverse is None:
            if product <= 0:
                return
            size = float(np.sum((self._shape.T @ change) ** 2))
            self._inverse = self._shape @ self._shape.T * (product / size)
        W = self._inverse
        if product <= 1e-10 * float(np.linalg.norm(step) * np.linalg.norm(change)):
            return
        Wy = W @ change
        outer = np.outer(step, Wy)
        updated = W - (outer + outer.T) / product + (1 + float(change @ Wy) / product) * np.outer(step, step) / product
        if np.all(np.isfinite(updated)):
            self._inverse, self._factor = (updated + updated.T) / 2, None


FLATTEST = 1e-15  # smallest eigenvalue of W kept, relative to the largest: where rounding drowns what was learnt
FIRST_STEP = 0.1  # length of the first trial step, relative to 1 + |x| in the solver's units


def _change(before: Point, after: Point, weights: np.ndarray) -> np.ndarray:
    """Change of the combined gradient, each piece paired with the nearest gradient of the new point."""
    kept = weights[: len(before.gradients)]
    if len(before.gradients) == 1 or kept.sum() < 0.5:
        return after.gradients[0] - before.gradients[0]
    change = np.zeros_like(before.x)
    for weight, gradient in zip(kept, before.gradients, strict=True):
        if weight > 1e-9:
            distance = np.linalg.norm(after.gradients - gradient, axis=1)
            change += weight * (after.gradients[int(np.argmin(distance))] - gradient)
    return change / kept.sum()

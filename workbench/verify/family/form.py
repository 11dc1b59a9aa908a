"""Polynomials of several variables on a box in Bernstein form, in fixed point with one error bound for all.

    coefficients on the unit box --halved--> on pieces;   inf p >= min coefficient - error

Values lie in the convex hull of the coefficients, and the coefficients at corners are values. Every number is an
integer of at most VALUE bits; `error` bounds how far each is from the true coefficient, and a mean adds no more than
a half to it. Axes of high degree are kept as lists, the others packed (`bernstein_lanes`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise, product
from math import prod

from flint import fmpq

from workbench.verify.family.lanes import BIAS, VALUE, Lanes, casteljau, lanes

PACKED = 8  # axes up to this degree are packed


@dataclass(frozen=True, slots=True)
class Layout:
    """Where the coefficients of given degrees stand.

    degrees : of every axis;  listed, packed : positions of the axes kept either way
    sizes, strides : of the list's axes;  lanes : of the packed ones
    """

    degrees: tuple[int, ...]
    listed: tuple[int, ...]
    packed: tuple[int, ...]
    sizes: tuple[int, ...]
    strides: tuple[int, ...]
    lanes: Lanes

    def arrange(self, values: Sequence[int]) -> list[int]:
        """The packed elements of a flat tensor (axes in order, the last fastest)."""
        shape = [d + 1 for d in self.degrees]
        strides = [prod(shape[k + 1 :]) for k in range(len(shape))]

        def offsets(axes: Sequence[int]) -> list[int]:
            steps = [[strides[a] * k for k in range(shape[a])] for a in axes]
            return [sum(choice) for choice in product(*steps)]

        inner = offsets(self.packed)
        return [self.lanes.pack([values[outer + k] for k in inner]) for outer in offsets(self.listed)]


@lru_cache(maxsize=256)
def layout(degrees: tuple[int, ...]) -> Layout:
    """The layout of tensors with these degrees; the last axis (frequency) is always listed."""
    last = len(degrees) - 1
    listed = tuple(a for a, d in enumerate(degrees) if d > PACKED or a == last)
    packed = tuple(a for a in range(len(degrees)) if a not in listed)
    sizes = tuple(degrees[a] + 1 for a in listed)
    strides = tuple(prod(sizes[k + 1 :]) for k in range(len(sizes)))
    return Layout(degrees, listed, packed, sizes, strides, lanes(tuple(degrees[a] + 1 for a in packed)))


@dataclass(frozen=True, slots=True)
class Form:
    """One real polynomial on one piece of its box.

    elements : biased lanes, one big integer for each index of the listed axes
    error : bound on what rounding did to any coefficient, in units of the last place
    """

    layout: Layout
    elements: list[int]
    error: int

    @classmethod
    def rounded(cls, degrees: tuple[int, ...], values: Sequence[int], error: int = 1) -> "Form":
        """From integers of any size, known within `error`; scaled by a power of two until they fit."""
        shift = max(max(values, default=0).bit_length(), min(values, default=0).bit_length()) - VALUE
        if shift > 0:
            values, error = [v >> shift for v in values], (error >> shift) + 2
        place = layout(degrees)
        return cls(place, place.arrange(values), error)

    @classmethod
    def of(cls, degrees: tuple[int, ...], values: Sequence[fmpq]) -> "Form":
        """From exact rationals, in units of a power of two for which the largest fits."""
        size = max((int(v.p).bit_length() - int(v.q).bit_length() + 1 for v in values if v), default=0)
        up, down = 1 << max(VALUE - 1 - size, 0), 1 << max(size + 1 - VALUE, 0)
        place = layout(degrees)
        return cls(place, place.arrange([int(v.p) * up // (int(v.q) * down) for v in values]), 1)

    def halves(self, axis: int) -> tuple["Form", "Form"]:
        """The same polynomial on the lower and on the upper half of an axis."""
        place = self.layout
        error = self.error + place.degrees[axis]
        if axis in place.packed:
            position = place.packed.index(axis)
            pairs = [place.lanes.halves(e, position) for e in self.elements]
            left, right = [p[0] for p in pairs], [p[1] for p in pairs]
        else:
            left, right = list(self.elements), list(self.elements)
            for column in self._columns(axis):
                left[column], right[column] = casteljau(self.elements[column], place.lanes.low)
        return Form(place, left, error), Form(place, right, error)

    def slope(self, axis: int) -> float:
        """log2 of a bound on the derivative along an axis over the piece, about one bit coarse; -1 if there is none."""
        place = self.layout
        degree, masks = place.degrees[axis], place.lanes
        if degree == 0:
            return -1.0
        if axis in place.packed:
            position = place.packed.index(axis)
            bits = max(masks.slope_bits(e, position) for e in self.elements)
        else:
            bits = max(
                masks.size_bits(b, a, masks.ones)
                for column in self._columns(axis)
                for a, b in pairwise(self.elements[column])
            )
        return bits + degree.bit_length() - 1 if bits else -1.0

    def positive(self) -> bool:
        """Whether every coefficient is proved positive: then so is the polynomial on the piece."""
        masks = self.layout.lanes
        return not any(masks.below(e, BIAS + self.error + 1) for e in self.elements)

    def negative_at_a_corner(self) -> bool:
        """Whether the polynomial is proved negative at a corner of the piece."""
        masks, threshold = self.layout.lanes, BIAS - self.error
        ends = [(0, (size - 1) * stride) for size, stride in zip(self.layout.sizes, self.layout.strides, strict=True)]
        return any(masks.below(self.elements[sum(at)], threshold) & masks.corners for at in product(*ends))

    def _columns(self, axis: int) -> list[slice]:
        """The elements along a listed axis, for every index of the other listed axes."""
        place = self.layout
        position = place.listed.index(axis)
        size, stride = place.sizes[position], place.strides[position]
        return [
            slice(base, base + (size - 1) * stride + 1, stride)
            for base in range(len(self.elements))
            if base // stride % size == 0
        ]

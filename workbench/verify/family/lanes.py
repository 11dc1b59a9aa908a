"""Many integers in one: a tensor of fixed-point numbers packed into the lanes of a big integer.

    lane k = BIAS + v_k, |v_k| < BIAS, LANE bits wide   -->   one addition adds all lanes, one test compares all

The bias keeps every lane positive, and the mean of two biased numbers is the biased mean: halving needs no unpacking.
Python's integers do the work of a vector unit: averaging a thousand numbers of 160 bits takes a few microseconds.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import prod

LANE = 192  # bits of a lane
VALUE = 160  # |v| stays below 2**VALUE
BIAS = 1 << (VALUE + 1)
WEIGHT = 1 << 14  # combinations Σ w v with Σ|w| up to 2 WEIGHT still fit: VALUE + 2 + 15 < LANE - 1


@dataclass(frozen=True, slots=True)
class Lanes:
    """Masks for tensors of one shape; the last axis runs fastest, in the lowest lanes.

    shape : entries along each axis;  strides : lanes from one entry to the next
    ones : 1 in every lane;  top : the highest bit of every lane;  low : all others
    first : for each axis, the lanes whose entry along it is the first
    corners : the highest bit of the lanes that are first or last along every axis
    """

    shape: tuple[int, ...]
    strides: tuple[int, ...]
    count: int
    ones: int
    top: int
    low: int
    first: tuple[int, ...]
    corners: int

    def pack(self, values: Sequence[int]) -> int:
        """One big integer of signed numbers below 2**VALUE in size."""
        width = LANE // 8
        return int.from_bytes(b"".join((v + BIAS).to_bytes(width, "little") for v in values), "little")

    def entry(self, packed: int, lane: int) -> int:
        """The signed number in one lane."""
        return ((packed >> (LANE * lane)) & ((1 << LANE) - 1)) - BIAS

    def negated(self, packed: int) -> int:
        """Every lane with its sign changed."""
        return 2 * BIAS * self.ones - packed

    def below(self, packed: int, threshold: int) -> int:
        """The top bit of every lane that is smaller than the threshold (of the lane itself, its bias included)."""
        return (((packed | self.top) - threshold * self.ones) & self.top) ^ self.top

    def halves(self, packed: int, axis: int) -> tuple[int, int]:
        """Control points on the lower and on the upper half of an axis."""
        stride, mask = self.strides[axis] * LANE, self.first[axis]
        column = [(packed >> (k * stride)) & mask for k in range(self.shape[axis])]
        return tuple(  # type: ignore[return-value]
            sum(part << (k * stride) for k, part in enumerate(side)) for side in casteljau(column, self.low)
        )

    def slope_bits(self, packed: int, axis: int) -> int:
        """Bit length of the largest difference of neighbours along an axis (or up to one bit more)."""
        stride, last = self.strides[axis] * LANE, self.shape[axis] - 1
        inner = sum(self.first[axis] << (k * stride) for k in range(last))
        return self.size_bits((packed >> stride) & inner, packed & inner, inner & self.ones)

    def size_bits(self, above: int, below: int, ones: int) -> int:
        """Bit length of the largest |above - below| over the lanes marked in `ones` (zero in the others)."""
        sign = ones * BIAS
        difference = above + sign - below
        negative = ~difference & sign
        spread = negative - (negative >> (VALUE + 1))
        size = (difference ^ spread) & ~sign & self.low
        return self._folded(size).bit_length()

    def _folded(self, packed: int) -> int:
        """All lanes laid over each other by "or"."""
        count = self.count
        while count > 1:
            half = (count + 1) // 2
            packed = (packed >> (half * LANE)) | (packed & ((1 << (half * LANE)) - 1))
            count = half
        return packed


@lru_cache(maxsize=256)
def lanes(shape: tuple[int, ...]) -> Lanes:
    """The masks of a shape."""
    count = prod(shape)
    ones = ((1 << (LANE * count)) - 1) // ((1 << LANE) - 1)
    top = ones << (LANE - 1)
    strides = tuple(prod(shape[k + 1 :]) for k in range(len(shape)))
    whole = (1 << LANE) - 1
    first = []
    for axis, (size, stride) in enumerate(zip(shape, strides, strict=True)):
        outer, block = prod(shape[:axis]), (1 << (LANE * stride)) - 1
        first.append(sum(block << (LANE * k * size * stride) for k in range(outer)))
    corners = top
    for axis, (size, stride) in enumerate(zip(shape, strides, strict=True)):
        corners &= first[axis] | first[axis] << (LANE * (size - 1) * stride)
    return Lanes(shape, strides, count, ones, top, ones * whole ^ top, tuple(first), corners)


def casteljau(column: list[int], low: int) -> tuple[list[int], list[int]]:
    """Control points of the lower and the upper half from those of the whole: de Casteljau at the midpoint.

    Each mean is rounded down, so a point of degree d is off by at most d/2.
    """
    left, right = [column[0]], [column[-1]]
    while len(column) > 1:
        column = [((a + b) >> 1) & low for a, b in pairwise(column)]
        left.append(column[0])
        right.append(column[-1])
    right.reverse()
    return left, right


def marked(mask: int) -> Iterator[int]:
    """Lanes whose top bit is set, lowest first."""
    while mask:
        bit = mask & -mask
        yield (bit.bit_length() - 1) // LANE
        mask ^= bit

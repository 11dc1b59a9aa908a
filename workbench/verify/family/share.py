"""What part of a box of parameters a search has left open, and in which cells the rest falls apart.

undecided pieces (parameters and frequency) --projection on the parameters--> union --> open share, free cells
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product

from flint import fmpq

from workbench.verify.family.polynomial import ParameterBox, Point
from workbench.verify.family.search import Interval

Cell = tuple[Interval, ...]
MOST_CELLS = 2000


@dataclass(frozen=True, slots=True)
class Shares:
    """Dyadic cells of the unit box: those touched by an undecided piece, and the free rest (the largest first)."""

    open: tuple[Cell, ...]
    free: tuple[Cell, ...]


def volume(cell: Cell) -> Fraction:
    """Share of the unit box."""
    return Fraction(1, 2 ** sum(depth for _, depth in cell))


def middle(box: ParameterBox, cell: Cell) -> Point:
    """The point of the box at the middle of a cell."""
    return box.point([fmpq(2 * k + 1, 2 ** (d + 1)) for k, d in cell])


def corners(box: ParameterBox, cell: Cell) -> list[Point]:
    """Middle and corners of a cell."""
    ends = product(*((fmpq(k, 2**d), fmpq(k + 1, 2**d)) for k, d in cell))
    return [middle(box, cell), *(box.point(corner) for corner in ends)]


def shares(cells: Sequence[Cell], axes: int) -> Shares:
    """The unit box cut into open and free cells; beyond MOST_CELLS of them the rest counts as open."""
    open_cells: list[Cell] = []
    free: list[Cell] = []
    stack = [(((0, 0),) * axes, list(dict.fromkeys(cells)))]
    while stack:
        cell, touching = stack.pop(0)
        if not touching:
            free.append(cell)
            continue
        axis = _finer(cell, touching)
        if axis is None or len(stack) + len(open_cells) + len(free) > MOST_CELLS:
            open_cells.append(cell)
            continue
        k, depth = cell[axis]
        for side in (0, 1):
            half = (*cell[:axis], (2 * k + side, depth + 1), *cell[axis + 1 :])
            stack.append((half, [c for c in touching if _meet(c[axis], half[axis])]))
    free.sort(key=volume, reverse=True)
    return Shares(tuple(open_cells), tuple(free))


def _finer(cell: Cell, touching: Sequence[Cell]) -> int | None:
    """The axis along which some piece is finest compared with the cell; None if a piece covers the cell."""
    best, axis = 0, None
    for piece in touching:
        gains = [own[1] - mine[1] for own, mine in zip(piece, cell, strict=True)]
        if max(gains, default=0) <= 0:
            return None
        if max(gains) > best:
            best = max(gains)
            axis = gains.index(best)
    return axis


def _meet(one: Interval, other: Interval) -> bool:
    """Whether two dyadic intervals overlap: then one holds the other."""
    (a, m), (b, n) = one, other
    return a >> (m - n) == b if m >= n else b >> (n - m) == a

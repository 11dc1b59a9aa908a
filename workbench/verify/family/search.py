"""Cutting a box in halves until every piece is decided.

the whole --judge--> decided | halve along the axis of largest slope --> ... --> nothing left, or the pieces left
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

from workbench.verify.family.form import Form

Interval = tuple[int, int]  # (k, depth): [k, k + 1] / 2**depth of the unit interval


class Refuted(Exception):
    """A piece shows that the claim is false."""


@dataclass(slots=True, eq=False)
class Piece:
    """A box of pieces of polynomials."""

    forms: tuple[Form, ...]
    place: tuple[Interval, ...]

    def halves(self, axis: int) -> tuple["Piece", "Piece"]:
        """Both halves along an axis."""
        pairs = [form.halves(axis) for form in self.forms]
        k, depth = self.place[axis]
        low, high = (
            Piece(
                tuple(pair[side] for pair in pairs),
                (*self.place[:axis], (2 * k + side, depth + 1), *self.place[axis + 1 :]),
            )
            for side in (0, 1)
        )
        return low, high


@dataclass(frozen=True, slots=True)
class Search:
    """What a search left: pieces left undecided, pieces looked at, whether the claim was refuted."""

    left: tuple[Piece, ...]
    pieces: int
    refuted: bool


Judge = Callable[[tuple[Form, ...]], bool]


def search(
    forms: tuple[Form, ...], judge: Judge, *, most: int, deadline: float, doubt: Callable[[Piece], bool] | None = None
) -> Search:
    """Halve until every piece is judged, `most` pieces were looked at or the deadline (perf_counter) has passed.

    judge : forms -> whether they are decided; raises Refuted if they show that the claim is false
    doubt : asked for an undecided piece now and then; True if the claim is false there
    """
    queue = deque([Piece(forms, ((0, 0),) * len(forms[0].layout.degrees))])
    pieces, asked = 0, 64
    while queue and pieces < most and perf_counter() < deadline:
        piece = queue.popleft()
        pieces += 1
        try:
            if judge(piece.forms):
                continue
            refuted = doubt is not None and pieces >= asked and doubt(piece)
        except Refuted:
            refuted = True
        if refuted:
            return Search((piece, *queue), pieces, True)
        asked = asked * 4 if pieces >= asked else asked
        queue.extend(piece.halves(steepest(piece.forms, piece.place)))
    return Search(tuple(queue), pieces, False)


def steepest(forms: Sequence[Form], place: Sequence[Interval]) -> int:
    """The axis with the largest slope of the forms; of equals the least halved one."""
    axes = range(len(place))
    return max(axes, key=lambda a: (max(form.slope(a) for form in forms), -place[a][1]))

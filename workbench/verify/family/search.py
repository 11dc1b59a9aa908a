"""Cutting a box in halves until every piece is decided: the search, the tree it leaves, and the replay of the tree.

    root --judge--> decided | halve along the axis of largest slope --> ... --> tree in preorder

A tree is a list: an axis number where a piece was halved, a mark [..] where it was decided, None where it was not.
Replaying needs no list of boxes and leaves no gap: halves cover the whole.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

from workbench.verify.family.form import Form

Interval = tuple[int, int]  # (k, depth): [k, k + 1] / 2**depth of the unit interval
Mark = list[int]
LONGEST = 100_000  # entries of a tree that a replay accepts
DEEPEST = 400  # halvings one inside the other that a replay accepts


class Refuted(Exception):
    """A piece shows that the claim is false."""


@dataclass(slots=True, eq=False)
class Piece:
    """A box of pieces of polynomials; forms are dropped once it is decided or halved."""

    forms: tuple[Form, ...]
    place: tuple[Interval, ...]
    mark: Mark | None = None
    axis: int = -1
    parts: tuple["Piece", "Piece"] | None = None

    def halve(self, axis: int) -> tuple["Piece", "Piece"]:
        """Both halves along an axis."""
        pairs = [form.halves(axis) for form in self.forms]
        k, depth = self.place[axis]
        self.axis, self.forms = axis, ()
        self.parts = tuple(  # type: ignore[assignment]
            Piece(
                tuple(pair[side] for pair in pairs),
                (*self.place[:axis], (2 * k + side, depth + 1), *self.place[axis + 1 :]),
            )
            for side in (0, 1)
        )
        return self.parts  # type: ignore[return-value]


@dataclass(frozen=True, slots=True)
class Search:
    """What a search left: the root, pieces left undecided, pieces looked at, whether the claim was refuted."""

    root: Piece
    left: tuple[Piece, ...]
    pieces: int
    refuted: bool

    def tree(self) -> list[Any]:
        """Preorder list of axes, marks and None."""
        out: list[Any] = []
        stack = [self.root]
        while stack:
            piece = stack.pop()
            if piece.parts:
                out.append(piece.axis)
                stack += [piece.parts[1], piece.parts[0]]
            else:
                out.append(piece.mark)
        return out


Judge = Callable[[tuple[Form, ...]], Mark | None]


def search(
    forms: tuple[Form, ...], judge: Judge, *, most: int, deadline: float, doubt: Callable[[Piece], bool] | None = None
) -> Search:
    """Halve until every piece is judged, `most` pieces were looked at or the deadline (perf_counter) has passed.

    judge : forms -> mark if decided, None if not; raises Refuted if they show that the claim is false
    doubt : asked for an undecided piece now and then; True if the claim is false there
    """
    axes = len(forms[0].layout.degrees)
    root = Piece(forms, ((0, 0),) * axes)
    queue, pieces, asked, refuted = deque([root]), 0, 64, False
    while queue and not refuted and pieces < most and perf_counter() < deadline:
        piece = queue.popleft()
        pieces += 1
        try:
            piece.mark = judge(piece.forms)
        except Refuted:
            refuted = True
        if piece.mark is not None:
            piece.forms = ()
            continue
        if refuted or (doubt and pieces >= asked and doubt(piece)):
            refuted = True
            queue.appendleft(piece)
            break
        asked = asked * 4 if pieces >= asked else asked
        queue.extend(piece.halve(steepest(piece.forms, piece.place)))
    return Search(root, tuple(queue), pieces, refuted)


def steepest(forms: Sequence[Form], place: Sequence[Interval]) -> int:
    """The axis with the largest slope of the first two forms (others perturb them); of equals the least halved one."""
    axes = range(len(place))
    return max(axes, key=lambda a: (max(form.slope(a) for form in forms[:2]), -place[a][1]))


def replay(forms: tuple[Form, ...], tree: Sequence[Any], confirm: Callable[[tuple[Form, ...], Any], bool]) -> bool:
    """Whether a tree covers the whole and every mark in it is confirmed on freshly halved forms."""
    axes = len(forms[0].layout.degrees)
    place = ((0, 0),) * axes
    stack = [Piece(forms, place)]
    if not isinstance(tree, list) or len(tree) > LONGEST:
        return False
    for entry in tree:
        if not stack:
            return False
        piece = stack.pop()
        if type(entry) is int:
            depth = sum(level for _, level in piece.place)
            if not 0 <= entry < axes or piece.forms[0].layout.degrees[entry] == 0 or depth >= DEEPEST:
                return False
            lower, upper = piece.halve(entry)
            stack += [upper, lower]
        elif not confirm(piece.forms, entry):
            return False
    return not stack

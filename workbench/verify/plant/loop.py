"""A model under the blocks of a structure, in exact rationals: points, openings, channels, dead times kept as they are.

    after = passed · before + push at every point;  u = after at the model's inputs, e = signed sums of after
    dx = A x + B w + B_d d,  z = C x + D w + D_zd d,  c = C_c x + D_cw w + D_cd d,   d_j(t) = c_j(t − T_j)

Points are the model's inputs and outputs, the references, and what one block makes for another. An open point passes
the push alone. "before u" is what reaches the point u in front of the push.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from flint import fmpq, fmpq_mat

from workbench.verify.exact.failure import NotProved, TableError
from workbench.verify.exact.quasi import Quasi, minors
from workbench.verify.exact.system import identity, matrix, part, stacked, zeros
from workbench.verify.plant.block import Matrices, matrices_of, sample_time_of
from workbench.verify.plant.table import Model, Table

BEFORE = "before "
MOST_ORDER = 120


@dataclass(frozen=True, slots=True)
class Lined:
    """A system with dead times pulled out: d is c some time ago."""

    A: fmpq_mat
    Bd: fmpq_mat
    B: fmpq_mat
    Cd: fmpq_mat  # c by x
    Dcd: fmpq_mat  # c by d
    Dcw: fmpq_mat
    C: fmpq_mat
    Dzd: fmpq_mat
    D: fmpq_mat
    times: tuple[fmpq, ...]
    sample_time: fmpq | None


class Loop:
    """One model of a table closed by the table's blocks."""

    def __init__(self, table: Table, model: Model) -> None:
        """Raises TableError where signals do not fit together, NotProved where a block has no twin."""
        self.model, self.sample_time = model, model.sample_time
        self._blocks = [(block, matrices_of(block)) for block in table.blocks]
        order = len(model.system.states) + sum(A.nrows() for _, (A, *_) in self._blocks)
        if order > MOST_ORDER:
            raise NotProved(f"a loop of {order} states is more than the checker expands")
        for block, (A, *_) in self._blocks:
            if A.nrows() and sample_time_of(block) != model.sample_time:
                raise TableError(
                    f"a block of kind {block.kind[:40]!r} must be sampled as the model is; it is not. Mend it."
                )
        made = list(dict.fromkeys(name for block in table.blocks for name in block.outputs))
        inner = [name for name in made if name not in model.inputs]
        self.points = (*model.inputs, *model.outputs, *table.references, *inner)
        if len(set(self.points)) < len(self.points):
            raise TableError("every signal of a loop must have one origin; one of the table's has two. Mend it.")
        self._at = {name: i for i, name in enumerate(self.points)}
        for name in self.points:  # a name that reads as something else would say two things
            read = _pieces(name)
            if read is not None and {n.removeprefix(BEFORE) for _, n in read} <= set(self.points) - {name}:
                raise TableError(f"point {name[:40]!r} also reads as a sum of other points. Rename it.")
        self._made = made
        self._characteristic: dict[tuple[str, ...], Quasi] = {}

    def characteristic(self, openings: Sequence[str] = ()) -> Quasi:
        """det(sI − A) of the closed loop with its dead times in it; of z where it is sampled."""
        key = tuple(sorted(openings))
        if key not in self._characteristic:
            system = self.channel((), (), openings)
            self._characteristic[key] = (
                minors(system.A, system.Bd, system.Cd, system.Dcd, system.times)
                if system.times
                else Quasi({fmpq(0): system.A.charpoly()})
            )
        return self._characteristic[key]

    def channel(self, inputs: Sequence[str], outputs: Sequence[str], openings: Sequence[str] = ()) -> Lined:
        """From pushes at points to signals, with some points open."""
        for name in (*inputs, *openings):
            if name not in self._at:
                raise NotProved(f"{name[:60]!r} is no point of the loop")
        N, model = len(self.points), self.model
        system, ends = model.system, range(len(model.lines))
        u, y = system.index("inputs", model.inputs), system.index("outputs", model.outputs)
        sinks = system.index("inputs", [x.sink for x in model.lines])
        sources = system.index("outputs", [x.source for x in model.lines])
        x = range(len(system.states))
        Ak, Bk, Ck, Dk = self._controller()
        n, nk, m = len(x), Ak.nrows(), len(model.inputs)
        at_u = _selected(N, range(m))
        at_y = _selected(N, range(m, m + len(y)))
        at_v = _selected(N, [self._at[name] for name in self._made])
        push = _selected(N, [self._at[name] for name in inputs])
        passed = identity(N)
        for name in openings:
            passed[self._at[name], self._at[name]] = fmpq(0)
        to_u, to_y = at_u.transpose(), part(system.C, y, x)
        Dyu, Dyd = part(system.D, y, u), part(system.D, y, sinks)
        # before = X [x; xk; d] + M after
        X = stacked([[at_y * to_y, at_v * Ck, at_y * Dyd]])
        M = at_v * Dk + at_y * Dyu * to_u
        try:
            inside = (identity(N) - passed * M).inv()
        except ZeroDivisionError as error:
            raise NotProved("the blocks close an algebraic loop without solution") from error
        after = stacked([[inside * passed * X, inside * push]])  # by [x; xk; d; w]
        before = stacked([[X, zeros(N, len(inputs))]]) + M * after
        try:
            z = self._rows(outputs, before, after)
        except TableError as error:
            raise NotProved(str(error)) from error
        state = stacked([[system.A, zeros(n, nk), part(system.B, x, sinks), zeros(n, len(inputs))],
                         [zeros(nk, n), Ak, zeros(nk, len(ends) + len(inputs))]])  # fmt: skip
        state = state + stacked([[part(system.B, x, u) * to_u], [Bk]]) * after
        c = stacked([[part(system.C, sources, x), zeros(len(ends), nk), part(system.D, sources, sinks),
                      zeros(len(ends), len(inputs))]])  # fmt: skip
        c = c + part(system.D, sources, u) * to_u * after
        s, d, w = range(n + nk), range(n + nk, n + nk + len(ends)), range(after.ncols() - len(inputs), after.ncols())
        cut = [[part(whole, range(whole.nrows()), k) for k in (s, d, w)] for whole in (state, c, z)]
        (A, Bd, B), (Cd, Dcd, Dcw), (C, Dzd, D) = cut
        return Lined(A, Bd, B, Cd, Dcd, Dcw, C, Dzd, D, tuple(x.dead_time for x in model.lines), self.sample_time)

    def _controller(self) -> Matrices:
        """All blocks side by side, from after (N) to what they make."""
        N, orders = len(self.points), [A.nrows() for _, (A, *_) in self._blocks]
        n, made = sum(orders), self._made
        A, B, C, D = zeros(n, n), zeros(n, N), zeros(len(made), n), zeros(len(made), N)
        first = 0
        for (block, (a, b, c, d)), order in zip(self._blocks, orders, strict=True):
            reads = matrix([self._sum(text, before=False) for text in block.inputs], N)
            out = [made.index(name) for name in block.outputs]
            b, d = b * reads, d * reads
            for i in range(order):
                for j in range(order):
                    A[first + i, first + j] = a[i, j]
                for j in range(N):
                    B[first + i, j] = b[i, j]
            for i, row in enumerate(out):
                for j in range(order):
                    C[row, first + j] = c[i, j]
                for j in range(N):
                    D[row, j] += d[i, j]
            first += order
        return A, B, C, D

    def _rows(self, texts: Sequence[str], before: fmpq_mat, after: fmpq_mat) -> fmpq_mat:
        """Signed sums of what is behind and in front of points."""
        N = len(self.points)
        sums = [self._sum(text, before=True) for text in texts]
        behind, front = (matrix([row[k : k + N] for row in sums], N) for k in (0, N))
        return behind * after + front * before

    def _sum(self, text: str, *, before: bool) -> list[fmpq]:
        """Factors of a signed sum over the points, and over what is before them if that is allowed."""
        N, out = len(self.points), [fmpq(0)] * (2 * len(self.points) if before else len(self.points))
        pieces = [(1, text)] if text in self._at else _pieces(text)
        for sign, name in pieces or [(1, "")]:
            bare = name.removeprefix(BEFORE) if before and name not in self._at else name
            place = self._at.get(bare)
            if place is None:
                raise TableError(f"{text[:60]!r} must be a point or a signed sum of points; it is none. Mend it.")
            place += N if bare != name else 0
            if out[place] != 0:
                raise TableError(f"{text[:60]!r} must name each signal once; it does not. Mend it.")
            out[place] = fmpq(sign)
        return out


def _pieces(text: str) -> list[tuple[int, str]] | None:
    """The signs and names of a sum: a sign stands between spaces, or leads."""
    words = re.split(r"\s+([+-])\s+", text.strip())
    if words[0][:1] in ("+", "-"):
        words[0:1] = [words[0][0], words[0][1:].strip()]
    else:
        words.insert(0, "+")
    if not all(words):
        return None
    return [(-1 if sign == "-" else 1, name) for sign, name in zip(words[::2], words[1::2], strict=True)]


def _selected(N: int, places: Sequence[int]) -> fmpq_mat:
    out = zeros(N, len(places))
    for j, i in enumerate(places):
        out[i, j] = fmpq(1)
    return out

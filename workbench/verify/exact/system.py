"""Linear systems in exact rationals, with a name for every signal, and the block matrices they are made of.

dx/dt = A x + B u, y = C x + D u;   names --System.index--> positions;   blocks --stacked--> one matrix
"""

from collections.abc import Sequence
from dataclasses import dataclass

from flint import fmpq, fmpq_mat

from workbench.verify.exact.failure import TableError


def zeros(rows: int, columns: int) -> fmpq_mat:
    """A matrix of zeros."""
    return fmpq_mat(rows, columns, [0] * (rows * columns))


def identity(n: int) -> fmpq_mat:
    """The identity of order n."""
    return diagonal([fmpq(1)] * n)


def diagonal(entries: Sequence[fmpq]) -> fmpq_mat:
    """A diagonal matrix."""
    n = len(entries)
    return fmpq_mat(n, n, [entries[i] if i == j else fmpq(0) for i in range(n) for j in range(n)])


def matrix(rows: Sequence[Sequence[fmpq]], columns: int | None = None) -> fmpq_mat:
    """A matrix from its rows; `columns` for one without rows."""
    width = len(rows[0]) if rows else columns or 0
    return fmpq_mat(len(rows), width, [entry for row in rows for entry in row])


def part(m: fmpq_mat, rows: Sequence[int], columns: Sequence[int]) -> fmpq_mat:
    """Some rows and columns of a matrix, in the order given."""
    return fmpq_mat(len(rows), len(columns), [m[i, j] for i in rows for j in columns])


def stacked(blocks: Sequence[Sequence[fmpq_mat]]) -> fmpq_mat:
    """One matrix from rows of blocks."""
    rows: list[list[fmpq]] = []
    for line in blocks:
        for beside in zip(*(block.tolist() for block in line), strict=True):
            rows.append([entry for one in beside for entry in one])
    return matrix(rows, sum(block.ncols() for block in blocks[0]))


@dataclass(frozen=True, slots=True)
class System:
    """dx/dt = A x + B u, y = C x + D u in exact rationals."""

    A: fmpq_mat
    B: fmpq_mat
    C: fmpq_mat
    D: fmpq_mat
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def index(self, kind: str, names: Sequence[str]) -> list[int]:
        """Positions of named states, inputs or outputs."""
        known = {name: i for i, name in enumerate(getattr(self, kind))}
        missing = [name for name in names if name not in known]
        if missing:
            raise TableError(
                f"the plant must have {missing[0]!r} among its {kind}; it has {', '.join(known)[:120]}. "
                "Get the table again from its source."
            )
        return [known[name] for name in names]

    def select(self, inputs: Sequence[str], outputs: Sequence[str]) -> "System":
        """The same states seen through some inputs and outputs."""
        u, y, x = self.index("inputs", inputs), self.index("outputs", outputs), range(len(self.states))
        return System(
            self.A, part(self.B, x, u), part(self.C, y, x), part(self.D, y, u), self.states, tuple(inputs),
            tuple(outputs),
        )  # fmt: skip

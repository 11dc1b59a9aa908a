"""The same problem by a smooth local solver: SLSQP with exact gradients on frequencies that are exchanged.

    gains --log σ_max at chosen frequencies--> SLSQP --> gains
      --exchange: dense peaks that come near a limit are added--> again, until none passes a limit

The objective is carried by a variable t ≤ log σ_i(M) for every singular value i of the integral part, so that its
maximum may lie where they meet.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from workbench.design.restriction.affine import Affine, Rows
from workbench.machine.budget import Deadline
from workbench.solve.exchange import Found, exchange
from workbench.solve.smooth import Options, Point, minimise

BACK_OFF = 2e-5  # relative; of the limits while solving, so that the bracket over all frequencies has room
NEAR = 0.9  # peaks above this share of their limit are watched
FIRST = 16  # frequencies at the beginning
ROUNDS = 25
SETTLED = 1e-6  # relative change of the objective between rounds that ends the search
REACH, RAISE = 50.0, 5.0  # how far one run may go: sizes of a gain, of the objective's logarithm


@dataclass(frozen=True, slots=True)
class Reached:
    """Where a solver ended: gains, the objective after each step, programmes solved, why it stopped."""

    x: np.ndarray
    history: tuple[float, ...]
    solves: int
    outcome: str


@dataclass(frozen=True, slots=True)
class Watched:
    """Frequencies watched, as positions among the dense ones per gain; how far a run may go, as a share of `REACH`."""

    chosen: tuple[frozenset[int], ...]
    reach: float = 1.0

    def programme(self, affine: Affine, x: np.ndarray, back_off: float) -> "Programme":
        """The programme of a run from x."""
        rows = tuple(r.take(sorted(own)) for r, own in zip(affine.dense, self.chosen, strict=True))
        return Programme(affine, rows, back_off, self.reach, x, affine.sizes(x))


@dataclass(frozen=True, slots=True)
class Programme:
    """Maximise t ≤ log σ_i(M) under log shares ≤ 0, in z = (x/size, t)."""

    affine: Affine
    rows: tuple[Rows, ...]
    back_off: float
    reach: float
    centre: np.ndarray
    size: np.ndarray

    def start(self) -> np.ndarray:
        """z at the centre."""
        return np.r_[self.centre / self.size, -math.log(self.affine.objective(self.centre))]

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Of z: the box of the parameters, within reach of the centre."""
        z, (low, high) = self.start(), self.affine.structure.bounds.T / self.size
        span = REACH * self.reach
        return (
            np.r_[np.maximum(low, z[:-1] - span), z[-1] - RAISE],
            np.r_[np.minimum(high, z[:-1] + span), z[-1] + RAISE * self.reach],
        )

    def at(self, z: np.ndarray) -> Point:
        """Objective −t and the constraints with their gradients."""
        x, names, values, slopes = z[:-1] * self.size, [], [], []
        for rows in self.rows:
            value, slope = rows.logarithms(x)
            values.append(math.log1p(-self.back_off) - value)
            slopes.append(np.column_stack([-slope * self.size, np.zeros(len(value))]))
            names += [rows.name] * len(value)
        u, s, vh = np.linalg.svd(np.tensordot(x, self.affine.integral, 1))
        rise = np.einsum("as,nab,sb->sn", u, self.affine.integral, vh) / s[:, None]
        values.append(np.log(s) - z[-1])
        slopes.append(np.column_stack([rise * self.size, -np.ones(len(s))]))
        names += ["integrated error"] * len(s)
        down = np.r_[np.zeros(len(x)), -1.0]
        return Point(-z[-1], down, np.concatenate(values), np.concatenate(slopes), tuple(names))


@dataclass(frozen=True, slots=True)
class _Seen:
    """Gains after a run, and what the dense frequencies say of them.

    best, history : the best allowed so far, the objectives of all that were the best;  peaks : near a limit or above it
    """

    x: np.ndarray
    best: np.ndarray
    history: tuple[float, ...]
    allowed: bool
    stable: bool
    peaks: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, affine: Affine, x: np.ndarray, back_off: float, before: "_Seen | None") -> "_Seen":
        """What is seen of x; `before` is the last."""
        shares = [rows.shares(x) for rows in affine.dense]
        peaks = tuple((n, int(k)) for n, share in enumerate(shares) for k in local_peaks(share, NEAR * (1 - back_off)))
        stable, value = not affine.unstable(x), affine.objective(x)
        allowed = stable and max(share.max() for share in shares) <= (1 - back_off) * (1 + BACK_OFF / 4)
        if before is None:
            return cls(x, x, (value if allowed else math.inf,), allowed, stable, peaks)
        if allowed and value < before.history[-1]:
            return cls(x, x, (*before.history, value), allowed, stable, peaks)
        # the solver may have stepped across a region that its frequencies do not show
        return cls(x if stable else before.best, before.best, before.history, allowed, stable, peaks)


def local(
    affine: Affine, x: np.ndarray, back_off: float, until: Deadline, on_step: Callable[[int, float], None] | None = None
) -> Reached:
    """Gains by SLSQP; the best point seen that is stable and within the limits on the dense frequencies, else x."""
    begin = _Seen.of(affine, x, back_off, None)
    spread = (np.linspace(0, len(rows.omega) - 1, FIRST).astype(int) for rows in affine.dense)
    held = _more(Watched(tuple(frozenset(each.tolist()) for each in spread)), begin)
    if until.expired:
        return Reached(x, begin.history, 0, "the time was over")
    settled: list[float] = []  # relative gains of the rounds that ended within the limits

    def solve(held: Watched, last: _Seen | None) -> _Seen:
        before = last or begin
        programme = held.programme(affine, before.x, back_off)
        found = minimise(programme, programme.start(), Options(iterations=60, tolerance=1e-8))
        seen = _Seen.of(affine, found.x[:-1] * programme.size, back_off, before)
        settled[:] = [seen.history[-1] / before.history[-1]]
        if on_step is not None and len(seen.history) > len(before.history):
            on_step(len(seen.history) - 1, seen.history[-1])
        return seen

    def search(_: Watched, seen: _Seen) -> Found[tuple[int, int]]:
        return Found(seen.allowed and settled[0] >= 1 - SETTLED, seen.peaks)

    done = exchange(
        held, solve, search, lambda held, seen, _: _more(held, seen), rounds=ROUNDS, expired=lambda: until.expired
    )
    outcome = "settled" if done.settled else done.outcome
    return Reached(done.answer.best, done.answer.history, len(done.rounds), outcome)


def _more(held: Watched, seen: _Seen) -> Watched:
    """With the peaks watched too; nearer to the centre where the loop became unstable."""
    more = tuple(own | {k for n, k in seen.peaks if n == i} for i, own in enumerate(held.chosen))
    return Watched(more, held.reach if seen.stable else held.reach / 4)


def local_peaks(curve: np.ndarray, above: float) -> np.ndarray:
    """Indices of the local maxima, ends included, that exceed a level."""
    padded = np.r_[-math.inf, curve, -math.inf]
    return np.flatnonzero((curve >= padded[:-2]) & (curve > padded[2:]) & (curve > above))

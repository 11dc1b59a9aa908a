"""The largest value of a decaying response over all time, by its modes: branch and bound, so the work follows them.

    y(t) = final + Re Σ_g c_g e^{M_g t} x_g     a block M_g for each cluster of poles, coupled ones kept whole
      --bound over an interval--> pieces that cannot hold the largest are dropped, the others split --> bracket

Each block is put into coordinates in which it contracts (M + Mᴴ < 0), so |e^{Mt} x| falls from every instant on and
bounds what remains. Over an interval a block that turns less than a radian is followed by its value and slope; a faster
one by its envelope, the value and slope of e^{(M − jω)t} x: however many periods an interval holds, they cost one look.
Nothing here has a size of its own: rates, times and signals may come in any unit. Sampled responses are the same sums
at whole numbers of samples, M a logarithm; what dies at once (poles near z = 0) is summed sample by sample.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from workbench.errors import InputError
from workbench.lti.realisation import EPS, Realisation, balanced

SEPARATION = 1e4  # largest factor that telling blocks apart may put on rounding; closer poles stay in one block
LIKE = 0.05  # of a frequency: blocks this close beat, so they are followed together
TOLERANCE = 1e-10  # of the largest value: width of the bracket
ROUNDING = 64 * EPS  # of the sum of what a response is made of: its last digits
BATCH = 64  # intervals split at a time, the most promising first
MOST = 400_000  # intervals; then the bracket is left as wide as it is
RATIO = 1.5  # of the first intervals' ends
LARGEST_BLOCK = 24  # states that cannot be told apart, followed by one exponential each time
REST = 1e-13  # of a sampled response: what remains where it is summed to its end
MANY_STATES, MOST_PRODUCTS = 60, 2e10  # so many (chains of samples of dead time), and states² × samples at most
WINDOW = 1024
SETTLED_SAMPLES, FAST = 350, 0.9  # samples summed one by one, and the |z| that is 1e-16 by then


class Block(NamedTuple):
    """A cluster of modes: its part of the response is Re c e^{Mt} x."""

    M: np.ndarray  # (k, k) upper triangular, complex; M + Mᴴ negative definite
    c: np.ndarray  # (k,)
    x: np.ndarray  # (k,)
    turn: float  # [rad/s] frequency of the frame in which it is slow


@dataclass(frozen=True, slots=True)
class Bracket:
    """The largest value of a response's measure lies between `value`, reached at `time`, and `upper`."""

    value: float
    upper: float
    time: float


@dataclass(frozen=True, slots=True)
class Response:
    """final + Re Σ c e^{M(t − start)} x from `start` on, and samples before it."""

    final: float
    blocks: tuple[Block, ...]
    whole: bool  # whether t counts samples
    start: float = 0.0
    early: tuple[float, ...] = ()  # y_0, y_1, … of a sampled response before `start`

    def at(self, t: np.ndarray) -> np.ndarray:
        """y (k,) at instants (k,), or after so many samples."""
        y, late = np.full(len(t), self.final), t >= self.start
        for block in self.blocks:
            y[late] += (_moved(block, t[late] - self.start) @ block.c).real
        y[~late] = np.array(self.early)[t[~late].astype(int)]
        return y

    def rounding(self) -> float:
        """How far the last digits of y may be off."""
        parts = sum(float(np.abs(block.c) @ np.abs(block.x)) for block in self.blocks)
        return ROUNDING * (abs(self.final) + parts)


def step_response(system: Realisation, sample_time: float | None) -> Response:
    """The unit step response of a stable system (1 input, 1 output) from rest; sampled: t in samples."""
    A, B, C, D = balanced(*system)
    if len(A) == 0:
        return Response(float(D[0, 0]), (), sample_time is not None)
    N = A if sample_time is None else A - np.eye(len(A))
    away = np.linalg.solve(N, B[:, 0])  # the state less its final one, at t = 0
    final = float(D[0, 0] - C[0] @ away)
    if sample_time is None:
        return Response(final, _blocks(A, away, C[0]), False)
    slowest = float(np.abs(np.linalg.eigvals(A)).max())
    rest = math.ceil(math.log(REST) / math.log(slowest)) if 0 < slowest < 1 else 0
    whole = len(A) > MANY_STATES and len(A) ** 2 * rest <= MOST_PRODUCTS
    early, last = _samples(A, away, C[0], len(A) + (rest if whole else SETTLED_SAMPLES))
    blocks = () if whole else _blocks(A, last, C[0], sampled=True)
    return Response(final, blocks, True, float(len(early)), tuple(final + early))


def _samples(A: np.ndarray, x: np.ndarray, c: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """c A^k x (count,) for k from 0, at least so many, and the state behind them."""
    states, power = x[:, None], A
    while states.shape[1] < min(count, WINDOW):
        states, power = np.hstack([states, power @ states]), power @ power
    found = []
    for _ in range(math.ceil(count / states.shape[1])):
        found.append(c @ states)
        states = power @ states
    return np.concatenate(found), states[:, 0]


def _blocks(A: np.ndarray, x: np.ndarray, c: np.ndarray, *, sampled: bool = False) -> tuple[Block, ...]:
    """The blocks of c e^{At} x, or of c A^t x with the fast ones left out."""
    from ctrlsys import mb03rz
    from scipy.linalg import block_diag, logm, schur

    n = len(A)
    T, U = schur(A, output="complex")[:2]
    T, V, count, sizes, *_ = mb03rz("U", "N", np.asfortranarray(T), SEPARATION, 0.0, np.asfortranarray(U))
    x, c, found, first = np.linalg.solve(V, x), c @ V, [], 0
    for size in sizes[:count]:
        cut = slice(first, first + int(size))
        M, first = np.triu(T[cut, cut]), first + int(size)
        if sampled:
            if np.abs(M.diagonal()).max() < FAST:
                continue
            M = np.log(M) if size == 1 else np.triu(logm(_small(M)))
        if not M.diagonal().real.max() < 0:
            raise InputError("the closed loop is stable at most by a rounding; its step response has no measure.")
        found.append(_contracting(_small(M), c[cut], x[cut]))
    found.sort(key=lambda block: block.turn)
    joined: list[list[Block]] = []
    for block in found:
        close = joined and abs(block.turn - joined[-1][-1].turn) <= LIKE / n * abs(block.turn) and block.turn != 0
        joined[-1].append(block) if close else joined.append([block])
    return tuple(
        group[0] if len(group) == 1 else Block(
            block_diag(*(b.M for b in group)), np.concatenate([b.c for b in group]),
            np.concatenate([b.x for b in group]), float(np.mean([b.turn for b in group])),
        )
        for group in joined
    )  # fmt: skip


def _small(M: np.ndarray) -> np.ndarray:
    """A block itself, refused where it is too large to be followed."""
    if len(M) > LARGEST_BLOCK:
        raise InputError(
            f"the step response has {len(M)} modes that rounding does not tell apart; at most {LARGEST_BLOCK} can be "
            "judged together. Use a shorter dead time in samples, or fewer equal filters."
        )
    return M


def _contracting(M: np.ndarray, c: np.ndarray, x: np.ndarray) -> Block:
    """The block in units (powers of a factor along its diagonal) in which its couplings are below its decay."""
    k, decay = len(M), -M.diagonal().real.max()
    off = np.abs(np.triu(M, 1)).max(initial=0.0)
    units = np.ones(k)
    if off > 0:
        units = min(1.0, decay / (2 * k * off)) ** np.arange(k)
    M, c, x = M / units[:, None] * units, c * units, x / units
    size_c, size_x = np.linalg.norm(c), np.linalg.norm(x)
    if size_c > 0 and size_x > 0:
        c, x = c * math.sqrt(size_x / size_c), x * math.sqrt(size_c / size_x)
    return Block(M, c, x, float(M.diagonal().imag.mean()))


def _moved(block: Block, t: np.ndarray) -> np.ndarray:
    """e^{Mt} x (len(t), k)."""
    rates = block.M.diagonal()
    if np.count_nonzero(block.M) <= len(rates):  # no coupling
        return np.exp(rates * t[:, None]) * block.x
    from scipy.linalg import expm

    slowest = rates.real.max() + 1j * block.turn  # so that the rest grows like a power of t at most
    inner = block.M - slowest * np.eye(len(rates))
    return np.exp(slowest * t)[:, None] * (expm(inner * t[:, None, None]) @ block.x)


def largest(response: Response, begin: float, sign: int, *, level: float = 0.0) -> Bracket:
    """The largest of y (sign 1), −y (−1) or |y| (0) from `begin` on, or `level` if that is larger.

    y(∞) itself does not count: give it as `level` if it shall.
    """
    size = np.abs if sign == 0 else lambda y: sign * y
    best, when = float(level), math.inf
    early = np.array(response.early)[int(begin) :] if response.whole else np.zeros(0)
    if len(early) and size(early).max() > best:
        best, when = float(size(early).max()), int(begin) + float(np.argmax(size(early)))
    begin = max(begin, response.start)
    scale = max(abs(response.final) if sign else 0.0, abs(best))
    at_begin = float(size(response.at(np.array([begin])))[0])
    if at_begin > best:
        best, when = at_begin, begin
    low, high = _first(response, begin, max(scale, best))
    upper, y, middle = _bounds(response, low, high, size)
    looked, left_over = len(low), -math.inf
    while True:
        if len(y) and size(y).max() > best:
            at = int(np.argmax(size(y)))
            best, when = float(size(y[at])), float(middle[at])
        slack = max(TOLERANCE * max(best, scale), response.rounding())
        keep = (upper > best + slack) & (high > low)
        low, high, upper = low[keep], high[keep], upper[keep]
        if not len(low):
            return Bracket(best, best + slack, when)
        if looked > MOST:
            return Bracket(best, max(float(upper.max()), left_over), when)
        order = np.argsort(-upper)
        chosen, rest = order[:BATCH], order[BATCH:]
        parts_low, parts_high = _split(low[chosen], high[chosen], whole=response.whole)
        bounds, y, middle = _bounds(response, parts_low, parts_high, size)
        looked += len(parts_low)
        low, high = np.r_[low[rest], parts_low], np.r_[high[rest], parts_high]
        upper = np.r_[upper[rest], bounds]


def _first(response: Response, begin: float, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Intervals from `begin` to where what remains is below the tolerance, each half as long again as the last."""
    if not response.blocks:
        return np.zeros(0), np.zeros(0)
    fastest = max(float(np.abs(block.M.diagonal()).max()) for block in response.blocks)
    wanted = max(TOLERANCE / 4 * scale, response.rounding() / 4)
    step = 0.1 / fastest
    ends = [begin, begin + (max(1.0, math.ceil(step)) if response.whole else step)]
    if not math.isfinite(ends[-1]):
        return np.zeros(0), np.zeros(0)
    while True:
        remaining = sum(_envelope(block, np.array([ends[-1] - response.start]))[0] for block in response.blocks)
        if remaining <= wanted:
            break
        longer = (ends[-1] - begin) * RATIO
        ends.append(begin + (math.ceil(longer) if response.whole else longer))
    ends = np.array(ends)
    return (np.r_[begin, ends[1:-1] + 1], ends[1:]) if response.whole else (ends[:-1], ends[1:])


def _split(low: np.ndarray, high: np.ndarray, *, whole: bool) -> tuple[np.ndarray, np.ndarray]:
    """Each interval in four; of whole numbers, into as many as there are if fewer."""
    part = np.arange(5) / 4
    if not whole:
        ends = low[:, None] + (high - low)[:, None] * part
        return ends[:, :-1].ravel(), ends[:, 1:].ravel()
    ends = np.floor(low[:, None] + (high + 1 - low)[:, None] * part)
    first, last = ends[:, :-1].ravel(), ends[:, 1:].ravel() - 1
    return first[last >= first], last[last >= first]


def _envelope(block: Block, t: np.ndarray) -> np.ndarray:
    """What |c e^{Ms} x| is at most for every s ≥ t."""
    return np.linalg.norm(block.c) * np.linalg.norm(_moved(block, t), axis=1)


def _bounds(response: Response, low: np.ndarray, high: np.ndarray, size):
    """An upper bound of the measure over each interval; y at its middle, and the middle."""
    if len(low) == 0:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    middle = (low + high) / 2
    middle = np.floor(middle) if response.whole else middle
    half = np.maximum(high - middle, middle - low)
    y, centre = np.full(len(low), response.final), np.full(len(low), response.final)
    slope, slack = np.zeros(len(low)), np.zeros(len(low))
    for M, c, x, turn in response.blocks:
        block = Block(M, c, x, turn)
        here, before = (
            _moved(block, middle - response.start),
            np.linalg.norm(_moved(block, low - response.start), axis=1),
        )
        value, push = here @ c, c @ M
        y += value.real
        followed = abs(turn) * half < 1
        centre += np.where(followed, value.real, 0.0)
        slope += np.where(followed, (here @ push).real, 0.0)
        bend = half**2 / 2 * np.linalg.norm(push @ M) * before
        inner = M - 1j * turn * np.eye(len(M))
        slow = np.abs(value) + half * np.abs(here @ (c @ inner))
        slow += half**2 / 2 * np.linalg.norm(c @ inner @ inner) * before
        hull = np.minimum(np.linalg.norm(c) * before, slow)
        # a block that is followed may still be bounded by its envelope alone, where that is less
        slack += np.where(followed, np.minimum(bend, np.inf), hull)
    return size(centre) + half * np.abs(slope) + slack, y, middle

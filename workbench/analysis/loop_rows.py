"""Smooth rows of what a law keeps in reserve, with exact derivatives by the seventeen parameters.

    ReserveLoops  --θ-->  damping of the worst roots;  σ_max(S) at its highest crests
    break points  --θ-->  |S − ½| of every locus, or μ(S − I/2) of several signals, at its highest crests

They steer; `break_points`, `variations`, `sampled_cases` and `frozen` judge. A row is >= 0 where its limit is met and
relative to it. A damping row of a root λ is (−Re λ − ζ|λ|)/√(|λ|² + ω0²): smooth, and with a slope at real roots too.
"""

from collections.abc import Callable, Sequence

import numpy as np

from workbench.analysis.break_parts import Part, Point
from workbench.analysis.corners import Box
from workbench.analysis.reserve_loops import Law, Loops, ReserveLoops, Watched
from workbench.control.loop.affine import LawMatrices, Stacked
from workbench.lti.mu import gradient, lower

Rows = tuple[np.ndarray, np.ndarray]  # values (k,), derivatives (k, 17)

REFERENCE = 5.0  # ω0 [rad/s] below which a root counts by its size, not by its angle
WORST = 3  # roots of a loop that get a row
WATCHED = 10  # corners of a box that steer
JOINING = 3  # of them that the worst ones may take the places of each time all are looked at
LOOKED = 15  # evaluations from one look at all corners to the next
CRESTS = 3  # of |S − ½| over frequency that get a row, for each point
BAND = (0.02, 2e3)  # [rad/s]
GRID = np.geomspace(*BAND, 180)


def damping_rows(loop: Stacked, K: LawMatrices, damping: float, decay: float = 0.0) -> Rows:
    """The roots of a loop that miss, or nearly miss, a damping ratio and a decay rate [1/s]: the worst ones."""

    def room(values: np.ndarray) -> np.ndarray:
        size = np.abs(values)
        return (-values.real - damping * size - decay) / np.sqrt(size**2 + REFERENCE**2)

    values, slopes = loop.roots(K, lambda values: np.argsort(room(values))[:WORST])
    row, size = room(values), np.abs(values)
    along = (values.conj()[:, None] * slopes).real / np.maximum(size, 1e-12)[:, None]  # derivative of |λ|
    scale = np.sqrt(size**2 + REFERENCE**2)
    return row, (-slopes.real - damping * along) / scale[:, None] - (row * size / scale**2)[:, None] * along


class ReserveAt:
    """The break points at one θ on one grid of frequencies."""

    def __init__(self, whole: ReserveLoops, theta: np.ndarray, omega: np.ndarray = GRID) -> None:
        self.whole, self.theta, self.omega = whole, np.asarray(theta, float), omega
        self._matrices: dict[Law, LawMatrices] = {}
        self.K = [
            (self.matrices(Law(g.subject.name)), self.matrices(Law(g.subject.name, modal=True))) for g in whole.groups
        ]
        self.M = [
            (g.loop.closed(K[0], omega), g.modal_loop.closed(K[1], omega))
            for g, K in zip(whole.groups, self.K, strict=True)
        ]

    def matrices(self, law: Law) -> LawMatrices:
        """A law's matrices and their derivatives, computed once."""
        if law not in self._matrices:
            self._matrices[law] = self.whole.law(law)(self.theta)
        return self._matrices[law]

    def damping(self, loops: Loops, damping: float, decay: float = 0.0) -> Rows:
        """Rows of a damping ratio and a decay rate [1/s] that every root of the loops keeps."""
        found = [damping_rows(loop, self.matrices(law), damping, decay) for law, loop in loops]
        return np.concatenate([v for v, _ in found]), np.vstack([d for _, d in found])

    def corners(self, box: Box, decay: float) -> list[tuple[str, Rows]]:
        """Rows of a decay rate [1/s] at the corners of a box that are watched; all are looked at now and then."""
        every, watched = self.whole.corners(box), self.whole.watched.setdefault(box, Watched())
        if watched.count % LOOKED == 0:
            growth = np.max([self._growth([loops[g] for loops in every]) for g in range(len(every[0]))], axis=0)
            worst = np.argsort(-growth)[:WATCHED].tolist()
            watched.corners = watched.corners or worst
            for new in [k for k in worst[:JOINING] if k not in watched.corners]:  # as many rows as before
                easiest = min(range(len(watched.corners)), key=lambda i: growth[watched.corners[i]])
                watched.corners[easiest] = new
        watched.count += 1
        return [(every[k][0][1].name, self.damping(every[k], 0.0, decay)) for k in watched.corners]

    def _growth(self, loops: Sequence[tuple[Law, Stacked]]) -> np.ndarray:
        """(corners,) largest real part of a root of one group's loop at every corner."""
        K = self.matrices(loops[0][0])
        A = np.array([loop.state_matrix(K) for _, loop in loops])
        return np.linalg.eigvals(A).real.max(axis=1)

    def peak(self, loops: Loops, limit: float) -> Rows:
        """Rows of σ_max(S) at the commands of the loops, at its highest crests."""
        found = [_peak_rows(loop, self.matrices(law), limit) for law, loop in loops]
        return np.concatenate([v for v, _ in found]), np.vstack([d for _, d in found])

    def rows(self, name: str, alpha: float) -> Rows:
        """Rows of a balanced disk margin α at a point: 1 − α |S − ½| or 1 − α μ at the highest crests."""
        point = self.whole.points[name]
        if point.together:
            return self._at_once(point, alpha)
        if not point.apart:
            return self._crests(*self._scalar(point), alpha)
        values, slopes = zip(*(self._crests(*self._largest(part), alpha) for part in point.parts), strict=True)
        return np.concatenate(values), np.vstack(slopes)

    def _loop(self, part: Part) -> tuple[LawMatrices, np.ndarray, int]:
        """The law's matrices, the closed map, and how many signals of the kind there are."""
        group = self.whole.groups[part.group]
        loop = group.modal_loop if part.modal else group.loop
        K, M = self.K[part.group][part.modal], self.M[part.group][part.modal]
        return K, M, loop.sensors if part.at_sensors else loop.commands

    def _beyond(self, part: Part) -> np.ndarray:
        """(k, r, r) S − I in the part's directions."""
        K, M, size = self._loop(part)
        if part.at_sensors:  # S = I + M K
            return (part.left @ M[:, :size, :]) @ (K.value[:, :size] @ part.right)
        return (part.left @ K.value[:size, :]) @ (M[:, :, :size] @ part.right)  # S = I + K M

    def _slope(self, part: Part, at: int, weight: np.ndarray) -> np.ndarray:
        """(17,) complex: trace(weight dS) at frequency number `at`, of S in the part's directions; weight (r, r)."""
        K, M, size = self._loop(part)
        left, right = _sides(K, M[at], size, part.at_sensors)
        inner = right @ part.right @ weight @ part.left @ left
        return np.tensordot(K.slope, inner.T, 2)

    def _scalar(self, point: Point):
        S = 1 + sum(self._beyond(part)[:, 0, 0] for part in point.parts)
        one = np.ones((1, 1))

        def slope(at: int) -> np.ndarray:
            return np.sum([self._slope(part, at, one) for part in point.parts], axis=0)

        return S - 0.5, slope

    def _largest(self, part: Part):
        beyond = self._beyond(part)
        values, right = np.linalg.eig(beyond + 0.5 * np.eye(beyond.shape[1]))
        which = np.abs(values).argmax(axis=1)
        picked = np.take_along_axis(values, which[:, None], 1)[:, 0]

        def slope(at: int) -> np.ndarray:
            V = right[at]
            return self._slope(part, at, np.outer(V[:, which[at]], np.linalg.inv(V)[which[at]]))

        return picked, slope

    def _crests(self, z: np.ndarray, slope: Callable[[int], np.ndarray], alpha: float) -> Rows:
        size = np.abs(z)
        values, slopes = [], []
        for at in _highest(size):
            values.append(1 - alpha * size[at])
            slopes.append(-alpha * (z[at].conj() * slope(at)).real / size[at])
        return np.array(values), np.array(slopes)

    def _at_once(self, point: Point, alpha: float) -> Rows:
        """The same of several signals, each with a factor of its own: μ from below, which for up to three is μ."""
        M = 0.5 * np.eye(len(point.parts[0].left)) + sum(self._beyond(part) for part in point.parts)
        values, slopes = [], []
        for at in _highest(lower(M)):
            value, W, _ = gradient(M[at])
            values.append(1 - alpha * value)
            slopes.append(-alpha * sum(self._slope(part, at, W.conj().T) for part in point.parts).real)
        return np.array(values), np.array(slopes)


def _sides(K: LawMatrices, M: np.ndarray, size: int, at_sensors: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """left, right of dS = left dK right, S at the first `size` commands or sensors of a closed map M."""
    if at_sensors:  # dS = M dK (I + M K), the latter from the sensors
        left, right = M[:size], M @ K.value[:, :size]
        right[:size] += np.eye(size)
    else:  # dS = (I + K M) dK M
        left, right = K.value[:size] @ M, M[:, :size]
        left[:, :size] += np.eye(size)
    return left, right


def _highest(size: np.ndarray) -> np.ndarray:
    """Places of the highest crests, `CRESTS` of them; the highest again where there are fewer."""
    crest = np.flatnonzero(np.r_[True, size[1:] >= size[:-1]] & np.r_[size[:-1] >= size[1:], True])
    crest = crest[np.argsort(-size[crest])][:CRESTS]
    return np.r_[crest, np.full(CRESTS - len(crest), crest[0])]


def _peak_rows(loop: Stacked, K: LawMatrices, limit: float) -> Rows:
    """1 − σ_max(S)/limit at the commands, at the highest crests over the frequencies up to half the sampling rate."""
    top = BAND[1] if loop.sample_time is None else min(BAND[1], np.pi / loop.sample_time)
    omega = np.geomspace(BAND[0], top, len(GRID))
    M, c = loop.closed(K, omega), loop.commands
    left, sizes, right = np.linalg.svd(np.eye(c) + K.value[:c] @ M[:, :, :c])
    values, slopes = [], []
    for at in _highest(sizes[:, 0]):
        u, v = left[at][:, 0].conj(), right[at][0].conj()
        to, by = _sides(K, M[at], c)
        values.append(1 - sizes[at, 0] / limit)
        slopes.append(-((K.slope @ (by @ v)) @ (u @ to)).real / limit)
    return np.array(values), np.array(slopes)

"""The bent ride on drawn guideways: the closure's judge, which shares its responses and nothing of its statistics.

    periodic guideway --linear loop--> deviations --force law at every instant--> loads --linear loop--> …

One period of a ride is a fixed point: the loads that the bent forces make of the deviations which these loads make.
Every ride is laid beside the linear one over the same guideway, so that most of the chance cancels.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from math import factorial

import numpy as np

from workbench.analysis.closure import SIGNALS, GridLoop
from workbench.errors import InputError
from workbench.physics.vehicle.curvature import ForceBend

ROUNDS = 60
SETTLED = 1e-6  # of the largest load: 1e-6 of a mean square
REMEMBERED = 6  # rounds that the next one learns from
FAR = 0.5  # [m, rad, of main coil] a round beyond it is not coming back


@dataclass(frozen=True)
class DrawnRides:
    """Sums over looked-at quantities (weights (r, K) each) of rides that settled, bent over straight.

    ratio, error : (q,) of mean squares, and standard error by the scatter of the paired rides
    rides : that settled;  lost : those whose rounds did not: the force grows faster than the loop answers
    """

    ratio: np.ndarray
    error: np.ndarray
    rides: int
    lost: int


def drawn_rides(loop: GridLoop, weights: Sequence[np.ndarray], *, rides: int = 16, seed: int = 0) -> DrawnRides:
    """Ratios of weighted sums of mean squares over drawn periods of a loop's guideway.

    weights : (K, r) each, of the one-sided densities of what is looked at
    rides : drawn with the numbers of this seed, the same for every loop
    """
    if rides < 2:
        raise InputError(f"a statistical error needs at least 2 rides; got {rides!r}.")
    force, draws, pairs = _force(loop.bend), np.random.default_rng(seed), []
    K, sources = len(loop.wind), loop.wind.shape[2]
    for _ in range(rides):
        parts = draws.standard_normal((2, K, sources)) * np.sqrt(0.5 / loop.duration)
        noise = parts[0] + 1j * parts[1]
        noise[-1] = 0.0  # of the last frequency only the cosine is on the grid
        loads = _settled(loop, force, noise[:, :, None])
        if loads is not None:
            straight = loop.felt_wind @ noise[:, :, None]
            bent = straight + loop.felt_push @ loads
            squares = [(np.abs(y[1:, :, 0]) ** 2) for y in (straight, bent)]
            pairs.append([[(w[1:] * square).sum() for w in weights] for square in squares])
    if len(pairs) < 2:
        return DrawnRides(np.full(len(weights), np.nan), np.full(len(weights), np.nan), len(pairs), rides - len(pairs))
    straight, bent = np.array(pairs).swapaxes(0, 1)
    ratio = bent.sum(0) / straight.sum(0)
    error = (bent - ratio * straight).std(axis=0, ddof=1) / straight.mean(0) / np.sqrt(len(pairs))
    return DrawnRides(ratio, error, len(pairs), rides - len(pairs))


def _settled(loop: GridLoop, force, noise: np.ndarray) -> np.ndarray | None:
    """(K, 5, 1) amplitudes of the loads of the bent forces over one guideway; None where the rounds do not settle.

    Anderson's acceleration: the next loads are the combination of the last ones whose changes cancel best.
    """
    from scipy.fft import irfft, rfft

    met, loads = loop.wind @ noise, np.zeros((len(noise), 5, 1), complex)
    made, changes = [], []
    for _ in range(ROUNDS):
        deviations = irfft((met + loop.push @ loads)[:, :, 0], n=loop.count, axis=0) * loop.count
        if not np.abs(deviations).max() < FAR:
            return None
        forces = force(deviations.reshape(loop.count, loop.sets, SIGNALS)).reshape(loop.count, -1)
        after = (rfft(forces, axis=0) / loop.count @ loop.loads.T)[:, :, None]  # pyright: ignore[reportOperatorIssue]
        made, changes = [*made, after][-REMEMBERED:], [*changes, after - loads][-REMEMBERED:]
        if np.abs(changes[-1]).max() <= SETTLED * np.abs(after).max():
            return after
        loads = after
        if len(made) > 1:
            size = np.linalg.norm(after, axis=0)  # of each load: forces and moments side by side
            off = np.column_stack([((changes[-1] - c) / np.where(size, size, 1.0)).ravel() for c in changes[:-1]])
            last = (changes[-1] / np.where(size, size, 1.0)).ravel()
            stacked = (np.concatenate([part.real, part.imag]) for part in (off, last))
            shares = np.linalg.lstsq(*stacked, rcond=1e-10)[0]
            loads = after - sum(x * (after - m) for x, m in zip(shares, made[:-1], strict=True))
    return None


def _force(bend: ForceBend):
    """(N, n, 4) deviations -> (N, n, 3) residual forces, as a sum over the polynomial's terms."""
    powers, columns = [], []
    for tensor in bend.derivatives:
        order = tensor.ndim - 2
        for place in combinations_with_replacement(range(SIGNALS), order):
            power = [place.count(k) for k in range(SIGNALS)]
            values = tensor[(slice(None), slice(None), *place)] / np.prod([factorial(p) for p in power])
            if values.any():
                powers.append(power)
                columns.append(values)
    terms = np.array(columns)  # (terms, n, 3)
    most = max((max(p) for p in powers), default=0)

    def force(deviations: np.ndarray) -> np.ndarray:
        if not powers:
            return np.zeros((*deviations.shape[:2], 3))
        each = [np.ones_like(deviations)]
        for _ in range(most):
            each.append(each[-1] * deviations)
        basis = np.stack([
            each[a][..., 0] * each[b][..., 1] * each[c][..., 2] * each[d][..., 3] for a, b, c, d in powers
        ])  # fmt: skip
        return np.einsum("ptn,pnk->tnk", basis, terms, optimize=True)

    return force

"""Margins of the loop through one signal of a plant under a structure: every crossing found, sampled or late alike.

    Loop, K --S at the point--> L = 1/S − 1 real: gains; |L| = 1: phase, dead time

Sampled loops are asked in the w plane, where every crossing is the root of an eigenvalue problem as in continuous time.
With dead times every crossing of |L| through 1 is enclosed; a gain margin is looked for on a grid there, up to a loop
gain of `SMALL`.
"""

import math
from collections.abc import Sequence

import numpy as np

from workbench.control.structure.block import Controller
from workbench.control.structure.channel import Channel
from workbench.control.structure.loop import Loop
from workbench.errors import InputError
from workbench.lti.bilinear import in_w_plane, unwarped
from workbench.lti.crossing import ScalarResponse
from workbench.lti.delay import LinedSystem
from workbench.lti.grid import seeds
from workbench.lti.margin import ChannelMargin, channel_margin, lags
from workbench.lti.peak_ceiling import enclosure
from workbench.lti.peak_crossing import crossings, pursued
from workbench.lti.realisation import Realisation

SMALL = 1e-3  # loop gain with dead times below which no gain margin is looked for: a factor of a thousand
TURN = 0.1  # [rad] of the dead times from one frequency of the grid to the next
MOST = 100_000  # frequencies of the grid


def channel_margins(loop: Loop, K: Controller, points: Sequence[str]) -> list[ChannelMargin]:
    """Of each point of a stable loop alone, the others closed; refuses what cannot be decided."""
    channel = loop.sensitivity(points)
    if loop.model.delayed:
        return [_delayed(loop, K, p) for p in points]
    S, h = channel.system(K), loop.sample_time
    if h is None:
        return [channel_margin(*S, channel=i, name=p) for i, p in enumerate(points)]
    mapped = in_w_plane(S, h)
    if mapped is None:
        raise InputError(f"the sampled loop of {loop.name!r} must have no pole at z = −1; it has. Stabilise it first.")
    return [_sampled(mapped, h, i, p) for i, p in enumerate(points)]


def _sampled(S: Realisation, h: float, i: int, point: str) -> ChannelMargin:
    """In the w plane gains and phases are those of the sampled loop; its frequencies are not, nor is dead time."""
    found = channel_margin(*S, channel=i, name=point)
    one = slice(i, i + 1)
    T = ScalarResponse(S.A, S.B[:, one], -S.C[one], 1 - S.D[one, one])

    def true(w: float | None) -> float | None:
        return None if w is None else float(unwarped(w, h))

    late = [(lag / float(unwarped(w, h)), w) for lag, w in lags(T) if w > 0]
    if abs(T(np.array([math.inf]))[0] / (1 - T(np.array([math.inf]))[0])) >= 1:  # still at the Nyquist frequency
        late.append((float(np.angle(-(_loop(T, math.inf)))) % (2 * math.pi) * h / math.pi, math.inf))
    delay = min(late, default=(math.inf, None))
    return ChannelMargin(
        channel=point, gain_up=found.gain_up, gain_up_frequency=true(found.gain_up_frequency),
        gain_down=found.gain_down, gain_down_frequency=true(found.gain_down_frequency),
        phase=found.phase, phase_frequency=true(found.phase_frequency),
        delay=delay[0], delay_frequency=true(delay[1]),
    )  # fmt: skip


def _loop(T: ScalarResponse, omega: float) -> complex:
    value = complex(T(np.array([omega]))[0])
    return value / (1 - value)


def _delayed(loop: Loop, K: Controller, point: str) -> ChannelMargin:
    """Phase and dead time from every crossing of |L| through 1, gains from a grid."""
    channel = loop.sensitivity((point,))
    system = channel.lined_system(K)

    def S(omega: np.ndarray) -> np.ndarray:
        return channel.response(K, omega)[:, 0, 0]

    poles = channel.poles(K)
    grid = seeds(poles, np.zeros(0), (0.0, math.inf))
    found = crossings(enclosure(system, channel.late(K)), grid[np.isfinite(grid)])
    if found.reason:
        raise InputError(f"the margins at {point!r} of {loop.name!r} must be decided; they are not: {found.reason}")
    angles: list[tuple[float, float]] = []
    if len(found.intervals):
        omega = pursued(lambda at: 0.5 - S(at).real, found.intervals)
        L = 1 / S(omega) - 1
        angles = list(zip((np.angle(-L) % (2 * math.pi)).tolist(), omega.tolist(), strict=True))
    direct = float(system.D[0, 0])
    gains = _factors(S, _grid(S, grid[np.isfinite(grid)], float(loop.model.lined().dead_times.sum())))
    return ChannelMargin.of(point, gains, angles, strong=direct <= 0.5)


def _grid(S, start: np.ndarray, longest: float) -> np.ndarray:
    """Frequencies so close that dead times turn little from one to the next, until the loop gain stays small."""
    small = np.flatnonzero(np.abs(1 / S(start[start > 0]) - 1) > SMALL)
    top = float(start[start > 0][min(small[-1] + 1, len(start) - 2)]) if len(small) else float(start[-1])
    count = min(math.ceil(top * longest / TURN), MOST)
    return np.unique(np.r_[start, np.geomspace(start[start > 0][0], top, 1000), np.linspace(0.0, top, count + 2)])


def _factors(S, grid: np.ndarray) -> list[tuple[float, float]]:
    """Factors −1/L at which L is real, with their frequencies; at rest too."""
    L = 1 / S(grid[grid > 0]) - 1
    grid = grid[grid > 0]
    sign = L.imag > 0
    ends = np.flatnonzero(sign[1:] != sign[:-1])
    between = np.stack([grid[ends], grid[ends + 1]], axis=1)
    omega = np.r_[0.0, pursued(lambda at: (1 / S(at) - 1).imag, between) if len(ends) else []]
    with np.errstate(all="ignore"):
        real = (1 / S(omega) - 1).real if len(omega) else np.zeros(0)
        return [(float(-1 / x), float(w)) for x, w in zip(real, omega, strict=True) if x and math.isfinite(x)]


def lined(channel: Channel, K: Controller) -> LinedSystem:
    """A channel under K as a lined system: states first, then lines."""
    A, B, C, D = channel.lined_system(K)
    late = channel.late(K)
    order = np.argsort(late > 0, kind="stable")
    return LinedSystem(A[np.ix_(order, order)], B[order], C[:, order], D, late[late > 0], channel.sample_time)

"""Guideways flown side by side, linearly and nonlinearly: squares of what is felt, time flown, contacts.

    Exponential, Guideways --some steps at a time--> series, distances --> sums over the time that counts, contacts

A flight counts from `warm_up` on. One that touches is put back onto its linear flight, and counts again `warm_up`
later; until then neither its squares nor a further contact count.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from workbench.simulation.course import Guideways
from workbench.simulation.exponential import Exponential, Stretch
from workbench.simulation.history import Contact
from workbench.simulation.reading import Reader, digital_weight

STEPS = 128  # at a time: a fifth of a second


@dataclass(frozen=True, slots=True)
class Flight:
    """What one guideway did.

    seconds : that count [s];  linear, nonlinear : (s,) ∫ square dt of the reader's series over them
    felt_linear, felt_nonlinear : the same of the weighted accelerations, all together [m²/s³]
    contacts : those that count
    """

    seconds: float
    linear: np.ndarray
    nonlinear: np.ndarray
    felt_linear: float
    felt_nonlinear: float
    contacts: tuple[Contact, ...]


def flown_over(
    integrator: Exponential, guideways: Guideways, reader: Reader, *, duration: float, warm_up: float,
    on_steps: Callable[[int], None] | None = None,
) -> list[Flight]:  # fmt: skip
    """The flights over some guideways, for `warm_up` and then `duration` [s], from rest at their beginnings.

    on_steps : called with the number of steps just done
    """
    h, positions, flights = integrator.step, integrator.rig.vehicle.positions, guideways.cubics.shape[2]
    steps, settling = int(np.ceil((warm_up + duration) / h)), int(np.ceil(warm_up / h))
    place, counts_from = integrator.start(flights), np.full(flights, settling)
    weighted = _Weighted(reader, h)
    sums, contacts, counted = np.zeros((2, flights, len(reader.names) + 1)), [[] for _ in range(flights)], 0
    for first in range(0, steps, STEPS):
        size = min(STEPS, steps - first)
        place, stretch = integrator.fly(place, guideways.met(positions, first, size))
        touching = _first_touch(stretch)
        at = np.arange(first + 1, first + size + 1)[:, None]
        counts = (at > counts_from) & (np.arange(size)[:, None] < touching)
        counted = counted + counts.sum(axis=0)
        for route, series in enumerate(reader.series(stretch)):
            clear = np.where((np.arange(size)[:, None] < touching)[:, :, None], series, 0.0)
            sums[route, :, :-1] += np.einsum("kbs,kb->bs", clear**2, counts)
            sums[route, :, -1] += np.einsum("kb,kb->b", weighted.squares(route, clear), counts)
        touched = touching < size
        for b in np.flatnonzero(touched):
            step = first + 1 + int(touching[b])
            if step > counts_from[b]:
                contacts[b].append(_contact(stretch.distance[: int(touching[b]) + 1, b], h, step))
            counts_from[b] = first + size + settling
        place = place.joined(touched) if touched.any() else place
        if on_steps is not None:
            on_steps(size)
    seconds = h * np.asarray(counted)
    return [
        Flight(float(t), h * one[:-1], h * two[:-1], float(h * one[-1]), float(h * two[-1]), tuple(found))
        for t, one, two, found in zip(seconds, *sums, contacts, strict=True)
    ]


class _Weighted:
    """Sum of the squares of the weighted accelerations, of the linear flights (route 0) and the nonlinear ones (1)."""

    def __init__(self, reader: Reader, step: float) -> None:
        self._filters = [(digital_weight(name, step), columns) for name, columns in reader.felt.items()]
        self._memory: dict[tuple[int, int], np.ndarray] = {}

    def squares(self, route: int, series: np.ndarray) -> np.ndarray:
        """(k, b) of series (k, b, s), which go on from those given before."""
        from scipy.signal import sosfilt

        total = np.zeros(series.shape[:2])
        for number, (sections, columns) in enumerate(self._filters):
            given = np.ascontiguousarray(series[:, :, columns].transpose(1, 2, 0))
            before = self._memory.get((route, number), np.zeros((len(sections), *given.shape[:2], 2)))
            felt, self._memory[route, number] = sosfilt(sections, given, axis=-1, zi=before)
            total += (felt**2).sum(axis=1).T
        return total


def _first_touch(stretch: Stretch) -> np.ndarray:
    """(b,) the step of the stretch in which each flight touches or leaves the numbers; their count where none does."""
    with np.errstate(invalid="ignore"):
        clear = (stretch.distance > 0).all(axis=2) & np.isfinite(stretch.rate).all(axis=2)
    return np.where(clear.all(axis=0), len(clear), np.argmin(clear, axis=0))


def _contact(distance: np.ndarray, h: float, step: int) -> Contact:
    """From distances (k, 2n), set by set from floor and wall, the last of which touches."""
    here = distance[-1]
    surface = ("floor", "wall")[int(np.argmin(here)) % 2] if np.isfinite(here).all() else "diverged"
    known = here if np.isfinite(here).all() else distance[max(len(distance) - 2, 0)]
    coil_set = int(np.argmin(np.nan_to_num(known, nan=np.inf))) // 2 + 1
    return Contact(time=h * step, coil_set=coil_set, surface=surface)

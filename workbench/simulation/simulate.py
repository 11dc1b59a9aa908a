"""One run of a rig: along a course, under loads, until it ends or the vehicle touches the guideway."""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.errors import InputError
from workbench.simulation.course import Course
from workbench.simulation.history import Contact, History
from workbench.simulation.load import Failure, Load
from workbench.simulation.period import CHUNK, HISTORY, Period, period
from workbench.simulation.rig import Rig

JUST = 1e-6  # of half a step: beside a node
LONGEST = 20_000_000  # periods in a run: above this a mistyped duration is likelier than a wish


@dataclass(frozen=True)
class Simulator:
    """A rig made ready to run, so that many runs share one compilation."""

    rig: Rig
    period: Period

    @classmethod
    def of(cls, rig: Rig) -> "Simulator":
        """Builds and compiles the rig's period."""
        return cls(rig, period(rig))

    def run(
        self,
        duration: float,
        *,
        course: Course | None = None,
        loads: Sequence[Load] = (),
        failure: Failure | None = None,
        seed: int | None = None,
        keep_every: int = 1,
    ) -> History:
        """One run from rest at the operating point; see `simulate`."""
        rig = self.rig
        count = _periods(rig, duration)
        if keep_every < 1:
            raise InputError(f"keep_every must be at least 1; got {keep_every!r}. 10 keeps every tenth reading.")
        generator = None if seed is None else np.random.default_rng(seed)
        if generator is None and (rig.gap_noise or rig.acceleration_noise):
            raise InputError("sensor noise needs a seed, so that the run can be repeated; give seed=0.")
        state = self.period.rest
        kept, floor, wall, cut, done = [], [], [], 0.0, 0
        contact: Contact | None = None
        advance = _Called(self.period.advance)
        while done < count and contact is None:
            size = min(CHUNK, count - done)
            times = rig.period * (done + np.arange(CHUNK))
            arguments = self._exogenous(times, course, loads), self._noise(generator), self._strength(times, failure)
            states, readings = advance(state, *arguments)
            readings = readings[:, :size].copy()
            contact, stop = self._touch(readings, times)
            readings = readings[:, :stop]
            kept.append(readings[:, (-done) % keep_every :: keep_every])
            floor.append(readings[self.period.rows["floor"]])
            wall.append(readings[self.period.rows["wall"]])
            cut += readings[self.period.rows["limited"]].sum()
            done += stop
            state = states[:, -1].copy()
        return self._history(
            np.hstack(kept), keep_every, np.hstack(floor), np.hstack(wall), contact, cut / max(done, 1), duration
        )

    def _exogenous(self, times: np.ndarray, course: Course | None, loads: Sequence[Load]) -> np.ndarray:
        """(3 (3n + 5) · substeps, k): ζ, η, bank, loads at start, middle and end of each step of each period."""
        vehicle = self.rig.vehicle
        n, half, steps = vehicle.count, self.rig.step_used / 2, self.rig.substeps
        nodes = times[0] + half * np.arange(2 * steps * len(times) + 1)
        met = np.repeat(self.period.exogenous[:, None], len(nodes), axis=1)
        if course is not None:
            met[: 2 * n] += course.inputs(vehicle.positions, vehicle.speed, nodes)
        before = met.copy()
        for load in loads:  # one that jumps at a node has its old value before and its new one after
            met[3 * n :] += load.at(nodes + JUST * half)
            before[3 * n :] += load.at(nodes - JUST * half)
        each = np.vstack([met[:, 0:-1:2], met[:, 1::2], before[:, 2::2]])
        return each.T.reshape(len(times), -1).T

    def _noise(self, generator: np.random.Generator | None) -> np.ndarray:
        m = self.rig.law.count
        if generator is None:
            return np.zeros((4 * m, CHUNK))
        # a one-sided density S² [1/Hz] up to the half sample rate 1/(2T) has the variance S²/(2T)
        deviation = np.repeat(
            [self.rig.gap_noise, self.rig.gap_noise, self.rig.acceleration_noise, self.rig.acceleration_noise], m
        )
        return generator.standard_normal((4 * m, CHUNK)) * deviation[:, None] / np.sqrt(2 * self.rig.period)

    def _strength(self, times: np.ndarray, failure: Failure | None) -> np.ndarray:
        before = self.rig.point.strength
        return np.repeat(before[:, None], len(times), axis=1) if failure is None else failure.strength(times, before)

    def _touch(self, readings: np.ndarray, times: np.ndarray) -> tuple[Contact | None, int]:
        """The first contact in a chunk and how many readings come before it."""
        rows = self.period.rows
        distance = np.stack([readings[rows["floor"]], readings[rows["wall"]]])  # (2, n, k)
        clear = (np.nan_to_num(distance, nan=-np.inf) > 0).all(axis=(0, 1)) & np.isfinite(readings).all(axis=0)
        if clear.all():
            return None, readings.shape[1]
        first = int(np.argmin(clear))
        later = readings[rows["touch"], first].item()
        time = float(times[first] + later)
        here = distance[:, :, first]
        if not np.isfinite(readings[:, first]).all():
            here = distance[:, :, max(first - 1, 0)]
            return Contact(time=time, coil_set=int(np.nanargmin(here.min(axis=0))) + 1, surface="diverged"), first
        surface, coil_set = np.unravel_index(int(np.argmin(here)), here.shape)
        touched = Contact(time=time, coil_set=int(coil_set) + 1, surface=("floor", "wall")[surface])
        return touched, first + (later > 0)  # what was read before the touch is kept

    def _history(self, readings, keep_every, floor, wall, contact, limited, duration) -> History:
        parts = {name: readings[self.period.rows[name]] for name in HISTORY}
        smallest = [side.min(axis=1, initial=np.inf) for side in (floor, wall)]
        time = self.rig.period * keep_every * np.arange(readings.shape[1])
        return History(
            time=time, **parts, rest=self.rig.point.deviation[:2], floor=smallest[0], wall=smallest[1],
            contact=contact, limited=float(limited), duration=float(duration), warning=self.rig.warning,
        )  # fmt: skip


def simulate(
    rig: Rig,
    duration: float,
    *,
    course: Course | None = None,
    loads: Sequence[Load] = (),
    failure: Failure | None = None,
    seed: int | None = None,
    keep_every: int = 1,
) -> History:
    """Runs a rig from rest at its operating point.

    Parameters
    ----------
    duration : float
        [s]
    course : Course
        Guideway met on the way; smooth if left out.
    loads : sequence of Load
        On top of those of the operating point.
    failure : Failure
        A coil set that fails on the way.
    seed : int
        Of the sensor noise.
    keep_every : int
        Readings kept: one in so many periods. Contact and smallest clearance look at every one.

    Returns
    -------
    History
        Up to the first contact with the guideway, which is reported and not simulated through.
    """
    return Simulator.of(rig).run(
        duration, course=course, loads=loads, failure=failure, seed=seed, keep_every=keep_every
    )


class _Called:
    """A function on arrays of its own, without conversions; a call overwrites what the last one returned."""

    def __init__(self, function: ca.Function) -> None:
        self._function = function  # the buffer refers to it
        self._buffer, self._run = function.buffer()
        self._arguments = [np.zeros(function.size_in(i), order="F") for i in range(function.n_in())]
        self._results = [np.zeros(function.size_out(i), order="F") for i in range(function.n_out())]
        for i, array in enumerate(self._arguments):
            self._buffer.set_arg(i, memoryview(array.T))  # pyright: ignore[reportCallIssue]
        for i, array in enumerate(self._results):
            self._buffer.set_res(i, memoryview(array.T))  # pyright: ignore[reportCallIssue]

    def __call__(self, *arguments: np.ndarray) -> list[np.ndarray]:
        for own, given in zip(self._arguments, arguments, strict=True):
            own[...] = given.reshape(own.shape)
        self._run()
        return self._results


def _periods(rig: Rig, duration: float) -> int:
    if not 0 < duration < np.inf or duration / rig.period > LONGEST:
        raise InputError(
            f"the duration must be positive and at most {LONGEST * rig.period:g} s; got {duration!r} s. "
            "Shorten the run or lengthen the step."
        )
    return int(np.ceil(duration / rig.period - 1e-9)) + 1

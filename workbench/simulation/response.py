"""Responses of a closed loop to steps at named signals: exact in continuous time, sampled, with dead times.

    steps at any points of a Loop --each alone, exact--> unit step responses --sum of (size, start)--> Response
        continuous   one matrix exponential a grid       sampled   the recursion itself
        dead times   the method of steps, no fractions

From rest, as deviations from it; a pulse is two steps, a staircase many.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.control.structure.block import Controller
from workbench.control.structure.channel import Channel
from workbench.control.structure.loop import Loop
from workbench.errors import InputError, unknown_name
from workbench.lti.exponential import advanced
from workbench.lti.march import Lined, Pieces, step_pieces
from workbench.machine.budget import heed
from workbench.result import Result, Row

LIFETIMES = 8.0  # of the slowest pole
INSTANTS = 801  # of a history where nothing else is said
MOST_INSTANTS = 200_000
MOST_STEPS = 1000  # at one signal
SETTLED = 0.02  # of the largest distance from the end
ON_GRID = 1e-9  # of a sample: a step that near belongs to it


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A jump by `size`, in the signal's unit, at `start` [s]."""

    size: float = 1.0
    start: float = 0.0

    def __post_init__(self) -> None:
        for name, low in (("size", -math.inf), ("start", 0.0)):
            value = getattr(self, name)
            number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
            if not (number and math.isfinite(value) and value >= low):
                what = "a finite number" if name == "size" else "a finite time, zero or more [s]"
                raise InputError(f"the {name} of a step must be {what}; got {value!r}. Give for instance Step(size=1).")


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Response(Result):
    """What one loop answers to steps.

    model : its name;  steps : signal to its steps;  sample_time : [s] of a sampled loop, or None
    time : (k,) [s];  outputs : p names;  values : (k, p), by name through `response["speed"]`
    """

    model: str
    steps: Mapping[str, tuple[Step, ...]]
    sample_time: float | None
    time: np.ndarray
    outputs: tuple[str, ...]
    values: np.ndarray

    def __getitem__(self, name: str) -> np.ndarray:
        """(k,) of an output."""
        if name not in self.outputs:
            raise unknown_name("output", name, self.outputs)
        return self.values[:, self.outputs.index(name)]

    @property
    def input(self) -> str:
        """What happens, in words."""
        each = [f"{name} by {step.size:g} at {step.start:g} s" for name, steps in self.steps.items() for step in steps]
        return "; ".join(each[:4]) + ("; …" if len(each) > 4 else "")

    def settled(self, name: str) -> float | None:
        """Instant [s] from which an output stays within 2 % of its largest distance from where it ends; None if it
        moves until the end.
        """
        away = np.abs(self[name] - self[name][-1])
        late = np.flatnonzero(away > SETTLED * away.max(initial=0.0))
        if not len(late):
            return 0.0
        return None if late[-1] + 2 >= len(self.time) else float(self.time[late[-1] + 1])

    def rows(self) -> list[Row]:
        found: list[Row] = [("model", self.model, ""), ("steps", self.input, "")]
        for name, column in zip(self.outputs, self.values.T, strict=True):
            top = int(np.argmax(np.abs(column)))
            found += [
                (f"{name}, largest", float(column[top]), f"at {self.time[top]:.4g} s"),
                (f"{name}, at the end", float(column[-1]), f"at {self.time[-1]:.4g} s"),
                (f"{name}, settled to {SETTLED:.0%}", self.settled(name), "s"),
            ]
        return found

    def to_frame(self):
        """A pandas.DataFrame with the time and a column an output."""
        import pandas as pd

        return pd.DataFrame(
            {"time": self.time, **{name: self.values[:, k] for k, name in enumerate(self.outputs)}}
        )  # fmt: skip


def loop_response(
    loop: Loop, K: Controller, steps: Mapping[str, Sequence[Step]], outputs: Sequence[str], *,
    duration: float | None = None, instants: int = INSTANTS,
) -> Response:  # fmt: skip
    """The response of a loop from rest.

    Parameters
    ----------
    steps : point to its steps; at a point between model and controller they are disturbances there
    outputs : points or signed sums of them
    duration : [s]; until all has come to rest if left out
    instants : of the history; of a sampled loop every sample is one

    Raises
    ------
    InputError
        If a name is unknown, an unstable loop has no duration or a dead time, or nothing finite comes of it.
    """
    if not steps or not outputs:
        raise InputError("a response needs at least one step and one output; got none. Name them.")
    if isinstance(instants, bool) or not isinstance(instants, int) or not 2 <= instants <= MOST_INSTANTS:
        raise InputError(f"instants must be a whole number from 2 to {MOST_INSTANTS}; got {instants!r}.")
    for name, each in steps.items():
        if not 1 <= len(each) <= MOST_STEPS:
            raise InputError(f"{name!r} must have 1 to {MOST_STEPS} steps; got {len(each)}.")
    channels = {name: loop.channel((name,), tuple(outputs)) for name in steps}
    time = _instants(loop, K, duration, max(s.start for each in steps.values() for s in each), instants)
    values = np.zeros((len(time), len(outputs)))
    for name, each in steps.items():
        unit = _UnitStep.of(loop, K, channels[name])
        for step in each:
            heed("the responses of a loop")
            values += step.size * unit.at(time, step.start)
    if not np.isfinite(values).all():
        raise InputError("responses must be finite; the loop grows beyond all numbers. Shorten the duration.")
    return Response(
        model=loop.name, steps={name: tuple(each) for name, each in steps.items()}, sample_time=loop.sample_time,
        time=time, outputs=tuple(outputs), values=values,
    )  # fmt: skip


def _instants(loop: Loop, K: Controller, duration: float | None, last: float, count: int) -> np.ndarray:
    """Instants (k,) [s] from 0 on."""
    h, decay = loop.sample_time, -loop.abscissa(K)
    if duration is None:
        if not decay > 0:
            raise InputError(
                f"the loop of {loop.name!r} is unstable and never comes to rest; give a duration, or other values."
            )
        duration = last + LIFETIMES / decay
    checked = isinstance(duration, int | float | np.number) and not isinstance(duration, bool)
    if not (checked and 0 < duration < math.inf):
        raise InputError(f"the duration must be positive and finite [s]; got {duration!r}.")
    if h is None:
        return np.linspace(0.0, duration, count)
    samples = math.floor(duration / h + ON_GRID) + 1
    if samples > MOST_INSTANTS:
        raise InputError(
            f"a sampled history must have at most {MOST_INSTANTS} samples, {MOST_INSTANTS * h:g} s; got {duration:g} s."
        )
    return h * np.arange(max(samples, 2))


@dataclass(frozen=True)
class _UnitStep:
    """A unit step response of a loop, from rest, at any instants of a grid."""

    loop: Loop
    system: Sequence[np.ndarray]  # A, B, C, D; with dead times C (p, ·) and D alone count
    pieces: Pieces | None = None

    @classmethod
    def of(cls, loop: Loop, K: Controller, channel: Channel) -> "_UnitStep":
        """With dead times the whole march is made at once."""
        if loop.sample_time is not None or not loop.model.delayed:
            return cls(loop, channel.system(K))
        if loop.unstable_poles(K):
            raise InputError(
                f"the loop of {loop.name!r} is unstable, and with its dead times no history of it is computed. "
                "Give other values."
            )
        lined = Lined(*channel.lined_system(K), channel.late(K))
        return cls(loop, lined.matrices, step_pieces(lined))

    def at(self, time: np.ndarray, start: float) -> np.ndarray:
        """(k, p) where the step comes at `start` [s]; between two samples it is felt from the next one on."""
        h = self.loop.sample_time
        begin = time[0] + (0 if h is None else math.ceil(start / h - ON_GRID)) * (h or 0.0)
        first = int(np.searchsorted(time, start if h is None else begin - ON_GRID * h))
        after = time[first:] - start
        if not len(after):
            return np.zeros((len(time), len(self.system[2])))
        A, B, C, D = self.system
        if self.pieces is not None:
            found = self.pieces.at(after)[:, :, 0]
        elif h is not None:
            found = rolled(A, B, C, D, len(after))
        else:
            found = exponential(A, B, C, D, float(time[1] - time[0]), len(after), float(after[0]))
        return np.vstack([np.zeros((first, found.shape[1])), found])


def exponential(A, B, C, D, step: float, count: int, first: float = 0.0) -> np.ndarray:
    """Unit step responses (count, p) of a continuous system at first, first + step, …, by matrix exponentials.

    What overflows is not finite.
    """
    turn, pushed = advanced(A, B, step)
    if not (np.isfinite(turn).all() and np.isfinite(pushed).all()):
        raise InputError("step responses must be finite; the loop's matrices overflow. Check the values.")
    return rolled(turn, pushed, C, D, count, advanced(A, B, first)[1] if first else None)


def rolled(A, B, C, D, count: int, start: np.ndarray | None = None) -> np.ndarray:
    """Responses (count, p) of a sampled system to a unit step, from rest or from states (n, 1)."""
    x, out = np.zeros((len(A), 1)) if start is None else start, np.empty((count, len(C)))
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(count):
            out[k] = (C @ x + D)[:, 0]
            x = A @ x + B
    return out

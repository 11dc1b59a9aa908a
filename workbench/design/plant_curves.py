"""What pictures of a plant's loops are drawn from: frequency responses of the open loops, step responses of the closed.

    Loop, K --L at a point, the others closed--> LoopCurve      --step at what comes from outside--> StepCurve

Dead times are exact in both: responses at frequencies, steps by the method of steps.
"""

from dataclasses import dataclass

import numpy as np

from workbench.analysis.loop_curve import LoopCurve
from workbench.control.structure.block import Controller
from workbench.control.structure.loop import Loop
from workbench.lti.march import Lined, step_pieces
from workbench.result import Result, Row
from workbench.simulation.response import exponential, rolled

POINTS = 801  # frequencies of a curve
INSTANTS = 2001  # of a step looked at
SHOWN = 401  # of a step drawn
LIFETIMES = 8.0  # of the slowest pole
SETTLED = 0.01  # of the largest value: what is left when a picture ends
MOST_SAMPLES = 20_000


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class StepCurve(Result):
    """Responses to a unit step at one signal, from rest: time (k,) [s], values (k, p) of the outputs."""

    model: str
    input: str
    outputs: tuple[str, ...]
    time: np.ndarray
    values: np.ndarray

    def rows(self) -> list[Row]:
        return [(f"{self.input} → {name}, at the end", float(v), "")
                for name, v in zip(self.outputs, self.values[-1], strict=True)]  # fmt: skip


def open_loop(loop: Loop, K: Controller, point: str) -> LoopCurve:
    """L at a point, all other loops closed."""
    poles = loop.poles(K)
    h = loop.sample_time
    sizes = np.abs(poles if h is None else np.log(poles[np.abs(poles) > 1e-9].astype(complex)) / h)
    sizes = sizes[sizes > 0] if (sizes > 0).any() else np.ones(1)
    low, high = sizes.min() / 30, sizes.max() * 10
    high = high if h is None else min(high, np.pi / h)
    omega = np.unique(np.r_[np.geomspace(min(low, high / 10), high, POINTS), sizes[(sizes > low) & (sizes < high)]])
    S = loop.sensitivity((point,)).response(K, omega)[:, 0, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        L = 1 / S - 1
    known = np.isfinite(L)
    return LoopCurve(group=loop.name, name=point, frequency_hz=omega[known] / (2 * np.pi), loop=L[known])


def step_curve(loop: Loop, K: Controller, input: str, outputs: tuple[str, ...]) -> StepCurve:
    """Step responses of a stable loop, until they rest.

    Raises InputError where they take too many pieces to come to rest.
    """
    channel, h = loop.channel((input,), outputs), loop.sample_time
    decay = -loop.abscissa(K)
    end = LIFETIMES / decay if decay > 0 else LIFETIMES
    if h is not None:
        count = int(min(np.ceil(end / h), MOST_SAMPLES)) + 1
        time, values = h * np.arange(count), rolled(*channel.system(K), count)
    elif loop.model.delayed:
        pieces = step_pieces(Lined(*channel.lined_system(K), channel.late(K)))
        time = np.linspace(0.0, float(pieces.start[-1] + pieces.length[-1]), INSTANTS)
        values = pieces.at(time)[:, :, 0]
    else:
        time = np.linspace(0.0, end, INSTANTS)
        values = exponential(*channel.system(K), float(time[1]), INSTANTS)
    last = _settled(values)
    if h is not None:
        return StepCurve(model=loop.name, input=input, outputs=outputs, time=time[:last], values=values[:last])
    chosen = np.linspace(0.0, time[last - 1], SHOWN)
    shown = np.stack([np.interp(chosen, time, column) for column in values.T], axis=1)
    return StepCurve(model=loop.name, input=input, outputs=outputs, time=chosen, values=shown)


def _settled(values: np.ndarray) -> int:
    """How many instants to show: a third more than until all stay near where they end."""
    size = np.abs(values).max(axis=0)
    away = (np.abs(values - values[-1]) > SETTLED * np.where(size > 0, size, 1.0)).any(axis=1)
    last = int(np.flatnonzero(away)[-1]) if away.any() else 0
    return min(len(values), max(int(1.3 * last) + 2, 20))

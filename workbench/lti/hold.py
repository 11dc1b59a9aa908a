"""A continuous model as a digital controller sees it: commands held, outputs read at the samples, dead times exact.

    u[k] --held from kT + computing delay on--> dead times, states, dead times --> y[k] read at kT --> Model at T

A held command is piecewise constant, so the states move by matrix exponentials between its steps, and a dead time of n
samples and a part is a chain of n values and one look between the samples: nothing is approximated. Outputs are read
before the commands of the same moment act, so the sampled model has no direct gain.

Source: Åström & Wittenmark, Computer-Controlled Systems, sampling a system with a time delay.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError, unknown_name
from workbench.lti.delay import rational
from workbench.lti.exponential import advanced
from workbench.lti.model import MOST_SAMPLES, Model
from workbench.lti.plant import Plant

LARGEST = 1e150  # its square is a double
SAME_TIME = 1e-12  # relative: of a delay that is a whole number of samples but for rounding
INSIDE = (
    "dead times must stand at inputs or outputs for the sampled loop to be exact; the one into {sink!r} of model "
    "{model!r} stands between states. Put a Padé fraction into the model, or accept a controller that is not checked."
)


class InsideError(InputError):
    """A dead time between states: no finite number of samples holds what is on its way."""


def held(model: Model, sample_time: float, computing_delay: float | Mapping[str, float] = 0.0) -> Model:
    """The model between samples at kT, its inputs held.

    Parameters
    ----------
    model : Model
        Continuous, or sampled with this very sample time.
    sample_time : float
        T [s].
    computing_delay : float or mapping of input to float
        From reading the outputs to the new values at the inputs [s], 0 or more.

    Returns
    -------
    Model
        Sampled, with the model's inputs and outputs, and without lines: dead times are states.

    Raises
    ------
    InputError
        If a dead time stands between states (an InsideError), a delay is too long or negative, or a sampled model has
        another sample time or would be delayed by a part of a sample.
    """
    if not 0 < sample_time < float("inf"):
        raise InputError(f"the sample time must be positive and finite [s]; got {sample_time!r}. Give 0.001 for 1 kHz.")
    delays = _delays(model, computing_delay, sample_time)
    if model.sample_time is not None:
        return _later(model, sample_time, delays)
    if any(d > MOST_SAMPLES * sample_time for d in [*delays.values(), *(x.dead_time for x in model.lines)]):
        raise InputError(
            f"delays must be at most {MOST_SAMPLES} samples, {MOST_SAMPLES * sample_time:g} s; those of model "
            f"{model.name!r} are longer. Sample more slowly."
        )
    return _Sampling(model, sample_time, delays).model()


def _delays(model: Model, given: float | Mapping[str, float], sample_time: float) -> dict[str, float]:
    """Of every input."""
    named = dict.fromkeys(model.inputs, given) if isinstance(given, int | float) else dict(given)
    for name, delay in named.items():
        if name not in model.inputs:
            raise unknown_name("input", name, model.inputs)
        if not 0 <= delay < float("inf"):
            raise InputError(f"the computing delay must be zero or more [s]; got {delay!r}. Leave it out for none.")
    return {name: float(named.get(name, 0.0)) for name in model.inputs}


def _later(model: Model, sample_time: float, delays: Mapping[str, float]) -> Model:
    """A sampled model behind whole samples of delay; what happens between its samples nobody knows."""
    h = float(model.sample_time or 0.0)
    if abs(sample_time - h) > SAME_TIME * h:
        raise InputError(
            f"model {model.name!r} is sampled every {h:g} s, and its controller must be too; got {sample_time:g} s. "
            "Leave the sample time out, or give a continuous model."
        )
    for name, delay in delays.items():
        if abs(delay - round(delay / h) * h) > SAME_TIME * max(delay, h):
            raise InputError(
                f"the computing delay before {name!r} must be whole samples of {h:g} s, since the model is sampled; "
                f"got {delay:g} s. Give a multiple of it, or a continuous model."
            )
    plant = model.plant
    if model.lines:
        A, B, C, D = rational(model.lined(), model.pade_order)
        plant = Plant(A=A, B=B, C=C, D=D, states=_numbered(len(A)), inputs=model.inputs, outputs=model.outputs)
    late = {name: round(delay / h) * h for name, delay in delays.items() if round(delay / h)}
    return Model(model.name, plant, input_delay=late, sample_time=h)


@dataclass(frozen=True, slots=True)
class _Signal:
    """A signal as what makes it: Σ rows[σ] x(t − σ) + Σ pulses[j, d] u_j(t − d), σ and d in seconds."""

    rows: dict[float, np.ndarray]
    pulses: dict[tuple[int, float], float]

    def later(self, time: float) -> "_Signal":
        return _Signal({s + time: row for s, row in self.rows.items()},
                       {(j, d + time): g for (j, d), g in self.pulses.items()})  # fmt: skip

    def plus(self, factor: float, other: "_Signal") -> "_Signal":
        rows, pulses = dict(self.rows), dict(self.pulses)
        for s, row in other.rows.items():
            rows[s] = rows.get(s, 0.0) + factor * row
        for key, g in other.pulses.items():
            pulses[key] = pulses.get(key, 0.0) + factor * g
        return _Signal(rows, pulses)


class _Sampling:
    """The work of `held` for a continuous model."""

    def __init__(self, model: Model, T: float, delays: Mapping[str, float]) -> None:
        self.given, self.T, plant = model, T, model.plant
        self.A, self.n = plant.A, len(plant.A)
        self.entry = {position: k for k, position in enumerate(plant.index("inputs", model.inputs))}
        self.delay = [delays[name] for name in model.inputs]
        self.line = dict(zip(plant.index("inputs", [x.sink for x in model.lines]), model.lines, strict=True))
        self._known: dict[int, _Signal] = {}
        self.outputs = [self._row(i, ()) for i in plant.index("outputs", model.outputs)]
        self.forces: dict[tuple[int, float], np.ndarray] = {}  # (input, delay) to its column of dx/dt
        for position in np.flatnonzero(np.abs(plant.B).max(axis=0, initial=0.0)):
            signal = self._entering(int(position), ())
            if signal.rows:
                raise InsideError(INSIDE.format(sink=self.line[int(position)].sink, model=model.name))
            for key, g in signal.pulses.items():
                self.forces[key] = self.forces.get(key, 0.0) + g * plant.B[:, position]

    def _entering(self, position: int, above: tuple[int, ...]) -> _Signal:
        """What stands at an input of the plant: a held command behind its computing delay, or a line's end."""
        if position in self.entry:
            j = self.entry[position]
            return _Signal({}, {(j, self.delay[j]): 1.0})
        line = self.line[position]
        if position in above:
            raise InsideError(INSIDE.format(sink=line.sink, model=self.given.name))
        if position not in self._known:
            source = self.given.plant.index("outputs", [line.source])[0]
            self._known[position] = self._row(source, (*above, position)).later(line.dead_time)
        return self._known[position]

    def _row(self, i: int, above: tuple[int, ...]) -> _Signal:
        """What an output of the plant is made of."""
        C, D = self.given.plant.C[i], self.given.plant.D[i]
        signal = _Signal({0.0: C} if C.any() else {}, {})
        for position in np.flatnonzero(D):
            signal = signal.plus(float(D[position]), self._entering(int(position), above))
        return signal

    def _split(self, time: float) -> tuple[int, float]:
        """Whole samples and the rest [s] of a delay."""
        whole = int(np.floor(time / self.T * (1 + SAME_TIME)))
        return whole, max(time - whole * self.T, 0.0)

    def model(self) -> Model:
        """States: the plant's, each input's past values newest first, each delayed output's chain."""
        given, n, m = self.given, self.n, len(self.given.inputs)
        length = [0] * m  # past values of each input that something still needs
        for j, d in self.forces:
            whole, part = self._split(d)
            length[j] = max(length[j], whole + (part > 0))
        for signal in self.outputs:
            for j, d in signal.pulses:
                length[j] = max(length[j], self._split(d)[0] + 1)
        first = [n + sum(length[:j]) for j in range(m)]
        chains, count = [], n + sum(length)
        for i, signal in enumerate(self.outputs):
            for sigma, row in signal.rows.items():
                whole, part = self._split(sigma)
                if whole or part:
                    chains.append((i, row, whole, part, count))
                    count += whole + (part > 0)
        A, B = np.zeros((count, count)), np.zeros((count, m))
        C = np.zeros((len(self.outputs), count))
        A[:n], B[:n] = self._moved(self.T, count, m, first)
        for j in range(m):
            if length[j]:
                B[first[j], j] = 1.0
                past = range(first[j], first[j] + length[j] - 1)
                A[[k + 1 for k in past], list(past)] = 1.0
        for i, row, whole, part, start in chains:
            step = self._moved(self.T - part, count, m, first) if part else (np.eye(n, count), np.zeros((n, m)))
            A[start], B[start] = row @ step[0], row @ step[1]
            links = range(start, start + whole + (part > 0) - 1)
            A[[k + 1 for k in links], list(links)] = 1.0
            C[i, start + len(links)] += 1.0
        for i, signal in enumerate(self.outputs):
            C[i, :n] += signal.rows.get(0.0, 0.0)
            for (j, d), g in signal.pulses.items():
                C[i, first[j] + self._split(d)[0]] += g
        if not all(np.abs(M).max(initial=0.0) < LARGEST for M in (A, B, C)):
            raise InputError(
                f"the sampled loop must have entries below {LARGEST:g}, so that it can be computed; it has larger "
                "ones. Check the plant's numbers and units, and the sample time."
            )
        plant = Plant(A=A, B=B, C=C, D=np.zeros((len(C), m)), states=_numbered(count),
                      inputs=given.inputs, outputs=given.outputs)  # fmt: skip
        return Model(given.name, plant, sample_time=self.T)

    def _moved(self, time: float, count: int, m: int, first: list[int]) -> tuple[np.ndarray, np.ndarray]:
        """x(kT + time), 0 < time ≤ T, from the states at kT (n, count) and from u[k] (n, m)."""
        turn, pushed = self._after(time)
        X, U = np.zeros((self.n, count)), np.zeros((self.n, m))
        X[:, : self.n] = turn
        for number, (j, d) in enumerate(self.forces):
            whole, part = self._split(d)
            newer = self._after(time - min(part, time))[1][:, number]
            older = pushed[:, number] - newer
            if whole:
                X[:, first[j] + whole - 1] += newer
            else:
                U[:, j] += newer
            if part:
                X[:, first[j] + whole] += older
        return X, U

    def _after(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """e^{A time} and ∫₀^time e^{As} ds times the columns of `forces`."""
        return advanced(self.A, np.column_stack([np.zeros((self.n, 0)), *self.forces.values()]), time)


def _numbered(count: int) -> tuple[str, ...]:
    return tuple(f"x{k + 1}" for k in range(count))

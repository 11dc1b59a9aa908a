"""A plant to tune a controller for: a state space with dead times anywhere, continuous or discrete.

    inputs ──► ┌───────────┐ ──► outputs
           ┌──►│   plant   │──┐
           │   └───────────┘  │
           └── e^(−s·time) ◄──┘   a delay line for each dead time: from one of the plant's outputs to one of its inputs

This linear fractional form holds dead times at inputs, at outputs and inside alike. Frequency responses, poles and step
responses that judge are exact; where a search needs a finite number of states, each line becomes a Padé fraction
(continuous) or, exactly, a chain of states (discrete).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import InitVar, dataclass, field, replace

import numpy as np

from workbench.errors import InputError, unknown_name
from workbench.lti import Plant
from workbench.lti.delay import LinedSystem, rational
from workbench.lti.fraction import from_control
from workbench.lti.margin import ChannelMargins
from workbench.lti.norm import Peak

MOST_SAMPLES = 2000  # of a discrete dead time; each is a state


@dataclass(frozen=True, slots=True)
class DelayLine:
    """A dead time between an output of the plant (`source`) and one of its inputs (`sink`), used for nothing else."""

    source: str
    sink: str
    dead_time: float  # [s]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Model:
    """A named plant with dead times.

    Parameters
    ----------
    name : str
    plant : Plant
        With an output and an input more for each delay line. Read as x[k+1] = A x[k] + B u[k] if a sample time is
        given.
    input_delay, output_delay : mapping of signal name to dead time [s]
        Turned into lines when the model is made, in which the signals keep their names.
    sample_time : float or None
        [s]; None for continuous time. Dead times must then be whole multiples of it.
    lines : tuple of DelayLine
    pade_order : int
        Order of the fraction that stands for a continuous dead time in `rational`.
    cancelled : complex numbers
        Poles that were cancelled when the model was made, on request; see `lti.make.tf`.

    Raises
    ------
    InputError
        If names are unknown or doubled, or a number is out of range.
    """

    name: str
    plant: Plant
    input_delay: InitVar[Mapping[str, float] | None] = None
    output_delay: InitVar[Mapping[str, float] | None] = None
    sample_time: float | None = None
    lines: tuple[DelayLine, ...] = ()
    pade_order: int = 4
    cancelled: tuple[complex, ...] = ()
    inputs: tuple[str, ...] = field(init=False)
    outputs: tuple[str, ...] = field(init=False)

    def __post_init__(self, input_delay, output_delay) -> None:
        if not isinstance(self.plant, Plant):
            raise InputError(f"a model's plant must be an lti.Plant; got {type(self.plant).__name__}. Make one first.")
        if self.sample_time is not None and not (self.sample_time > 0 and math.isfinite(self.sample_time)):
            raise InputError(f"sample time must be positive [s]; got {self.sample_time!r}. Give None for continuous.")
        if not (isinstance(self.pade_order, int) and 1 <= self.pade_order <= 12):
            raise InputError(f"pade_order must be a whole number from 1 to 12; got {self.pade_order!r}.")
        plant, lines = self.plant, list(self.lines)
        for kind, delays in (("inputs", input_delay), ("outputs", output_delay)):
            for signal, dead_time in (delays or {}).items():
                plant, line = _with_line(plant, kind, signal, dead_time)
                lines += [line] if line else []
        for line in lines:
            self._check_time(line)
        for kind, ends in (("inputs", [x.sink for x in lines]), ("outputs", [x.source for x in lines])):
            plant.index(kind, ends)
            if len(set(ends)) != len(ends):
                raise InputError(f"each delay line must have {kind} of the plant to itself; got {ends}.")
        object.__setattr__(self, "plant", plant)
        object.__setattr__(self, "lines", tuple(lines))
        object.__setattr__(self, "inputs", tuple(u for u in plant.inputs if u not in {x.sink for x in lines}))
        object.__setattr__(self, "outputs", tuple(y for y in plant.outputs if y not in {x.source for x in lines}))
        both = sorted(set(self.inputs) & set(self.outputs))
        if both:
            raise InputError(
                f"inputs and outputs of a model must have different names; {both[0]!r} is both. Rename one of them."
            )

    def _check_time(self, line: DelayLine) -> None:
        if not (line.dead_time > 0 and math.isfinite(line.dead_time)):
            raise InputError(f"a dead time must be positive [s]; got {line.dead_time!r}. Leave the line out for none.")
        if self.sample_time is not None:
            samples = line.dead_time / self.sample_time
            if abs(samples - round(samples)) > 1e-9 * samples or round(samples) > MOST_SAMPLES:
                raise InputError(
                    f"a dead time of a discrete model must be 1 to {MOST_SAMPLES} whole sample times of "
                    f"{self.sample_time:g} s; got {line.dead_time:g} s. Put the fraction into the discretised plant."
                )

    @classmethod
    def from_control(cls, system, name: str = "model") -> "Model":
        """The same system from python-control, with its signal names and its sample time; of any size.

        A state space or a matrix of transfer functions; anything else is refused in a sentence.
        """
        dt = getattr(system, "dt", None)
        if dt is True:
            raise InputError("a discrete system must have a sample time in seconds; got dt = True. Give dt a number.")
        (A, B, C, D), states, inputs, outputs = from_control(system)
        plant = Plant(A=A, B=B, C=C, D=D, states=states, inputs=inputs, outputs=outputs)
        return cls(name, plant, sample_time=float(dt) if dt else None)

    def __repr__(self) -> str:
        time = "continuous" if self.sample_time is None else f"sampled every {self.sample_time:g} s"
        gone = f" ({len(self.cancelled)} cancelled)" if self.cancelled else ""
        return (
            f"<Model {self.name}: {len(self.plant.states)} states{gone}, "
            f"{', '.join(self.inputs)} → {', '.join(self.outputs)}, {len(self.lines)} dead times, {time}>"
        )

    @property
    def delayed(self) -> bool:
        """Whether the model has dead times that no finite number of states holds."""
        return bool(self.lines) and self.sample_time is None

    def lined(self) -> LinedSystem:
        """The plant from `inputs` to `outputs` with every delay line's end beside its states."""
        plant = self.plant
        sinks = plant.index("inputs", [x.sink for x in self.lines])
        sources = plant.index("outputs", [x.source for x in self.lines])
        u, y = plant.index("inputs", self.inputs), plant.index("outputs", self.outputs)
        return LinedSystem(
            np.block([[plant.A, plant.B[:, sinks]], [plant.C[sources], plant.D[np.ix_(sources, sinks)]]]),
            np.vstack([plant.B[:, u], plant.D[np.ix_(sources, u)]]),
            np.hstack([plant.C[y], plant.D[np.ix_(y, sinks)]]),
            plant.D[np.ix_(y, u)],
            np.array([x.dead_time for x in self.lines]),
            self.sample_time,
        )

    def poles(self) -> np.ndarray:
        """Poles (k,) in s, in z if sampled; with dead times those that matter, see `measure.poles`."""
        from workbench.lti.measure import poles

        return poles(self.lined())

    def unstable_poles(self) -> int:
        """How many poles are on or beyond the stability limit; dead times exact, by counting."""
        from workbench.lti.measure import unstable_poles

        return unstable_poles(self.lined())

    def abscissa(self) -> float:
        """Largest real part of the poles [1/s], of log(z)/h if sampled; dead times exact, and counted."""
        from workbench.lti.measure import abscissa

        return abscissa(self.lined())

    def peak(self) -> Peak:
        """The H∞ norm of a stable model: a certified bracket over all frequencies, dead times exact."""
        from workbench.lti.measure import peak

        return peak(self.lined())

    def rms(self) -> float:
        """The H₂ norm of a stable model: rms of all outputs under unit white noise, dead times exact."""
        from workbench.lti.measure import rms

        return rms(self.lined())

    def variance(self) -> float:
        """The square of `rms`."""
        return self.rms() ** 2

    def margins(self) -> ChannelMargins:
        """Gain, phase and delay margins of every channel, and peaks of S and T, of negative feedback around a model."""
        from workbench.lti.measure import margins

        return margins(self.lined(), self.inputs)

    def to_control(self):
        """The same system as a python-control StateSpace; refused with continuous dead times, which that cannot hold.

        Take `rational().to_control()` for Padé fractions.
        """
        if self.delayed:
            raise InputError(
                f"a state space has no dead times; {self.name} has {len(self.lines)}. Use rational().to_control(), "
                "which puts Padé fractions in their place."
            )
        return self.rational().to_control(self.sample_time, self.name)

    def select(self, *, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> "Model":
        """The same states and dead times seen through some inputs and outputs, in the order given; all if left out."""
        inputs, outputs = (own if asked is None else (asked,) if isinstance(asked, str) else tuple(asked)
                           for asked, own in ((inputs, self.inputs), (outputs, self.outputs)))  # fmt: skip
        for kind, asked, own in (("input", inputs, self.inputs), ("output", outputs, self.outputs)):
            for signal in asked:
                if signal not in own:
                    raise unknown_name(kind, signal, own)
        ends = [line.sink for line in self.lines], [line.source for line in self.lines]
        seen = self.plant.select(inputs=[*inputs, *ends[0]], outputs=[*outputs, *ends[1]])
        return replace(self, plant=seen, input_delay=None, output_delay=None)

    def renamed(self, names: Mapping[str, str]) -> "Model":
        """The same model with other names for some of its inputs and outputs."""
        for signal in names:
            if signal not in (*self.inputs, *self.outputs):
                raise unknown_name("signal", signal, (*self.inputs, *self.outputs))
        kinds = {kind: tuple(names.get(s, s) for s in getattr(self.plant, kind)) for kind in ("inputs", "outputs")}
        return replace(self, plant=replace(self.plant, **kinds), input_delay=None, output_delay=None)

    def scaled(
        self, *, inputs: Mapping[str, float] | None = None, outputs: Mapping[str, float] | None = None
    ) -> "Model":
        """The same model with some inputs and outputs multiplied by factors: other units, or another sign."""
        plant = self.plant
        B, C, D = plant.B.copy(), plant.C.copy(), plant.D.copy()
        for signal, factor in (inputs or {}).items():
            (j,) = plant.index("inputs", [signal])
            B[:, j], D[:, j] = B[:, j] * factor, D[:, j] * factor
        for signal, factor in (outputs or {}).items():
            (i,) = plant.index("outputs", [signal])
            C[i], D[i] = C[i] * factor, D[i] * factor
        return replace(self, plant=replace(plant, B=B, C=C, D=D), input_delay=None, output_delay=None)

    def rational(self) -> Plant:
        """The model as a plant without lines: Padé fractions, or chains of states, in their place."""
        A, B, C, D = rational(self.lined(), self.pade_order)
        states = self.plant.states + tuple(f"delay {i + 1}" for i in range(len(A) - len(self.plant.states)))
        return Plant(A=A, B=B, C=C, D=D, states=states, inputs=self.inputs, outputs=self.outputs)

    def response(self, omega) -> np.ndarray:
        """Frequency response (k, p, m) at (k,) [rad/s], dead times exact; at z = exp(jωh) if sampled."""
        return self.lined().response(np.atleast_1d(np.asarray(omega, float)))


def _with_line(plant: Plant, kind: str, signal: str, dead_time: float) -> tuple[Plant, DelayLine | None]:
    """The plant with a delay line at one of its signals: the name stays in front (input) or behind it (output)."""
    names = plant.inputs if kind == "inputs" else plant.outputs
    if signal not in names:
        raise unknown_name(kind.rstrip("s"), str(signal), names)
    if not isinstance(dead_time, int | float) or math.isnan(dead_time) or dead_time < 0:
        raise InputError(f"the dead time of {signal!r} must not be negative [s]; got {dead_time!r}.")
    if dead_time == 0:
        return plant, None
    n, m, p = len(plant.states), len(plant.inputs), len(plant.outputs)
    source, sink = f"{signal} into its dead time", f"{signal} out of its dead time"
    at = names.index(signal)
    B, C, D = np.zeros((n, m + 1)), np.zeros((p + 1, n)), np.zeros((p + 1, m + 1))
    B[:, :m], C[:p], D[:p, :m] = plant.B, plant.C, plant.D
    if kind == "inputs":
        B[:, m], D[:p, m] = plant.B[:, at], plant.D[:, at]
        B[:, at], D[:p, at], D[p, at] = 0.0, 0.0, 1.0
    else:
        C[p], D[p, :m] = plant.C[at], plant.D[at]
        C[at], D[at], D[at, m] = 0.0, 0.0, 1.0
    longer = Plant(
        A=plant.A, B=B, C=C, D=D,
        states=plant.states, inputs=(*plant.inputs, sink), outputs=(*plant.outputs, source),
    )  # fmt: skip
    return longer, DelayLine(source, sink, float(dead_time))

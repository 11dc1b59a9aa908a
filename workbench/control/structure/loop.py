"""A model under a controller structure: points, channels between them, openings, and what must hold before tuning.

            disturbance "u"                    disturbance "y"
                 ▼                                  ▼
    K ──"before u"──●──"u"──► model ──"before y"──●──"y"──► K        the point "u", the point "y"

Every signal is a point: the model's inputs and outputs, the references, and what one block of the structure makes for
another. Pushing at a point adds to the signal there; the point's output is the signal behind the push ("u": as it
enters the model; "y": as it is measured), "before u" and "before y" are in front of it. An open point passes the push
alone.
Any signed sum of points ("r - y") is an output too. Feedback is negative: with the points open, L = −(before) and
S = (I + L)⁻¹ is seen from the points to themselves once they are closed.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from workbench.control.structure.block import Controller
from workbench.control.structure.channel import Channel
from workbench.control.structure.check import check_modes, check_pattern
from workbench.control.structure.fraction import Fraction
from workbench.control.structure.structure import Structure
from workbench.errors import InputError, unknown_name
from workbench.lti.count import unstable_poles
from workbench.lti.delay import LinedSystem, rational
from workbench.lti.measure import beyond, rightmost
from workbench.lti.model import Model
from workbench.lti.roots import abscissa
from workbench.lti.sums import BEFORE, known_terms, refuse_ambiguous


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Loop:
    """A model and the structure around it.

    Parameters
    ----------
    model : Model
    structure : Structure
        Its outputs that are inputs of the model drive them; others are signals between blocks.
    checked : bool
        Whether what no tuning can mend is refused; not where a broken loop is looked at as it is.

    Attributes
    ----------
    points : every signal, in the order inputs of the model, its outputs, references, signals between blocks
    exogenous : points that nothing drives: free inputs of the model and references
    analysis_points : where the loop can be opened: signals that the structure makes or measures

    Raises
    ------
    InputError
        If a name is unknown, sample times differ, the start closes an algebraic loop without solution, or an unstable
        mode of the model is out of the structure's reach or sight.
    """

    model: Model
    structure: Structure
    checked: bool = True
    points: tuple[str, ...] = field(init=False)
    exogenous: tuple[str, ...] = field(init=False)
    analysis_points: tuple[str, ...] = field(init=False)
    _position: dict[str, int] = field(init=False)
    _lined: LinedSystem = field(init=False)
    _rational: LinedSystem = field(init=False)
    _all: Channel = field(init=False)

    def __post_init__(self) -> None:
        def put(name: str, value) -> None:
            object.__setattr__(self, name, value)

        model, structure = self.model, self.structure
        inner = [name for name in structure.outputs if name not in model.inputs]
        points = (*model.inputs, *model.outputs, *structure.references, *inner)
        doubled = sorted({name for name in points if points.count(name) > 1})
        if doubled:
            raise InputError(
                f"every signal of a loop must have one origin; {doubled[0]!r} has two among model, references and "
                "blocks. Rename one of them."
            )
        refuse_ambiguous(points)
        put("points", points)
        put("_position", {name: i for i, name in enumerate(points)})
        read = {name for text in structure.inputs for name in self._terms(text, points)}
        for name in inner:
            if name not in read:
                raise unknown_name("model input or signal read by a block", name, [*model.inputs, *read])
        for name in structure.references:
            if name not in read:
                raise InputError(f"every reference must be read by a block; {name!r} is not. Leave it out.")
        driven = set(structure.outputs)
        put("exogenous", tuple(n for n in (*model.inputs, *structure.references) if n not in driven))
        measured = (n for n in model.outputs if n in read)
        put("analysis_points", (*structure.outputs, *measured))
        lined = model.lined()
        put("_lined", lined)
        put("_rational", LinedSystem(*rational(lined, model.pade_order), np.zeros(0), model.sample_time))
        put("_all", self.channel(inputs=(), outputs=()))
        if self.checked:
            self.check()

    def __reduce__(self):
        return Loop, (self.model, self.structure, self.checked)

    def __repr__(self) -> str:
        return f"<Loop: {self.model.name}, {len(self.points)} points, {', '.join(self.analysis_points)} can be opened>"

    @property
    def name(self) -> str:
        """The model's name."""
        return self.model.name

    @property
    def sample_time(self) -> float | None:
        """[s], or None for continuous time."""
        return self.model.sample_time

    @property
    def commands(self) -> tuple[str, ...]:
        """Signals that the structure makes and the model takes."""
        return tuple(name for name in self.structure.outputs if name in self.model.inputs)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Signals that the model makes and the structure reads."""
        return tuple(name for name in self.analysis_points if name in self.model.outputs)

    def check(self) -> None:
        """Refuse what no tuning can mend; see the class."""
        structure, h = self.structure, self.model.sample_time
        if structure.order and structure.sample_time != h:
            shown = [f"{t:g} s" if t else "continuous" for t in (h, structure.sample_time)]
            raise InputError(
                f"model and structure must be sampled alike; got {shown[0]} and {shown[1]}. "
                "Use structure.sampled(h), or a model of the same kind."
            )
        start = structure.controller()
        if not np.isfinite(start.stacked()).all():
            raise InputError("the structure's start must give finite matrices; it does not. Move it off zero divisors.")
        self._all.system(start)
        open_loop = self._all.rational
        seen = open_loop.A, open_loop.B2, open_loop.C2
        check_modes(*seen, h, self.model.name)
        check_pattern(*seen, open_loop.D22, structure.reach, h, self.model.name)

    def channel(
        self, inputs: str | Iterable[str], outputs: str | Iterable[str], openings: str | Iterable[str] = ()
    ) -> Channel:
        """The map from pushes at points to signals, with some points open.

        inputs : points;  outputs : points, "before " + point, signed sums of these;  openings : points
        """
        return self._channel(_listed(inputs), _listed(outputs), _listed(openings), 1.0)

    def loop_gain(self, points: str | Iterable[str], openings: str | Iterable[str] = ()) -> Channel:
        """L at the points, all of them open (and the openings too); the loop is I + L."""
        points = _listed(points)
        self._openable(points)
        opened = tuple(dict.fromkeys((*points, *_listed(openings))))
        return self._channel(points, tuple(BEFORE + p for p in points), opened, -1.0)

    def sensitivity(self, points: str | Iterable[str], openings: str | Iterable[str] = ()) -> Channel:
        """S = (I + L)⁻¹ at the points: from a push there to the signal behind it."""
        points = _listed(points)
        self._openable(points)
        return self._channel(points, points, self._others(points, openings), 1.0)

    def complementary(self, points: str | Iterable[str], openings: str | Iterable[str] = ()) -> Channel:
        """T = L (I + L)⁻¹ = I − S at the points."""
        points = _listed(points)
        self._openable(points)
        return self._channel(points, tuple(BEFORE + p for p in points), self._others(points, openings), -1.0)

    def poles(self, K: Controller, openings: str | Iterable[str] = ()) -> np.ndarray:
        """Poles of the closed loop, nothing cancelled; of infinitely many, with dead times, those that are located."""
        channel = self.channel((), (), openings) if openings else self._all
        return channel.poles(K)

    def unstable_poles(self, K: Controller) -> int:
        """How many closed-loop poles are on or beyond the stability limit, dead times exact; see `loop_count`."""
        if not self.model.delayed:
            return beyond(self.poles(K), self.sample_time)
        return unstable_poles(self._all.lined(K), self._all.late(K))

    def abscissa(self, K: Controller) -> float:
        """Largest real part of the closed-loop poles [1/s], of log(z)/h if sampled; dead times exact, and counted."""
        if self.model.delayed:
            return abscissa(self._all.lined(K), self._all.late(K))
        return rightmost(self.poles(K), self.sample_time)

    def _channel(self, inputs, outputs, openings, sign: float) -> Channel:
        for name in (*inputs, *openings):
            if name not in self._position:
                raise unknown_name("point", name, self.points)
        if len(set(inputs)) != len(inputs):
            raise InputError(f"a channel's inputs must be distinct points; got {list(inputs)}.")
        exact = self._fraction(self._lined, inputs, outputs, openings, sign)
        same = not len(self._lined.dead_times)
        rational = exact if same else self._fraction(self._rational, inputs, outputs, openings, sign)
        kept = None
        if inputs or outputs:
            rational_kept, exact_kept = (
                fraction.visible(self.structure.pattern, self.structure.order) for fraction in (rational, exact)
            )
            kept = rational_kept, exact_kept
        return Channel(
            inputs, outputs, openings, self.model.sample_time, self.model.delayed, rational, exact, self._lined, kept
        )

    def _fraction(self, plant: LinedSystem, inputs, outputs, openings, sign: float) -> Fraction:
        """The loop with the controller pulled out. Points hold `after = passed · before + push`."""
        N, structure = len(self.points), self.structure
        m, p = len(self.model.inputs), len(self.model.outputs)
        from_v = self._selection(structure.outputs)  # before (N) from v
        from_y = np.eye(N)[:, m : m + p]  # before from the model's outputs
        push = self._selection(inputs)  # push (N) from w
        passed = np.ones((N, 1))
        passed[[self._position[name] for name in openings]] = 0.0
        u_v, u_w = (passed * from_v)[:m], push[:m]
        before = [from_y @ plant.C, from_y @ plant.D @ u_w, from_v + from_y @ plant.D @ u_v]  # by x, w, v
        after = [passed * before[0], passed * before[1] + push, passed * before[2]]
        z = [sign * row for row in self._rows(outputs, before, after)]
        e = self._rows(structure.inputs, before, after)
        return Fraction(plant.A, plant.B @ u_w, plant.B @ u_v, z[0], e[0], z[1], z[2], e[1], e[2])

    def _rows(self, texts: Sequence[str], before: list[np.ndarray], after: list[np.ndarray]) -> list[np.ndarray]:
        """The sums' coefficients of x, w and v."""
        behind, front = np.zeros((len(texts), len(self.points))), np.zeros((len(texts), len(self.points)))
        for i, text in enumerate(texts):
            for name, factor in self._terms(text).items():
                if name in self._position:
                    behind[i, self._position[name]] = factor
                else:
                    front[i, self._position[name.removeprefix(BEFORE)]] = factor
        return [behind @ a + front @ b for a, b in zip(after, before, strict=True)]

    def _terms(self, text: str, known: Sequence[str] | None = None) -> dict[str, float]:
        """The terms of a sum of points and what is before them, or of `known` alone."""
        try:
            return known_terms(text, known or [*self.points, *(BEFORE + p for p in self.points)], listed=self.points)
        except InputError as error:
            if known is None:  # of a loop that stands: what comes from outside is named already
                raise
            raise InputError(
                f"{error} A reference must be named in Structure(…, references=…); signs of a sum stand between spaces."
            ) from None

    def _selection(self, names: Sequence[str]) -> np.ndarray:
        """(N, count): column j has its one at the point of name j."""
        out = np.zeros((len(self.points), len(names)))
        out[[self._position[name] for name in names], range(len(names))] = 1.0
        return out

    def _openable(self, points: Sequence[str]) -> None:
        """Refuse points without a loop through them."""
        for name in points:
            if name not in self.analysis_points:
                raise unknown_name("analysis point", name, self.analysis_points)
        if not points:
            raise InputError(f"name at least one analysis point; there are {', '.join(self.analysis_points)}.")

    def _others(self, points: Sequence[str], openings: str | Iterable[str]) -> tuple[str, ...]:
        """Openings beside the points; a point that is to be measured closed cannot be open."""
        openings = _listed(openings)
        both = [name for name in openings if name in points]
        if both:
            raise InputError(f"a point where S or T is taken must be closed; {both[0]!r} is among the openings.")
        return openings


def _listed(names: str | Iterable[str]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names)

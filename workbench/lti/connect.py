"""Systems joined by the names of their signals: the algebra of models.

    models --append--> side by side --connect--> one model, from pushes at some points to sums of points
                                       open_at: loop gain at points;  series, parallel, feedback, lft: cases of it

               push "u"                     push "y"
                  ▼                             ▼
    ──"before u"──●──"u"──► model ──"before y"──●──"y"──►

Every signal is a point, as in a loop (`control.structure.loop`): what a system makes, what a link makes for an input,
and what only comes from outside. A system's input reads the point of its name, or the signed sum that it is named after
("r - y"). Dead times stay lines of the joined model, so nothing is approximated.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from workbench.errors import InputError, unknown_name
from workbench.lti.algebraic import IllPosedError, closing
from workbench.lti.join import beside, diagonal, wired
from workbench.lti.model import DelayLine, Model
from workbench.lti.plant import Plant
from workbench.lti.realisation import Realisation
from workbench.lti.sums import BEFORE, known_terms, refuse_ambiguous

Names = str | Iterable[str] | Mapping[str, str]


def connect(
    systems: Iterable[Model | Plant],
    *,
    inputs: Names,
    outputs: Names,
    links: Mapping[str, str] | None = None,
    openings: str | Iterable[str] = (),
    references: str | Iterable[str] = (),
    name: str = "connected",
) -> Model:
    """One model of several, wired by names.

    Parameters
    ----------
    systems : of Model, Plant, or state spaces and transfer functions of python-control
        Each signal is made by one of them. Sample times agree; what has neither states nor dead times has any.
    inputs : points to push at, or new name → point
        A push adds to what is there, so an input may be a signal from outside or one that a system makes.
    outputs : points, "before " + point, signed sums of these; or new name → such a sum
        A point's value is behind its push, "before" it is in front.
    links : input of a system → signed sum of points, where the names alone do not say it
    openings : points that pass their push alone: where a loop is cut
    references : signals from outside that stay at rest unless they are among `inputs`
    name : of the result

    Returns
    -------
    Model
        Its states and delay lines are those of the systems, in their order.

    Raises
    ------
    InputError
        If a name is unknown, a signal has two makers, an input none, or sample times differ.
    IllPosedError
        If signals pass round at once without a solution that has digits left; see `lti.algebraic`.

    Examples
    --------
    >>> from workbench.lti.make import tf
    >>> loop = connect(
    ...     [tf([1.0], [1.0, 0.0], input="u", output="y"), tf([3.0], [1.0], input="r - y", output="u")],
    ...     inputs="r", outputs=["y", "u"],
    ... )
    >>> loop
    <Model connected: 1 states, r → y, u, 0 dead times, continuous>
    >>> loop.poles().tolist()
    [-3.0]
    """
    models = [model_of(system) for system in systems]
    if not models:
        raise InputError("at least one system must be connected; got none. Give a list of models.")
    links, pushed, asked = dict(links or {}), _named(inputs), _named(outputs)
    made = tuple(signal for m in models for signal in m.outputs)
    reads = tuple(signal for m in models for signal in m.inputs)
    _refuse_doubled("outputs", made)
    for signal in links:
        if signal not in reads or signal in made:
            raise unknown_name("input of a system to link", signal, set(reads) - set(made))
    points = tuple(dict.fromkeys([*made, *links, *pushed.values(), *_listed(references)]))
    refuse_ambiguous(points)
    both = (*points, *(BEFORE + point for point in points))
    read = [_read(signal, points, both) for signal in reads]
    linked = {signal: known_terms(text, both, points) for signal, text in links.items()}
    heard = {name.removeprefix(BEFORE) for terms in (*read, *linked.values()) for name in terms}
    for point in (*pushed.values(), *_listed(references)):
        if point not in heard and point not in made:
            raise unknown_name("signal from outside", point, [*made, *heard])
    for point in _listed(openings):
        if point not in points:
            raise unknown_name("point to open", point, points)
    # points v = (behind, before) = E (ends·y + pushes·w), and what systems read and the outside sees is made of v
    N = len(points)
    passed, pushes, ends = np.zeros((2 * N, 2 * N)), np.zeros((2 * N, len(pushed))), np.zeros((2 * N, len(made)))
    passed[range(N), range(N, 2 * N)] = [float(point not in _listed(openings)) for point in points]
    passed[[N + points.index(signal) for signal in linked]] = _coefficients(linked.values(), both)
    pushes[[points.index(point) for point in pushed.values()], range(len(pushed))] = 1.0
    ends[[N + points.index(signal) for signal in made], range(len(made))] = 1.0
    E, sound = closing(passed, np.eye(2 * N))
    if not sound:
        raise IllPosedError(f"links must not lead round in a circle without solution; got {links}. Cut one of them.")
    into = _coefficients(read, both) @ E
    seen = _coefficients((known_terms(text, both, points) for text in asked.values()), both) @ E
    plant, lines = _appended(models)
    through = np.eye(len(lines))
    joined = wired(
        plant,
        diagonal([into @ ends, 0 * through]), diagonal([into @ pushes, through]),
        diagonal([seen @ ends, through]), diagonal([seen @ pushes, 0 * through]),
    )  # fmt: skip
    return _model(name, models, joined, lines, tuple(pushed), tuple(asked))


def append(systems: Iterable[Model | Plant], *, name: str = "appended") -> Model:
    """Systems side by side with all their inputs and outputs, nothing joined; no name may appear twice."""
    models = [model_of(system) for system in systems]
    inputs, outputs = ([signal for m in models for signal in getattr(m, kind)] for kind in ("inputs", "outputs"))
    _refuse_doubled("inputs", inputs)
    _refuse_doubled("outputs", outputs)
    return _model(name, models, *_appended(models), tuple(inputs), tuple(outputs))


def select(
    system: Model | Plant, *, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None
) -> Model:
    """The same system seen through some of its inputs and outputs, in the order given; all if left out."""
    return model_of(system).select(inputs=inputs, outputs=outputs)


def open_at(
    systems: Iterable[Model | Plant],
    points: str | Iterable[str],
    *,
    links: Mapping[str, str] | None = None,
    openings: str | Iterable[str] = (),
    references: str | Iterable[str] = (),
    name: str = "loop gain",
) -> Model:
    """The loop gain L at points, all of them open (and the openings too); feedback is negative, so the loop is I + L.

    From a push at each point to −(what comes back to it), named "back to " + point. Arguments as in `connect`.
    """
    points = _listed(points)
    around = connect(
        systems, inputs=points, outputs={f"back to {p}": BEFORE + p for p in points}, links=links,
        openings=(*points, *_listed(openings)), references=references, name=name,
    )  # fmt: skip
    return around.scaled(outputs=dict.fromkeys(around.outputs, -1.0))


def series(first: Model | Plant, second: Model | Plant, *, name: str = "series") -> Model:
    """What leaves `first` enters `second`, in the order of their signals, whatever the names."""
    one, other = _apart(first, "first "), _apart(second, "second ")
    _refuse_unlike("outputs of the first and inputs of the second", one.outputs, other.inputs)
    return connect(
        [one, other],
        inputs=dict(zip(model_of(first).inputs, one.inputs, strict=True)),
        outputs=dict(zip(model_of(second).outputs, other.outputs, strict=True)),
        links=dict(zip(other.inputs, one.outputs, strict=True)), name=name,
    )  # fmt: skip


def parallel(first: Model | Plant, second: Model | Plant, *, name: str = "parallel") -> Model:
    """Both with the same inputs, their outputs added; signals are named as the first's."""
    named, one, other = model_of(first), _apart(first, "first "), _apart(second, "second ")
    _refuse_unlike("inputs of both", one.inputs, other.inputs)
    _refuse_unlike("outputs of both", one.outputs, other.outputs)
    return connect(
        [one, other], inputs=dict(zip(named.inputs, one.inputs, strict=True)),
        outputs={y: f"{a} + {b}" for y, a, b in zip(named.outputs, one.outputs, other.outputs, strict=True)},
        links=dict(zip(other.inputs, one.inputs, strict=True)), name=name,
    )  # fmt: skip


def feedback(forward: Model | Plant, back: Model | Plant, *, sign: int = -1, name: str = "feedback") -> Model:
    """`forward` around which `back` leads from its outputs to its inputs, added with the sign; named as `forward`."""
    named, one, other = model_of(forward), _apart(forward, "forward "), _apart(back, "back ")
    _refuse_unlike("outputs of the forward path and inputs of the backward one", one.outputs, other.inputs)
    _refuse_unlike("inputs of the forward path and outputs of the backward one", one.inputs, other.outputs)
    mark = "-" if sign < 0 else "+"
    links = dict(zip(other.inputs, one.outputs, strict=True))
    links |= {u: f"{mark}{y}" if sign < 0 else y for u, y in zip(one.inputs, other.outputs, strict=True)}
    return connect(
        [one, other], inputs=dict(zip(named.inputs, one.inputs, strict=True)),
        outputs=dict(zip(named.outputs, one.outputs, strict=True)), links=links, name=name,
    )  # fmt: skip


def lft(upper: Model | Plant, lower: Model | Plant, *, name: str = "closed") -> Model:
    """Linear fractional transformation by names: `lower` reads outputs of `upper` and makes inputs of it.

    What remains are the inputs of `upper` that `lower` does not make and the outputs that it does not read.
    """
    plant, controller = model_of(upper), model_of(lower)
    read = {term for text in controller.inputs for term in _read(text, plant.outputs, plant.outputs)}
    return connect(
        [plant, controller], inputs=[u for u in plant.inputs if u not in controller.outputs],
        outputs=[y for y in plant.outputs if y not in read], name=name,
    )  # fmt: skip


def model_of(system) -> Model:
    """A Model as it is; a Plant, or a system of python-control, as a Model."""
    if isinstance(system, Model):
        return system
    if isinstance(system, Plant):
        return Model("plant", system)
    return Model.from_control(system)


def _read(text: str, points: Sequence[str], known: Sequence[str]) -> dict[str, float]:
    """What an input reads: the point of its name, or the sum that it is named after."""
    try:
        return {text: 1.0} if text in points else known_terms(text, known, points)
    except InputError as error:
        raise InputError(
            f"the input {text!r} must be made by a system, linked, one of `inputs` or of `references`: {error}"
        ) from None


def _coefficients(sums: Iterable[dict[str, float]], known: Sequence[str]) -> np.ndarray:
    """(count, len(known)) of sums of known names."""
    at = {name: i for i, name in enumerate(known)}
    rows = [[(at[name], factor) for name, factor in terms.items()] for terms in sums]
    out = np.zeros((len(rows), len(known)))
    for i, row in enumerate(rows):
        for j, factor in row:
            out[i, j] = factor
    return out


def _appended(models: Sequence[Model]) -> tuple[Realisation, tuple[DelayLine, ...]]:
    """All plants side by side, the ends of their delay lines behind the other inputs and outputs; the lines."""
    parts, at_inputs, at_outputs, m, p = [], [], [], 0, 0
    for model in models:
        plant = model.plant
        parts.append(Realisation(plant.A, plant.B, plant.C, plant.D))
        at_inputs.append([m + i for i in plant.index("inputs", (*model.inputs, *(x.sink for x in model.lines)))])
        at_outputs.append([p + i for i in plant.index("outputs", (*model.outputs, *(x.source for x in model.lines)))])
        m, p = m + len(plant.inputs), p + len(plant.outputs)
    counts = [len(model.lines) for model in models]
    u = [i for at, q in zip(at_inputs, counts, strict=True) for i in at[: len(at) - q]]
    u += [i for at, q in zip(at_inputs, counts, strict=True) for i in at[len(at) - q :]]
    y = [i for at, q in zip(at_outputs, counts, strict=True) for i in at[: len(at) - q]]
    y += [i for at, q in zip(at_outputs, counts, strict=True) for i in at[len(at) - q :]]
    A, B, C, D = beside(*parts)
    names = _distinct([(m.name, end) for m in models for x in m.lines for end in (x.source, x.sink)])
    times = [x.dead_time for model in models for x in model.lines]
    lines = tuple(DelayLine(source, sink, t) for source, sink, t in zip(names[::2], names[1::2], times, strict=True))
    return Realisation(A, B[:, u], C[y], D[np.ix_(y, u)]), lines


def _model(name, models, joined: Realisation, lines: tuple[DelayLine, ...], inputs, outputs) -> Model:
    """The joined matrices with their names."""
    A, B, C, D = joined
    plant = Plant(
        A=A, B=B, C=C, D=D, states=_distinct([(m.name, state) for m in models for state in m.plant.states]),
        inputs=(*inputs, *(line.sink for line in lines)), outputs=(*outputs, *(line.source for line in lines)),
    )  # fmt: skip
    return Model(
        name, plant, sample_time=_sample_time(models), lines=lines,
        pade_order=max((m.pade_order for m in models if m.lines), default=4),
        cancelled=tuple(pole for m in models for pole in m.cancelled),
    )  # fmt: skip


def _distinct(named: Sequence[tuple[str, str]]) -> tuple[str, ...]:
    """Names inside of systems: as they are where that keeps them apart, else with their system's, else numbered."""
    for names in ([name for _, name in named], [f"{owner}: {name}" for owner, name in named]):
        if len(set(names)) == len(names):
            return tuple(names)
    return tuple(f"{owner}: {name} ({i + 1})" for i, (owner, name) in enumerate(named))


def _sample_time(models: Sequence[Model]) -> float | None:
    """That of all systems with states or dead times."""
    moving = [m for m in models if m.plant.states or m.lines] or list(models)
    times = {m.sample_time for m in moving}
    if len(times) > 1:
        shown = ", ".join(
            f"{m.name} {'continuous' if m.sample_time is None else f'{m.sample_time:g} s'}" for m in moving
        )
        raise InputError(f"systems joined must be sampled alike; got {shown}. Discretise or resample one of them.")
    return times.pop()


def _apart(system, prefix: str) -> Model:
    """The model with every signal's name begun by a prefix."""
    model = model_of(system)
    return model.renamed({signal: f"{prefix}{i + 1}" for i, signal in enumerate((*model.inputs, *model.outputs))})


def _named(names: Names) -> dict[str, str]:
    """New name → what it stands for, a sum being named as it is written."""
    if isinstance(names, Mapping):
        return dict(names)
    return {name: name for name in _listed(names)}


def _listed(names: str | Iterable[str]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names)


def _refuse_doubled(kind: str, names: Sequence[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{kind} of joined systems must have distinct names; {name!r} appears twice. Rename one.")


def _refuse_unlike(what: str, one: Sequence[str], other: Sequence[str]) -> None:
    if len(one) != len(other):
        raise InputError(f"{what} must be as many; got {len(one)} and {len(other)}. Use connect, which joins by names.")

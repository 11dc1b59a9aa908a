"""Time histories of a plant of one's own under its structure: every model's loop after steps at named signals.

problem, values --loop of each model; sampled: model held, structure sampled--> Response of each --> PlantSimulation
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from workbench.control.structure.block import Controller
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.design.problem import Problem
from workbench.design.record import checked_values
from workbench.errors import InputError, unknown_name
from workbench.exits import through
from workbench.lti.hold import held
from workbench.machine.threads import one_thread
from workbench.result import Result, Row
from workbench.simulation.response import INSTANTS, Response, Step, loop_response


@dataclass(frozen=True, kw_only=True, repr=False)
class PlantSimulation(Result):
    """Histories of every model's loop, from rest, as deviations from it.

    problem : its name;  values : of the structure's parameters;  computing_delay : [s] of a sampled loop
    responses : one a model, by name through `simulation["motor"]`
    """

    problem: str
    values: Mapping[str, float]
    computing_delay: float
    responses: tuple[Response, ...]

    def __getitem__(self, name: str) -> Response:
        """The response of a model."""
        for response in self.responses:
            if response.model == name:
                return response
        raise unknown_name("model", name, [response.model for response in self.responses])

    def plot(self):
        """A matplotlib Figure: outputs over time, model by model."""
        return through("histories")(self)

    def rows(self) -> list[Row]:
        return [row for response in self.responses for row in response.rows()]


def simulate_plant(
    problem: Problem, values: Mapping[str, float] | None = None, *,
    steps: Mapping[str, float | Step | Sequence[Step]] | None = None, outputs: Sequence[str] | None = None,
    duration: float | None = None, sample_time: float | None = None, computing_delay: float = 0.0,
    instants: int = INSTANTS,
) -> PlantSimulation:  # fmt: skip
    """The loop of every model after steps.

    Parameters
    ----------
    values : of parameters; the approved ones, or else the structure's own, where some are left out
    steps : point to the size of a step at the beginning, to a `Step`, or to several; at a point between model and
        structure they are disturbances. A unit step of the first reference, or else of the first other
        signal from outside, if left out.
    outputs : points or signed sums; what is measured and what is commanded if left out
    duration : [s];  instants : of the history, one every sample where the loop is sampled
    sample_time, computing_delay : [s] of a computer that runs the structure, its commands held meanwhile; the loop as
        it was designed if left out

    Raises
    ------
    InputError
        For unknown names, times that make no sense, or an unstable loop without a duration.
    """
    start = problem.approved if isinstance(problem.approved, Mapping) else {}
    structure = problem.structure_at({**start, **checked_values(values)})
    with one_thread():
        loops, K = _loops(problem, structure, sample_time, computing_delay)
        first = loops[0]
        usual = (*first.structure.references, *first.exogenous)[:1]
        asked = dict.fromkeys(usual, 1.0) if steps is None else dict(steps)
        if not asked:
            raise InputError(
                f"nothing acts on {problem.name!r} from outside; name where a step comes, one of "
                f"{', '.join(first.points)}."
            )
        each = {name: _steps(given) for name, given in asked.items()}
        seen = (*first.model.outputs, *first.commands) if outputs is None else _listed(outputs)
        found = tuple(
            loop_response(loop, K, each, seen, duration=duration, instants=instants) for loop in loops
        )  # fmt: skip
    return PlantSimulation(
        problem=problem.name, values=structure.values(), computing_delay=computing_delay, responses=found
    )


def _loops(
    problem: Problem, structure: Structure, sample_time: float | None, delay: float
) -> tuple[tuple[Loop, ...], Controller]:
    """The loops as they are, or as a computer runs them, and the controller at its values."""
    K = structure.controller()
    if sample_time is None:
        if delay:
            raise InputError(
                f"a computing delay belongs to a sampled loop; got {delay!r} s without a sample time. Give both."
            )
        return problem.loops, K
    own = structure.sample_time
    if own is not None and abs(sample_time - own) > 1e-12 * own:
        raise InputError(
            f"this structure is sampled every {own:g} s; got {sample_time!r} s. Leave the sample time out."
        )
    run = structure if own is not None else structure.sampled(sample_time)
    made = run.outputs
    models = (held(m, sample_time, {u: delay for u in m.inputs if u in made}) for m in problem.systems)
    return tuple(Loop(model, run) for model in models), run.controller()


def _steps(given: float | Step | Sequence[Step]) -> tuple[Step, ...]:
    """Steps from a size, a step or several."""
    if isinstance(given, Step):
        return (given,)
    if isinstance(given, Sequence) and not isinstance(given, str):
        if not all(isinstance(one, Step) for one in given):
            raise InputError(f"steps at a signal must be a size or of the kind Step; got {given!r}.")
        return tuple(given)
    return (Step(size=given),)


def _listed(outputs: Sequence[str] | str) -> tuple[str, ...]:
    return (outputs,) if isinstance(outputs, str) else tuple(outputs)

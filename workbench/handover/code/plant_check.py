"""Whether a structure may run on a computer: its sampled loop with every model, held against what is promised.

    models --held, dead times exact--> Loop with the sampled structure --> poles, damping, decay, peaks, delay reserve
    promises ---------------------------held against these---------------^

Stability, decay, damping, peak sensitivity, disk margin and the peak gain of a channel between sampled signals have a
counterpart in the sampled loop. A variance, and a channel from a disturbance that no sampling holds, are of the
continuous loop alone: those promises are not compared.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.analysis.precision import HALF_UNIT, SinglePrecision
from workbench.analysis.sampled import BISECTIONS, MOST_DELAY, PASSED, SampledLoop
from workbench.control.structure.block import Controller
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.errors import InfeasibleError, InputError
from workbench.goals.promise import Promise
from workbench.handover.code.digital import DigitalCheck, SampledPromise
from workbench.handover.code.program import MATRICES, Program, program
from workbench.lti.bilinear import in_w_plane
from workbench.lti.delay import LinedSystem
from workbench.lti.disk import disk_margin
from workbench.lti.front import matrices
from workbench.lti.hold import held
from workbench.lti.join import beside, wired
from workbench.lti.measure import sampled_peak
from workbench.lti.model import Model
from workbench.lti.realisation import Realisation
from workbench.machine.threads import one_thread

GRID = 200  # angles of the unit circle each way, beside those of the poles


def plant_check(
    models: Sequence[Model], structure: Structure, promises: Sequence[Promise], *, sample_time: float | None = None,
    computing_delay: float = 0.0,
) -> DigitalCheck:  # fmt: skip
    """The sampled loops of a structure at its values with its models, and the promises beside them.

    Raises
    ------
    InfeasibleError
        If a sampled loop is unstable.
    InputError
        If no sample time is known, the delay is negative or too long, or a dead time stands between states.
    """
    run = program(structure, models, sample_time)
    if not 0 <= computing_delay <= MOST_DELAY * run.sample_time:
        longest = 1e3 * MOST_DELAY * run.sample_time
        raise InputError(
            f"the computing delay must lie between 0 and {MOST_DELAY} samples, {longest:g} ms; "
            f"got {1e3 * computing_delay:g} ms. Sample more slowly, or compute faster."
        )
    with one_thread():  # small matrices: more threads only wait for each other
        return _checked(models, structure, promises, run, computing_delay)


def _checked(models, structure: Structure, promises, run: Program, computing_delay: float) -> DigitalCheck:
    T = run.sample_time
    sampled = structure if structure.sample_time is not None else structure.sampled(T)
    loops = {model.name: Loop(held(model, T, computing_delay), sampled) for model in models}
    K, found = sampled.controller(), {}
    for model in models:
        loop = loops[model.name]
        poles = loop.poles(K)
        if not np.abs(poles).max(initial=0.0) < 1:
            raise InfeasibleError(
                f"the sampled loop of {model.name} must be stable; it is unstable at a sample time of {1e3 * T:g} ms "
                f"with {1e3 * computing_delay:g} ms of computing. Sample or compute faster, or design for a larger "
                "delay margin."
            )
        lasting = np.log(_lasting(poles)) / T
        commands = tuple(name for name in run.outputs if name in model.inputs)
        found[model.name] = (
            SampledLoop(
                sample_time=T, computing_delay=computing_delay, stable=True, poles=poles,
                damping=_damping(lasting), decay=_decay(lasting),
                peak_sensitivity=sampled_peak(*loop.sensitivity(commands).system(K), T),
                delay_reserve=_reserve(model, run, computing_delay),
            ),
            _single_precision(loop.model, run),
        )  # fmt: skip
    beside = [
        SampledPromise(name=p.name, sense=p.sense, limit=p.limit, value=value)
        for p in promises
        if (value := _counterpart(p, loops, K)) is not None
    ]
    return DigitalCheck(groups=found, promises=tuple(beside), what="models")


def _lasting(poles: np.ndarray) -> np.ndarray:
    """Without those at z = 0, delays that have passed."""
    return poles[np.abs(poles) > PASSED].astype(complex)


def _damping(s: np.ndarray) -> float:
    return float(np.min(-s.real / np.abs(s), initial=1.0))


def _decay(s: np.ndarray) -> float:
    return float(np.min(-s.real, initial=np.inf))


def _counterpart(promise: Promise, loops: dict[str, Loop], K: Controller) -> float | None:
    """The worst value of what a promise speaks of over its models, in the sampled loops; None if it has no place there.

    A promise of a part of the frequencies is kept where it is kept by all of them.
    """
    values = [
        value
        for name, loop in loops.items()
        if not promise.subject.models or name in promise.subject.models
        if (value := _sampled_value(promise, loop, K)) is not None
    ]
    return (max if promise.sense == "<=" else min)(values, default=None)


def _sampled_value(promise: Promise, loop: Loop, K: Controller) -> float | None:
    if promise.subject.scaled:  # of another plant
        return None
    kind, subject, T = promise.kind, promise.subject, float(loop.sample_time or 0.0)
    if kind in ("stability", "decay rate", "damping ratio"):
        s = np.log(_lasting(loop.poles(K, subject.openings))) / T
        if subject.band is not None:
            s = s[(np.abs(s) >= subject.band[0]) & (np.abs(s) <= subject.band[1])]
        return _damping(s) if kind == "damping ratio" else _decay(s)
    if subject.band is not None:
        return None
    if kind == "peak sensitivity":
        return sampled_peak(*loop.sensitivity(subject.points, subject.openings).system(K), T).upper
    if kind == "disk margin":
        S = in_w_plane(loop.sensitivity(subject.points, subject.openings).system(K), T)
        return None if S is None else disk_margin(*S).lower
    sampled = {*loop.structure.references, *loop.analysis_points}
    if kind == "peak gain" and sampled.issuperset(subject.inputs):
        return sampled_peak(*loop.channel(subject.inputs, subject.outputs, subject.openings).system(K), T).upper
    return None


@dataclass(frozen=True, slots=True)
class _Closed:
    """A sampled model under a program: x⁺ = A x + B d, seen = C x + D d, x of model and program.

    d : what is added to the program's next states and to its commands;  seen : its states and its measurements
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray

    @classmethod
    def of(cls, model: Model, run: Program) -> "_Closed":
        plant = model.rational()
        reads = [k for k, name in enumerate(run.inputs) if name in plant.outputs]
        acts = [k for k, name in enumerate(run.outputs) if name in plant.inputs]
        P = plant.select(inputs=[run.outputs[k] for k in acts], outputs=[run.inputs[k] for k in reads])
        nk, nu, ny, eye = len(run.F), len(acts), len(reads), np.eye(len(run.F))
        own = Realisation(  # from measurements and what is added to the next states, to states and commands
            run.A, np.column_stack([run.B[:, reads], eye]), np.concatenate([eye, run.C[acts]]),
            np.pad(run.D[np.ix_(acts, reads)], ((nk, 0), (0, nk))),
        )  # fmt: skip
        back, into, out = np.zeros((nu + ny + nk, ny + nk + nu)), np.zeros((nu + ny + nk, nk + nu)), np.eye(nk + ny)
        back[:nu, ny + nk :], back[nu : nu + ny, :ny] = np.eye(nu), np.eye(ny)
        into[nu + ny :, :nk], into[:nu, nk:] = eye, np.eye(nu)
        out = np.pad(np.roll(out, ny, axis=1), ((0, 0), (0, nu)))
        return cls(*wired(beside(matrices(P), own), back, into, out, np.zeros((nk + ny, nk + nu))))

    @property
    def stable(self) -> bool:
        return bool(np.abs(np.linalg.eigvals(self.A)).max(initial=0.0) < 1)


def _single_precision(model: Model, run: Program) -> SinglePrecision:
    """What the rounding of the coefficients does to a stable loop.

    The loop stays stable under every change of the coefficients, entry by entry up to t times their rounding, as long
    as t ρ(|Δ| |M(z)|) < 1 on the unit circle (Perron), M from what a wrong coefficient adds to what it multiplies. The
    circle is looked at on a grid.
    """
    other, closed = run.rounded(), _Closed.of(model, run)
    reads = [k for k, name in enumerate(run.inputs) if name in model.outputs]
    acts = [k for k, name in enumerate(run.outputs) if name in model.inputs]
    pairs = [(getattr(run, name), getattr(other, name)) for name in MATRICES]
    F, B, C, D = (np.abs(there - here) for here, there in pairs)
    change = np.vstack([np.hstack([F, B[:, reads]]), np.hstack([C[acts], D[np.ix_(acts, reads)]])])
    poles = np.linalg.eigvals(closed.A)
    even = np.geomspace(1e-6, np.pi, GRID)
    angles = np.unique(np.r_[np.abs(np.angle(poles)), np.pi - even, even])
    alone = LinedSystem(closed.A, closed.B, closed.C, closed.D, np.zeros(0), run.sample_time)
    sizes = np.abs(alone.response(np.minimum(angles, np.pi) / run.sample_time))
    worst = float(np.abs(np.linalg.eigvals(change @ sizes)).max(initial=0.0))
    slow = np.abs(np.linalg.eigvals(run.F))
    slow = slow[slow > 0]
    return SinglePrecision(
        coefficient_error=max(_error(*pair) for pair in pairs), margin=1 / worst if worst else float("inf"),
        dead_band=float(HALF_UNIT / slow.min()) if len(slow) else 0.0,
    )  # fmt: skip


def _error(exact: np.ndarray, rounded: np.ndarray) -> float:
    size = np.abs(exact)
    return float(np.max(np.abs(rounded - exact)[size > 0] / size[size > 0], initial=0.0))


def _reserve(model: Model, run: Program, delay: float) -> float:
    """From a stable delay to the nearest that is not: half samples, then bisection; samples of a sampled model."""
    T = run.sample_time

    def stable(value: float) -> bool:
        return _Closed.of(held(model, T, value), run).stable

    low = high = delay
    for high in _later(delay, T / 2 if model.sample_time is None else T, MOST_DELAY * T):
        if not stable(high):
            break
        low = high
    else:
        return low - delay
    for _ in range(BISECTIONS if model.sample_time is None else 0):
        middle = (low + high) / 2
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low - delay


def _later(start: float, step: float, end: float) -> Iterator[float]:
    count = 1
    while (value := start + count * step) <= end:
        yield value
        count += 1

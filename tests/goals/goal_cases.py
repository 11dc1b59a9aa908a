"""Loops for the tests of goals, and the check that a goal's gradient is the derivative of its value."""

import numpy as np

from workbench.control.structure.block import Controller
from workbench.control.structure.loop import Loop
from workbench.control.structure.space import state_space
from workbench.control.structure.structure import Structure
from workbench.goals.gain import Gain, Tracking, WeightedGain
from workbench.goals.loop_shape import LoopShape, MaxLoopGain, MinLoopGain, Rejection, Sensitivity
from workbench.goals.margin import DelayMargin, Margins
from workbench.goals.poles import ControllerPoles, Poles
from workbench.goals.sector import ConicSector, Passivity, WeightedPassivity
from workbench.goals.spectrum import RmsLimit, Spectrum
from workbench.goals.time import Overshoot, StepRejection
from workbench.goals.tracking import StepTracking, Transient
from workbench.goals.variance import Variance, WeightedVariance
from workbench.lti import Plant
from workbench.lti.model import Model

PAIR = {"inputs": ("u3", "u1"), "outputs": ("y3", "y1")}
ONE = {"inputs": "u3", "outputs": "y3"}
LAG = ([1.0], [1.0, 2.0])
# at least one of every kind that a plant of one's own can be asked for
EXAMPLES = [
    Poles(decay=0.1),
    Poles(damping=0.3),
    Poles(frequency=3.0),
    ControllerPoles(decay=0.4),
    Gain(**PAIR),
    Gain(**PAIR, limit=([1.0, 1.0], [1.0, 4.0])),
    Gain(**PAIR, limit={0.1: 1.0, 10.0: 3.0}),
    Gain(**PAIR, focus=(2.0, 5.0)),
    WeightedGain(**PAIR, left=LAG, right=np.diag([1.0, 2.0])),
    Tracking(**ONE, response_time=1.0),
    Sensitivity(points=("u1", "u2")),
    Rejection(points="u1", attenuation=([1.0, 1.0], [1.0, 0.01])),
    MinLoopGain(points=("u1", "u2"), profile=2.0, focus=(0.1, 1.0)),
    MaxLoopGain(points="y1", profile=([1.0], [1.0, 0.0])),
    LoopShape(points="y1", target={0.1: 3.0, 10.0: 0.03}, focus=(0.2, 8.0)),
    Margins(points="u1", gain_db=6.0),
    Margins(points=("u1", "u2"), gain_db=6.0, phase_deg=35.0),
    DelayMargin(points=("y2", "y1"), delay=0.1),
    Passivity(**PAIR, focus=(0.0, 3.0)),
    WeightedPassivity(**PAIR, left=([1.0, 2.0], [1.0, 3.0]), input_index=-1.0, output_index=0.1),
    ConicSector(**PAIR, sector=(-2.0, 5.0)),
    Spectrum(**PAIR, mask={0.1: 1.0, 1.0: 0.01}, density=({0.1: 1.0, 10.0: 0.1}, 1.0), unit="g"),
    RmsLimit(**PAIR, limit=2.0),
    RmsLimit(**PAIR, limit=2.0, density={0.1: 1.0, 10.0: 0.1}, focus=(1.0, 5.0)),
    Variance(**PAIR),
    WeightedVariance(**PAIR, left=LAG, right=([1.0, 3.0], [1.0, 2.0])),
    StepTracking(**ONE, time_constant=1.0, static_error=1e4),
    StepTracking(**PAIR, time_constant=1.0, overshoot_percent=10.0),
    Transient(**ONE, reference=LAG, signal="impulse"),
    Transient(**ONE, reference=LAG, signal="step", static_error=1e4),
    Transient(**ONE, reference=LAG, signal="ramp", static_error=1e4),
    Transient(**ONE, reference=LAG, signal="ramp", gap=1e4),
    Overshoot(**ONE),
    StepRejection(**PAIR, peak=1.0, settling_time=3.0),
    StepRejection(**PAIR, peak=1.0, settling_time=30.0, fraction=1.0),
]


def plant(A, B, C, D=None, inputs=None, outputs=None) -> Plant:
    """A plant with the given names; w1…, u1… are for the caller to choose."""
    free = Plant.from_matrices(np.atleast_2d(A), np.atleast_2d(B), np.atleast_2d(C), D)
    return Plant(
        A=free.A, B=free.B, C=free.C, D=free.D, states=free.states,
        inputs=tuple(inputs or free.inputs), outputs=tuple(outputs or free.outputs),
    )  # fmt: skip


def loop_of(system: Plant, *, controls, measured, order=0, sample_time=None, references=(), **delays) -> Loop:
    """The plant with a state-space controller of an order between measured signals and controls."""
    block = state_space(list(measured), list(controls), order, sample_time=sample_time) if order else None
    if block is None:
        from workbench.control.structure.blocks import gain

        block = gain(list(measured), list(controls))
    structure = Structure([block], references=references)
    return Loop(Model("case", system, sample_time=sample_time, **delays), structure)


def random_plant(seed: int, n: int, m: int, p: int, *, decay: float = 0.3, feedthrough: bool = False) -> Plant:
    """A stable plant with inputs u1…um and outputs y1…yp."""
    random = np.random.default_rng(seed)
    A = random.standard_normal((n, n))
    A -= (np.linalg.eigvals(A).real.max() + decay) * np.eye(n)
    D = 0.3 * random.standard_normal((p, m)) if feedthrough else None
    return Plant.from_matrices(A, random.standard_normal((n, m)), random.standard_normal((p, n)), D)


def random_controller(seed: int, order: int, outputs: int, inputs: int, size: float = 0.1) -> Controller:
    """A slow, weak, stable controller that leaves a stable plant stable."""
    random = np.random.default_rng(seed)
    A = random.standard_normal((order, order))
    A -= (np.linalg.eigvals(A).real.max() + 1 if order else 0) * np.eye(order)
    return Controller(
        A, size * random.standard_normal((order, inputs)), random.standard_normal((outputs, order)),
        size * random.standard_normal((outputs, inputs)),
    )  # fmt: skip


def slope_error(bound, K: Controller, *, step: float = 1e-6, seed: int = 0) -> float:
    """|difference quotient − gradient| over the size of the gradient, along three random directions."""
    random = np.random.default_rng(seed)
    value = bound.evaluate(K)
    assert value.gradients, value
    top, gradient = value.gradients[0]
    # the piece is the value: to rounding of another order of summation
    np.testing.assert_allclose(top, value.value, rtol=1e-9, atol=1e-12)
    size = max(np.sqrt(gradient.inner(gradient)), 1e-12)
    worst = 0.0
    for _ in range(3):
        d = Controller(*(random.standard_normal(getattr(K, name).shape) for name in "ABCD"))
        up, down = (bound.evaluate(K.plus(d, sign * step)).value for sign in (1, -1))
        worst = max(worst, abs((up - down) / (2 * step) - gradient.inner(d)) / size)
    return worst

"""Loops for the tests of goals, and the check that a goal's gradient is the derivative of its value."""

import numpy as np

from workbench.control.structure.block import Controller
from workbench.control.structure.loop import Loop
from workbench.control.structure.space import state_space
from workbench.control.structure.structure import Structure
from workbench.lti import Plant
from workbench.lti.model import Model


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

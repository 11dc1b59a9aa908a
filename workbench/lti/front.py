"""What stands in front of a plant's inputs: lags, integrators, patterns.

command --1/(1 + s·lag)--> input      the input is a state and an output then
command --1/s------------> input      so that its rate is what is chosen
amounts --patterns-------> inputs     several inputs moved together
"""

from collections.abc import Sequence

import numpy as np

from workbench.lti.join import beside, wired
from workbench.lti.plant import Plant
from workbench.lti.realisation import Realisation


def lagged(plant: Plant, inputs: Sequence[str], commands: Sequence[str], lag: float) -> Plant:
    """A plant whose inputs follow commands with a first-order lag [s], at once if it is 0.

    The commands take the inputs' places; the inputs become outputs behind the others, and states if there is a lag.
    """
    k, m, p = len(inputs), len(plant.inputs), len(plant.outputs)
    pick = np.eye(m)[plant.index("inputs", inputs)]  # (k, m)
    renamed = dict(zip(inputs, commands, strict=True))
    if lag == 0:
        eye, none = np.eye(m), np.zeros((k, p))
        A, B, C, D = wired(
            matrices(plant), np.zeros((m, p)), eye, _below(np.eye(p), none), _below(np.zeros((p, m)), pick)
        )
    else:
        one = np.eye(k)
        whole = beside(matrices(plant), Realisation(-one / lag, one / lag, one, 0 * one))
        back = np.zeros((m + k, p + k))
        back[:m, p:] = pick.T
        others = np.eye(m) - pick.T @ pick
        A, B, C, D = wired(whole, back, _below(others, pick), np.eye(p + k), np.zeros((p + k, m)))
    return Plant(
        A=A, B=B, C=C, D=D, states=plant.states + (tuple(inputs) if lag else ()),
        inputs=tuple(renamed.get(u, u) for u in plant.inputs), outputs=plant.outputs + tuple(inputs),
    )  # fmt: skip


def integrated(plant: Plant, inputs: Sequence[str], states: Sequence[str]) -> Plant:
    """A plant with integrators before some inputs, whose names are those of the rates then."""
    k, m, p = len(inputs), len(plant.inputs), len(plant.outputs)
    pick, one = np.eye(m)[plant.index("inputs", inputs)], np.eye(k)
    whole = beside(matrices(plant), Realisation(0 * one, one, one, 0 * one))
    back = np.zeros((m + k, p + k))
    back[:m, p:] = pick.T
    A, B, C, D = wired(whole, back, _below(np.eye(m) - pick.T @ pick, pick), np.eye(p, p + k), np.zeros((p, m)))
    return Plant(
        A=A, B=B, C=C, D=D, states=plant.states + tuple(states), inputs=plant.inputs, outputs=plant.outputs
    )  # fmt: skip


def mixed(plant: Plant, inputs: Sequence[str], names: Sequence[str], patterns: np.ndarray) -> Plant:
    """A plant whose inputs are moved along patterns (inputs, names) only; the named amounts stand before the others."""
    u, taken = plant.index("inputs", inputs), set(inputs)
    others = [i for i, name in enumerate(plant.inputs) if name not in taken]
    B, D = (np.column_stack([M[:, u] @ patterns, M[:, others]]) for M in (plant.B, plant.D))
    return Plant(
        A=plant.A, B=B, C=plant.C, D=D, states=plant.states,
        inputs=(*names, *(plant.inputs[i] for i in others)), outputs=plant.outputs,
    )  # fmt: skip


def matrices(plant: Plant) -> Realisation:
    """The four of a plant without their names."""
    return Realisation(plant.A, plant.B, plant.C, plant.D)


def _below(top: np.ndarray, bottom: np.ndarray) -> np.ndarray:
    return np.concatenate([top, bottom])

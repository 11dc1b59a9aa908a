"""The checker's twin of each kind of block has the transfer function of the block itself, continuous and sampled."""

import numpy as np
import pytest

from workbench.control import Gains, ModalLaw
from workbench.control.structure.block import Parameter
from workbench.control.structure.blocks import (
    gain,
    lead_lag,
    low_pass,
    low_pass_second,
    notch,
    pid,
    pid_matrix,
    pid_two_degrees,
    washout,
)
from workbench.control.structure.registry import BLOCKS
from workbench.control.structure.space import modal_law, state_space, transfer_function
from workbench.control.structure.structure import Structure
from workbench.handover.table.plant import structure_part
from workbench.verify.exact.failure import NotProved, TableError
from workbench.verify.plant.block import matrices_of
from workbench.verify.plant.table import Block, _block

POSITIONS = ((2.0, 1.0), (2.0, -1.0), (-2.0, 1.0), (-2.0, -1.0))
RNG = np.random.default_rng(11)


def law(motor):
    return ModalLaw.with_motor(POSITIONS, 0.4) if motor else ModalLaw(POSITIONS, 0.4)


def gains():
    from workbench.control.gains import GAIN_NAMES, TIME_CONSTANTS

    return Gains.from_mapping({
        name: RNG.uniform(0.1, 0.9) if name in TIME_CONSTANTS else RNG.normal() for name in GAIN_NAMES
    })  # fmt: skip


MADE = {
    "gain": lambda: gain("e", "u", 2.5),
    "gain of a mask": lambda: gain(["a", "b"], ["u", "v"], [[1, 0], [2, 3]], mask=[[1, 0], [1, 1]]),
    "pid": lambda: pid("r - y", "u", Kp=2.0, Ki=0.7, Kd=0.3, Tf=0.05),
    "pid of other names": lambda: pid("e", "u", Kp=Parameter("mine", 1.5, 0, 9), parts="PD", Kd=0.2, name="x"),
    "pid_two_degrees": lambda: pid_two_degrees("r", "y", "u", Kp=2.0, Ki=0.7, Kd=0.3, Tf=0.05, b=0.8, c=0.3),
    "pid_matrix": lambda: pid_matrix(
        ["a", "b"], ["u", "v"], Kp=[[1, 2], [3, 4]], Ki=[[0.1, 0.2], [0.3, 0.4]], Kd=[[0.5, 0], [0, 0.6]], Tf=0.2
    ),
    "pid_matrix of a mask": lambda: pid_matrix(
        ["a", "b"], ["u"], Kp=[[1, 0]], Ki=[[0.1, 0]], Kd=[[0.5, 0]], Tf=0.2, mask=[[1, 0]], name="m"
    ),
    "lead_lag": lambda: lead_lag("e", "u", K=3.0, T_zero=0.4, T_pole=0.07),
    "low_pass": lambda: low_pass("e", "u", tau=0.3),
    "low_pass_second": lambda: low_pass_second("e", "u", omega=7.0, zeta=0.4),
    "washout": lambda: washout("e", "u", tau=1.3),
    "notch": lambda: notch("e", "u", omega=9.0, zeta_zero=0.05, zeta_pole=0.8),
    "transfer_function": lambda: transfer_function("e", "u", [2.0, 3.0], [4.0, 5.0, 6.0, 7.0]),
    "transfer_function of equal degrees": lambda: transfer_function("e", "u", [2.0, 3.0, 1.0], [4.0, 5.0, 6.0]),
    "state_space": lambda: state_space(["a", "b"], ["u"], 3, direct=True),
    "modal_law": lambda: modal_law(law(False), gains()),
    "modal_law with a motor": lambda: modal_law(law(True), gains()),
}


def twin(block):
    """The checker's block, as a table would have it."""
    return _block(structure_part(Structure((block,)))["blocks"][0], "block")


def response(matrices, s):
    A, B, C, D = (np.array([[float(x) for x in row] for row in m.tolist()]).reshape(m.nrows(), m.ncols())
                  for m in matrices)  # fmt: skip
    return C @ np.linalg.solve(s * np.eye(len(A)) - A, B) + D


def test_every_kind_that_a_table_can_hold_has_a_twin():
    assert {name.split(" ")[0] for name in MADE} == set(BLOCKS)


@pytest.mark.parametrize("name", MADE)
@pytest.mark.parametrize("h", [None, 0.02])
def test_a_twin_has_the_blocks_transfer_function(name, h):
    block = MADE[name]()
    theta = block.start + np.where(block.start == 0, 0.0, RNG.uniform(0.1, 0.4, len(block.start)))
    block = block.with_parameters([
        Parameter(p.name, v, free=False) for p, v in zip(block.parameters, theta, strict=True)
    ])  # fmt: skip
    if h is not None and block.order:
        block = block.sampled(h)
    K, found = block.matrices(theta), matrices_of(twin(block))
    for omega in (0.3, 4.0, 60.0):
        s = 1j * omega if h is None else np.exp(1j * omega * h)
        ours = K.C @ np.linalg.solve(s * np.eye(K.order) - K.A, K.B) + K.D
        assert response(found, s) == pytest.approx(ours, rel=1e-11, abs=1e-11 * np.abs(ours).max())


def test_an_action_without_gain_has_no_state():
    assert matrices_of(twin(pid("e", "u", Kp=1.0, parts="PD", Kd=0.2)))[0].nrows() == 1
    assert matrices_of(twin(pid("e", "u", Kp=1.0, parts="P")))[0].nrows() == 0


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"options": {"order": 3}}, "options of its kind"),
        ({"inputs": ("a", "b")}, "1 inputs and one output"),
        ({"parameters": {}}, "parameters of its kind"),
    ],
)
def test_a_block_of_other_parts_than_its_kinds_is_refused(change, sentence):
    block = twin(low_pass("e", "u", tau=0.3))
    given = {key: getattr(block, key) for key in ("kind", "inputs", "outputs", "options", "parameters")} | change
    with pytest.raises(TableError, match=sentence):
        matrices_of(Block(**given))


def test_a_kind_without_a_twin_is_not_proved():
    with pytest.raises(NotProved, match="no twin of a block of kind 'magic'"):
        matrices_of(Block("magic", ("e",), ("u",), {}, {}))

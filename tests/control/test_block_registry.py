import pickle
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from test_structure_blocks import a_block_of_each_kind

from workbench.control.gains import Gains
from workbench.control.law import ModalLaw
from workbench.control.structure.block import Parameter
from workbench.control.structure.blocks import gain, pid_matrix
from workbench.control.structure.registry import BLOCKS, make_block
from workbench.control.structure.space import expression, modal_law, state_space, transfer_function
from workbench.control.structure.structure import Structure
from workbench.errors import InputError
from workbench.lti.plant import Plant

LAW = ModalLaw.with_motor(((3.0, 1.1), (3.0, -1.1), (-3.0, 1.1), (-3.0, -1.1)), 0.8)


def every_block():
    known = {name: block for name, block in a_block_of_each_kind().items() if name != "expression"}
    gains = Gains.from_mapping({name: 0.3 + 0.1 * k for k, name in enumerate(Gains.__dataclass_fields__)})
    more = {
        "masked gain": gain(["a", "b"], ["u", "v"], [[1, 0], [2, 3]], mask=[[1, 0], [1, 1]], fixed=[[0, 0], [1, 0]]),
        "pid matrix": pid_matrix(
            ["a - b", "c"],
            ["u", "v"],
            Kp=[[1, 0], [2, 3]],
            Ki=0.5,
            Kd=[[0, 0], [0.1, 4]],
            Tf=0.2,
            mask=[[1, 0], [1, 1]],
            name="P",
        ),
        "named gain": gain("a - b", "u", 2.0, name="F", low=0, high=4),
        "sampled state space": state_space("y", "u", 2, sample_time=0.1, direct=True, name="K"),
        "sampled transfer function": transfer_function("y", "u", [1, 2], [1, 0.2], sample_time=0.1),
        "modal law": modal_law(LAW, gains, {"K_h": (0, 5), "tau_h": (0.01, 5)}),
        "renamed": known["pid"].renamed({"Kp": "stiffness", "Tf": "tau"}),
        "sampled notch": known["notch"].sampled(0.01),
    }
    return known | more


@pytest.mark.parametrize("name", every_block())
def test_a_block_is_made_again_from_kind_signals_options_and_parameters(name):
    block = every_block()[name]
    again = make_block(block.kind, block.inputs, block.outputs, block.options, block.parameters)
    by_slot = make_block(
        block.kind, block.inputs, block.outputs, block.options, dict(zip(block.slots, block.parameters, strict=True))
    )
    theta = np.random.default_rng(len(name)).uniform(0.2, 2, len(block.parameters))
    for other in (again, by_slot, pickle.loads(pickle.dumps(again))):
        for field in ("inputs", "outputs", "parameters", "idle", "sample_time", "kind", "options", "slots"):
            assert getattr(other, field) == getattr(block, field)
        for matrix in "ABCD":
            assert np.array_equal(getattr(other.matrices(theta), matrix), getattr(block.matrices(theta), matrix))


def test_every_kind_is_among_the_blocks_above():
    assert {block.kind for block in every_block().values()} == set(BLOCKS)


def test_a_structure_keeps_kind_and_options_of_its_blocks():
    block = every_block()["pid"].sampled(0.02)
    changed = Structure(block).with_values({"Kp": 7.0}).freeze("Kd", 0.0).blocks[0]
    assert (changed.kind, changed.options) == ("pid", {"parts": "PID", "tustin_s": 0.02})
    again = make_block(changed.kind, changed.inputs, changed.outputs, changed.options, changed.parameters)
    assert Structure(again).order == Structure(changed).order == 1  # the derivative's state is left out in both


def test_a_number_for_a_slot_is_the_start_of_a_parameter_called_after_the_block():
    block = make_block("pid", ["r - y"], ["u"], {"parts": "PI"}, {"Kp": 3, "Ki": Parameter("reset", 2, 0, 9)}, name="c")
    assert [p.name for p in block.parameters] == ["c.Kp", "reset", "c.Kd", "c.Tf"]
    assert [p.value for p in block.parameters[:3]] == [3, 2, 0]
    assert [p.free for p in block.parameters] == [True, True, False, True]
    assert block.idle == ((0, ("reset",)), (1, ("c.Kd",)))


def test_an_entry_of_a_masked_gain_may_be_held_at_a_number_that_is_not_zero():
    block = every_block()["masked gain"]
    held = {p.name: p.value for p in block.parameters if not p.free}
    assert held == {"K_2_1": 2.0}
    assert Structure(block).controller().D.tolist() == [[1, 0], [2, 3]]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("pidd", ["e"], ["u"], {}, {}), "did you mean 'pid'"),
        (("expression", ["e"], ["u"], {}, {}), "lives in the program"),
        (("pid", ["e", "f"], ["u"], {}, {}), "must have 1 inputs and 1 outputs; got 2 and 1"),
        (("pid", ["e"], ["u"], {"part": "P"}, {}), "did you mean 'parts'"),
        (("pid", ["e"], ["u"], {"parts": 3}, {}), "letters of 'PID'"),
        (("pid", ["e"], ["u"], {}, {"Kpp": 1}), "did you mean 'Kp'"),
        (("pid", ["e"], ["u"], {}, {"Kp": "1"}), "finite number"),
        (("pid", ["e"], ["u"], {}, {"Kp": True}), "finite number"),
        (("pid", ["e"], ["u"], {}, {"Tf": -1}), "Tf must be positive"),
        (("pid", ["e"], ["u"], {"tustin_s": 0}, {}), "tustin_s must be a positive"),
        (("pid", ["e"], ["u"], {}, [Parameter("a", 1)]), "its 4 parameters; got 1"),
        (("gain", ["e"], ["u"], {"mask": [[0]]}, {}), "allow at least one"),
        (("gain", ["e"], ["u"], {"mask": "x"}, {}), "mask"),
        (("gain", ["e"] * 61, ["u"], {}, {}), "1 to 60 inputs"),
        (("state_space", ["e"], ["u"], {"order": 10**9}, {}), "from 0 to 60"),
        (("state_space", ["e"], ["u"], {}, {}), "order must be a whole number"),
        (("state_space", ["e"], ["u"], {"order": 2, "direct": 1}, {}), "true or false"),
        (("transfer_function", ["e"], ["u"], {"numerator_degree": 3, "denominator_degree": 1}, {}), "no more"),
        (("modal_law", ["e"], ["u"], {"positions": [[1, 1]], "depth": 1}, {}), "coil sets"),
        (("modal_law", ["e"], ["u"], {"positions": 1, "depth": 1}, {}), "must have positions"),
        (("modal_law", ["e"], ["u"], {"positions": LAW.positions, "depth": 0.8}, {}), "of other names"),
    ],
)
def test_what_cannot_be_made_is_refused(arguments, sentence):
    with pytest.raises(InputError, match=sentence):
        make_block(*arguments)


def test_an_option_that_no_file_can_hold_is_refused():
    with pytest.raises(InputError, match="an option must be"):
        replace(every_block()["pid"], options={"plant": Plant})


def test_an_expression_says_that_it_is_one():
    a = ca.SX.sym("a")
    assert expression("e", "u", [(Parameter("a", 2), a)], D=a).kind == "expression"

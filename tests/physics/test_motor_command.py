"""`workbench motor`: what it prints and what it refuses."""

import json

import pytest

from workbench.commands.motor import motor
from workbench.errors import InputError

POSE = {"x": 0.0, "y": 0.3, "z": 0.0, "pitch": 0.0, "yaw": 0.0, "roll": 0.0}


def run(capsys, **change) -> dict:
    assert motor(**{**POSE, "coils": 1, "json": True, **change}) == 0
    return json.loads(capsys.readouterr().out)


def test_json_holds_the_working_point(capsys):
    found = run(capsys, coils=32)
    # half a unit of the last digit of an independent evaluation
    assert found["force_n"] == pytest.approx([0, 1703.05, 1339.84], abs=5e-3)
    assert found["torque_n_m"] == pytest.approx([204.13, 0, 0], abs=5e-3)
    assert found["thrust_n"] == pytest.approx(64312, abs=0.5)
    assert found["normal_n"] == pytest.approx(81746, abs=0.5)
    assert found["inductance_h"] == pytest.approx([469.13 / 7.5e8, 0], abs=1e-11)
    assert found["stiffness"][1][1] == pytest.approx(6951, abs=0.5)
    assert len(found["stiffness"]) == len(found["stiffness"][0]) == 6


def test_table_names_thrust(capsys):
    assert motor(**POSE, coils=1, json=False) == 0
    assert "thrust of three phases" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"y": 0.0}, "clear the winding"),
        ({"y": -0.1}, "clear the winding"),
        ({"roll": 0.8}, "clear the winding"),
        ({"x": float("nan")}, "six finite numbers"),
        ({"coils": 0}, "at least 1"),
    ],
)
def test_bad_input_is_refused_in_one_sentence(change, sentence):
    with pytest.raises(InputError, match=sentence):
        motor(**{**POSE, "coils": 1, "json": True, **change})

"""The explorer on a plant of one's own: session and panel."""

import json
import struct

import pytest

from workbench.control.structure.block import Parameter
from workbench.control.structure.blocks import gain
from workbench.control.structure.structure import Structure
from workbench.design.plant_analysis import plant_analysis
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.explore import PlantSession, explore
from workbench.files.problem import load_problem
from workbench.goals.margin import Margins
from workbench.lti.make import tf


def tank(dead_time=0.1):
    model = tf([1.0], [1.0, 0.0], input="u", output="y", dead_time=dead_time, name="tank")
    structure = Structure(gain("r - y", "u", Parameter("K", 2.0, 0.1, 30.0)), "r")
    return Problem(models=model, structure=structure, goals=[Margins("u", gain_db=6, hard=True)], name="tank")


def test_moving_a_value_shows_the_analysis_of_it_and_undo_goes_back():
    session = PlantSession(tank())
    before = session.snapshot
    session.move("K", 4.0)
    alone = plant_analysis(session.problem, {"K": 4.0})
    assert session.snapshot.analysis.to_dict() == alone.to_dict()
    assert session.snapshot.met
    session.undo()
    assert session.values == {"K": 2.0}
    assert session.snapshot.analysis.to_dict() == before.analysis.to_dict()
    session.undo()  # nothing left


def test_an_unstable_loop_is_shown_without_curves_and_is_not_met():
    session = PlantSession(tank())
    session.move("K", 20.0)  # K · dead time > π/2
    assert not session.snapshot.stable
    assert not session.snapshot.met
    assert session.snapshot.steps == ()
    assert session.comparison()[1]


def test_values_out_of_bounds_and_unknown_ones_are_refused():
    session = PlantSession(tank())
    with pytest.raises(InputError, match=r"K must lie within \[0\.1, 30\]; got 40"):
        session.move("K", 40.0)
    with pytest.raises(InputError, match="unknown parameter 'KK'"):
        session.move("KK", 1.0)
    with pytest.raises(InputError, match="unknown parameter 'Kp'"):
        PlantSession(tank(), {"Kp": 1.0})
    with pytest.raises(InputError, match="unknown pinned design"):
        session.unpin("none")


@pytest.mark.slow
def test_pins_stand_beside_the_present_design_and_survive_a_file(tmp_path):
    session = PlantSession(tank())
    session.pin("first")
    session.move("K", 6.0)
    heads, rows = session.comparison()
    assert heads == ["", "now", "first", "unit"]
    decay = next(row for row in rows if row[0] == "slowest decay")
    assert decay[1] != decay[2]
    session.save(tmp_path / "s.json")
    other = PlantSession(tank())
    other.load(tmp_path / "s.json")
    assert other.values == {"K": 6.0}
    assert other.comparison() == session.comparison()
    for change, said in (
        ({"problem": "other"}, "saved exploration of 'tank'"), ({"values": {"K": "x"}}, "must be a number within"),
        ({"values": {"K": 99.0}}, "must be a number within"), ({"values": 3}, "as an object"),
        ({"pins": [1]}, "must be objects"),
    ):  # fmt: skip
        document = {**json.loads((tmp_path / "s.json").read_text()), **change}
        (tmp_path / "bad.json").write_text(json.dumps(document))
        with pytest.raises(InputError, match=said):
            other.load(tmp_path / "bad.json")
        assert other.values == {"K": 6.0}


def test_the_table_of_a_session_holds_its_values(tmp_path):
    from workbench.handover.table.table import read_table

    session = PlantSession(tank())
    session.move("K", 3.0)
    session.write_table(tmp_path / "gains.json")
    assert read_table(tmp_path / "gains.json").values() == {"K": 3.0}


@pytest.mark.slow
def test_the_panel_has_a_slider_for_every_parameter_and_a_picture_that_follows(tmp_path):
    pytest.importorskip("ipywidgets")
    panel = explore(load_problem("dc_motor"), {"Kp": 15.0}, state=tmp_path / "s.json")
    assert set(panel.sliders) == {"Kp", "Ki", "Kd", "Tf"}
    before = panel.image.value
    assert before[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", before[16:24])
    assert width > 900
    assert height > 500
    panel.sliders["Kp"].value = 25.0
    assert panel.session.values["Kp"] == 25.0
    assert panel.image.value != before
    panel.buttons["pin this design"].click()
    panel.behind.value = "design 1"
    panel.buttons["approved gains"].click()
    assert panel.session.values["Kp"] == 15.0
    assert panel.sliders["Kp"].value == 15.0
    assert "Margins voltage" in panel.table.value
    assert (tmp_path / "s.json").exists()

"""The analysis and the report of a plant of one's own, through the library and `workbench analyse`."""

import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from typer.testing import CliRunner

from workbench.commands.app import app
from workbench.control.structure.blocks import gain, pid
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.design.plant_analysis import loop_poles, plant_analysis
from workbench.design.plant_curves import open_loop, step_curve
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.goals.margin import Margins
from workbench.handover.report.plant import plant_report
from workbench.handover.table.table import table_of
from workbench.lti.hold import held
from workbench.lti.make import tf


def lag(dead_time=0.0):
    return tf([1.0], [1.0, 0.0], input="u", output="y", dead_time=dead_time, name="tank")


def problem(model, k=2.0, phase_deg=40):
    return Problem(
        models=model, structure=Structure(gain("r - y", "u", k), "r"), name="tank", title="A <tank> & its valve",
        goals=[Margins(points="u", gain_db=3, phase_deg=phase_deg, hard=True)],
    )  # fmt: skip


class Checked(HTMLParser):
    """Tags that close in order, ids that occur once."""

    def __init__(self):
        super().__init__()
        self.open, self.ids = [], set()

    def handle_starttag(self, tag, attrs):
        identity = dict(attrs).get("id")
        assert identity is None or identity not in self.ids
        self.ids.add(identity)
        if tag not in ("meta", "br", "path", "use", "rect"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in ("path", "use", "rect"):
            assert self.open.pop() == tag


def run(*arguments):
    return CliRunner().invoke(app, list(map(str, arguments)))


def test_the_report_states_goals_parameters_margins_and_proofs_and_leaves_nothing_open():
    found = plant_analysis(problem(lag(0.05)))
    table = table_of(found.design)
    text = plant_report(found, table=table)
    parser = Checked()
    parser.feed(text)
    assert parser.open == []
    for fact in (
        "all goals met",
        table.digest,
        "Step at r, measured",
        "Bode diagram at u",
        "Nyquist curve at y",
        "stability",
    ):
        assert fact in text
    assert "A &lt;tank&gt; &amp; its valve" in text
    assert "<tank>" not in text
    assert re.search(r"https?://(?!www\.w3\.org)", text) is None  # nothing is fetched
    other = table_of(plant_analysis(problem(lag(0.05), 1.5)).design)
    with pytest.raises(InputError, match="must hold the design's values"):
        plant_report(found, table=other)


def test_of_an_unstable_loop_there_are_poles_and_no_margins():
    found = plant_analysis(problem(lag(2.0)))
    document = found.to_dict()
    assert not document["stable"]
    assert "margins" not in document
    assert "peak_sensitivity" not in document
    assert any(re_ > 0 for re_, _ in document["models"][0]["poles"])
    assert "unstable" in plant_report(found)


def test_steps_of_a_lag_are_its_formula_continuous_late_and_sampled():
    K = Structure(gain("r - y", "u", 2.0), "r")
    curve = step_curve(Loop(lag(), K), K.controller(), "r", ("y", "u"))
    np.testing.assert_allclose(curve.values[:, 0], 1 - np.exp(-2 * curve.time), atol=1e-4)  # interpolated between looks
    np.testing.assert_allclose(curve.values[:, 1], 2 * np.exp(-2 * curve.time), atol=1e-4)
    late = step_curve(Loop(lag(0.1), K), K.controller(), "r", ("y",))
    first = (late.time >= 0.1) & (late.time <= 0.2)  # until the feedback is felt: 2 (t − 0.1)
    np.testing.assert_allclose(late.values[late.time < 0.09], 0.0, atol=1e-9)
    np.testing.assert_allclose(late.values[first, 0], 2 * (late.time[first] - 0.1), atol=2e-3)  # a look apart
    T = 0.1
    sampled = step_curve(Loop(held(lag(), T), K), K.controller(), "r", ("y",))
    np.testing.assert_allclose(sampled.values[:, 0], 1 - 0.8 ** np.arange(len(sampled.time)), rtol=1e-12)


def test_open_loops_and_poles_are_their_formulas():
    K = Structure(gain("r - y", "u", 2.0), "r")
    loop = Loop(lag(0.1), K)
    curve = open_loop(loop, K.controller(), "u")
    s = 2j * np.pi * curve.frequency_hz
    np.testing.assert_allclose(curve.loop, 2 / s * np.exp(-0.1 * s), rtol=1e-9)
    found = loop_poles(Loop(held(lag(), 0.1), K), K.controller())
    assert found.poles == pytest.approx([0.8], rel=1e-12)
    assert found.decay == pytest.approx(-np.log(0.8) / 0.1, rel=1e-12)
    assert found.damping == 1.0


def test_the_command_says_the_same_and_takes_values_from_tables_and_mappings(tmp_path):
    document = json.loads(run("analyse", "dc_motor", "--json").stdout)
    assert {"problem", "values", "stable", "damping", "decay", "models", "requirements", "margins"} <= set(document)
    assert {m["point"] for m in document["margins"]["single"]} == {"voltage", "speed"}
    (tmp_path / "some.toml").write_text("Kp = 10.0\n")
    other = json.loads(run("analyse", "dc_motor", "--gains", tmp_path / "some.toml", "--json").stdout)
    assert other["values"] == {**document["values"], "Kp": 10.0}
    assert other["margins"] != document["margins"]
    result = run("analyse", "dc_motor", "--report", tmp_path / "r.html")
    assert result.exit_code == 0
    assert "Margins, one point broken" in result.stdout
    assert "<title>DC motor" in (tmp_path / "r.html").read_text()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("Kpp = 1.0", "unknown parameter 'Kpp'; did you mean 'Kp'"),
        ("Kp = 'much'", "must give a number for 'Kp'"),
        ("Kp = nan", "must give a number for 'Kp'"),
        ("Kp = true", "must give a number for 'Kp'"),
        ("values = [1.0]", "must map names of parameters to numbers"),
        ("digest = 'no'", "digest"),
    ],
)
def test_values_that_cannot_be_are_one_sentence(text, said, tmp_path):
    (tmp_path / "g.toml").write_text(text + "\n")
    result = run("analyse", "dc_motor", "--gains", tmp_path / "g.toml")
    assert isinstance(result.exception, InputError)
    assert said in str(result.exception)


def test_a_table_of_another_structure_is_refused(tmp_path):
    own = Problem(models=lag(), structure=pid("r - y", "u", parts="PI", name="slow", Ki=0.1), goals=[], name="tank")
    table_of(plant_analysis(own).design).write(tmp_path / "gains.json")
    result = run("analyse", "dc_motor", "--gains", tmp_path / "gains.json")
    assert isinstance(result.exception, InputError)
    assert "unknown parameter 'slow.Kp'" in str(result.exception)

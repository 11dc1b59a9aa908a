"""A table of a plant of one's own as CSV, MATLAB file and C header, through the library and the command."""

import csv
import json
import math
from dataclasses import replace
from io import BytesIO, StringIO

import numpy as np
import pytest
from click.testing import Result
from scipy.io import loadmat
from typer.testing import CliRunner

from workbench.commands.app import app
from workbench.control.structure.blocks import gain, pid
from workbench.design.problem import Problem
from workbench.design.record import given
from workbench.errors import InfeasibleError, InputError
from workbench.goals.margin import Margins
from workbench.handover.code.formats import check_of, render
from workbench.handover.code.program import program
from workbench.handover.table.table import read_table, table_of
from workbench.lti.hold import held
from workbench.lti.make import tf
from workbench.lti.model import DelayLine, Model
from workbench.lti.plant import Plant


def arm(dead_time=0.004):
    return tf([400], [1, 2.8, 401.6, 800, 0], input="torque", output="angle", dead_time=dead_time, name="arm")


def problem(models, structure, phase_deg=45):
    asked = [Margins(points=structure.outputs, gain_db=6, phase_deg=phase_deg, hard=True)]
    return Problem(models=models, structure=structure, goals=asked, name="arm", title="An arm on a shaft")


def law():
    return pid("r - angle", "torque", Kp=0.5, Kd=0.1, parts="PD", Tf=0.02)


@pytest.fixture(scope="module")
def table():
    return table_of(given(problem(arm(), law()), {}))


@pytest.fixture(scope="module")
def path(table, tmp_path_factory):
    place = tmp_path_factory.mktemp("tables") / "gains.json"
    table.write(place)
    return place


def run(*arguments) -> Result:
    return CliRunner().invoke(app, list(map(str, arguments)))


def test_the_header_names_signals_parameters_digest_and_the_check(table):
    text = render(table, "c", sample_time=0.002).decode("ascii")
    for fact in (table.digest, "#define WB_INPUT_ANGLE 1", "#define WB_OUTPUT_TORQUE 0", " *   Kp = 0.5", "arm"):
        assert fact in text
    assert "WB_SAMPLE_TIME WB_R(0.002)" in text
    assert "stability >= 0, promised" in text
    assert "models: arm\n" in text


def test_a_sample_time_is_chosen_where_none_is_known_and_the_header_says_so(table):
    check = check_of(table)
    assert check.chosen
    assert not check.broken
    T = check.worst()["sample_time"]
    assert f"{T:.0e}"[0] in "125"  # of 1, 2, 5 · 10^k s
    assert "sample time, chosen for want of one" in render(table, "c", check=check).decode("ascii")
    assert not check_of(table, sample_time=T).chosen


def test_a_promise_of_whatever_name_stays_in_its_comment(table):
    check = check_of(table, sample_time=0.002)
    evil = replace(check.promises[0], name='gain r → y */ #error "out" \\')
    text = render(table, "c", check=replace(check, promises=(evil,))).decode("ascii")
    assert "gain r to y _/ _error _out_ _ >= 0" in text


def test_csv_has_the_decimals_of_the_table_under_names_and_units(table):
    names, units, values = csv.reader(StringIO(render(table, "csv").decode("utf-8")))
    assert dict(zip(names, map(float, values), strict=True)) == table.values()
    assert dict(zip(names, units, strict=True))["Tf"] == "s"


def test_a_matlab_file_holds_parameters_models_and_the_controller_on_both_time_axes(table):
    found = loadmat(BytesIO(render(table, "mat", sample_time=0.002)), simplify_cells=True)
    assert found["parameters"] == table.values()
    own = program(table.to_structure(), table.to_models(), 0.002)
    for name in "ABCD":
        np.testing.assert_array_equal(np.reshape(found["discrete"][name], getattr(own, name).shape), getattr(own, name))
    assert found["discrete"]["Ts"] == 0.002
    assert found["model_1"]["dead_times"] == 0.004
    # Kp + Kd s/(Tf s + 1) at infinity, and at rest
    assert np.ravel(found["continuous"]["D"])[0] == pytest.approx(0.5 + 0.1 / 0.02, rel=1e-12)
    rest = np.ravel(found["continuous"]["D"])[0] - (
        np.ravel(found["continuous"]["C"])[0] * np.ravel(found["continuous"]["B"])[0] / found["continuous"]["A"]
    )
    assert rest == pytest.approx(0.5, rel=1e-12)
    assert found["provenance"]["digest"] == table.digest


def test_json_is_the_tables_own_file(table, tmp_path):
    (tmp_path / "t.json").write_bytes(render(table, "json"))
    assert read_table(tmp_path / "t.json").to_dict() == table.to_dict()


def test_a_sampled_loop_that_breaks_a_promise_is_exported_only_if_that_is_accepted():
    # 1/s under a gain of one bears 90 degrees and a dead time of π/2; 45 degrees are promised
    model, T = tf([1.0], [1.0, 0.0], input="torque", output="angle", name="arm"), 0.1
    table = table_of(given(problem(model, gain("r - angle", "torque", 1.0)), {}))
    reserve = check_of(table, sample_time=T).worst()["delay_reserve"]
    assert reserve == pytest.approx(math.pi / 2 - T / 2, abs=1e-3)  # a hold is half a sample late, to second order
    late = {"sample_time": T, "computing_delay": 0.9 * reserve}
    with pytest.raises(InfeasibleError, match=r"must keep what the table promises; at 100 ms with .*disk margin"):
        render(table, "c", **late)
    assert "NOT KEPT" in render(table, "c", accept=True, **late).decode("ascii")
    with pytest.raises(InfeasibleError, match="sampled loop of arm must be stable; it is unstable"):
        render(table, "c", sample_time=T, computing_delay=1.1 * reserve, accept=True)


def test_the_sampled_loop_of_a_sampled_model_is_the_loop_of_the_table():
    T = 0.01
    own = problem(held(arm(0.0), T), gain("r - angle", "torque", 0.3), phase_deg=20)
    table = table_of(given(own, {}))
    check = check_of(table)
    disk = next(p for p in check.promises if p.name.startswith("disk margin"))
    verdict = given(own, {}).verdicts[0]
    factor = 10 ** (verdict.value / 20)  # in dB, the stricter of the two
    assert 2 * (factor - 1) / (factor + 1) == pytest.approx(disk.value, rel=2e-3)  # the bracket's width
    with pytest.raises(InputError, match=r"sampled every 0\.01 s keeps that sample time; got 0\.02 s"):
        render(table, "c", sample_time=0.02)
    with pytest.raises(InputError, match=r"must be whole samples of 0\.01 s"):
        render(table, "c", computing_delay=0.001)
    assert check_of(table, computing_delay=T).worst()["delay_reserve"] < check.worst()["delay_reserve"]


def test_a_loop_that_no_samples_hold_is_exported_unchecked_if_that_is_accepted():
    plant = Plant(
        A=np.diag([-1.0, -2.0]), B=[[1.0, 0.0], [0.0, 1.0]], C=[[0.0, 1.0], [1.0, 0.0]], D=np.zeros((2, 2)),
        states=("x1", "x2"), inputs=("u", "w"), outputs=("y", "z"),
    )  # fmt: skip
    model = Model("inside", plant, lines=(DelayLine("z", "w", 0.1),))
    table = table_of(given(problem(model, gain("r - y", "u", 0.5)), {}))
    with pytest.raises(InputError, match="stands between states"):
        render(table, "c", sample_time=0.01)
    assert "the sampled loop was not checked" in render(table, "c", sample_time=0.01, accept=True).decode("ascii")


def test_the_command_writes_header_and_check(path, tmp_path):
    result = run("export", path, "--format", "c", "--sample-time-ms", 2, "--out", tmp_path / "law.h", "--prefix", "arm")
    assert result.exit_code == 0, result.output
    assert "static inline void arm_step" in (tmp_path / "law.h").read_text()
    document = json.loads(run("export", path, "--format", "c", "--sample-time-ms", 2, "--json").stdout)
    assert document["check"]["sample_time"] == 0.002
    kept = [p["kept"] for p in document["check"]["promises"]]
    assert len(kept) >= 2
    assert all(kept)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--format", "csv", "--prefix", "arm"), "--prefix is for the format c"),
        (("--format", "c", "--prefix", "a-b"), "a prefix must be a letter"),
        (("--format", "c", "--sample-time-ms", "nan"), "sample time of the controller must be positive"),
        (("--format", "c", "--sample-time-ms", "-1"), "sample time of the controller must be positive"),
        (("--format", "c", "--sample-time-ms", "1", "--computing-delay-ms", "-1"), "computing delay must lie between"),
        (("--format", "csv", "--computing-delay-ms", "1"), "--computing-delay-ms is for the formats mat and c"),
    ],
)
def test_what_cannot_be_is_one_sentence(path, arguments, said):
    result = run("export", path, *arguments)
    assert isinstance(result.exception, InputError)
    assert said in str(result.exception)

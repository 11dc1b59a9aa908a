"""The same gains as CSV, MATLAB file and C header; the header is compiled and run."""

import csv
import shutil
import subprocess
from io import BytesIO, StringIO

import numpy as np
import pytest
from scipy.io import loadmat
from scipy.linalg import expm
from scipy.signal import cont2discrete, dlsim

from workbench.analysis.sampled import sampled_loop
from workbench.control import GAIN_UNITS
from workbench.errors import InfeasibleError, InputError
from workbench.files.problem import shipped_problems
from workbench.handover.code.digital import digital_check, with_sample_time
from workbench.handover.code.formats import FORMATS, render, suffix
from workbench.handover.table.table import read_table

COMPILER = shutil.which("cc") or shutil.which("gcc")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler on PATH")
FLAGS = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Werror"]
PROGRAM = """
#include "wb_law.h"
#include <stdio.h>
/* doubles in, doubles out: the number of samples, then the samples; again until the input ends */
int main(void)
{
    double count, in[WB_SENSORS];
    while (fread(&count, sizeof count, 1, stdin) == 1) {
        wb_state state;
        wb_init(&state);
        for (; count > 0.5; count -= 1.0) {
            wb_real sensors[WB_SENSORS], commands[WB_COMMANDS];
            double out[WB_COMMANDS];
            int i;
            if (fread(in, sizeof(double), WB_SENSORS, stdin) != WB_SENSORS) return 1;
            for (i = 0; i < WB_SENSORS; i++) sensors[i] = (wb_real)in[i];
            wb_step(&state, sensors, commands);
            for (i = 0; i < WB_COMMANDS; i++) out[i] = (double)commands[i];
            if (fwrite(out, sizeof(double), WB_COMMANDS, stdout) != WB_COMMANDS) return 2;
        }
    }
    return 0;
}
"""
STEPS = 1500  # 1.5 s, nearly twice the slowest time constant (0.84 s)
T = 1e-3


def compiled(table, folder, define=()):
    """A function from samples (runs, k, sensors) to commands (runs, k, sets), each run from rest."""
    (folder / "wb_law.h").write_bytes(render(table, "c"))
    (folder / "main.c").write_text(PROGRAM)
    subprocess.run([COMPILER, *FLAGS, *define, "main.c", "-o", "law"], cwd=folder, check=True, capture_output=True)

    def run(samples):
        runs, count, _ = samples.shape
        feed = b"".join(np.float64(count).tobytes() + np.ascontiguousarray(one).tobytes() for one in samples)
        done = subprocess.run([folder / "law"], input=feed, check=True, capture_output=True)
        return np.frombuffer(done.stdout).reshape(runs, count, -1)

    return run


@pytest.fixture(scope="module", params=["double", "float"])
def controller(request, table, tmp_path_factory):
    # double: ten additions of rounding 1e-16 on commands of size ten; float: 6e-8 times the same, and the rounding of
    # the slowest filter's state over its memory of 2τ/T = 1700 samples
    define, tolerance = {"double": ((), 1e-12), "float": (("-DWB_FLOAT",), 1e-4)}[request.param]
    return compiled(table, tmp_path_factory.mktemp(request.param), define), tolerance


def unit_steps():
    """(16, STEPS, 16): one run per sensor, which stands at 1 from the first sample on."""
    return np.repeat(np.eye(16)[:, None, :], STEPS, axis=1)


@needs_compiler
def test_the_compiled_step_responses_are_those_of_scipys_tustin_filters(controller, table):
    run, tolerance = controller
    A, B, C, D, _ = cont2discrete(table.to_law().numeric(table.to_gains()), T, method="bilinear")
    steps = unit_steps()
    exact = np.array([dlsim((A, B, C, D, T), one)[1] for one in steps])
    assert np.abs(exact).max() > 1  # there is something to compare
    np.testing.assert_allclose(run(steps), exact, atol=tolerance, rtol=0)  # guide, Definitions: Discretisation: 1e-12


@needs_compiler
def test_the_compiled_law_follows_noise_as_the_sampled_law_does(controller, table):
    run, tolerance = controller
    noise = np.random.default_rng(7).normal(size=(2, STEPS, 16))
    exact = np.array([table.to_discrete().commands(one) for one in noise])
    np.testing.assert_allclose(run(noise), exact, atol=tolerance * np.abs(exact).max(), rtol=0)


@needs_compiler
def test_the_compiled_step_responses_stay_within_the_stated_bound_of_the_continuous_law(controller, table):
    run, tolerance = controller
    A, B, C, D = table.to_law().numeric(table.to_gains())
    turn, exact = expm(A * T), np.empty((16, STEPS, 4))
    for sensor in range(16):
        settled = -np.linalg.solve(A, B[:, sensor])
        state = np.zeros(len(A))
        for k in range(STEPS):
            exact[sensor, k] = C @ state + D[:, sensor]
            state = settled + turn @ (state - settled)
    bound = table.to_discrete().command_step_bound().T  # (16, 4); derived in `control.discrete.discretise`
    worst = np.abs(run(unit_steps()) - exact).max(axis=1)
    assert np.all(worst <= bound + tolerance * np.abs(exact).max())
    assert bound.max() < 0.01 * np.abs(exact).max()  # and the bound says something


@needs_compiler
def test_a_vehicle_with_six_coil_sets_gets_a_header_of_its_size(table, tmp_path):
    places = [[x, y] for x in ("9.0", "0.5", "-7.65") for y in ("0.965", "-0.965")]
    six = table.model_copy(update={"law": table.law.model_copy(update={"positions_m": places}), "plant": None})
    noise = np.random.default_rng(8).normal(size=(1, 300, 24))
    (own,) = compiled(six, tmp_path)(noise)
    assert own.shape == (300, 6)
    np.testing.assert_allclose(own, six.to_discrete().commands(noise[0]), atol=1e-12 * np.abs(own).max(), rtol=0)


@needs_compiler
def test_a_law_with_motors_has_their_commands_after_the_coils(table, tmp_path):
    from workbench.control import ModalLaw

    plain = table.to_law()
    law = ModalLaw.with_motor(plain.positions, plain.depth)
    actuators = [{"name": a.name, "signal": a.signal, "lever": repr(a.lever)} for a in law.actuators]
    block = type(table.law).model_validate({**table.law.model_dump(), "actuators": actuators})
    motor = table.model_copy(update={"law": block})
    assert motor.to_law() == law
    noise = np.random.default_rng(9).normal(size=(1, 300, 16))
    (own,) = compiled(motor, tmp_path)(noise)
    assert own.shape == (300, 8)
    np.testing.assert_allclose(own, motor.to_discrete().commands(noise[0]), atol=1e-12 * np.abs(own).max(), rtol=0)
    text = render(motor, "c").decode("ascii")
    assert "command_motor_d_right, command_motor_d_left: for sway" in text


@needs_compiler
def test_a_title_cannot_leave_its_comment(table, tmp_path):
    evil = 'x */ #error "out" /* ??/ \\ \n#error line'
    text = render(table.model_copy(update={"title": evil, "problem": evil}), "c")
    (tmp_path / "wb_law.h").write_bytes(text)
    (tmp_path / "main.c").write_text(PROGRAM)
    subprocess.run([COMPILER, *FLAGS, "-c", "main.c"], cwd=tmp_path, check=True, capture_output=True)


def test_the_header_names_what_it_came_from(table):
    text = render(table, "c").decode("ascii")
    for fact in (table.digest, table.data_sha256, table.created, "K_h       = -1.03219", "WB_R(0.001) /* s */"):
        assert fact in text
    assert "malloc" not in text


def test_csv_has_the_seventeen_digits_as_printed_under_their_names_and_units(table):
    names, units, values = csv.reader(StringIO(render(table, "csv").decode("utf-8")))
    assert dict(zip(names, values, strict=True)) == table.gains
    assert dict(zip(names, units, strict=True)) == GAIN_UNITS


def test_pandas_reads_the_two_header_rows_as_names_and_units(table):
    import pandas as pd

    frame = pd.read_csv(BytesIO(render(table, "csv")), header=[0, 1])
    assert list(frame.columns) == list(GAIN_UNITS.items())
    assert frame.iloc[0].tolist() == list(table.to_gains().as_dict().values())


@pytest.mark.parametrize("format", ["c", "mat"])
def test_a_law_whose_sampled_loop_is_unstable_is_not_exported_to_a_controller(table, format):
    slow = with_sample_time(table, 0.05)
    with pytest.raises(InfeasibleError, match="unstable at a sample time of 50 ms with 0 ms of computing"):
        render(slow, format)
    with pytest.raises(InfeasibleError, match="with 40 ms of computing"):
        render(table, format, computing_delay=0.04)


def test_groups_checked_apart_have_the_poles_and_the_peak_of_the_whole_vehicle(table):
    law, plant, sampled = table.to_law(), table.to_plant(), table.to_discrete()
    whole = sampled_loop(plant, sampled, law.commands, law.sensors)
    check = digital_check(table)
    assert list(check.groups) == ["heave_pitch", "sway_roll_yaw"]
    # a group carries the filters of the other group's motions too, at rest; rounding of the two splittings otherwise
    assert check.worst()["damping"] == pytest.approx(whole.damping, rel=1e-9)
    assert check.worst()["peak_sensitivity"] == pytest.approx(whole.peak_sensitivity.upper, rel=1e-7)
    assert check.worst()["delay_reserve"] == pytest.approx(whole.delay_reserve, rel=1e-6)


def test_a_table_for_heave_alone_is_checked_with_the_rest_of_the_vehicle_held():
    heave = read_table(shipped_problems()["heave"] / "approved.json")
    check = digital_check(heave)
    assert list(check.groups) == ["heave"]
    # heave with pitch held promises its peak under the name of its group; the promise is compared as any other
    peak = check.groups["heave"][0].peak_sensitivity.upper
    assert {p.name: p.value for p in check.promises}["peak sensitivity, heave_pitch"] == peak
    assert "motions: heave\n" in render(heave, "c", accept=True).decode("ascii")


def test_a_peak_promised_of_a_group_that_the_table_does_not_control_is_refused(table):
    name = "peak sensitivity, sway_roll_yaw"
    renamed = [p.model_copy(update={"name": "peak sensitivity, sway"}) if p.name == name else p for p in table.promises]
    with pytest.raises(InputError, match="'peak sensitivity, sway' must be promised of a group"):
        digital_check(table.model_copy(update={"promises": renamed}))


def test_header_and_matlab_file_state_the_figures_of_the_sampled_loop(table):
    check = digital_check(table, 2e-4)
    text = render(table, "c", computing_delay=2e-4, accept=True).decode("ascii")
    assert "computing delay: 0.2 ms" in text
    assert f"peak sensitivity: {check.worst()['peak_sensitivity']:.4g}" in text
    assert f"quantisation margin: {check.worst()['quantisation_margin']:.4g} times" in text
    assert "motions: heave/pitch, sway/roll/yaw" in text
    found = loadmat(BytesIO(render(table, "mat", computing_delay=2e-4, accept=True)), simplify_cells=True)["check"]
    assert found["delay_reserve"] == check.worst()["delay_reserve"]
    bare = table.model_copy(update={"plant": None})
    assert "was not checked" in render(bare, "c").decode("ascii")


def test_a_matlab_file_holds_gains_filters_and_the_sampled_law(table):
    found = loadmat(BytesIO(render(table, "mat")), simplify_cells=True)
    assert found["gains"] == table.to_gains().as_dict()
    law = table.to_discrete()
    numerator, denominator = law.transfer_functions()
    np.testing.assert_array_equal(found["filters"]["numerator"], numerator)
    np.testing.assert_array_equal(found["filters"]["denominator"], denominator)
    for name, matrix in zip("ABCD", law.state_space(), strict=True):
        np.testing.assert_array_equal(found["discrete"][name], matrix)
    assert found["discrete"]["Ts"] == law.sample_time
    for name, matrix in zip("ABCD", table.to_law().numeric(table.to_gains()), strict=True):
        np.testing.assert_array_equal(found["continuous"][name], matrix)
    assert list(found["law"]["sensors"]) == list(table.to_law().sensors)
    assert found["provenance"]["digest"] == table.digest
    np.testing.assert_array_equal(found["plant"]["A"], table.to_plant().A)


def test_json_is_the_tables_own_file(table, tmp_path):
    (tmp_path / "t.json").write_bytes(render(table, "json"))
    assert read_table(tmp_path / "t.json") == table


def test_each_format_has_an_ending_and_an_unknown_one_is_refused(table):
    assert [suffix(f) for f in FORMATS] == [".csv", ".json", ".mat", ".h"]
    with pytest.raises(InputError, match="unknown format 'cvs'; did you mean 'csv'"):
        render(table, "cvs")


def test_a_law_too_fast_for_its_sample_time_is_refused_for_the_digital_formats_only(table):
    slow = table.model_copy(update={"law": table.law.model_copy(update={"sample_time_s": "0.2"})})
    for format in ("c", "mat"):
        with pytest.raises(InputError, match=r"at most the filter's time constant tau_hp = 0\.105972 s"):
            render(slow, format)
    assert render(slow, "csv") == render(table, "csv")


SPEEDS = (30.0, 47.3, 91.0, 134.0)
SCHEDULE_PROGRAM = """
#include "wb_law.h"
#include <stdio.h>
/* per run: a speed and the number of samples, then the samples */
int main(void)
{
    double head[2], in[WB_SENSORS];
    while (fread(head, sizeof(double), 2, stdin) == 2) {
        wb_state state;
        wb_init(&state);
        wb_set_speed(&state, (wb_real)head[0]);
        for (; head[1] > 0.5; head[1] -= 1.0) {
            wb_real sensors[WB_SENSORS], commands[WB_COMMANDS];
            double out[WB_COMMANDS];
            int i;
            if (fread(in, sizeof(double), WB_SENSORS, stdin) != WB_SENSORS) return 1;
            for (i = 0; i < WB_SENSORS; i++) sensors[i] = (wb_real)in[i];
            wb_step(&state, sensors, commands);
            for (i = 0; i < WB_COMMANDS; i++) out[i] = (double)commands[i];
            if (fwrite(out, sizeof(double), WB_COMMANDS, stdout) != WB_COMMANDS) return 2;
        }
    }
    return 0;
}
"""


@pytest.fixture(scope="module")
def scheduled():
    return read_table(shipped_problems()["scheduled_vehicle"] / "approved.json")


@needs_compiler
@pytest.mark.parametrize(("define", "tolerance"), [((), 1e-12), (("-DWB_FLOAT",), 1e-3)])
def test_the_compiled_schedule_is_the_sampled_law_of_each_speed(scheduled, tmp_path, define, tolerance):
    # double: rounding of a Horner evaluation; float: the same on coefficients that nearly cancel (direct + memory)
    from workbench.control.discrete import discretise

    (tmp_path / "wb_law.h").write_bytes(render(scheduled, "c", accept=True))
    (tmp_path / "main.c").write_text(SCHEDULE_PROGRAM)
    subprocess.run([COMPILER, *FLAGS, *define, "main.c", "-o", "law"], cwd=tmp_path, check=True, capture_output=True)
    noise = np.random.default_rng(11).normal(size=(300, 16))
    outside = {10.0: 30.0, 200.0: 134.0, float("nan"): 30.0}
    asked = [*SPEEDS, *outside]
    feed = b"".join(np.array([v, len(noise)]).tobytes() + noise.tobytes() for v in asked)
    done = subprocess.run([tmp_path / "law"], input=feed, check=True, capture_output=True)
    own = np.frombuffer(done.stdout).reshape(len(asked), len(noise), -1)
    schedule, law = scheduled.to_schedule(), scheduled.to_law()
    for v, commands in zip(asked, own, strict=True):
        exact = discretise(law, schedule.gains_at(outside.get(v, v)), T).commands(noise)
        np.testing.assert_allclose(commands, exact, atol=tolerance * np.abs(exact).max(), rtol=0)
    cruise = render(scheduled.model_copy(update={"schedule": None}), "c", accept=True).decode("ascii")
    assert "wb_set_speed" not in cruise


def test_the_csv_of_a_schedule_has_a_row_for_every_speed(scheduled):
    import pandas as pd

    frame = pd.read_csv(BytesIO(render(scheduled, "csv")), header=[0, 1])
    assert list(frame.columns) == [("speed", "m/s"), *GAIN_UNITS.items()]
    assert frame[("speed", "m/s")].tolist() == [float(v) for v in range(30, 135)]
    schedule = scheduled.to_schedule()
    np.testing.assert_array_equal(frame.to_numpy()[:, 1:], schedule.table(frame[("speed", "m/s")]))


def test_the_matlab_file_of_a_schedule_holds_its_polynomials_and_says_where_the_rest_holds(scheduled):
    found = loadmat(BytesIO(render(scheduled, "mat", accept=True)), simplify_cells=True)["schedule"]
    assert found["at"] == 134.0
    t = (91.0 - found["centre"]) / found["scale"]
    values = np.polynomial.polynomial.polyval(t, found["coefficients"].T)
    np.testing.assert_allclose(values, scheduled.to_schedule().table([91.0])[0], rtol=1e-14)
    assert list(found["names"]) == list(GAIN_UNITS)


def test_cells_of_a_matlab_file_hold_text(table):
    found = loadmat(BytesIO(render(table, "mat")))
    groups = found["check"][0, 0]["groups"]
    assert [str(cell[0]) for cell in groups.ravel()] == ["heave_pitch", "sway_roll_yaw"]


@pytest.fixture(scope="module")
def default():
    return read_table(shipped_problems()["comfort_limit"] / "approved.json")


def with_limit(table, name, limit):
    """The table with one promise of the nominal plant changed."""
    promises = [p.model_copy(update={"limit": limit}) if p.name == name and not p.box else p for p in table.promises]
    return table.model_copy(update={"promises": promises})


def test_every_promise_with_a_sampled_counterpart_stands_beside_its_sampled_value(table):
    check = digital_check(table, 5e-4)
    worst = check.worst()
    assert {p.name: p.value for p in check.promises} == {
        "damping ratio": worst["damping"], "decay rate": worst["decay"],
        **{f"peak sensitivity, {g}": loop.peak_sensitivity.upper for g, (loop, _) in check.groups.items()},
    }  # fmt: skip


@pytest.mark.parametrize(
    ("name", "figure", "side"),
    [("damping ratio", "damping", 1), ("decay rate", "decay", 1), ("peak sensitivity", "", -1)],
)
@pytest.mark.parametrize("format", ["c", pytest.param("mat", marks=pytest.mark.slow)])
def test_a_promise_broken_by_a_hair_in_the_sampled_loop_is_refused_by_name_and_one_kept_is_not(
    table, name, figure, side, format
):
    check = digital_check(table)
    loop, _ = check.groups["sway_roll_yaw"]
    value = check.worst()[figure] if figure else loop.peak_sensitivity.upper
    name = name if figure else f"{name}, sway_roll_yaw"
    bearable = table.model_copy(update={"promises": [p for p in table.promises if p.name == name]})
    with pytest.raises(InfeasibleError, match=f"does not: {name} [<>]= "):
        render(with_limit(bearable, name, value * (1 + side * 1e-6)), format)
    assert render(with_limit(bearable, name, value * (1 + side * 1e-6)), format, accept=True)
    assert render(with_limit(bearable, name, value * (1 - side * 1e-6)), format)


def test_the_sampled_decay_is_that_of_the_groups_own_filters():
    # heave_pitch measures no roll: a roll filter at rest, 1/tau_h = 0.25 1/s, is no pole of its loop
    table = read_table(shipped_problems()["comfort_limit"] / "approved.json")
    fast = digital_check(with_sample_time(table, 2e-5)).worst()
    continuous = {r.name: r.value for r in table.requirements}
    assert fast["decay"] == pytest.approx(continuous["decay rate"], rel=1e-3)
    assert fast["damping"] == pytest.approx(continuous["damping ratio"], rel=2e-3)

"""Commands as a shell sees them: exit codes, strict JSON, nearest names, nothing half-written."""

import json
import os
import subprocess
import sys

import pytest

from workbench.control import GAIN_NAMES
from workbench.files.problem import shipped_problems

COMMANDS = (
    "problems", "new", "design", "analyse", "compare", "model", "forces", "motor", "propulsion", "noise", "reproduce",
    "verify", "export", "simulate", "study",
)  # fmt: skip
QUICK = ("--starts", "1", "--seed", "1", "--no-trade-off")  # one start of heave takes about a second


def strict(text: str):
    """The one JSON document in a text; NaN and infinity are refused."""

    def refuse(name):
        raise AssertionError(f"{name} is not JSON")

    return json.loads(text, parse_constant=refuse)


def places(document, path=""):
    """Every (path, value) of a document's leaves."""
    if isinstance(document, dict):
        for key, value in document.items():
            yield from places(value, f"{path}.{key}")
    elif isinstance(document, list):
        for k, value in enumerate(document):
            yield from places(value, f"{path}[{k}]")
    else:
        yield path, document


def test_help_names_every_command(command):
    done = command("--help")
    assert done.code == 0
    assert all(name in done.out for name in COMMANDS)


def test_every_command_has_help_with_its_options(command):
    for name in COMMANDS:
        done = command(name, "--help")
        assert done.code == 0
        assert "--json" in done.out


def test_problems_lists_what_ships_one_line_each(command):
    done = command("problems")
    assert done.code == 0
    for name in shipped_problems():
        assert sum(line.split()[:1] == [name] for line in done.out.splitlines()) == 1
    assert [entry["name"] for entry in strict(command("problems", "--json").out)] == [*shipped_problems()]


@pytest.mark.parametrize(("typed", "offered"), [("rev", ["revenue_vehicle"]), ("wood", ["wood_berry"]), ("zz", [])])
def test_the_shell_completes_problem_names(typed, offered):
    env = {**os.environ, "_WORKBENCH_COMPLETE": "complete_bash", "COMP_WORDS": f"workbench design {typed}"}
    done = subprocess.run(
        [os.path.join(os.path.dirname(sys.executable), "workbench")],
        env={**env, "COMP_CWORD": "2"}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.stdout.split() == offered


def test_an_analysis_writes_its_report_for_good_and_for_unstable_gains(command, report_gains, tmp_path):
    done = command("analyse", "heave", "--report", tmp_path / "good.html", "--json")
    assert strict(done.out)["report"] == str(tmp_path / "good.html")
    assert "all 6 requirements met" in (tmp_path / "good.html").read_text()
    done = command("analyse", "comfort_limit", "--gains", report_gains, "--report", tmp_path / "bad.html")
    assert done.code == 0
    assert "requirements missed" in (tmp_path / "bad.html").read_text()
    done = command("analyse", "heave", "--report", tmp_path)
    assert done.code == 2
    assert len(done.err.strip().splitlines()) == 1


def test_analysis_as_json_has_the_keys_that_others_read(command, report_gains):
    done = command("analyse", "report_1975", "--json")
    assert done.code == 0
    assert done.err == ""
    a = strict(done.out)
    assert tuple(a["gains"]) == GAIN_NAMES
    assert a["problem"] == "report_1975"
    assert a["stable"] is True
    assert all(len(pole) == 2 for pole in [*a["poles"], *a["loop_poles"]])
    assert all(set(mode) >= {"name", "frequency_hz", "damping"} for mode in a["modes"])
    assert set(a["peak_sensitivity"]) == {"heave_pitch", "sway_roll_yaw"}
    felt = {f"{kind}_{d}": {"cg", "front", "rear"} for kind in ("acceleration", "weighted") for d in "zy"}
    for rms in (a["rms"], *a["by_type"].values()):
        assert all(set(rms[k]) >= v for k, v in felt.items())
        assert all(set(rms[k]) == {"front", "rear"} for k in ("gap", "gap_lateral", "current"))
    assert set(a["by_type"]) == {"A1", "A2", "A3", "A4"}
    assert set(a["static_error"]) == {"gap", "gap_lateral"}
    assert set(a["control_power_w"]) >= {"to_body", "electrical", "resistive"}
    assert a["sum_alpha_squared"] > 0
    assert a["cost"] > 0
    given = strict(command("analyse", "report_1975", "--gains", str(report_gains), "--json").out)
    assert given == a  # the same gains from a file


def test_unstable_gains_are_analysed_with_null_for_what_does_not_exist(command, tmp_path, report_gains):
    gains = tmp_path / "unstable.toml"
    gains.write_text(report_gains.read_text().replace("K_zdot = 0.15", "K_zdot = -2.0"))
    done = command("analyse", "report_1975", "--gains", gains, "--json")
    assert done.code == 0
    a = strict(done.out)
    assert a["stable"] is False
    assert a["cost"] is None
    assert a["sum_alpha_squared"] is None
    assert set(a["peak_sensitivity"].values()) == {None}
    assert all(value is None for _, value in places([a["rms"], a["by_type"], a["control_power_w"], a["static_error"]]))
    assert max(re for re, _ in a["poles"]) > 0
    assert command("analyse", "report_1975", "--gains", gains).code == 0


@pytest.mark.parametrize(
    "arguments",
    [
        ("problems",),
        ("model", "heave"),
        ("model", "report_1975"),
        ("forces",),
        ("motor",),
        ("propulsion",),
        ("noise",),
        ("analyse", "report_1975"),
    ],
    ids=" ".join,
)
def test_json_is_one_strict_document_and_nothing_else(command, arguments):
    done = command(*arguments, "--json")
    assert done.code == 0
    assert done.err == ""
    strict(done.out)


def test_a_design_writes_table_and_report_and_says_where(command, tmp_path):
    done = command("design", "heave", *QUICK, "--out", tmp_path / "deep" / "down", "--json")
    assert done.code == 0, done
    document = strict(done.out)
    assert all(r["met"] for r in document["requirements"])
    assert {"name", "sense", "limit", "value", "unit", "met", "where"} <= set(document["requirements"][0])
    folder = tmp_path / "deep" / "down"
    assert sorted(os.listdir(folder)) == ["gains.json", "report.html"]
    assert document["table"] == str(folder / "gains.json")
    again = strict(command("analyse", "heave", "--gains", folder / "gains.json", "--json").out)
    assert again["cost"] == pytest.approx(document["cost"], rel=1e-12)  # a table read back gives the same analysis


def test_a_design_that_cannot_be_leaves_with_1_names_what_binds_and_writes_nothing(command, changed_problem, tmp_path):
    limit = "damping_ratio_at_least = 0.5"
    folder = changed_problem(limit, f"{limit}\nsum_alpha_squared_at_most = 1.5e-4")
    done = command("design", folder, *QUICK, "--out", tmp_path / "out")
    assert done.code == 1
    assert done.out == ""
    assert "'sum of mean square currents' must be <= 0.00015" in done.err  # the requirement by name, with its limit
    assert "best found" in done.err
    assert "(all coil sets)" in done.err
    assert "a miss of" in done.err
    assert done.err.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("desgin", "heave"), "Did you mean 'design'"),
        (("design",), "Missing argument 'PROBLEM'"),
        (("analyse", "revenue_vehicel"), "unknown problem 'revenue_vehicel'; did you mean 'revenue_vehicle'?"),
        (("analyse", "no/such/folder"), "a problem's folder must hold data.toml; no/such/folder does not"),
        (("analyse", "x" * 5000), "unknown problem"),
        (("analyse", "heave", "--gain", "x"), "No such option"),
        (("design", "heave", "--starts", "0"), "the number of starts must be at least 1; got 0"),
        (("design", "heave", "--starts", "-3"), "the number of starts must be at least 1; got -3"),
        (("design", "wood_berry", "--fix", "K_h=1"), "unknown parameter 'K_h'"),
        (("design", "wood_berry", "--speed", "90"), "a speed is asked of a vehicle"),
        (("design", "wood_berry", "--boxes"), "controls a plant of its own, with no box of vehicles"),
        (("design", "wood_berry", "--solver", "ipopt"), "steer by pieces with corners, which ipopt does not follow"),
        (
            ("design", "heave", "--robust", "--trade-off"),
            "--trade-off sweeps a limit of 'peak sensitivity' for one set",
        ),
        (("design", "scheduled_vehicle", "--trade-off"), "'scheduled_vehicle' is asked for something else"),
        (("design", "heave", "--robust", "--starts", "0"), "the number of starts must be at least 1; got 0"),
        (("design", "heave", "--starts", "100000000"), "the number of starts must be at most 10000; got 100000000"),
        (("design", "heave", "--starts", "many"), "Invalid value for '--starts'"),
        (("design", "heave", "--seed", "-1"), "Invalid value for '--seed'"),
        (("design", "heave", "--solver", "slsq"), "unknown method 'slsq'; did you mean 'slsqp'?"),
        (("design", "heave", "--fix", "tau_h"), "--fix takes name=number pairs"),
        (("design", "heave", "--fix", "tau_h=fast"), "--fix takes name=number pairs"),
        (("design", "heave", "--fix", "=1"), "unknown gain ''"),
        (("design", "heave", "--fix", "K_hh=1"), "unknown gain 'K_hh'; did you mean 'K_h'?"),
        (("design", "heave", "--fix", "K_h=1,K_h=2"), "--fix must name a parameter once; got K_h twice"),
        (("design", "heave", "--fix", "K_h=nan"), "K_h must be a finite number [1/m]; got 'nan'"),
        (("design", "heave", "--fix", "K_h=1e9"), "K_h must lie within ±1e+06 1/m"),
        (("design", "heave", "--fix", "tau_z=-0.5"), "tau_z must not be negative; got -0.5 s"),
        (("design", "heave", "--fix", "tau_h=0"), "tau_h must be positive in a design"),
        (("model", "heave", "--latex", "--json"), "--latex and --json must not be given together"),
        (("reproduce", "--appendix", "zz"), "appendix"),
        (("export", "no.json", "--format", "csv"), "no.json must be a readable file; No such file"),
        (("analyse", "report_1975", "--gains", "/"), "/ must be a readable file; Is a directory"),
    ],
    ids=lambda value: " ".join(value)[:60] if isinstance(value, tuple) else "",
)
def test_bad_arguments_give_their_sentence(refused, tmp_path, arguments, sentence):
    more = ("--out", str(tmp_path)) if arguments[0] == "design" and len(arguments) > 1 else ()
    assert sentence in refused(*arguments, *more)
    assert list(tmp_path.iterdir()) == []


def test_a_problem_without_approved_gains_asks_for_some(refused, changed_problem):
    assert "has no approved gains; give some with --gains FILE" in refused("analyse", changed_problem("0.3", "0.3"))


def test_an_unwritable_folder_is_refused_before_any_work(refused, tmp_path):
    (tmp_path / "file").write_text("in the way")
    assert "must be a folder that can be written to" in refused("design", "heave", "--out", tmp_path / "file")
    assert "must be a folder that can be written to" in refused("design", "heave", "--out", tmp_path / "file" / "below")
    assert (tmp_path / "file").read_text() == "in the way"


def shell(*arguments: str, **options) -> subprocess.CompletedProcess:
    """The command in a process of its own."""
    return subprocess.run(
        [sys.executable, "-c", "from workbench.cli import main; main()", *arguments],
        capture_output=True, text=True, timeout=120, check=False, **options,
    )  # fmt: skip


def test_the_process_leaves_with_the_commands_code(tmp_path):
    assert shell("problems").returncode == 0
    wrong = shell("analyse", "hevae")
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert "did you mean 'heave'?" in wrong.stderr
    assert shell().returncode == 2  # without a command there is nothing to do but show the help


def test_a_reader_that_leaves_early_is_no_error():
    process = subprocess.Popen(
        [sys.executable, "-c", "from workbench.cli import main; main()", "motor"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    assert "Traceback" not in process.stderr.read()
    process.stderr.close()
    process.wait(timeout=60)

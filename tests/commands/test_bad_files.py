"""Data files and gains files that cannot be used: each gives one sentence that says what must hold."""

import pytest

from workbench.machine.reading import LARGEST_FILE

TAU = "tau_h = [0.03, 4.0]"


@pytest.mark.parametrize(
    ("before", "after", "sentence"),
    [
        ("weight_n =", "weight_kg =", "key 'vehicle.weight_n' is missing; add it, with its unit in the name"),
        ("coil_depth_m =", "coil_depth =", "key 'vehicle.coil_depth_m' is missing"),
        ("gap_m = 0.3\n", "gap_m = 0.3\nlength_m = 30.0\n", "key 'vehicle.length_m' is not known; check its name"),
        ("[sensors]", "[sensor]", "key 'sensors' is missing"),
        ("weight_n = 444800.0", "weight_n = nan", "vehicle.weight_n is not usable"),
        ("weight_n = 444800.0", "weight_n = inf", "vehicle.weight_n is not usable"),
        ("weight_n = 444800.0", "weight_n = -444800.0", "weight_n is not usable: Input should be greater than 0"),
        ("weight_n = 444800.0", 'weight_n = "heavy"', "vehicle.weight_n is not usable"),
        ("weight_n = 444800.0", "weight_n = [444800.0]", "vehicle.weight_n is not usable"),
        ("pitch_kg_m2 = 3.41e6", "pitch_kg_m2 = 3.60e6", "no moment of inertia may exceed the sum of the other two"),
        ("current_lag_s = 0.010", "current_lag_s = -0.010", "physics.current_lag_s is not usable"),
        ("corner_frequency_hz = 0.1", "corner_frequency_hz = 0", "corner_frequency_hz is not usable"),
        ('types = ["A1"]', 'types = ["A5"]', "types.0 is not usable: unknown word 'A5'; did you mean 'A4'?"),
        ('types = ["A1"]', "types = []", "types is not usable"),
        ('groups = ["heave"]', 'groups = ["bounce"]', "problem.groups.0 is not usable"),
        ('kind = "power_law"', 'kind = "fractal"', "guideway"),
        ("damping_ratio_at_least =", "damping_at_least =", "did you mean 'damping_ratio_at_least'?"),
        ("damping_ratio_at_least = 0.5", "damping_ratio_at_least = -0.5", "damping_ratio_at_least is not usable"),
        (TAU, "tau_hh = [0.03, 4.0]", "unknown gain 'tau_hh'; did you mean 'tau_h'?"),
        (TAU, "", "every gain must be either bounded (free) or fixed; both: none, neither: tau_h"),
        (TAU, "tau_h = [4.0, 0.03]", "the bounds of tau_h must rise"),
        (TAU, "tau_h = [-0.03, 4.0]", "the bounds of tau_h must rise, from a positive value for a time constant"),
        (TAU, "tau_h = 0.03", "bounds.tau_h is not usable"),
        ("tau_y = 0.2", "tau_y = 0.2\nK_h = 1.0", "every gain must be either bounded (free) or fixed; both: K_h"),
        ("K_hp = 0.0", "K_hp = nan", "fixed.K_hp is not usable"),
        ("sample_time_s = 0.001", "sample_time_s = 0.0", "discretisation.sample_time_s is not usable"),
        (
            "[bounds]", '[operating_point]\nside_force_n = 5e6\nsource = "a gale"\n\n[bounds]',
            "the vehicle must rest clear of the guideway",
        ),
        ("[problem]", "[problem", "must be valid TOML"),
        ("[vehicle]", "[vehicle]\nweight_n = 1.0", "must be valid TOML; Cannot overwrite a value"),
        ("[vehicle]", "[vehicle]\na = " + "[" * 5000, "must not be nested deeply; give a flat TOML mapping"),
        ("[vehicle]", "[vehicle]\na = " + "9" * 5000, "must be valid TOML; a number has thousands of digits"),
    ],
    ids=lambda value: value[:40].replace("\n", " "),
)  # fmt: skip
def test_an_unusable_data_file_is_refused_by_its_key(refused, changed_problem, before, after, sentence):
    line = refused("model", changed_problem(before, after))
    assert sentence in line


def test_the_value_at_fault_is_quoted_but_never_at_length(refused, changed_problem):
    assert "got -0.01" in refused("model", changed_problem("current_lag_s = 0.010", "current_lag_s = -0.010"))


def test_a_long_value_is_cut(refused, changed_problem):
    line = refused("model", changed_problem("weight_n = 444800.0", f'weight_n = "{"x" * 10_000}"'))
    assert len(line) < 400


def test_a_problem_whose_code_cannot_run_is_refused(refused, changed_problem, tmp_path):
    folder = changed_problem("0.3", "0.3")
    for text, sentence in (
        ("def problem(data)\n", "must be valid Python; line 1"),
        ("x = 1\n", "must define problem(data)"),
        ("def problem(data):\n    return 3\n", "must return a design.Problem; got a int"),
    ):
        (tmp_path / "changed" / "problem.py").write_text(text)
        assert sentence in refused("model", folder)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda t: t.replace("K_h =", "K_hh ="), "unknown gain 'K_hh'; did you mean 'K_h'?"),
        (lambda t: t.replace("tau_y = 0.637\n", ""), "gains must name all seventeen parameters; missing tau_y."),
        (lambda t: t.replace("K_roll = 1.25", "K_roll = nan"), "K_roll must be a finite number [1]; got 'nan'"),
        (lambda t: t.replace("K_roll = 1.25", "K_roll = inf"), "K_roll must be a finite number [1]; got 'inf'"),
        (lambda t: t.replace("K_roll = 1.25", "K_roll = true"), "K_roll must be a finite number [1]; got 'True'"),
        (lambda t: t.replace("K_roll = 1.25", "K_roll = [1.25]"), "K_roll must be a finite number [1]; got '[1.25]'"),
        (lambda t: t.replace("K_roll = 1.25", 'K_roll = "big"'), "K_roll must be a number; got 'big'"),
        (lambda t: t.replace("K_roll = 1.25", "K_roll = 1e7"), "K_roll must lie within ±1e+06 1; got 1e+07"),
        (lambda t: t.replace("K_roll = 1.25", "K_roll = 1" + "0" * 400), "K_roll must be 0 or of a size from"),
        (lambda t: t.replace("tau_h = 0.637", "tau_h = -0.637"), "tau_h must not be negative; got -0.637 s"),
        (lambda t: "gains = 5\n", "'gains' in"),
        (lambda t: "", "gains must name all seventeen parameters"),
        (lambda t: "\x00", "must be valid TOML"),
    ],
)  # fmt: skip
def test_an_unusable_gains_file_is_refused_by_its_name(refused, report_gains, change, sentence):
    report_gains.write_text(change(report_gains.read_text()))
    assert sentence in refused("analyse", "report_1975", "--gains", report_gains)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"[]", "must hold a JSON mapping; got a list"),
        (b"3", "must hold a JSON mapping; got a int"),
        (b"{", "must be valid JSON"),
        (b"", "must be valid JSON"),
        (b'{"K_h": NaN}', "must be valid JSON; NaN is not a number JSON allows"),
        (b'{"K_h": 1, "K_h": 2}', "must be valid JSON; key 'K_h' is given twice"),
        (b'{"K_h": ' + b"9" * 5000 + b"}", "must be valid JSON; a number has thousands of digits"),
        (b"[" * 100_000, "must not be nested deeply; give a flat JSON mapping"),
        (b'{"gains": ' * 5000 + b"1" + b"}" * 5000, "must not be nested deeply"),
        (b'{"K_h": "\xff"}', "must be UTF-8 text; byte 9 is not"),
        (b" " * (LARGEST_FILE + 1), f"must be at most {LARGEST_FILE} bytes; it has more"),
        (b'{"gains": null}', "must be a mapping of the seventeen names; got a NoneType"),
    ],
    ids=lambda value: value[:30] if isinstance(value, str) else "",
)
def test_a_gains_file_that_is_no_mapping_is_refused(refused, tmp_path, content, sentence):
    path = tmp_path / "gains.json"
    path.write_bytes(content)
    assert sentence in refused("analyse", "report_1975", "--gains", path)


def test_a_file_without_end_is_refused(refused):
    assert f"must be at most {LARGEST_FILE} bytes" in refused("analyse", "report_1975", "--gains", "/dev/zero")


def test_a_folder_or_a_missing_file_in_place_of_gains_is_refused(refused, tmp_path):
    assert "must be a readable file; Is a directory" in refused("analyse", "report_1975", "--gains", tmp_path)
    assert "must be a readable file; No such file" in refused("analyse", "report_1975", "--gains", tmp_path / "none")


def test_a_folder_in_place_of_the_data_file_is_refused(refused, tmp_path):
    (tmp_path / "data.toml").mkdir()
    assert "a problem's folder must hold data.toml" in refused("analyse", tmp_path)


def test_a_changed_gain_table_is_refused_by_export_and_as_gains(refused, command, tmp_path):
    quick = ("--starts", "1", "--seed", "1", "--no-trade-off")
    assert command("design", "heave", *quick, "--out", tmp_path).code == 0
    table = tmp_path / "gains.json"
    text = table.read_text()
    table.write_text(text.replace('"seed": 1', '"seed": 2'))
    assert "the table was changed after it was signed" in refused("export", table, "--format", "csv")
    assert "the table was changed after it was signed" in refused("analyse", "heave", "--gains", table)
    table.write_text(text[: len(text) // 2])
    assert "must be valid JSON" in refused("export", table, "--format", "csv")
    assert "must be valid JSON" in refused("analyse", "heave", "--gains", table)

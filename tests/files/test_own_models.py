"""Each way to state a plant gives the plant that its formula gives."""

import numpy as np
import pytest
from own_cases import LOOP, folder_with, model_of
from scipy.io import savemat

from workbench.errors import InputError
from workbench.files.problem import load_problem

OMEGA = np.array([0.01, 0.4, 2.0, 30.0])
S = 1j * OMEGA
ROUNDING = 1e-12  # a handful of operations
IO = 'inputs = ["u"]\noutputs = ["y"]\n'


def response(model) -> np.ndarray:
    return model.response(OMEGA)[:, 0, 0]


@pytest.mark.parametrize(
    ("lines", "formula"),
    [
        ('kind = "matrices"\nA = [[-2]]\nB = [[4.0]]\nC = [[3.0]]', lambda s: 12 / (s + 2)),
        ('kind = "matrices"\nA = []\nB = []\nC = [[]]\nD = [[7.0]]', lambda s: 7 + 0 * s),
        ('kind = "matrices"\nA = [[-2]]\nB = [[4.0]]\nC = [[3.0]]\nD = [[1]]\ninput_dead_time_s = {u = 0.1}\n'
         "output_dead_time_min = {y = 0.01}", lambda s: (12 / (s + 2) + 1) * np.exp(-0.7 * s)),
        ('kind = "transfer_function"\nentry = [{numerator = [1, 2], denominator = [1, 3, 5], dead_time_s = 0.3}]',
         lambda s: (s + 2) / (s**2 + 3 * s + 5) * np.exp(-0.3 * s)),
        ('kind = "first_order"\nentry = [{gain = 3, time_constant_min = 2, dead_time_min = 0.5}]',
         lambda s: 3 / (120 * s + 1) * np.exp(-30 * s)),
        ('kind = "zero_pole_gain"\nentry = [{gain = 2, zeros_rad_s = [-3], poles_rad_s = [-1, [-2, 5]]}]',
         lambda s: 2 * (s + 3) / (s + 1) / ((s + 2) ** 2 + 25)),
        ('kind = "zero_pole_gain"\n'
         "entry = [{static_gain = 2, zeros_rad_s = [-4], poles_hz = [-1, -2], integrators = 1}]",
         lambda s: 2 * (1 + s / 4) / (1 + s / 2 / np.pi) / (1 + s / 4 / np.pi) / s),
        ('kind = "zero_pole_gain"\nentry = [{gain = 5, pole_pairs = [{natural_frequency_hz = 1, damping = 0.01}],'
         "zero_pairs = [{natural_frequency_rad_s = 3, damping = 0}]}]",
         lambda s: 5 * (s**2 + 9) / (s**2 + 0.04 * np.pi * s + 4 * np.pi**2)),
        ('kind = "zero_pole_gain"\nsample_time_ms = 20\nentry = [{static_gain = 2, poles_z = [0.5], zeros_z = []}]',
         lambda s: 1 / (np.exp(0.02 * s) - 0.5)),
        ('kind = "transfer_function"\nsample_time_s = 0.02\n'
         "entry = [{numerator = [1], denominator = [1, -0.9], dead_time_s = 0.06}]",
         lambda s: np.exp(-0.06 * s) / (np.exp(0.02 * s) - 0.9)),
    ],
)  # fmt: skip
def test_a_model_has_the_response_of_its_formula(tmp_path, lines, formula):
    assert response(model_of(tmp_path, IO + lines)) == pytest.approx(formula(S), rel=ROUNDING)


def test_poles_and_zeros_of_several_entries_add_up(tmp_path):
    model = model_of(
        tmp_path,
        'inputs = ["u", "w"]\noutputs = ["y", "v"]\nkind = "zero_pole_gain"\nentry = [\n'
        '{input = "u", output = "y", gain = 1, poles_rad_s = [-1], dead_time_s = 0.2},\n'
        '{input = "w", output = "y", gain = 2, poles_rad_s = [-0.1, -0.1]},\n'
        '{input = "u", output = "v", gain = 3}]',
    )
    found = model.response(OMEGA)
    assert found[:, 0, 0] == pytest.approx(np.exp(-0.2 * S) / (S + 1), rel=ROUNDING)
    assert found[:, 0, 1] == pytest.approx(2 / (S + 0.1) ** 2, rel=ROUNDING)
    assert found[:, 1, 0] == pytest.approx(3 + 0 * S, rel=ROUNDING)
    assert np.all(found[:, 1, 1] == 0)


@pytest.mark.parametrize("ending", ["mat", "csv"])
def test_matrices_in_a_file_are_the_matrices(tmp_path, ending):
    rng = np.random.default_rng(1)
    A, B, C, D = (rng.normal(size=shape) for shape in ((3, 3), (3, 2), (1, 3), (1, 2)))
    tmp_path.mkdir(exist_ok=True)
    if ending == "mat":
        savemat(tmp_path / "plant.mat", {"A": A, "B": B, "C": C, "D": D})
    else:
        rows = np.hstack([np.vstack([A, C]), np.vstack([B, D])]).tolist()
        (tmp_path / "plant.csv").write_text("\n".join(",".join(map(repr, row)) for row in rows))
    model = model_of(tmp_path, f'kind = "file"\nfile = "plant.{ending}"\ninputs = ["u", "w"]\noutputs = ["y"]')
    for given, found in zip((A, B, C, D), (model.plant.A, model.plant.B, model.plant.C, model.plant.D), strict=True):
        assert np.array_equal(given, found)


def test_a_changed_file_of_matrices_changes_the_digest(tmp_path):
    (tmp_path / "plant.csv").write_text("-1,1\n1,0")
    lines = 'kind = "file"\nfile = "plant.csv"\n' + IO
    model_of(tmp_path, lines)
    first = load_problem(str(tmp_path)).data_sha256
    (tmp_path / "plant.csv").write_text("-1,1\n1,1")
    assert load_problem(str(tmp_path)).data_sha256 != first


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("../plant.csv", None, "in the folder of its data.toml"),
        ("/etc/passwd", None, "in the folder of its data.toml"),
        ("plant.txt", b"1,1\n1,1", "end in .mat or .csv"),
        ("plant.csv", None, "readable file"),
        ("plant.csv", b"", "rows of equal length"),
        ("plant.csv", b"1,2\n3", "rows of equal length"),
        ("plant.csv", b"1,x\n3,4", "numbers between commas"),
        ("plant.csv", b"1,nan\n3,4", "finite numbers"),
        ("plant.csv", b"1,2,3\n3,4,5", "got 2 rows of 3"),
        ("plant.csv", b"\xff\xfe", "UTF-8"),
        ("plant.mat", b"", "MATLAB file"),
        ("plant.mat", b"MATLAB 5.0 MAT-file" + bytes(300), "MATLAB file|lacks A, B, C"),
        ("plant.mat", bytes(range(256)) * 4, "MATLAB file"),
    ],
)
def test_a_file_that_holds_no_plant_is_refused(tmp_path, name, content, sentence):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=sentence):
        model_of(tmp_path, f'kind = "file"\nfile = "{name}"\n' + IO)


@pytest.mark.parametrize(
    "given",
    [
        {"A": [[1.0]], "B": [[1.0]]},
        {"A": "text", "B": [[1]], "C": [[1]]},
        {"A": [[1j]], "B": [[1]], "C": [[1]]},
        {"A": [[1, 2]], "B": [[1]], "C": [[1]]},
    ],
)
def test_a_mat_file_of_other_things_is_refused(tmp_path, given):
    savemat(tmp_path / "plant.mat", given)
    with pytest.raises(InputError, match=r"lacks C|must hold"):
        model_of(tmp_path, 'kind = "file"\nfile = "plant.mat"\n' + IO)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("dead_time_ms", "dead_time_us", "unknown key 'dead_time_us'; did you mean 'dead_time_s'"),
        ("dead_time_ms = 400", "dead_time_ms = 400, dead_time_s = 0.4", "'dead_time_s' is given twice"),
        ("dead_time_ms = 400", "dead_time_ms = -400", "dead_time_s is not usable"),
        ("dead_time_ms = 400", "dead_time_ms = true", "dead_time_s is not usable"),
        ("[3.0, 1.0]", "[0.0]", "proper"),
        ("[2.0]", "[1.0, 2.0, 3.0]", "proper"),
        ("[2.0]", "[nan]", "numerator.0 is not usable"),
        ("[3.0, 1.0]", f"[{'1.0, ' * 14}]", "denominator is not usable"),
        ('"transfer_function"', '"transfer"', "kind"),
        (
            'inputs = ["u"]\noutputs = ["y"]\nentry',
            'inputs = ["u", "u"]\noutputs = ["y"]\nentry',
            "must name its input",
        ),
        ('outputs = ["y"]\nentry', 'outputs = ["u"]\nentry', "different names"),
        ('name = "tank"', 'name = ""', "name is not usable"),
        ("[[model]]", "[[models]]", "unknown key 'models'; did you mean 'model'"),
        ("[structure]", "[structures]", "unknown key 'structures'; did you mean 'structure'"),
        ('references = ["r"]', 'references = ["q"]', "'r'"),
        ('kind = "pid"', 'kind = "pif"', "structure.block.0: unknown kind of block 'pif'; did you mean 'pid'"),
        ('kind = "pid"', 'kind = "expression"', "lives in the program"),
        ('parts = "PI"', 'part = "PI"', "did you mean 'parts'"),
        ("Kp = 0.5", "Kpp = 0.5", "unknown key 'Kpp'; did you mean 'Kp'"),
        ("Kp = 0.5", "Tf = 0.5", "unknown key 'Tf'; did you mean 'Tf_s'"),
        ("Kp = 0.5", "Kd = 0.5", "Kd is not among the parts"),
        ("Kp = 0.5", 'Kp = "0.5"', "not usable"),
        ("low = 0.0, high = 2.0", "low = 2.0, high = 0.0", "must rise"),
        ("low = 0.0", "low = 1.0", "must start within its bounds"),
        ("low = 0.0", "lower = 0.0", "did you mean 'low'"),
        ('kind = "margins"', 'kind = "margin"', "goal.0: unknown kind of goal 'margin'; did you mean 'margins'"),
        ('kind = "margins"\n', "", "must have a kind"),
        ("gain_db = 6", "gain_dB = 6", "did you mean 'gain_db'"),
        ("gain_db = 6", "gain_db = 1e9", "from 0 to 1000"),
        ("gain_db = 6", 'gain_db = "6"', "must be a finite number"),
        ("hard = true", "hard = 1", "must be true or false"),
        ('points = ["u"]', 'points = ["z"]', "goal.0: .*'z'"),
        ('points = ["u"]', "points = []", "at least one"),
        ('points = ["u"]\n', "", "goal.0: a goal of kind 'margins' must say points"),
        ('kind = "margins"', 'kind = "delay_margin"', "gain_db"),
        ('outputs = "y"', "", "goal.1: a goal of kind 'step_tracking' must say outputs"),
        ("time_constant_s = 2", "time_constant_s = 0", "goal.1"),
        ("time_constant_s = 2", 'time_constant_s = 2\nmodels = ["barrel"]', "must name models of tank; got 'barrel'"),
        ("hard = true", "hard = true\nfocus_hz = [2, 1]", "low < high"),
    ],
)
def test_what_cannot_be_is_refused_by_its_key(tmp_path, old, new, sentence):
    assert old in LOOP
    with pytest.raises(InputError, match=sentence) as caught:
        load_problem(folder_with(tmp_path, LOOP.replace(old, new)))
    assert str(caught.value).startswith(str(tmp_path))
    assert len(str(caught.value)) < 1000


def test_the_same_plant_in_other_units_is_the_same_problem(tmp_path):
    other = LOOP.replace("dead_time_ms = 400", "dead_time_s = 0.4")
    other = other.replace("time_constant_s = 2", "time_constant_ms = 2000")
    other = other.replace('parts = "PI" }\nparameters = {', 'parts = "PI" }\nparameters = { Tf_min = 0.001,')
    usual = LOOP.replace('parts = "PI" }\nparameters = {', 'parts = "PI" }\nparameters = { Tf_ms = 60.0,')
    assert usual != other
    one, two = (load_problem(folder_with(tmp_path / name, text)) for name, text in (("a", usual), ("b", other)))
    assert one.systems[0].lines == two.systems[0].lines
    assert one.structure.parameters == two.structure.parameters
    assert one.goals == two.goals


def test_a_speed_is_not_for_a_plant_of_ones_own(tmp_path):
    with pytest.raises(InputError, match="asked of a vehicle"):
        load_problem(folder_with(tmp_path, LOOP), speed=30.0)


@pytest.mark.parametrize("columns", ["real,imaginary", "magnitude,phase_deg", "magnitude_db,phase_deg"])
def test_a_measured_response_is_fitted_within_its_tolerance(tmp_path, columns):
    # an integrator behind a dead time and a resonance; the file says them in one of three ways
    f = np.geomspace(0.05, 20.0, 80)
    s = 2j * np.pi * f
    G = 3 / s * np.exp(-0.04 * s) * 400 / (s**2 + 2 * s + 400)
    said = {
        "real": G.real, "imaginary": G.imag, "magnitude": np.abs(G), "magnitude_db": 20 * np.log10(np.abs(G)),
        "phase_deg": np.rad2deg(np.angle(G)),
    }  # fmt: skip
    rows = zip(f, *(said[column] for column in columns.split(",")), strict=True)
    text = "\n".join([f"frequency_hz,{columns}", *(",".join(map(repr, map(float, row))) for row in rows)])
    (tmp_path / "tests.csv").write_text(text)
    model = model_of(
        tmp_path, 'kind = "frequency_response"\ninputs = ["u"]\noutputs = ["y"]\nentry = [{file = "tests.csv"}]\n'
        "integrators = 1\ndead_time_ms = 40\ntolerance = 1e-6",
    )  # fmt: skip
    assert model.response(2 * np.pi * f)[:, 0, 0] == pytest.approx(G, rel=1e-6)
    assert sorted(np.abs(model.plant.poles())) == pytest.approx([0, 20, 20], abs=1e-4)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("", "header"),
        ("f,real,imaginary\n1,2,3\n2,3,4", "header"),
        ("frequency_hz,real,imaginary\n1,2,3", "2 to 10000 rows"),
        ("frequency_hz,real,imaginary\n1,2,3\n1,2,3", "must rise"),
        ("frequency_hz,real,imaginary\n0,2,3\n1,2,3", "must rise"),
        ("frequency_hz,real,imaginary\n1,0,0\n2,2,3", "not be zero"),
        ("frequency_hz,real,imaginary\n1,1,x\n2,2,3", "numbers between commas"),
        ("frequency_hz,real,imaginary\n" + "\n".join(f"{k},{(-1) ** k},{k % 3}" for k in range(1, 9)), "tolerance"),
    ],
)
def test_a_response_that_cannot_be_read_or_fitted_is_refused(tmp_path, content, sentence):
    (tmp_path / "t.csv").write_text(content)
    with pytest.raises(InputError, match=sentence):
        model_of(tmp_path, 'kind = "frequency_response"\nentry = [{file = "t.csv"}]\n' + IO)

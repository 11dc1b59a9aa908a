"""`workbench verify`: what it prints, and the exit code that scripts rely on."""

import json

import pytest
import typer

from workbench.commands.verify import verify as command
from workbench.errors import InfeasibleError, InputError


@pytest.fixture
def run(capsys):
    """Exit code, stdout and sentence of the command, as `workbench.cli` turns them out."""
    app = typer.Typer()
    app.command()(command)

    def call(*arguments):
        code, sentence = 0, ""
        try:
            app(args=[str(a) for a in arguments], standalone_mode=False)
        except InfeasibleError as error:
            code, sentence = 1, str(error)
        except InputError as error:
            code, sentence = 2, str(error)
        return code, capsys.readouterr().out, sentence

    return call


@pytest.fixture
def written(tmp_path):
    def write(document):
        path = tmp_path / "gains.json"
        path.write_text(json.dumps(document))
        return path

    return write


def test_a_good_table_ends_with_zero_and_a_line_for_every_promise(run, written, heave):
    code, out, sentence = run(written(heave.document))
    assert (code, sentence) == (0, "")
    for promise in heave.document["promises"]:
        assert promise["name"].split(",")[0] in out
    assert "not proved" not in out
    assert "fails" not in out


def test_json_is_one_document_with_the_keys_that_are_promised(run, written, heave):
    path = written(heave.document)
    code, out, _ = run(path, "--json", "--problem", "heave")
    document = json.loads(out)
    assert code == 0
    assert document["table"] == str(path)
    assert document["digest_ok"] is True
    assert document["proved"] is True
    assert document["problem"]["holds"] is True
    assert document["problem"]["plant_difference"] <= 1e-9
    for promise in document["promises"]:
        assert set(promise) == {
            "name", "sense", "limit", "claimed", "proved", "method", "box", "holds", "verdict", "reason", "seconds"
        }  # fmt: skip
        assert promise["claimed"][0] <= promise["proved"][0] <= promise["proved"][1] <= promise["claimed"][1]
        assert promise["holds"] is True
    assert json.loads(run(path, "--json")[1])["problem"] is None


def test_a_changed_digit_ends_with_one_and_says_which_promise_fails(run, written, heave):
    def change(document):
        text = document["gains"]["K_zdot"]
        document["gains"]["K_zdot"] = text[:-1] + str((int(text[-1]) + 1) % 10)

    code, out, sentence = run(written(heave.changed(change)), "--json")
    document = json.loads(out)
    assert code == 1
    assert document["digest_ok"] is True
    assert document["proved"] is False
    assert "does not hold: 'damping ratio' is claimed to lie in" in sentence
    assert "\n" not in sentence
    assert document["faults"]
    unsigned = heave.document
    change(unsigned)
    code, out, sentence = run(written(unsigned))
    assert code == 1
    assert "the digest must be the SHA-256 of the content" in sentence
    assert "fails" in out


def test_a_table_of_another_problem_ends_with_one(run, written, heave):
    code, out, sentence = run(written(heave.document), "--problem", "heave_pitch", "--json")
    assert code == 1
    assert "the data of 'heave_pitch' must be those the table was made from" in sentence
    document = json.loads(out)
    assert document["proved"] is False
    assert document["problem"]["data_sha256_ok"] is False


def test_bad_input_ends_with_two_and_one_sentence(run, tmp_path):
    path = tmp_path / "bad.json"
    path.write_text("[]")
    assert run(path)[0] == 2
    code, out, sentence = run(tmp_path / "none.json")
    assert (code, out) == (2, "")
    assert "must be a readable file" in sentence
    code, _, sentence = run(path, "--speed", "100")
    assert code == 2
    assert "--speed must come with --problem" in sentence


def test_an_unknown_problem_ends_with_two(run, written, heave):
    code, _, sentence = run(written(heave.document), "--problem", "heav")
    assert code == 2
    assert "did you mean 'heave'" in sentence


def test_a_budget_that_does_not_suffice_leaves_the_table_undecided(run, written, revenue):
    code, out, sentence = run(written(revenue.document), "--json", "--budget-seconds", "0.05")
    document = json.loads(out)
    assert code == 1
    assert "undecided" in sentence
    assert document["proved"] is False
    assert not any(p["holds"] for p in document["promises"][-3:])


@pytest.mark.parametrize("seconds", ["0", "-1", "nan", "inf"])
def test_a_budget_that_cannot_be_kept_is_refused(run, written, heave, seconds):
    code, _, sentence = run(written(heave.document), "--budget-seconds", seconds)
    assert code == 2
    assert "--budget-seconds must be a positive, finite number" in sentence


def test_numbers_that_would_hang_a_proof_are_refused_at_once(run, written, heave):
    code, _, sentence = run(written(heave.changed(lambda d: d["gains"].update(K_h="1e330"))))
    assert code == 2
    assert "gains.K_h must be zero or of a size between" in sentence


def test_what_is_not_promised_and_what_nobody_proved_is_said(run, written, heave):
    _, out, _ = run(written(heave.document))
    assert "Without a promise of its own" in out
    assert "any motion in Theta" in out
    assert "Stated by the author, proved by nobody" in out
    document = json.loads(run(written(heave.document), "--json")[1])
    assert "measured.cost" in document["stated"]


def test_a_table_of_a_plant_of_ones_own_says_nothing_of_vehicles_and_ends_alike(run, written):
    from plant_cases import design_of

    from workbench.files.digest import digest_of
    from workbench.handover.table.plant import plant_table

    document = plant_table(design_of("motor")).to_dict()
    code, out, sentence = run(written(document), "--json")
    said = json.loads(out)
    assert (code, sentence, said["proved"]) == (0, "", True)
    assert not {"plant_follows", "coupling"} & said.keys()
    assert [p["name"] for p in said["promises"]][:2] == ["stability", "damping ratio"]
    assert run(written(document))[0] == 0
    document["structure"]["blocks"][1]["parameters"]["Kp"]["value"] = "-600.0"
    code, _, sentence = run(written(document))
    assert (code, "changed after it was signed" in sentence) == (1, True)
    document["digest"] = digest_of(document)
    code, _, sentence = run(written(document))
    assert (code, "stability" in sentence) == (1, True)
    document["structure"]["blocks"][1]["parameters"]["Kp"]["value"] = "sixty"
    assert run(written(document))[0] == 2


def test_a_plant_of_ones_own_is_held_against_its_problem(run, written):
    from workbench.design.record import given
    from workbench.files.problem import load_problem
    from workbench.handover.table.plant import plant_table

    problem = load_problem("dc_motor")
    document = plant_table(given(problem, {"Kp": 19.76, "Ki": 33.37, "Kd": 1.67})).to_dict()
    code, out, _ = run(written(document), "--problem", "dc_motor", "--json")
    assert (code, json.loads(out)["problem"]["holds"]) == (0, True)
    document["models"][0]["A"][0][0] = repr(float(document["models"][0]["A"][0][0]) * (1 + 1e-8))
    code, out, sentence = run(written(document), "--problem", "dc_motor", "--json")
    assert code == 1
    assert any("must be the problem's to 1e-9" in words for words in json.loads(out)["faults"])
    code, _, sentence = run(written(document), "--problem", "heave")
    assert (code, "of the kind that 'heave' is" in sentence) == (2, True)

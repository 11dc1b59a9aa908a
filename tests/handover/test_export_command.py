"""`workbench export`: files, standard output, JSON, refusals."""

import json
from base64 import b64decode
from io import BytesIO

import pytest
import typer
from scipy.io import loadmat
from typer.testing import CliRunner

from workbench.commands.export import export
from workbench.errors import InputError
from workbench.handover.code.formats import render

app = typer.Typer()
app.command()(export)


@pytest.fixture
def path(table, tmp_path):
    table.write(tmp_path / "gains.json")
    return tmp_path / "gains.json"


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments], catch_exceptions=False)


def test_text_goes_to_standard_output_as_it_is(path, table):
    for format in ("csv", "c", "json"):
        result = run(path, "--format", format)
        assert result.exit_code == 0
        assert result.stdout_bytes == render(table, format)


def test_a_file_or_a_folder_takes_the_export_and_nothing_is_printed(path, table, tmp_path):
    assert run(path, "--format", "c", "--out", tmp_path / "law" / "wb_law.h").stdout == ""
    assert (tmp_path / "law" / "wb_law.h").read_bytes() == render(table, "c")
    run(path, "--format", "csv", "--out", tmp_path)
    assert (tmp_path / "gains.csv").read_bytes() == render(table, "csv")
    assert not list(tmp_path.glob("*.part"))


def test_json_is_one_document_that_says_where_or_carries_the_content(path, table, tmp_path):
    written = json.loads(run(path, "--format", "mat", "--out", tmp_path, "--json").stdout)
    assert written["path"] == str(tmp_path / "gains.mat")
    assert written["digest"] == table.digest
    carried = json.loads(run(path, "--format", "csv", "--json").stdout)
    assert carried["content"].encode() == render(table, "csv")
    binary = json.loads(run(path, "--format", "mat", "--json").stdout)
    assert loadmat(BytesIO(b64decode(binary["content_base64"])), simplify_cells=True)["gains"]["K_h"] == -1.03219


def test_bad_input_is_refused_before_anything_is_written(path, tmp_path):
    with pytest.raises(InputError, match="unknown format 'xml'"):
        run(path, "--format", "xml", "--out", tmp_path / "out.xml")
    with pytest.raises(InputError, match="must be a readable file"):
        run(tmp_path / "missing.json", "--format", "csv")
    path.write_text(path.read_text().replace("-1.03219", "-1.03218"))
    with pytest.raises(InputError, match="changed after it was signed"):
        run(path, "--format", "csv", "--out", tmp_path / "out.csv")
    assert not list(tmp_path.glob("out.*"))


def test_the_sample_time_and_the_computing_delay_are_those_asked_for(path):
    document = json.loads(
        run(path, "--format", "c", "--sample-time-ms", 0.5, "--computing-delay-ms", 0.25, "--json").stdout
    )
    assert document["check"]["sample_time"] == 5e-4
    assert document["check"]["computing_delay"] == 2.5e-4
    assert "#define WB_SAMPLE_TIME WB_R(0.0005) /* s */" in document["content"]
    with pytest.raises(InputError, match="--sample-time-ms is for the formats mat and c"):
        run(path, "--format", "csv", "--sample-time-ms", 1)
    with pytest.raises(InputError, match="must be positive"):
        run(path, "--format", "c", "--sample-time-ms", -1)


def test_a_place_that_cannot_be_written_is_refused(path, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="must be writable"):
        run(path, "--format", "csv", "--out", tmp_path / "file" / "below.csv")


def test_what_out_means_follows_one_rule(path, table, tmp_path):
    for out, file in (
        ("new", "new/gains.csv"), ("other/", "other/gains.csv"), ("v1.2/", "v1.2/gains.csv"), ("law.csv", "law.csv"),
    ):  # fmt: skip
        run(path, "--format", "csv", "--out", f"{tmp_path}/{out}")
        assert (tmp_path / file).is_file(), out
    (tmp_path / "bare").write_text("an older export")
    run(path, "--format", "csv", "--out", tmp_path / "bare")
    assert (tmp_path / "bare").read_bytes() == render(table, "csv")

"""`workbench study` and its report, as a user meets them."""

import json
import re
import xml.etree.ElementTree as ET

import pytest
import typer

from workbench.commands.study import study as command
from workbench.errors import BudgetEnded, InputError
from workbench.study.file import read_study
from workbench.study.report import study_report_html
from workbench.study.run import run_study


def call(file, out, **more):
    command(**{"file": file, "out": out, "workers": 1, "scheduler": None, "fresh": False, **more})


def test_json_is_one_document_with_failing_share_indices_and_provenance(study_file, tmp_path, capsys):
    call(study_file(60), tmp_path / "out", json=True)
    document = json.loads(capsys.readouterr().out)
    assert document["failing"]["rows_in_all"] == 60
    assert {i["parameter"] for i in document["indices"]} == {"K_h", "K_zdot"}
    assert len(document["provenance"]["study_sha256"]) == 64
    assert (tmp_path / "out" / "report.html").is_file()
    assert document == {**json.loads((tmp_path / "out" / "summary.json").read_text()), "report": document["report"]}


def test_the_terminal_shows_failing_quantities_and_sensitivity(study_file, tmp_path, capsys):
    call(study_file(60), tmp_path / "out")
    shown = capsys.readouterr().out
    for words in ("rows fail", "damping", "Rank correlation", "table.csv"):
        assert words in shown


def test_a_budget_that_is_over_says_how_to_go_on(study_file, tmp_path, monkeypatch):
    def late(asked, folder, *, on_rows, **rest):
        on_rows(17, 60)
        raise BudgetEnded("late")

    monkeypatch.setattr("workbench.study.run.run_study", late)
    with pytest.raises(BudgetEnded, match=r"the budget of 5 s ended with 17 of 60 rows finished and kept; .*--out"):
        call(study_file(60), tmp_path / "out", budget_seconds=5.0)


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan"), float("inf")])
def test_a_budget_that_is_none_is_refused(study_file, tmp_path, seconds):
    with pytest.raises(InputError, match="--budget-seconds must be a positive, finite number"):
        call(study_file(60), tmp_path / "out", budget_seconds=seconds)


def test_workers_of_this_machine_and_of_a_scheduler_are_not_both_taken(study_file, tmp_path):
    with pytest.raises(InputError, match="--workers are of this machine"):
        call(study_file(60), tmp_path / "out", workers=2, scheduler="tcp://nowhere:1")


def test_an_interrupt_says_how_to_go_on_and_ends_with_130(study_file, tmp_path, capsys, monkeypatch):
    def interrupted(asked, folder, *, on_rows, **rest):
        on_rows(17, 60)
        raise KeyboardInterrupt

    monkeypatch.setattr("workbench.study.run.run_study", interrupted)
    with pytest.raises(typer.Exit) as end:
        call(study_file(60), tmp_path / "out")
    assert end.value.exit_code == 130
    said = capsys.readouterr().err
    assert "17 of 60 rows finished and kept" in said
    assert f"--out {tmp_path / 'out'}" in said


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    file = folder / "one.toml"
    file.write_text(
        '[study]\nproblem = "heave"\ncount = 300\noutput = "csv"\n[[parameter]]\nname = "K_h"\nrange = [1.0, 4.0]\n'
        '[[parameter]]\nname = "tau_z"\ndistribution = "log_uniform"\nrange = [0.5, 4.0]\n'
    )
    result = run_study(read_study(file), folder / "out")
    return result, study_report_html(result)


def test_the_report_refers_to_nothing_outside(page):
    _, html = page
    assert not re.findall(r'(?:src|href)="(?!#)', html)
    assert "<script" not in html
    assert "url(http" not in html


def test_the_report_is_small(page):
    assert len(page[1]) < 1_500_000


def test_every_figure_of_the_report_has_its_numbers_beneath(page):
    figures = re.findall(r"<figure>.*?</figure>", page[1], re.DOTALL)
    assert len(figures) > 6
    for figure in figures:
        ET.fromstring(re.search(r"<svg.*?</svg>", figure, re.DOTALL).group().replace("xlink:", ""))
        assert "<details>" in figure


def test_ids_of_the_report_are_unique(page):
    ids = re.findall(r'\bid="([^"]*)"', page[1])
    assert len(ids) == len(set(ids))


def test_the_report_shows_the_share_that_fails_and_where_it_comes_from(page):
    result, html = page
    assert f"{100 * result.failing.share:.3g} %" in html
    assert result.provenance["study_sha256"] in html
    assert result.provenance["data_sha256"] in html


def test_names_in_a_report_are_text(tmp_path, page):
    from dataclasses import replace

    result, _ = page
    named = {**result.provenance, "problem": "<script>alert(1)</script>"}
    odd = replace(result, provenance=named, spreads=(), indices=())  # no figures: they take the time
    assert "<script>" not in study_report_html(odd)

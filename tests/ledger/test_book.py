"""Every row of the ledger holds, and the checker can tell when one does not."""

from functools import cache

import pytest

from workbench.errors import InputError
from workbench.ledger.book import KINDS, VERDICTS, Printed, appendices, check, ledger, printed_rows

ROWS = [(name, row.id) for name in appendices() for row in printed_rows(name)]


@cache
def entries(appendix: str):
    return {entry.row.id: entry for entry in ledger(appendix).entries}


@pytest.mark.parametrize(("appendix", "row"), ROWS)
def test_the_verdict_on_each_printed_number_holds(appendix, row):
    entry = entries(appendix)[row]
    assert entry.holds, entry.why


@pytest.mark.parametrize("appendix", appendices())
def test_row_ids_are_unique_and_begin_with_their_appendix(appendix):
    ids = [row.id for row in printed_rows(appendix)]
    assert len(set(ids)) == len(ids)
    assert all(name[0].lower() == appendix[0] for name in ids)


def test_no_row_stands_in_two_appendices():
    assert len({row for _, row in ROWS}) == len(ROWS)


def row(**changed) -> Printed:
    fields = {
        "id": "X.1",
        "place": "X",
        "quantity": "q",
        "printed": 2.0,
        "unit": "m",
        "tolerance": 0.05,
        "verdict": "reproduced",
    }
    return Printed(**fields | changed)


@pytest.mark.parametrize(
    ("changed", "ours", "holds"),
    [
        ({}, 2.04, True),
        ({}, 2.05, True),  # half a unit of the last digit counts as agreement
        ({}, 2.06, False),
        ({"verdict": "consistent by fit"}, 2.06, False),
        ({"verdict": "not reproducible"}, 2.04, False),
        ({"verdict": "not reproducible"}, 2.06, True),
        ({"verdict": "misprint"}, 2.04, False),
        ({"verdict": "misprint"}, 2.5, True),
        ({"verdict": "misprint", "corrected": 3.0}, 3.04, True),
        ({"verdict": "misprint", "corrected": 3.0}, 3.06, False),
        ({"verdict": "misprint", "corrected": 2.04}, 2.04, False),
        ({"verdict": "report's own inconsistency", "corrected": 3.0}, 3.0, True),
        ({"verdict": "scan", "corrected": 3.0}, 3.04, True),
        ({"verdict": "scan", "corrected": 3.0}, 2.0, False),
        ({"printed": "decreases", "tolerance": None, "at_most": 1.0}, 1.0, True),
        ({"printed": "decreases", "tolerance": None, "at_most": 1.0}, 1e9, False),
        ({"printed": "decreases", "tolerance": None, "at_most": 1.0}, float("nan"), False),
        ({"printed": "2 to 3", "tolerance": None, "at_least": 2.0, "at_most": 3.0}, 1.9, False),
        ({"printed": "good", "tolerance": None, "at_most": 1.0, "verdict": "not reproducible"}, 2.0, True),
        ({"printed": "good", "tolerance": None, "at_most": 1.0, "verdict": "not reproducible"}, 0.5, False),
        ({}, float("nan"), False),
    ],
)
def test_a_verdict_is_decided_by_numbers(changed, ours, holds):
    assert (check(row(**changed), ours) == "") is holds


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"verdict": "plausible"}, "unknown verdict 'plausible'"),
        ({"tolerance": None}, "must have a tolerance exactly if it prints a number"),
        ({"printed": "two"}, "must have a tolerance exactly if it prints a number"),
        ({"tolerance": -1.0}, "must not be negative"),
        ({"corrected": 3.0}, "must not be corrected under the verdict 'reproduced'"),
        ({"printed": "two", "tolerance": None}, "must have bounds, in order, exactly if it prints words"),
        ({"printed": "two", "tolerance": None, "at_least": 2.0, "at_most": 1.0}, "must have bounds, in order"),
        ({"at_most": 1.0}, "must have bounds, in order, exactly if it prints words"),
        ({"kind": "words"}, "must print words to be of the kind 'words'"),
        ({"kind": "rumour"}, "unknown kind of row 'rumour'"),
    ],
)
def test_rows_that_claim_nothing_checkable_are_refused(changed, sentence):
    with pytest.raises(InputError, match=sentence):
        row(**changed)


def test_an_unknown_appendix_is_refused():
    with pytest.raises(InputError, match="unknown appendix 'z'"):
        ledger("z")


def test_the_summary_counts_every_row_once():
    found = ledger("c")
    counts = {name: value for name, value, _ in found.rows()}
    assert sum(counts[words] for words in KINDS.values()) == len(found.entries) == sum(counts[v] for v in VERDICTS)


WORDS = [row for name in appendices() for row in printed_rows(name) if isinstance(row.printed, str)]


@pytest.mark.parametrize("statement", WORDS, ids=lambda row: row.id)
def test_every_statement_in_words_can_fail(statement):
    held = entries(next(a for a, name in ROWS if name == statement.id))[statement.id].ours
    edges = [b for b in (statement.at_least, statement.at_most) if b is not None]
    beyond = [1e9, -1e9, *(b + s for b in edges for s in (-1e-6, 0.0, 1e-6))]
    assert check(statement, held) == ""
    assert any(check(statement, value) for value in beyond)


def test_what_is_counted_as_printed_are_numbers_of_the_report():
    found = ledger()
    assert (found.count("number"), found.count("formula"), found.count("words")) == (211, 103, 84)  # quoted in README
    derived = {e.row.id for e in found.entries if e.row.kind == "derived"}
    assert "A.derived.drag" in derived
    assert not any(name.startswith(("B-", "B.5.", "C-1.")) for name in (e.row.id for e in found.entries
                   if e.row.kind == "number"))  # fmt: skip


def test_the_rounded_rate_gain_of_c5_gives_every_number_of_c5():
    from workbench.design.procedure import unfiltered
    from workbench.ledger.appendix_c import _prints_c5  # the middle of its range is what the row shows
    from workbench.ledger.baseline import report_gains, report_law, report_model

    model = report_model().plant, report_law(), unfiltered(report_gains())
    assert not _prints_c5(*model, 0.15)  # as printed, taken as exact: pitch damping 0.562
    assert all(_prints_c5(*model, rate) for rate in (0.1457, 0.147, 0.1481))
    assert not any(_prints_c5(*model, rate) for rate in (0.1455, 0.1484))

"""Every row of the ledger holds, and the checker can tell when one does not."""

from functools import cache

import pytest

from workbench.errors import InputError
from workbench.ledger.book import VERDICTS, Printed, appendices, check, ledger, printed_rows

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
        ({"printed": "about 2", "tolerance": None}, 7.0, True),
        ({"printed": "about 2", "tolerance": None}, float("nan"), False),
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
    assert counts["printed numbers"] == len(found.entries) == sum(counts[v] for v in VERDICTS)

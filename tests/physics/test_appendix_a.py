"""The ledger of Appendix A: every verdict holds."""

import tomllib
from pathlib import Path

import pytest

import workbench.ledger
from workbench.ledger.appendix_a import computed

ROWS = tomllib.loads((Path(workbench.ledger.__file__).parent / "appendix_a.toml").read_text("utf8"))["row"]


@pytest.fixture(scope="module")
def ours():
    return computed()


def test_every_row_has_a_number_of_ours_and_the_reverse(ours):
    assert sorted(row["id"] for row in ROWS) == sorted(ours)


def test_both_expansions_are_complete():
    assert sum(row["id"].startswith("A.3.extended.") for row in ROWS) == 36
    assert sum(row["id"].startswith("A.3.first_order.") for row in ROWS) == 15


@pytest.mark.parametrize("row", ROWS, ids=[row["id"] for row in ROWS])
def test_the_verdict_of_a_row_holds(row, ours):
    value, printed, tolerance = ours[row["id"]], row["printed"], row["tolerance"]
    if row["verdict"] == "reproduced":
        assert abs(value - printed) <= tolerance
    elif row["verdict"] == "not reproducible":
        assert abs(value - printed) > tolerance
    else:
        assert row["verdict"] in ("misprint", "report's own inconsistency")
        assert abs(value - row["corrected"]) <= tolerance
        assert abs(printed - row["corrected"]) > tolerance

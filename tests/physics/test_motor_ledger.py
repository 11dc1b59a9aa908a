"""Every number of Appendix F, sections 5, 6 and 7.1, carries a verdict that our number bears out."""

import tomllib
from importlib.resources import files

import pytest

from workbench.ledger.appendix_f_motor import computed

ROWS = tomllib.loads((files("workbench.ledger") / "appendix_f_motor.toml").read_text(encoding="utf-8"))["row"]
COMPUTED = computed()
VERDICTS = {"reproduced", "consistent by fit", "misprint", "scan", "report's own inconsistency", "not reproducible"}


def test_rows_and_computed_numbers_are_the_same_set():
    ids = [row["id"] for row in ROWS]
    assert len(ids) == len(set(ids))
    assert set(ids) == set(COMPUTED)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["id"])
def test_the_verdict_is_what_the_numbers_say(row):
    ours, printed, verdict = COMPUTED[row["id"]], row["printed"], row["verdict"]
    assert verdict in VERDICTS
    if isinstance(printed, str):
        assert "tolerance" not in row
        return
    tolerance = row["tolerance"]
    if verdict in ("reproduced", "consistent by fit"):
        assert abs(ours - printed) <= tolerance
    elif verdict == "not reproducible":
        assert abs(ours - printed) > tolerance
    else:
        assert abs(ours - row["corrected"]) <= tolerance
        assert abs(printed - row["corrected"]) > tolerance

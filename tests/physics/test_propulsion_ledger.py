"""Every number of Appendix E and of Appendix F, sections 3, 4, 7.2 and 7.3, has the verdict it claims."""

import pytest

from workbench.ledger.book import ledger


@pytest.mark.parametrize(("appendix", "least"), [("e", 8), ("f_propulsion", 40)])
def test_every_verdict_holds(appendix, least):
    book = ledger(appendix)
    assert len(book.entries) >= least  # a ledger that lost its rows holds trivially
    assert [f"{entry.row.id}: {entry.why}" for entry in book.failing] == []

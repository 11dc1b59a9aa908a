"""What the code cites of the definitions stands there under that heading; the page tells the code's own numbers."""

import re

import pytest
from guide_page import GUIDE, ROOT

from workbench.analysis.sampled import PASSED
from workbench.constants import GRAVITY
from workbench.ledger.effects import CURRENT_LAG
from workbench.physics.forces.law import REPORT_AMPERE_TURNS, REPORT_LIFT_RATIO, REPORT_LIFT_TO_DRAG

PAGE = (GUIDE / "definitions.md").read_text("utf-8")
HEADINGS = [line.removeprefix("## ").lower() for line in PAGE.splitlines() if line.startswith("## ")]
CITED = [
    (path.relative_to(ROOT).as_posix(), heading)
    for folder in ("workbench", "tests")
    for path in sorted((ROOT / folder).rglob("*.py"))
    for heading in re.findall(r"guide, Definitions: ([A-Z][\w ]+?)[;:.,)\n\"]", path.read_text("utf-8"))
]


@pytest.mark.parametrize(("place", "heading"), CITED, ids=[f"{place}-{heading}" for place, heading in CITED])
def test_a_heading_cited_is_there(place, heading):
    assert any(found.startswith(heading.lower()) for found in HEADINGS), (place, heading)


def test_most_of_the_page_is_cited():
    assert len({heading for _, heading in CITED}) >= 6


@pytest.mark.parametrize(
    ("said", "ours"),
    [
        ("Gravity is 9.80665 m/s²", GRAVITY == 9.80665),
        ("A current lag of 10 ms", CURRENT_LAG == 0.010),
        ("$|z| > 10^{-9}$", PASSED == 1e-9),
        ("0.8380 and 61.505", (REPORT_LIFT_RATIO, REPORT_LIFT_TO_DRAG) == (0.8380, 61.505)),
        ("429.69 kA-turns", REPORT_AMPERE_TURNS == 429.69e3),
    ],
)
def test_a_number_of_the_page_is_the_one_in_the_code(said, ours):
    assert said in PAGE
    assert ours

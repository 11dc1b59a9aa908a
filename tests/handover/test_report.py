"""The report: one file, complete, well formed, that asks nobody for anything."""

import re
from collections import Counter
from dataclasses import replace
from datetime import UTC, datetime
from html.parser import HTMLParser

import pytest

from workbench.control import Gains
from workbench.design.design import given
from workbench.design.robustness import Case
from workbench.design.tradeoff import TradeOff
from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.handover.report.report import report_html

VOID = {"meta", "br", "hr", "img", "input", "link"}
LOOSE = Gains(
    K_h=-0.9, K_hdot=0.32547, tau_h=0.399399, K_hp=0.366128, K_hpdot=0.632934, tau_hp=0.105972,
    K_zddot=0.16238, K_zdot=0.328058, tau_z=0.841518, K_yddot=-0.156948, K_ydot=1.1661, tau_y=0.209657,
    K_heave=1.0, K_pitch=0.975784, K_sway=1.0, K_roll=2.21167, K_yaw=0.470042,
)  # fmt: skip
CURVE = TradeOff(
    quantity="rms gap, front", unit="m", limits=(0.04, 0.033, 0.02), costs=(33.0, 34.1, None), gains=(LOOSE, None, None)
)
CASES = {
    "cases": [
        Case(name="mass +15 %", stable=True, damping=0.38, decay=0.8, peak_sensitivity={"heave_pitch": 2.0}).to_dict(),
        Case(
            name="command 1 lost", stable=False, damping=-0.1, decay=-0.6, peak_sensitivity={"heave_pitch": None}
        ).to_dict(),
    ],
    "gap force −8 %": {"stable": True, "peak_sensitivity": {"heave_pitch": 2.02}},
    "disk margin": 0.43,
}
WHEN = datetime(2026, 1, 2, tzinfo=UTC)


class Page(HTMLParser):
    """Checks that tags close in order, and collects what the tests ask about."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.ids, self.attributes, self.text = [], Counter(), [], [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags[tag] += 1
        self.attributes += [(tag, k, v or "") for k, v in attrs]
        self.ids += [v for k, v in attrs if k == "id"]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags[tag] += 1
        self.attributes += [(tag, k, v or "") for k, v in attrs]
        self.ids += [v for k, v in attrs if k == "id"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not (self.open and self.open[-1] == "style"):
            self.text.append(data)

    @property
    def words(self):
        return " ".join(" ".join(self.text).split())


@pytest.fixture(scope="module")
def html(design, table):
    return report_html(design, trade_off=CURVE, robustness=CASES, table=table, created=WHEN)


@pytest.fixture(scope="module")
def page(html):
    return Page(html)


def test_every_tag_closes_and_every_id_is_there_once_and_found(html, page):
    assert [i for i, n in Counter(page.ids).items() if n > 1] == []
    pointed = {v[1:] for _, k, v in page.attributes if k in ("href", "xlink:href")} | set(
        re.findall(r"url\(#([^)]*)\)", html)
    )
    assert pointed
    assert pointed <= set(page.ids)


def test_nothing_is_fetched(html, page):
    addresses = re.findall(r"https?://[^\s\"'<>)]*", html)
    assert set(addresses) <= {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}
    assert not {"script", "link", "img", "iframe", "object"} & set(page.tags)
    assert all(v.startswith("#") for _, k, v in page.attributes if k in ("src", "href", "xlink:href"))
    assert "@import" not in html
    assert ("meta", "content", "default-src 'none'; style-src 'unsafe-inline'") in page.attributes


def test_every_figure_has_a_caption_and_numbers_and_says_what_it_is(page):
    assert page.tags["svg"] == 1 + 1 + 5 + 2 == page.tags["figure"]  # roots, trade-off, spectra, loops
    assert page.tags["figcaption"] == page.tags["figure"]
    assert page.tags["details"] == page.tags["figure"]  # the modes stand open beside their figure; the sources fold too
    labels = [v for tag, k, v in page.attributes if (tag, k) == ("svg", "aria-label")]
    assert len(set(labels)) == page.tags["svg"]


def test_a_point_of_the_trade_off_refers_to_the_gains_behind_it_and_one_without_gains_to_nothing(html):
    assert html.count('<a xlink:href="#trade-off-pick-0">') == 1
    assert "<title>rms gap, front at 0.04: cost 33</title>" in html
    assert "trade-off-pick-1" not in html
    picked = html[html.index('id="trade-off-pick-0"') :]
    assert "<td>-0.9</td>" in picked[: picked.index("</div></div>")]


def test_the_sections_are_all_there_in_order(html):
    assert re.findall(r"<h2>(.*?)</h2>", html) == [
        "Margins and failures", "Requirements", "Gains", "Roots", "Trade-off", "Ride, strokes and currents", "Spectra",
        "Loops", "Robustness", "Provenance",
    ]  # fmt: skip


def test_requirements_gains_and_provenance_are_told_as_they_are(design, table, page):
    assert "all 11 requirements met" in page.words
    for verdict in design.requirements:
        assert verdict.name in page.words
        assert verdict.where in page.words
    for name, digits in table.gains.items():
        assert f"{name} {digits}" in page.words
    for fact in (table.digest, design.problem.data_sha256, "2026-01-02T00:00:00Z", "seed 3", "≤ 33 mm 28.68 mm"):
        assert fact in page.words
    for source in design.problem.sources.values():
        assert " ".join(source.split()) in page.words


def test_robustness_cases_show_as_rows_however_they_are_given(page):
    for words in (
        "mass +15 % yes 0.38 0.8 2",
        "command 1 lost no -0.1 -0.6 –",
        "gap force −8 % yes 2.02",
        "disk margin 0.43",
    ):
        assert words in page.words


def test_colours_follow_the_readers_light_and_paper(html):
    for medium in ("@media (prefers-color-scheme:dark)", "@media print", "@media (max-width:40rem)"):
        assert medium in html
    figures = "".join(re.findall(r"<svg.*?</svg>", html, flags=re.DOTALL))
    fixed = set(re.findall(r"#[0-9a-fA-F]{6}\b", figures))
    assert fixed == set(), "a colour that does not follow the style sheet"


@pytest.mark.slow
def test_one_design_makes_one_report(design, html, table):
    assert report_html(design, trade_off=CURVE, robustness=CASES, table=table, created=WHEN) == html


def test_an_unstable_design_is_reported_as_such_without_figures_it_cannot_have(unstable_design):
    page = Page(report_html(unstable_design))
    assert page.tags["svg"] == 1
    assert "The loop is unstable under these gains" in page.words
    assert "10 of 10 requirements missed" in page.words


def test_a_rate_without_filter_is_reported_by_its_roots_and_not_called_unstable():
    problem = load_problem("report_1975")
    page = Page(report_html(given(problem, problem.approved.with_values(tau_h=0.0, tau_hp=0.0))))
    assert "a gap's rate is taken without a filter" in page.words.lower()
    assert "The loop is unstable" not in page.words


def test_a_problem_of_heave_alone_shows_what_it_looks_at_and_no_more(heave_design):
    page = Page(report_html(heave_design))
    labels = [v for tag, k, v in page.attributes if (tag, k) == ("svg", "aria-label")]
    assert [label.rsplit(" of ", 1)[1] for label in labels[1:]] == ["acceleration_z", "gap", "current", "heave"]
    assert "lateral acceleration" not in page.words


def test_a_missed_requirement_is_said_first(design):
    first, *rest = design.requirements
    missed = replace(first, limit=0.5, met=False)
    page = Page(report_html(replace(design, verdicts=(missed, *rest))))
    assert "1 of 11 requirements missed" in page.words
    assert "damping ratio ≥ 0.5 0.4004 125 % missed" in page.words


def test_text_from_files_cannot_become_markup(design):
    evil = '<script>alert("x")</script><b>'
    problem = replace(design.problem, title=evil, name=evil, sources={evil: evil})
    page = Page(report_html(replace(design, problem=problem), robustness={evil: {evil: 1.0}}))
    assert "script" not in page.tags
    assert page.words.count('<script>alert("x")</script>') >= 5


def test_a_table_of_other_gains_is_refused(design, table):
    other = replace(design, values={**design.values, "K_h": -1.0})
    with pytest.raises(InputError, match="the gain table must hold the design's gains"):
        report_html(other, table=table)


def test_a_report_is_whole_and_small(design):
    text = report_html(design)
    assert text.startswith("<!DOCTYPE html>")
    assert text.endswith("</html>\n")
    assert len(text) < 600_000  # fits an e-mail

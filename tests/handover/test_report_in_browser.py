"""The report in headless Chromium: it opens in silence, its figures stand, a picked point shows its gains."""

import shutil

import pytest

from workbench.design.tradeoff import TradeOff
from workbench.handover.report.report import report_html

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on PATH (Debian: apt-get install chromium)"),
]


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as player:
        chromium = player.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        yield chromium
        chromium.close()


@pytest.fixture(scope="module")
def report(design, table, tmp_path_factory):
    gains = design.gains
    curve = TradeOff(
        quantity="peak sensitivity", unit="1", limits=(2.4, 2.0, 1.9), costs=(22.0, 23.5, 25.0),
        gains=(gains.with_values(K_h=-0.777), gains, gains),
    )  # fmt: skip
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_text(report_html(design, trade_off=curve, table=table), encoding="utf-8")
    return path


def opened(browser, report, **view):
    said = []
    page = browser.new_page(**view)
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: said.append(request.url) if not request.url.startswith("file:") else None)
    page.goto(report.as_uri())
    return page, said


def test_it_opens_without_a_word_on_the_console_and_asks_for_nothing(browser, report):
    page, said = opened(browser, report)
    assert said == []
    figures = page.locator("figure svg")
    assert figures.count() == 9  # roots, trade-off, five spectra, two groups of loops
    for k in range(figures.count()):
        box = figures.nth(k).bounding_box()
        assert box["width"] > 200
        assert box["height"] > 100


def test_a_picked_point_shows_its_gains_with_mouse_and_with_keyboard(browser, report):
    page, said = opened(browser, report)
    first = page.locator("#trade-off-pick-0")
    assert not first.is_visible()
    page.locator('figure svg a[*|href="#trade-off-pick-0"]').first.click(force=True)
    assert first.is_visible()
    assert "-0.777" in first.inner_text()
    page.locator('.picks p a[href="#trade-off-pick-1"]').focus()
    page.keyboard.press("Enter")
    assert page.locator("#trade-off-pick-1").is_visible()
    assert not first.is_visible()
    assert said == []


@pytest.mark.parametrize("width", [360, 1280])
def test_nothing_sticks_out_of_the_page_on_phone_and_desk(browser, report, width):
    page, _ = opened(browser, report, viewport={"width": width, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_dark_rooms_get_a_dark_page_and_paper_a_light_one(browser, report):
    shade = "getComputedStyle(document.body).backgroundColor"
    page, _ = opened(browser, report, color_scheme="dark")
    dark = page.evaluate(shade)
    page.emulate_media(media="print")
    paper = page.evaluate(shade)
    numbers = [sum(int(part) for part in colour.strip("rgb()").split(",")[:3]) for colour in (dark, paper)]
    assert numbers[0] < 150
    assert numbers[1] == 3 * 255

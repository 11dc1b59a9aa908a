"""The panel without a browser: sliders move the session, refusals are shown, pictures are pictures."""

import asyncio
import math
import struct

import pytest

from workbench.explore import Session, explore
from workbench.explore.panel import REST
from workbench.files.problem import load_problem


@pytest.fixture(scope="module")
def problem():
    return load_problem("heave")


@pytest.fixture
def panel(problem):
    return explore(problem)


def press(panel, label):
    panel.buttons[label].click()


def test_every_one_of_the_seventeen_and_the_operating_point_have_a_slider(panel):
    from workbench.control import GAIN_NAMES

    assert set(panel.sliders) == {*GAIN_NAMES, "mass", "current_force", "gap_force"}


def test_a_moved_slider_moves_gains_verdict_and_picture(panel):
    before = panel.image.value
    panel.sliders["K_zdot"].value *= 0.5
    assert panel.session.gains.K_zdot == panel.sliders["K_zdot"].value
    assert panel.image.value != before
    assert "not every requirement met" in panel.verdict.value


def test_margins_and_failures_stand_when_the_sliders_have_come_to_rest(panel):
    assert panel.first.value == ""  # nobody runs an event loop here
    panel.settle()
    assert "Margins, one point broken at a time" in panel.first.value
    assert "least damping under a change" in panel.smallest.value
    shown = panel.smallest.value
    panel.sliders["K_zdot"].value *= 0.5
    assert "opacity" in panel.first.value  # those of another position are faint
    panel.settle()
    assert "opacity" not in panel.first.value
    assert panel.smallest.value != shown


def test_in_an_event_loop_the_panel_settles_by_itself_after_the_last_move(panel):
    async def moved():
        panel.sliders["K_zdot"].value *= 0.9
        at_once = panel.first.value
        await asyncio.sleep(2 * REST)
        return at_once, panel.first.value

    at_once, later = asyncio.run(moved())
    assert "Margins" not in at_once
    assert "Margins" in later


def test_a_move_judges_the_nominal_loop_and_leaves_reserves_for_later():
    session = Session(load_problem("revenue_vehicle"))
    session.move("K_h", 1.01 * session.gains.K_h)
    shot = session.snapshot
    assert not shot.complete
    assert {"reserves", "reserve_verdicts"}.isdisjoint(shot.__dict__)
    quick = len(shot.asked)
    assert quick < len(session.problem.requirements)
    _ = shot.reserve_verdicts
    assert shot.complete
    assert len(shot.asked) >= len(session.problem.requirements)


def test_the_picture_is_a_png_of_the_stated_size(panel):
    width, height = struct.unpack(">II", panel.image.value[16:24])
    assert bytes(panel.image.value).startswith(b"\x89PNG")
    assert width > 900
    assert height > 500


def test_undo_and_approved_gains_put_the_sliders_back(panel, problem):
    panel.sliders["K_h"].value *= 1.5
    press(panel, "undo")
    assert panel.sliders["K_h"].value == pytest.approx(problem.gains.K_h, rel=1e-12)  # a float in a traitlet
    panel.sliders["K_zddot"].value *= 0.9
    press(panel, "approved gains")
    assert panel.session.gains == problem.gains


@pytest.mark.slow
def test_a_pinned_design_is_listed_compared_and_drawn_behind(panel):
    panel.name.value = "mine"
    press(panel, "pin this design")
    assert "pinned as mine" in panel.verdict.value
    alone = panel.image.value
    panel.behind.value = "mine"
    panel.sliders["K_zdot"].value *= 0.9
    assert ">mine</th>" in panel.table.value
    assert panel.image.value != alone
    press(panel, "unpin")
    assert panel.behind.value == "–"


def test_a_refusal_is_a_sentence_in_the_panel_and_not_a_traceback(panel, tmp_path):
    panel.sliders["mass"].value = 1.1
    press(panel, "export table")
    assert "must be of the nominal operating point" in panel.verdict.value
    panel.name.value = "nobody"
    press(panel, "unpin")
    assert "unknown pinned design" in panel.verdict.value


def test_the_table_button_writes_the_file_named(panel, tmp_path):
    panel.file.value = str(tmp_path / "mine.json")
    press(panel, "export table")
    assert (tmp_path / "mine.json").exists()
    assert "wrote" in panel.verdict.value


@pytest.mark.slow
def test_a_panel_opened_again_on_its_state_file_goes_on_where_it_was(problem, tmp_path):
    first = explore(problem, state=tmp_path / "state.json")
    first.sliders["K_h"].value *= 1.2
    press(first, "pin this design")
    second = explore(problem, state=tmp_path / "state.json")
    assert second.session.to_dict() == first.session.to_dict()
    assert second.sliders["K_h"].value == first.sliders["K_h"].value


def test_a_title_with_markup_is_shown_as_text(problem):
    from dataclasses import replace

    evil = explore(replace(problem, title="<script>alert(1)</script>"))
    assert "<script>" not in evil.verdict.value


def page_echo(slider):
    """The value with which the page answers a slider that was set: rounded to its step from its lowest value."""
    if hasattr(slider, "base"):
        steps = math.floor((math.log10(slider.value) - slider.min) / slider.step + 0.5)
        return 10 ** (slider.min + steps * slider.step)
    return slider.min + slider.step * math.floor((slider.value - slider.min) / slider.step + 0.5)


def test_the_values_a_page_rounds_and_sends_back_do_not_become_the_design(panel, problem):
    panel.sliders["K_zdot"].value *= 0.97
    press(panel, "optimise from here")
    found, undone = panel.session.gains, len(panel.session.past)
    assert panel.session.snapshot.met
    echoes = {name: page_echo(slider) for name, slider in panel.sliders.items()}
    for name, value in echoes.items():
        panel.sliders[name].value = value
    assert panel.session.gains == found  # to the last digit, though
    shown = {name: value for name, value in echoes.items() if name in found.as_dict()}
    assert {**found.as_dict(), **shown} != found.as_dict()  # the page's own values are others
    assert len(panel.session.past) == undone
    press(panel, "undo")
    press(panel, "undo")
    assert panel.session.gains == problem.gains


def test_one_step_of_a_slider_is_a_move(panel):
    for name in ("K_h", "tau_h", "K_zddot"):
        slider, before = panel.sliders[name], getattr(panel.session.gains, name)
        factor = slider.base**slider.step if hasattr(slider, "base") else None
        slider.value = slider.value * factor if factor else slider.value + slider.step
        assert getattr(panel.session.gains, name) == slider.value != before

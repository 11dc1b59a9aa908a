"""The panel without a browser: sliders move the session, refusals are shown, pictures are pictures."""

import struct

import pytest

from workbench.explore import explore
from workbench.export.problem import load_problem


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

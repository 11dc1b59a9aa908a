"""No text from a file steers the terminal: tables, sentences, JSON and progress show escapes as escapes."""

import json
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.commands.output import emit_json, emit_table, say
from workbench.machine.terminal import HIDDEN, printable

NASTY = {
    "hides what follows": "heave\x1b[8m",
    "sets the window's title": "\x1b]0;owned\x07",
    "is a C1 control": "\x9b8m",
    "deletes": "abc\b\b\bxyz\x7f",
    "returns to the line's start": "fails\rholds",
    "reads backwards": "\u202edevorp\u2066",
    "is a half of a character": "\ud800",
    "makes a row of its own": "x\n  everything proved   yes",
    "makes a line of its own": "x\u2028y\u2029z\x85",
    "is a zero byte": "a\0b",
}


@pytest.mark.parametrize("text", NASTY.values(), ids=NASTY)
def test_a_nasty_text_is_shown_and_not_obeyed(capsys, text):
    emit_table(text, ("a", text), [("b", text)])
    say(text.replace("\n", ""))
    out = capsys.readouterr().out
    assert not {c for c in out if c != "\n" and unicodedata.category(c) in HIDDEN}
    assert "everything proved   yes" not in [line.strip() for line in out.splitlines()]


@pytest.mark.parametrize("text", NASTY.values(), ids=NASTY)
def test_json_carries_a_nasty_text_unchanged_in_escapes(capsys, text):
    emit_json({"title": text, text: 1.0})
    out = capsys.readouterr().out
    assert json.loads(out) == {"title": text, text: 1.0}
    assert not {c for c in out if c != "\n" and unicodedata.category(c) in HIDDEN}


@given(st.text(st.characters(codec=None, exclude_categories=())))
def test_no_character_that_is_hidden_or_obeyed_passes(text):
    shown = printable(text)
    assert not {c for c in shown if unicodedata.category(c) in HIDDEN}
    shown.encode()


@pytest.mark.parametrize("text", ["K_ḣ, τ_h = 0.637 s ± 15 % … ²", "日本語", "", "no-break\u00a0space"])
def test_a_readable_text_stays_as_it_is(text):
    assert printable(text) == text


@pytest.mark.parametrize("text", [t for t in NASTY.values() if "\ud800" not in t and "\0" not in t])
def test_a_title_in_a_data_file_and_a_name_in_a_sentence_do_not_steer(command, changed_problem, text):
    folder = changed_problem('title = "', f"title = {json.dumps(text + ' ')[:-1]}")
    done = command("model", folder)
    assert done.code == 0, done
    assert not {c for c in done.out if c != "\n" and unicodedata.category(c) in HIDDEN}
    assert not {c for c in command("analyse", text).err if c != "\n" and unicodedata.category(c) in HIDDEN}

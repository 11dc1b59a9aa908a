"""Work in a process of its own ends in time, tells what it found, and passes on what it refuses."""

from time import monotonic

import pytest

from workbench.commands.guard import guarded
from workbench.errors import InputError


def test_what_the_work_says_arrives_in_order():
    heard = []
    assert guarded(lambda say: [say({"k": k}) for k in range(3)] and None, monotonic() + 60, heard.append)
    assert heard == [{"k": 0}, {"k": 1}, {"k": 2}]


def test_work_without_end_is_ended_and_what_it_said_stands():
    def endless(say):
        say({"found": 1})
        while True:
            pass

    heard = []
    assert not guarded(endless, monotonic() + 0.3, heard.append)
    assert heard == [{"found": 1}]


def test_a_refusal_and_a_defect_come_back_as_what_they_are():
    def refusing(say):
        raise InputError("the table must be one; it is none. Give one.")

    def broken(say):
        raise KeyError("lost")

    with pytest.raises(InputError, match="the table must be one"):
        guarded(refusing, monotonic() + 60, lambda message: None)
    with pytest.raises(RuntimeError, match="KeyError: 'lost'"):
        guarded(broken, monotonic() + 60, lambda message: None)


def test_work_that_ends_without_a_word_is_told_from_work_that_is_done():
    import os

    assert not guarded(lambda say: os._exit(9), monotonic() + 60, lambda message: None)

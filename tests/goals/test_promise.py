"""A promise is typed, speaks of named signals, and rounds to the side on which it holds."""

import math

import pytest

from workbench.errors import InputError
from workbench.goals.promise import Promise, Subject, kept_limit


def test_a_promise_reads_as_a_phrase():
    subject = Subject(points="torque", openings=("angle",), models=("light", "heavy"))
    assert (
        Promise("peak sensitivity", "<=", 2, subject).name
        == "peak sensitivity at torque with angle open of light, heavy"
    )


def test_a_record_holds_only_what_says_something():
    promise = Promise("peak gain", "<=", 3.0, Subject(inputs="r", outputs="y", band=(0, math.inf)))
    assert promise.to_dict() == {
        "kind": "peak gain", "sense": "<=", "limit": 3.0, "subject": {"inputs": ["r"], "outputs": ["y"]}
    }  # fmt: skip


def test_a_limit_that_is_not_reached_is_replaced_by_what_is():
    assert kept_limit(2.0, 1.9, "<=") == 2.0
    assert kept_limit(2.0, 2.3456, "<=") == 2.35
    assert kept_limit(0.5, 0.45678, ">=") == 0.456
    assert kept_limit(2.0, math.inf, "<=") is None
    assert kept_limit(1e-9, 0.1, "<=") >= 0.1


@pytest.mark.parametrize(("sense", "limit"), [("<", 1.0), ("<=", math.inf), ("<=", math.nan)])
def test_a_promise_without_a_limit_is_refused(sense, limit):
    with pytest.raises(InputError, match="a promise's"):
        Promise("peak gain", sense, limit)

"""Nobody gets a false table past the checker: thousands of them, judged by a second evaluation in plain NumPy."""

import json

import numpy as np
import pytest
from adversary import drawn, holds, kept, of_keys, of_numbers, of_promises
from plain_loop import PlainLoop

from workbench.handover.table.table import digest_of
from workbench.verify.check import verify_document
from workbench.verify.exact.failure import TableError

FAST = 50  # mutations of the small table in the fast suite: a few seconds of processor
FAST_LARGE = 4
LARGE = 160


def accepted(document) -> bool:
    try:
        return verify_document(document).proved
    except TableError:
        return False


def signed(text, mutate):
    document = json.loads(text)
    mutate(document)
    document["digest"] = digest_of(document)
    return document


def mutations_of(document):
    return [*of_numbers(document), *of_promises(document), *of_keys(document)]


def passed_and_false(text, mutations):
    """Mutations that the checker lets pass and the second evaluation finds false; and how many it lets pass."""
    wrong, passed = [], 0
    for words, mutate in mutations:
        document = signed(text, mutate)
        if accepted(document):
            passed += 1
            false = holds(document, PlainLoop(document))
            wrong += [f"{words}: {', '.join(false)}"] if false else []
    return wrong, passed


@pytest.fixture(scope="module")
def small(heave):
    return json.dumps(heave.document)


@pytest.fixture(scope="module")
def large(revenue):
    return json.dumps(revenue.document)


@pytest.mark.parametrize("file", ["heave", "revenue"])
def test_a_second_evaluation_finds_every_promise_true(file, request):
    document = request.getfixturevalue(file).document
    loop = PlainLoop(document)
    for p in document["promises"]:
        # 1e-9: doubles, and the peak's bracket, which is that wide
        assert loop.value(p["name"]) == pytest.approx(p["enclosure"][0], rel=1e-9)


@pytest.mark.slow
def test_none_of_a_sample_of_false_tables_passes(small, large):
    for text, count in ((small, FAST), (large, FAST_LARGE)):
        wrong, _ = passed_and_false(text, drawn(mutations_of(json.loads(text)), count, seed=12))
        assert wrong == []


def test_tables_true_by_a_hair_pass(small):
    for words, mutate in kept(json.loads(small)):
        assert accepted(signed(small, mutate)), words


def test_every_promise_false_by_a_hair_is_refused(small):
    every = list(of_promises(json.loads(small)))
    assert len(every) > 60
    some = drawn(every, 40, seed=7)  # the slow test takes them all
    assert [words for words, mutate in some if accepted(signed(small, mutate))] == []


def test_every_gain_and_every_number_of_the_certificate_a_hair_off_is_refused_unless_no_promise_changes(small):
    parts = ("gains", "law", "certificate")
    every = [m for m in of_numbers(json.loads(small)) if m[0].startswith(parts)]
    assert len(every) > 60
    passed = {words for words, mutate in drawn(every, 25, seed=3) if accepted(signed(small, mutate))}
    for words, mutate in every:
        if words in passed:
            document = signed(small, mutate)
            assert holds(document, PlainLoop(document)) == [], words


@pytest.mark.slow
def test_none_of_two_thousand_false_tables_passes(small, large):
    every = mutations_of(json.loads(small))
    some = drawn(mutations_of(json.loads(large)), LARGE, seed=1)
    assert len(every) + len(some) > 2000
    assert [words for words, mutate in of_promises(json.loads(small)) if accepted(signed(small, mutate))] == []
    wrong, passed = passed_and_false(small, every)
    more, _ = passed_and_false(large, some)
    assert wrong + more == []
    assert passed < 0.3 * len(every)  # of gains that steer what is held, titles and the like


@pytest.mark.slow
def test_tables_of_all_motions_true_by_a_hair_pass(large):
    for words, mutate in kept(json.loads(large)):
        assert accepted(signed(large, mutate)), words


@pytest.mark.slow
def test_random_gains_are_accepted_only_with_promises_that_a_second_evaluation_confirms(small):
    generator = np.random.default_rng(5)
    for _ in range(60):
        factor = {k: float(np.exp(generator.normal(0, 0.2))) for k in json.loads(small)["gains"]}

        def other(document, factor=factor):
            document["gains"] = {k: repr(float(v) * factor[k]) for k, v in document["gains"].items()}
            document["measured"], document["robustness"], document["requirements"] = {}, {}, []

        document = signed(small, other)
        loop = PlainLoop(document)
        for finding in verify_document(document).findings:
            if finding.proved is not None:
                assert loop.value(finding.name) == pytest.approx(finding.proved[0], rel=1e-8), finding.name

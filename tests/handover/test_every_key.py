"""Every key of a data file does what it says: two files that differ in it alone, and what must change.

The keys come from the schema; one without a statement in `key_statements` fails here.
"""

import copy
import json
import re
import tomllib
from functools import cache
from typing import Any

import numpy as np
import pytest
from key_figures import Seen, every_key
from key_statements import STATEMENTS, Pair

from workbench.errors import InfeasibleError, InputError
from workbench.files.problem import load_problem, shipped_problems

KEYS = sorted(set(every_key()))
SOURCES = [key for key in KEYS if key.endswith(".source")]
ROUNDING = 1e-9  # relative: what two ways to the same number may differ by


@cache
def shipped(base: str) -> dict:
    return tomllib.loads((shipped_problems()[base] / "data.toml").read_text())


def changed(mapping: dict, key: str, value: Any) -> dict:
    """The mapping with one key changed; a table that is not there comes with a source; None takes the key away."""
    out = copy.deepcopy(mapping)
    *way, last = re.sub(r"\[\w+\]", "", key).split(".")
    at = out
    for step in way:
        if isinstance(at.get(step), list):
            at[step] = value
            return out
        at = at.setdefault(step, {} if step == "limits" else {"source": "of a test"})
    if value is None:
        at.pop(last, None)
    else:
        at[last] = value
    return out


def pair_of(key: str, pair: Pair) -> tuple[dict, dict]:
    first = shipped(pair.base)
    for name, value in pair.also.items():
        first = changed(first, name, value)
    kind = re.match(r"(\w+)\[\w+\]\.kind$", key)
    whole = kind and isinstance(pair.value, dict)
    if key.startswith("bounds."):
        first = changed(first, "bounds", None)
    second = changed(first, kind.group(1) if whole else key, pair.value)
    if key.startswith("bounds."):
        second = changed(second, key.replace("bounds", "fixed"), None)
    return first, second


def same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.shape == b.shape and np.allclose(a, b, rtol=ROUNDING, atol=ROUNDING * np.abs(a).max(initial=0))
    if isinstance(a, float) and isinstance(b, float):
        return a == b or abs(a - b) <= ROUNDING * max(abs(a), abs(b))
    return type(a) is type(b) and a == b


@cache
def first_of(base: str, text: str) -> Seen:
    """What many pairs have in common, seen once."""
    return Seen(json.loads(text), approved(base))


@cache
def approved(base: str):
    return load_problem(base).approved


def test_every_key_has_a_statement_and_every_statement_a_key():
    # blocks [[goal]] have the keys of their kinds: tests/goals/test_reserve_goals.py
    assert set(KEYS) - set(SOURCES) - {"goal"} == set(STATEMENTS)


@pytest.mark.parametrize(
    "key", [pytest.param(k, marks=pytest.mark.slow if s.slow else ()) for k, s in sorted(STATEMENTS.items())]
)
def test_a_key_moves_what_it_is_for_and_nothing_that_it_is_not(key):
    pair = STATEMENTS[key]
    first, second = pair_of(key, pair)
    one = first_of(pair.base, json.dumps(first))
    if pair.refused:
        with pytest.raises((InputError, InfeasibleError), match=pair.refused):
            Seen(second, approved(pair.base)).document  # noqa: B018
        return
    other = Seen(second, approved(pair.base))
    for name in pair.moves:
        assert not same(one[name], other[name]), f"{name} stays {one[name]}"
    for name in pair.keeps:
        assert same(one[name], other[name]), f"{name} moves from {one[name]} to {other[name]}"
    for name, factor in pair.scales.items():
        assert other[name] == pytest.approx(factor * one[name], rel=1e-7), name
    assert pair.moves or pair.keeps or pair.scales


@pytest.mark.parametrize("block", sorted({re.sub(r"\[\w+\]", "", key).split(".")[0] for key in SOURCES}))
def test_the_source_of_a_table_is_kept_beside_the_problem_and_changes_nothing_else(block):
    mapping = changed(shipped("heave"), "requirements.source", "of a test")
    extra = {"motor": "hybrid_motor", "schedule": "scheduled_vehicle", "variation": "robust_vehicle"}
    if block not in mapping:
        base = extra.get(block, "heave")
        mapping = copy.deepcopy(shipped(base))
        mapping.setdefault(block, [{"name": "one", "source": "x y z"}] if block == "model" else {"source": "x y z"})
        if block == "points":
            mapping[block]["places"] = {"seat": [1.0, 0.0, 0.0]}
    other = copy.deepcopy(mapping)
    (other[block][0] if block == "model" else other[block])["source"] = "somebody else said so"
    one, two = Seen(mapping, approved("heave")), Seen(other, approved("heave"))
    assert one.source(block) != two.source(block) == "somebody else said so"
    assert same(one["plant"], two["plant"])


@pytest.mark.parametrize(
    ("base", "key", "value", "sentence"),
    [
        ("heave", "vehicle.gap_minimum_m", 0.2, "is of a force law from coils"),
        ("comfort_limit", "operating_point.side_force_above_cg_m", 0.5, "need side_force_n, the force itself"),
        ("comfort_limit", "operating_point.side_force_ahead_of_cg_m", 0.5, "need side_force_n, the force itself"),
        ("comfort_limit", "operating_point.lost_share", 0.5, "lost_share needs lost_set"),
    ],
)
def test_a_key_that_nothing_could_be_done_with_is_refused(base, key, value, sentence):
    with pytest.raises(InputError, match=sentence):
        Seen(changed(shipped(base), key, value), approved(base))

"""Tables that are false by a hair, and true by a hair: every promise, every field, every key of a table.

document --mutations--> (what was done, how) … --signed--> a table that somebody could have written
"""

import copy
import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

HAIR = 1e-6
STATED = 3e-6  # of figures that only have to agree to 1e-6
DECIMAL = re.compile(r"-?\d+(\.\d+)?([eE][-+]?\d+)?")
Path = tuple[Any, ...]
Mutation = tuple[str, Callable[[dict], None]]


def leaves(node: Any, at: Path = ()) -> Iterator[tuple[Path, Any]]:
    """Every entry that is no mapping and no list, with its place."""
    if isinstance(node, dict | list):
        for key, one in node.items() if isinstance(node, dict) else enumerate(node):
            yield from leaves(one, (*at, key))
    else:
        yield at, node


def mappings(node: Any, at: Path = ()) -> Iterator[Path]:
    """Place of every mapping."""
    if isinstance(node, dict):
        yield at
    if isinstance(node, dict | list):
        for key, one in node.items() if isinstance(node, dict) else enumerate(node):
            yield from mappings(one, (*at, key))


def inner(document: Any, at: Path) -> Any:
    for key in at:
        document = document[key]
    return document


def put(at: Path, value: Any) -> Callable[[dict], None]:
    def change(document):
        inner(document, at[:-1])[at[-1]] = value

    return change


def of_numbers(document: dict) -> Iterator[Mutation]:
    """Every number moved by a hair: decimals, figures, limits; zeros of matrices by a millionth of their row."""
    for at, value in leaves(document):
        if at[0] in ("digest", "data_sha256", "versions", "created", "format", "version", "seed", "starts"):
            continue
        name = ".".join(map(str, at))
        if isinstance(value, str) and DECIMAL.fullmatch(value):
            if float(value) == 0 and at[0] == "plant":
                row = max(abs(float(v)) for v in inner(document, at[:-1]))
                yield f"{name} from zero", put(at, repr(HAIR * (row or 1.0)))
            elif float(value) == 0:
                yield f"{name} from zero", put(at, repr(HAIR))
            else:
                yield f"{name} moved", put(at, repr(float(value) * (1 + HAIR)))
                if at[0] != "plant":
                    yield f"{name} turned", put(at, repr(-float(value)))
        elif isinstance(value, float) and not isinstance(value, bool):
            yield f"{name} moved", put(at, value * (1 + STATED) if value else STATED)
        elif isinstance(value, bool):
            yield f"{name} turned", put(at, not value)


def of_promises(document: dict) -> Iterator[Mutation]:
    """Every promise of the plant: a limit beyond the truth by a hair, an interval beside it, twice, by other names."""
    for i, promise in enumerate(document["promises"]):
        low, high = promise["enclosure"]
        upper, name = promise["sense"] == "<=", f"promise {promise['name']}"
        beyond = low * (1 - HAIR) if upper else high * (1 + HAIR)

        def limited(d, i=i, beyond=beyond, promise=promise):
            d["promises"][i]["limit"] = beyond
            d["requirements"] = [r for r in d["requirements"] if not promise["name"].startswith(r["name"])]

        yield f"{name}: limit beyond", limited
        yield f"{name}: interval above", put(("promises", i, "enclosure"), [high * (1 + HAIR), high * (1 + 2 * HAIR)])
        yield f"{name}: interval below", put(("promises", i, "enclosure"), [low * (1 - 2 * HAIR), low * (1 - HAIR)])
        yield f"{name}: other sense", put(("promises", i, "sense"), ">=" if upper else "<=")
        if "uniform" not in promise["name"]:  # no requirement asks for it: left out, the answer says so
            yield f"{name}: left out", lambda d, i=i: d["promises"].pop(i)
        yield (
            f"{name}: floating and wrong",
            lambda d, i=i, high=high: d["promises"][i].update(
                method="floating point: mine", enclosure=[high * (1 + 3 * HAIR)] * 2
            ),
        )

        def hidden(d, i=i, beyond=beyond):
            d["promises"].append(copy.deepcopy(d["promises"][i]) | {"limit": beyond})

        yield f"{name}: twice", hidden
        for other in document["promises"]:
            if other["name"] != promise["name"]:
                yield f"{name} as {other['name']}", put(("promises", i, "name"), other["name"])


def of_keys(document: dict) -> Iterator[Mutation]:
    """Every mapping with a key too many and, but for free ones, a key too few."""
    for at in mappings(document):
        name = ".".join(map(str, at)) or "the table"
        if at and at[0] in ("measured", "robustness", "versions"):
            continue  # free: what is not known there is a statement of the author
        yield f"{name}: unknown key", lambda d, at=at: inner(d, at).update(sworn="yes")
        for key in inner(document, at):
            if (*at, key)[-1] not in ("digest", "at", "certificate", "schedule", "undecided"):
                yield f"{name}: without {key}", lambda d, at=at, key=key: inner(d, at).pop(key)


def kept(document: dict) -> Iterator[Mutation]:
    """Changes that leave every promise true: limits inside the truth by a hair, wider intervals, other words."""
    for i, promise in enumerate(document["promises"]):
        low, high = promise["enclosure"]
        upper, name = promise["sense"] == "<=", f"promise {promise['name']}"
        inside = high * (1 + HAIR) if upper else low * (1 - HAIR)

        def limited(d, i=i, inside=inside, promise=promise):
            d["promises"][i]["limit"] = inside
            d["requirements"] = [r for r in d["requirements"] if not promise["name"].startswith(r["name"])]

        yield f"{name}: limit inside", limited
        yield f"{name}: wider", put(("promises", i, "enclosure"), [low * (1 - HAIR), high * (1 + HAIR)])
        yield f"{name}: floating", put(("promises", i, "method"), "floating point: mine")
    yield "another title", put(("title",), "another")
    yield "nothing measured", put(("measured",), {})
    yield "promises turned round", lambda d: d["promises"].reverse()


def holds(document: dict, loop) -> list[str]:
    """Names of the promises of the plant that a second evaluation finds false; doubles are right to 1e-8 at least."""
    false = []
    for p in document["promises"]:
        if p["box"]:
            continue
        value, slack = loop.value(p["name"]), 1e-8
        kept = value <= p["limit"] * (1 + slack) if p["sense"] == "<=" else value >= p["limit"] * (1 - slack)
        size = 2 * HAIR if p["method"].startswith("floating") else slack
        if not (kept and p["enclosure"][0] - size * value <= value <= p["enclosure"][1] + size * value):
            false.append(p["name"])
    return false


def drawn(mutations: list[Mutation], count: int, seed: int) -> list[Mutation]:
    """Some of many, the same on every machine."""
    chosen = np.random.default_rng(seed).choice(len(mutations), size=min(count, len(mutations)), replace=False)
    return [mutations[i] for i in sorted(chosen)]

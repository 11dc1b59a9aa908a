"""Whether a gain table is one of a problem, rebuilt from the problem's data.

    table, Problem --agreement--> data, plant, law, certificate, forces over speed: the problem's own
                              --> what must be promised: for the plant, over its variation, at every speed
                              --> figures derived again by the analysis

A requirement over a variation or a range of speeds is either promised over all of it or said to be undecided there.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.errors import InputError
from workbench.handover.table.certificate import SAME, certificate_of, force_difference
from workbench.lti import Plant
from workbench.result import Result, Row

AGREES = 1e-6  # relative: figures of the same algorithm on another machine agree to about 1e-9
NOTHING = 1e-9  # of the largest figure beside it: a computed zero
CHECKED_ELSEWHERE = {"poles", "loop_poles", "modes", "peak_sensitivity_bracket"}  # by the checker, from the table alone


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Agreement(Result):
    """Whether a gain table is one of a problem.

    plant_difference : largest difference of an entry, of the largest entry in its row; None if the signals differ
    force_difference : of a schedule, largest relative difference of the printed polynomials of the coil forces from the
        problem's, at 21 speeds; else None
    disagreements : one sentence for each thing that differs
    """

    problem: str
    data_sha256_ok: bool
    plant_difference: float | None
    disagreements: tuple[str, ...]
    force_difference: float | None = None

    @property
    def holds(self) -> bool:
        """Whether nothing differs."""
        return not self.disagreements

    def rows(self) -> list[Row]:
        """What was compared."""
        return [
            ("problem", self.problem, ""),
            ("data as in the table", self.data_sha256_ok, ""),
            ("largest difference of the plants", self.plant_difference, "of its row"),
            *(
                [("largest difference of the forces over speed", self.force_difference, "of the largest value")]
                if self.force_difference is not None
                else []
            ),
            *(("differs", sentence, "") for sentence in self.disagreements),
        ]


def agreement(document: dict[str, Any], problem, *, schedule: bool = True) -> Agreement:
    """A table's content (as `read_table(...).to_dict()` has it) held against a problem rebuilt from its data.

    schedule : whether a schedule that the problem asks for must be there; not for a table of one speed asked for
    """
    from workbench.handover.table.plant import VERSION as PLANTS
    from workbench.handover.table.plant_agreement import plant_agreement
    from workbench.handover.table.table import law_part

    ours, words = document["version"] == PLANTS, ("a vehicle", "a plant of one's own")
    if ours == problem.flies:
        raise InputError(
            f"the table must be of the kind that {problem.name!r} is; it is of {words[ours]}, the problem of "
            f"{words[not ours]}. Name the table's own problem."
        )
    if ours:
        return plant_agreement(document, problem)
    plant, sentences = problem.setting.plant, []
    same_data = document["data_sha256"] == problem.data_sha256
    if not same_data:
        sentences.append(
            f"the data of {problem.name!r} must be those the table was made from; their SHA-256 is "
            f"{problem.data_sha256[:12]}…, the table's {document['data_sha256'][:12]}…"
        )
    if document["title"] != problem.title:
        sentences.append(f"the title must be that of {problem.name!r}, {problem.title!r}; got {document['title']!r}")
    difference, place = _plant_difference(document["plant"], plant)
    if difference is None or not difference <= SAME:
        how = "their signals differ" if difference is None else f"{place} differs by {difference:.2g} of its row"
        sentences.append(f"the plant rebuilt from {problem.name!r} must be the table's to 1e-9; {how}")
    if not alike(document["law"], law_part(problem.law, problem.sample_time)):
        sentences.append(f"the control law's places and sample time must be those of {problem.name!r}; they differ")
    given = document.get("certificate")
    if given is not None:
        due = certificate_of(problem)
        wrong = [key for key, value in due.items() if not alike(given.get(key), value)]
        if wrong:
            sentences.append(f"the certificate must rest on the numbers of {problem.name!r}; {', '.join(wrong)} differ")
    sentences += _lacking(document, problem, schedule)
    off = None
    if same_data and difference is not None and difference <= SAME:
        forces = (document.get("schedule") or {}).get("forces")
        if forces:
            off, wrong = force_difference(forces, problem)
            if wrong:
                sentences.append(
                    f"the coil forces over speed must be those of {problem.name!r} as far as stated; {wrong}"
                )
        sentences += _figures(document, problem)
    return Agreement(
        problem=problem.name, data_sha256_ok=same_data, plant_difference=difference, disagreements=tuple(sentences),
        force_difference=off,
    )  # fmt: skip


def alike(one: Any, other: Any) -> bool:
    """The same structure, names and words; decimals the same to 1e-9, which is what another machine may change."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(alike(one[k], other[k]) for k in one)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(alike, one, other))
    if isinstance(one, str) and isinstance(other, str) and one != other:
        try:
            a, b = float(one), float(other)
        except ValueError:
            return False
        return abs(a - b) <= SAME * max(abs(a), abs(b))
    return type(one) is type(other) and one == other


def _lacking(document: dict[str, Any], problem, schedule: bool) -> list[str]:
    """What the problem requires and the table neither promises nor says to be undecided."""
    from workbench.verify.vehicle.kind import kind_of, promised_names

    groups, sentences = problem.setting.groups, []
    for where, intervals, requirements in _wherever(problem, schedule):
        for r in requirements:
            for name in promised_names(r.name, groups):
                asked = (name, r.sense, r.limit, intervals)
                if any(_covers(p, *asked) for p in document["promises"]):
                    continue
                if (intervals or kind_of(name) is None) and any(
                    _covers(u, *asked) for u in document.get("undecided", [])
                ):
                    continue
                sentences.append(
                    f"every requirement of {problem.name!r} must be promised{where}; {name!r} {r.sense} {r.limit:g} "
                    "is not"
                )
    return sentences


def _wherever(problem, schedule: bool) -> Iterator[tuple[str, Mapping[str, tuple[float, float]], Any]]:
    """Where what must hold: at the plant, over the variation, at every speed."""
    yield "", {}, problem.requirements
    if problem.variation is not None:
        words = " over its variation, or said to be undecided there"
        yield words, varied_box(problem.variation), problem.variation.asked(problem)
    if schedule and problem.plan is not None:
        yield " at every speed, or said to be undecided there", {"speed": problem.plan.range}, problem.plan.requirements


def varied_box(variation) -> dict[str, tuple[float, float]]:
    """The smallest box that holds a variation's own box, its named models and the nominal vehicle."""
    from workbench.design.variation import PARAMETERS

    box = dict(variation.box.intervals) if variation.box else {}
    for values in variation.models.values():
        for name, value in values.items():
            nominal = PARAMETERS[name][1]
            low, high = box.get(name, (value if nominal is None else nominal,) * 2)
            box[name] = (min(low, value), max(high, value))
    return {name: (float(low), float(high)) for name, (low, high) in box.items() if low < high}


def _covers(entry: dict[str, Any], name: str, sense: str, limit: float, intervals) -> bool:
    """Whether a promise (or what is undecided) is of this limit, over at least these intervals."""
    box = entry["box"]
    return (
        (entry["name"], entry["sense"], entry["limit"]) == (name, sense, limit)
        and bool(box) == bool(intervals)
        and all(k in box and box[k][0] <= low and high <= box[k][1] for k, (low, high) in intervals.items())
    )


def _figures(document: dict[str, Any], problem) -> list[str]:
    """What the analysis finds, and the cases of the robustness, against what the table states of them."""
    from workbench.analysis.analysis import analyse
    from workbench.control import Gains
    from workbench.design.robustness import robustness

    gains = Gains.from_mapping({name: float(text) for name, text in document["gains"].items()})
    found = analyse(problem.setting, gains, document["problem"]).to_dict()
    wrong = _judged(document, problem, gains)
    for key, stated in document["measured"].items():
        if key in found and key not in CHECKED_ELSEWHERE:
            wrong += _off(f"measured.{key}", stated, found[key])
    if document["robustness"].keys() & {"nominal"}:
        for case in robustness(problem, gains):
            stated = document["robustness"].get(case.name)
            if isinstance(stated, dict):
                wrong += _off(f"robustness.{case.name}", stated, case.to_dict())
    if not wrong:
        return []
    more = f" ({len(wrong) - 1} more)" if len(wrong) > 1 else ""
    return [f"figures must be what the analysis of {problem.name!r} finds to 1e-6; {wrong[0]}{more}"]


def _judged(document: dict[str, Any], problem, gains) -> list[str]:
    """What the problem's own goals find where the checker has no proof, against what the table states."""
    from workbench.goals.ride.flown import Flown

    loop, wrong = Flown(problem.setting, gains), []
    stated = {r["name"]: r for r in document["requirements"]}
    for goal in (r for r in problem.requirements if r.beside and r.name in stated):
        (verdict,) = goal.judge(loop)
        given = stated[goal.name]
        wrong += _off(f"requirements, {goal.name}", [given["value"], given["met"]], [verdict.value, verdict.met])
    return wrong


def _off(place: str, stated: Any, found: Any, size: float = 0.0) -> list[str]:
    """Sentences for figures that differ; size: of the largest figure beside."""
    if isinstance(stated, dict) and isinstance(found, dict):
        beside = max((abs(v) for v in found.values() if isinstance(v, float) and math.isfinite(v)), default=0.0)
        return [
            sentence for k, v in stated.items() if k in found for sentence in _off(f"{place}.{k}", v, found[k], beside)
        ]  # fmt: skip
    if isinstance(stated, list) and isinstance(found, list) and len(stated) == len(found):
        return [sentence for a, b in zip(stated, found, strict=True) for sentence in _off(place, a, b, size)]
    if isinstance(stated, int | float) and isinstance(found, int | float) and not isinstance(found, bool):
        slack = AGREES * max(abs(stated), abs(found)) + NOTHING * size
        return [] if abs(stated - found) <= slack else [f"{place} is stated as {stated:.9g}, found {found:.9g}"]
    return [] if stated == found else [f"{place} is stated as {str(stated)[:40]}, found {str(found)[:40]}"]


def _plant_difference(printed: dict[str, Any] | None, plant: Plant) -> tuple[float | None, str]:
    """Largest relative difference and its place."""
    names = {kind: tuple(printed[kind]) if printed else () for kind in ("states", "inputs", "outputs")}
    if printed is None or any(names[kind] != getattr(plant, kind) for kind in names):
        return None, ""
    worst, place = 0.0, ""
    for letter, row_kind, column_kind in (
        ("A", "states", "states"), ("B", "states", "inputs"), ("C", "outputs", "states"), ("D", "outputs", "inputs"),
    ):  # fmt: skip
        ours, theirs = getattr(plant, letter), np.array(printed[letter], float).reshape(getattr(plant, letter).shape)
        size = np.maximum(np.abs(ours), np.abs(theirs)).max(axis=1, keepdims=True, initial=0.0)
        off = np.abs(ours - theirs) / np.where(size > 0, size, 1.0)
        i, j = np.unravel_index(int(np.argmax(off)), off.shape)
        if off[i, j] > worst:
            worst, place = float(off[i, j]), f"{letter}({names[row_kind][i]}, {names[column_kind][j]})"
    return worst, place

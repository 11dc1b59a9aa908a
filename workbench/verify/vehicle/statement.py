"""What a table states besides its promises: requirements, figures, cases. Derived again where the checker can.

    stated figure --the prover's enclosure of the same--> agrees to 1e-6, or a fault by name
    figure without a derivation here --> listed as a statement of the author that nobody proved

Figures were computed in doubles, so they may differ from the truth by what those leave: 1e-6 is ample, and no more.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from flint import acb, arb, fmpq

from workbench.verify.exact import pole
from workbench.verify.exact.deadline import check
from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.pole import ends as ends_of
from workbench.verify.exact.sensitivity import Peak
from workbench.verify.reading import entries_of, keyed, mapping, number
from workbench.verify.vehicle.kind import called, promised_names
from workbench.verify.vehicle.loop import closed_loop
from workbench.verify.vehicle.prover import Prover
from workbench.verify.vehicle.response import ends
from workbench.verify.vehicle.table import TYPES

AGREES = fmpq(1, 10**6)
EXACTLY = fmpq(0)
NOTHING = fmpq(1, 10**9)  # of the largest figure of its kind: a zero that was computed
PLACES = ("front", "rear")
CASE = re.compile(r"(mass|current force|vertical sensors|lateral sensors) ([−+])(\d{1,2}) %")
PROVENANCE = (
    "problem", "title", "data_sha256", "created", "versions", "seed", "solver", "starts", "invariance",
    "law.sample_time_s",
)  # fmt: skip


class Statements:
    """Compares; collects what does not hold and what nobody proved."""

    def __init__(self, prover: Prover) -> None:
        self.prover, self.table = prover, prover.table
        self.faults: list[str] = []
        self.unproved: list[str] = list(PROVENANCE)

    def agrees(self, place: str, stated: Any, low: fmpq, high: fmpq, near: fmpq = EXACTLY) -> None:
        """A figure lies in an enclosure, to a millionth; `near`: absolute slack besides."""
        value = None if stated is None else number(stated, place)
        slack = AGREES * max(abs(low), abs(high)) + near
        if value is None or not low - slack <= value <= high + slack:
            shown = "nothing" if value is None else f"{float(value):.9g}"
            self.faults.append(f"{place} is stated as {shown}; derived again it is {float((low + high) / 2):.9g}")

    def promises(self, methods: Mapping[int, str]) -> None:
        """How a promise says that it was found, where it is not how it is proved here; shares left open; speeds."""
        for i, promise in enumerate(self.table.promises):
            if promise.method != methods.get(i):
                self.unproved.append(f"promises.{i}.method")
        self.unproved += [f"undecided.{i}" for i, _ in enumerate(self.table.undecided)]
        schedule = self.table.schedule or {}
        self.unproved += ["schedule.points"] if schedule else []
        self.unproved += ["schedule.forces (at other speeds than the table's)"] if schedule.get("forces") else []

    def requirements(self, proved: Mapping[str, tuple[fmpq, fmpq]]) -> None:
        """Each requirement's value is that of its promise, and it is met if it says so."""
        seen: dict[str, int] = {}
        groups = self.table.certificate.groups if self.table.certificate else ()
        for i, r in enumerate(self.table.requirements):
            place = f"requirements.{i} ({r.name})"
            if r.where:
                self.unproved.append(f"{place}.where")
            names = promised_names(r.name, groups)
            turn = seen.get(r.name, 0)
            seen[r.name] = turn + 1
            if turn >= len(names):
                self.faults.append(f"{place} is listed more often than there are groups")
                continue
            own = [name for name in names if r.where.startswith(name.partition(", ")[2])] if len(names) > 1 else names
            if len(own) != 1:
                self.faults.append(f"{place} does not say of which group it is")
                continue
            kept = r.value is not None and (r.value <= r.limit if r.sense == "<=" else r.value >= r.limit)
            close = r.value is not None and abs(r.value - r.limit) <= AGREES * abs(r.limit)
            if r.met != kept and not (close and r.met):
                self.faults.append(f"{place} is said to be {'met' if r.met else 'not met'}; its value says otherwise")
            if own[0] in proved:
                self.agrees(f"{place}.value", None if r.value is None else float(r.value), *proved[own[0]])
            else:
                self.unproved.append(f"{place}.value")

    def measured(self) -> None:
        """Figures of the analysis."""
        given = self.table.measured
        done = {"problem": self._problem, "stable": self._stable, "poles": self._poles, "loop_poles": self._loop_poles,
                "modes": self._modes, "peak_sensitivity": self._peaks, "peak_sensitivity_bracket": self._brackets,
                "rms": self._rms, "by_type": self._by_type, "sum_alpha_squared": self._currents,
                "static_error": self._static, "sensor_noise_rms": self._noise, "peak_gap_change": self._change,
                "motor": self._motor}  # fmt: skip
        for key, value in given.items():
            check()
            place = f"measured.{key}"
            if key not in done or value is None:
                self.unproved.append(place)
                continue
            try:
                done[key](place, value)
            except NotProved as error:
                check()
                self.unproved.append(f"{place} ({error})")

    def _problem(self, place: str, value: Any) -> None:
        if value != self.table.problem:
            self.faults.append(f"{place} must be the table's problem, {self.table.problem[:40]!r}; it is another")

    @property
    def _groups(self) -> tuple[str, ...]:
        return self.prover.certificate.groups

    def _discs(self) -> list[acb]:
        return [disc for group in self._groups for disc in self.prover.poles(group)]

    def _stable(self, place: str, value: Any) -> None:
        if value is not pole.stable(self._discs()):
            self.faults.append(f"{place} is stated as {value!r}; derived again it is {value is False}")

    def _strays(self, pairs: Sequence[Any], place: str) -> list[int]:
        """Which stated poles are none of the loop's, or are stated more often than the loop has them."""
        left = [
            [disc, count] for g in self._groups for disc, count in pole.counted(self.prover.loop(g).A.charpoly())
        ]  # fmt: skip
        strays = []
        for i, pair in enumerate(pairs):
            at = acb(*(arb(number(v, place)) for v in entries_of(pair, place, 2, 2)))
            off = [(float(abs(at - disc).mid()), k) for k, (disc, count) in enumerate(left) if count]
            nearest = min(off)[1] if off else None
            if nearest is None or not _near(at, left[nearest][0]):
                strays.append(i)
            else:
                left[nearest][1] -= 1
        return strays

    def _poles(self, place: str, value: Any) -> None:
        """Each eigenvalue is stated once; each stated is one."""
        order = sum(self.prover.loop(group).A.nrows() for group in self._groups)
        pairs = entries_of(value, place, 500)
        if len(pairs) != order:
            self.faults.append(f"{place} must be all {order} eigenvalues; {len(pairs)} are stated")
        self._among_poles(place, pairs)

    def _loop_poles(self, place: str, value: Any) -> None:
        """Each stated is an eigenvalue; which of them the commands see is not derived."""
        self._among_poles(place, entries_of(value, place, 500))
        self.unproved.append(f"{place} (whether these are all)")

    def _among_poles(self, place: str, pairs: Sequence[Any]) -> None:
        self.faults += [f"{place}.{i} is no pole of the loop, or stated twice" for i in self._strays(pairs, place)]

    def _modes(self, place: str, value: Any) -> None:
        keys = ("name", "frequency_hz", "damping", "pole")
        modes = [keyed(mode, f"{place}.{i}", keys) for i, mode in enumerate(entries_of(value, place, 500))]
        strays = self._strays([m["pole"] for m in modes], place)
        for i, m in enumerate(modes):
            at = f"{place}.{i}"
            if i in strays:
                self.faults.append(f"{at}.pole is no pole of the loop, or stated twice")
                continue
            p = acb(*(arb(number(v, at)) for v in m["pole"]))
            self.agrees(f"{at}.frequency_hz", m["frequency_hz"], *ends_of(abs(p) / (2 * arb.pi())))
            self.agrees(f"{at}.damping", m["damping"], *ends_of(-p.real / abs(p)), NOTHING)
        self.unproved.append(f"{place} (names, and whether these are all)")

    def _of_groups(self, place: str, value: Any) -> Iterator[tuple[str, Any]]:
        """Entries of the table's groups; those of no group must be empty."""
        own = {called(group): group for group in self._groups}
        for name, one in mapping(value, place).items():
            if name in own:
                yield own[name], one
            elif one is not None:
                self.faults.append(f"{place}.{name[:40]} is stated, and the table has no such group")
        missing = [name for name in own if name not in value]
        if missing:
            self.faults.append(f"{place} must state {missing[0]!r}, a group of the table; it does not")

    def _peaks(self, place: str, value: Any) -> None:
        for group, one in self._of_groups(place, value):
            self._peak(f"{place}.{called(group)}", one, self.prover.peak(group))

    def _peak(self, place: str, stated: Any, peak: Peak) -> None:
        value = None if stated is None else number(stated, place)
        if value is None or not (
            value > 0 and peak.below(value * (1 + AGREES)) and not peak.below(value * (1 - AGREES))
        ):
            self.faults.append(f"{place} is stated as {stated!r}; the peak derived again lies elsewhere")

    def _brackets(self, place: str, value: Any) -> None:
        for group, one in self._of_groups(place, value):
            at = f"{place}.{called(group)}"
            bracket = keyed(one, at, ("lower", "upper", "frequency_hz"))
            low, high = (number(bracket[k], at) for k in ("lower", "upper"))
            peak = self.prover.peak(group)
            if not (0 < low <= high and peak.below(high * (1 + AGREES)) and not peak.below(low * (1 - AGREES))):
                self.faults.append(f"{at} is stated as {float(low):.9g} … {float(high):.9g}; the peak lies elsewhere")
            self.unproved.append(f"{at}.frequency_hz")

    def _rms(self, place: str, value: Any) -> None:
        for quantity, places in mapping(value, place).items():
            if quantity not in ("gap", "gap_lateral", "current"):
                self.unproved.append(f"{place}.{quantity[:40]}")
                continue
            for k, end in enumerate(PLACES):
                stated = keyed(places, f"{place}.{quantity}", PLACES)[end]
                if stated is not None:
                    square = self.prover.mean_square(self._output(quantity, k))
                    self.agrees(f"{place}.{quantity}.{end}", stated, *ends_of(pole.root(square)))

    def _output(self, quantity: str, end: int) -> str:
        return f"{quantity}_{ends(self.table.law)[end] + 1}"

    def _by_type(self, place: str, value: Any) -> None:
        for kind, quantities in keyed(value, place, TYPES).items():
            for quantity, places in mapping(quantities, f"{place}.{kind}").items():
                if quantity not in ("gap", "gap_lateral", "current"):
                    self.unproved.append(f"{place}.{kind}.{quantity[:40]}")
                    continue
                for k, end in enumerate(PLACES):
                    stated = keyed(places, f"{place}.{kind}.{quantity}", PLACES)[end]
                    if stated is not None:
                        name = self._output(quantity, k)
                        total = ends_of(pole.root(self.prover.mean_square(name)))[1]
                        square = self.prover.mean_square(name, kind)
                        at = f"{place}.{kind}.{quantity}.{end}"
                        self.agrees(at, stated, *ends_of(pole.root(square)), NOTHING * total)

    def _currents(self, place: str, value: Any) -> None:
        self.agrees(place, value, *ends_of(self.prover.sum_of_currents()))

    def _each(self, place: str, value: Any, derive) -> None:
        for kind, stated in mapping(value, place).items():
            try:
                if stated is not None and kind in ("gap", "gap_lateral", "current"):
                    self.agrees(f"{place}.{kind}", stated, *ends_of(derive(kind)))
                elif stated is not None:
                    self.unproved.append(f"{place}.{kind[:40]}")
            except NotProved as error:
                check()
                self.unproved.append(f"{place}.{kind} ({error})")

    def _static(self, place: str, value: Any) -> None:
        self._each(place, value, self.prover.static_error)

    def _noise(self, place: str, value: Any) -> None:
        self._each(place, value, lambda kind: pole.root(self.prover.largest_noise(kind)))

    def _change(self, place: str, value: Any) -> None:
        self._each(place, value, self.prover.peak_change)

    def _motor(self, place: str, value: Any) -> None:
        motor = self.prover.certificate.motor
        for key, stated in mapping(value, place).items():
            at = f"{place}.{key[:40]}"
            if key == "current_at_3_sigma":
                self.agrees(at, stated, *ends_of(self.prover.motor_current()))
            elif motor is not None and key in ("rated_current", "working_current"):
                self.agrees(at, stated, *([motor.rated if key == "rated_current" else motor.working] * 2))
            else:
                self.unproved.append(at)

    def cases(self) -> None:
        """The loop with another mass, other forces, other sensors: stable, damping, decay and peaks of each case."""
        for name, value in self.table.robustness.items():
            check()
            place, factor = f"robustness.{name[:60]}", _factors(name)
            if factor is None or not isinstance(value, dict):
                self.unproved.append(place)
                continue
            try:
                self._case(place, value, factor)
            except NotProved as error:
                check()
                self.unproved.append(f"{place} ({error})")

    def _case(self, place: str, value: Any, factor: dict[str, fmpq]) -> None:
        case = keyed(value, place, ("name", "stable", "damping", "decay", "peak_sensitivity"))
        if case["name"] != place.removeprefix("robustness."):
            self.faults.append(f"{place}.name must be the case's own; it is another")
        loops = {g: closed_loop(self.table, g, factor) if factor else self.prover.loop(g) for g in self._groups}
        discs = [d for g, loop in loops.items() for d in (pole.poles(loop.A) if factor else self.prover.poles(g))]
        steady = pole.stable(discs)
        if case["stable"] is not steady:
            self.faults.append(f"{place}.stable is stated as {case['stable']!r}; derived again it is {steady}")
            return
        moving = [d for d in discs if not d.imag.is_zero()]
        self.agrees(f"{place}.decay", case["decay"], *ends_of(pole.decay(discs)))
        oscillating = ends_of(pole.damping(moving)) if moving else (fmpq(1), fmpq(1))
        self.agrees(f"{place}.damping", case["damping"], *oscillating)
        for name, stated in mapping(case["peak_sensitivity"], place).items():
            group = next((g for g in loops if name in (g, called(g))), None)
            if group is None:
                self.faults.append(f"{place}.peak_sensitivity.{name[:40]} is of no group of the table")
            elif steady:
                loop = loops[group]
                peak = Peak(loop.sensitivity, loop.lengths) if factor else self.prover.peak(group)
                self._peak(f"{place}.peak_sensitivity.{name}", stated, peak)


def _near(stated: acb, disc: acb) -> bool:
    return bool(abs(stated - disc) <= arb(AGREES) * (abs(disc) + arb(NOTHING)))


def _factors(name: str) -> dict[str, fmpq] | None:
    """What a case changes, from its name; None for a case that the checker does not derive."""
    if name == "nominal":
        return {}
    found = CASE.fullmatch(name)
    if found is None:
        return None
    change = fmpq(int(found[3]), 100)
    return {found[1].replace(" ", "_"): 1 + (change if found[2] == "+" else -change)}

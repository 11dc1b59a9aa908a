"""Damping, decay and peak sensitivity of loops that are not the nominal one: varied, sampled, frozen at other gaps.

Source: guide, Definitions: Variations and losses; Sampled loop; Frozen loop at a gap offset.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from workbench.analysis import plant_reserves
from workbench.analysis.change import Change, chosen_changes
from workbench.analysis.frozen import HEAVE, SWAY, frozen
from workbench.analysis.sampled_cases import sampled_cases
from workbench.analysis.setting import Setting
from workbench.analysis.variations import PEAK_TOLERANCE, Closed, check_change, damping_of, listed
from workbench.control.structure.loop import Loop
from workbench.errors import InputError
from workbench.goals.elsewhere import Elsewhere, Sampling, damping_measure, decay_measure, linear, peak_measure
from workbench.goals.goal import Rows, some_names
from workbench.goals.key import Key
from workbench.goals.measure import Asked, Bound, Largest, Measure
from workbench.goals.promise import Promise, Subject
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Found
from workbench.goals.ride.reserve import Reserve, mirrored, told_apart_by_sides
from workbench.goals.variance import Variance
from workbench.goals.verdict import Verdict

USUAL = ("scale:*", "mass:*", "force:*")  # of a vehicle, where none are named; of another plant the sensors' scales
LARGEST_OFFSET = 10.0  # [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class Varied(Reserve):
    """One figure of the loop under variations, the worst one.

    variations : names such as "mass:0.85", "dead:gap_1"; "scale:*", "lost:*" for all that an analysis lists of a kind
    """

    of_roots = True

    variations: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.variations != ():
            object.__setattr__(self, "variations", some_names("variations", self.variations))
        Reserve.__post_init__(self)

    def looked_at(self) -> str:
        return ", ".join(self.variations) or "the usual ones"

    def check(self, problem: str, setting: Setting) -> None:
        Reserve.check(self, problem, setting)
        self.changes(setting)

    def changes(self, setting: Setting) -> tuple[Change, ...]:
        """Those of a vehicle."""
        return chosen_changes(self.variations or USUAL, listed(setting), lambda c: check_change(setting, c))

    def steered(self, point: Evaluated) -> list[Change]:
        """Those whose rows differ from another's."""
        kept = point.reserve.whole.chosen
        if self.variations not in kept:
            kept[self.variations] = told_apart_by_sides(point.setting, self.changes(point.setting))
        return kept[self.variations]

    def among(self, loop: Flown) -> list[tuple[str, Closed]]:
        """The variations looked at, and the loop under each."""
        return [(change.name, loop.changed(change)) for change in self.changes(loop.setting)]

    def bind(self, loop: Loop) -> Bound:
        """The goal on a loop of any plant."""
        each = (Elsewhere(self.measured(plant_reserves.changed(loop, c)), c.name) for c in self.changes_of(loop))
        return Bound(self, Largest(tuple(each)))

    def changes_of(self, loop: Loop) -> tuple[Change, ...]:
        """Those of a plant of one's own."""
        return chosen_changes(
            self.variations or USUAL[:1], plant_reserves.listed(loop), lambda c: plant_reserves.check_change(loop, c)
        )

    def promises_on(self, loop: Loop, verdict: Verdict) -> tuple[Promise, ...]:
        about = self.subject(loop)
        subjects = (replace(about, scaled=((c.target, c.factor),)) for c in self.changes_of(loop))
        return self.promises_of(self.proof, verdict, subjects)

    def subject(self, loop: Loop) -> Subject:
        """What a promise of the figure speaks of, besides the change."""
        return Subject()

    def measured(self, loop: Loop) -> Measure:
        """The figure of one loop: a number that is at most 1 where the limit is kept."""
        raise TypeError(f"{type(self).__name__} must define measured()")  # a defect of ours, not of the input


@dataclass(frozen=True, slots=True, kw_only=True)
class VariedDamping(Varied):
    """The damping ratio under every variation is at least this; a real root that grows counts −1."""

    kind, sense, unit, proof = "damping ratio under variations", ">=", "1", "damping ratio"
    keys = (Key("at_least", "limit"), Key("variations"))

    def asked(self) -> Asked:
        return linear(self)

    def measured(self, loop: Loop) -> Measure:
        return damping_measure(loop, self.limit, self.focus)

    def rows_of(self, point: Evaluated) -> Rows:
        at, asked = point.reserve, self.asked_at(point.back_off)
        return [(f"damping under {c.name}", *at.damping(at.whole.varied(c), asked)) for c in self.steered(point)]

    def found(self, loop: Flown) -> Found:
        return [min((damping_of(changed.poles), name) for name, changed in self.among(loop))]


@dataclass(frozen=True, slots=True, kw_only=True)
class VariedDecay(Varied):
    """The decay rate under every variation is at least this."""

    kind, sense, unit, proof = "decay rate under variations", ">=", "1/s", "decay rate"
    keys = (Key("at_least_per_s", "limit"), Key("variations"))

    def asked(self) -> Asked:
        return linear(self)

    def measured(self, loop: Loop) -> Measure:
        return decay_measure(loop, self.limit, self.focus)

    def rows_of(self, point: Evaluated) -> Rows:
        at, asked = point.reserve, self.asked_at(point.back_off)
        return [(f"decay under {c.name}", *at.damping(at.whole.varied(c), 0.0, asked)) for c in self.steered(point)]

    def found(self, loop: Flown) -> Found:
        return [min((changed.decay, name) for name, changed in self.among(loop))]


@dataclass(frozen=True, slots=True, kw_only=True)
class VariedPeak(Varied):
    """The peak sensitivity under every variation is at most this."""

    kind, sense, unit, proof = "peak sensitivity under variations", "<=", "1", "peak sensitivity"
    keys = (Key("at_most", "limit"), Key("variations"))

    def measured(self, loop: Loop) -> Measure:
        return peak_measure(loop, self.limit, self.focus)

    def subject(self, loop: Loop) -> Subject:
        return Subject(points=loop.commands)

    def rows_of(self, point: Evaluated) -> Rows:
        at, asked = point.reserve, self.asked_at(point.back_off)
        return [(f"peak sensitivity under {c.name}", *at.peak(at.whole.varied(c), asked)) for c in self.steered(point)]

    def found(self, loop: Flown) -> Found:
        among = self.among(loop)
        unstable = [name for name, changed in among if not changed.stable]
        if unstable:
            return [(None, f"{unstable[0]}, unstable")]
        peaks = ((name, changed.peaks(PEAK_TOLERANCE)) for name, changed in among)
        return [max((peak, name) for name, each in peaks for peak in each.values() if peak is not None)]


@dataclass(frozen=True, slots=True, kw_only=True)
class VariedRms(Varied):
    """The rms of outputs under white noise of unit density at inputs is at most this under every variation [1/√s].

    Outputs are as they are read: that of a scaled sensor is scaled. Of a plant of one's own; rms values of vehicles
    that differ are limits of models (`[[model]]`).
    """

    kind, sense, unit, proof = "rms under variations", "<=", "1/√s", "variance"
    keys = (Key("at_most", "limit"), Key("inputs"), Key("outputs"), Key("variations"))
    of_roots = False

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def __post_init__(self) -> None:
        for name in ("inputs", "outputs"):
            object.__setattr__(self, name, some_names(name, getattr(self, name)))
        Varied.__post_init__(self)

    def check(self, problem: str, setting: Setting) -> None:
        raise InputError(
            f"{self.name!r} is asked of plants of one's own; problem {problem!r} has a vehicle. State its models under "
            "[[model]] and the limits on their rms values under [variation]."
        )

    def measured(self, loop: Loop) -> Measure:
        return Variance(self.inputs, self.outputs, limit=self.limit).bind(loop).measure

    def subject(self, loop: Loop) -> Subject:
        return Subject(inputs=self.inputs, outputs=self.outputs)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampled(Reserve):
    """One figure of the loop as a computer runs it.

    sample_time : [s];  delay_samples : of computing, whole or a part
    """

    of_roots = True

    sample_time: float = 0.001
    delay_samples: float = 1.0

    def __post_init__(self) -> None:
        if not (0 < self.sample_time < float("inf") and 0 <= self.delay_samples <= 50):
            raise InputError(
                "a sampled loop must have a positive sample time and 0 … 50 samples of delay; got "
                f"{self.sample_time!r} s and {self.delay_samples!r}. Give sample_time_ms = 1.0, delay_samples = 1.0."
            )
        Reserve.__post_init__(self)

    def looked_at(self) -> str:
        return f"sampled at {1e3 * self.sample_time:g} ms with {self.delay_samples:g} of delay"

    def loops(self, point: Evaluated):
        """Of every group."""
        return point.reserve.whole.sampled(self.sample_time, self.delay_samples * self.sample_time)

    def case(self, loop: Flown):
        """The loop judged."""
        return sampled_cases(loop.setting, loop.gains, [(self.sample_time, self.delay_samples)])[0]

    @property
    def where(self) -> str:
        """For people."""
        return self.looked_at()

    def bind(self, loop: Loop) -> Bound:
        """The goal on a loop of any plant, its controller sampled by Tustin's rule."""
        found = plant_reserves.sampled(loop, self.sample_time, self.delay_samples)
        measure = self.measured(found)
        if found.sample_time != loop.sample_time:
            measure = Sampling(measure, self.sample_time)
        return Bound(self, Elsewhere(measure, self.where))

    def measured(self, loop: Loop) -> Measure:
        """The figure of the sampled loop: a number that is at most 1 where the limit is kept."""
        raise TypeError(f"{type(self).__name__} must define measured()")  # a defect of ours, not of the input


SAMPLED = (Key("sample_time_ms", "sample_time", factor=1e-3), Key("delay_samples"))


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledDamping(Sampled):
    """The damping ratio of ln(z)/T is at least this."""

    kind, sense, unit = "sampled damping ratio", ">=", "1"
    keys = (Key("at_least", "limit"), *SAMPLED)

    def asked(self) -> Asked:
        return linear(self)

    def measured(self, loop: Loop) -> Measure:
        return damping_measure(loop, self.limit, self.focus)

    def rows_of(self, point: Evaluated) -> Rows:
        return [(self.name, *point.reserve.damping(self.loops(point), self.asked_at(point.back_off)))]

    def found(self, loop: Flown) -> Found:
        return [(self.case(loop).damping, self.where)]


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledDecay(Sampled):
    """The decay rate of ln(z)/T is at least this."""

    kind, sense, unit = "sampled decay rate", ">=", "1/s"
    keys = (Key("at_least_per_s", "limit"), *SAMPLED)

    def asked(self) -> Asked:
        return linear(self)

    def measured(self, loop: Loop) -> Measure:
        return decay_measure(loop, self.limit, self.focus)

    def rows_of(self, point: Evaluated) -> Rows:
        return [(self.name, *point.reserve.damping(self.loops(point), 0.0, self.asked_at(point.back_off)))]

    def found(self, loop: Flown) -> Found:
        return [(self.case(loop).decay, self.where)]


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledPeak(Sampled):
    """The peak sensitivity of the sampled loop is at most this in every group."""

    kind, sense, unit = "sampled peak sensitivity", "<=", "1"
    keys = (Key("at_most", "limit"), *SAMPLED)

    def measured(self, loop: Loop) -> Measure:
        return peak_measure(loop, self.limit, self.focus)

    def rows_of(self, point: Evaluated) -> Rows:
        return [(self.name, *point.reserve.peak(self.loops(point), self.asked_at(point.back_off)))]

    def found(self, loop: Flown) -> Found:
        peaks = self.case(loop).peak_sensitivity
        if any(peak is None for peak in peaks.values()):
            return [(None, f"{self.where}, unstable")]
        return [max((peak, f"{group}, {self.where}") for group, peak in peaks.items() if peak is not None)]


@dataclass(frozen=True, slots=True, kw_only=True)
class FrozenDamping(Reserve):
    """The damping ratio frozen at every pair of gap offsets is at least this.

    heave, sway : offsets [m]
    """

    kind, sense, unit = "damping ratio at gap offsets", ">=", "1"
    keys = (Key("at_least", "limit"), Key("heave_m", "heave"), Key("sway_m", "sway"))
    of_roots = True

    heave: tuple[float, ...] = HEAVE
    sway: tuple[float, ...] = SWAY

    def __post_init__(self) -> None:
        for name in ("heave", "sway"):
            try:
                offsets = tuple(float(v) for v in getattr(self, name))
            except (TypeError, ValueError):
                offsets = ()
            if not offsets or not all(abs(v) < LARGEST_OFFSET for v in offsets):
                given = str(getattr(self, name))[:60]
                raise InputError(
                    f"{name} must be a list of offsets below {LARGEST_OFFSET:g} m; got {given!r}. "
                    f"Give {name}_m = [-0.1, 0.0, 0.1]."
                )
            object.__setattr__(self, name, offsets)
        Reserve.__post_init__(self)

    def looked_at(self) -> str:
        return f"heave {_span(self.heave)} m, sway {_span(self.sway)} m"

    def check(self, problem: str, setting: Setting) -> None:
        Reserve.check(self, problem, setting)
        if setting.offsets is None:
            raise InputError(
                f"{self.name!r} can be required only where the coils are known; problem {problem!r} has a plant alone. "
                "Give the vehicle."
            )

    def rows_of(self, point: Evaluated) -> Rows:
        asked, at = self.asked_at(point.back_off), point.reserve
        alike = mirrored(point.setting)
        sides = dict.fromkeys(abs(y) if alike else y for y in self.sway)
        found: Rows = []
        for h in self.heave:
            for y in sides:
                loops = at.whole.frozen(h, y)
                if loops:
                    found.append((f"damping at {h:+.2g} m, {y:+.2g} m", *at.damping(loops, asked)))
        return found

    def found(self, loop: Flown) -> Found:
        at = frozen(loop.setting, loop.gains, heave=self.heave, sway=self.sway)
        if not at:
            return [(None, "the printed coefficients are not those of the coils; give force_law.kind 'corner'")]
        lost = [f for f in at if f.damping is None]
        if lost:
            return [(None, f"no current carries the weight at {lost[0].heave:+g} m, {lost[0].sway:+g} m")]
        worst = min(at, key=lambda f: f.damping if f.damping is not None else 0.0)
        return [(worst.damping, f"heave {worst.heave:+g} m, sway {worst.sway:+g} m")]


def _span(values: Sequence[float]) -> str:
    return f"{min(values):g} … {max(values):g}"

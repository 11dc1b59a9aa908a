"""The figures of an analysis for many gains, and many vehicles, at a time.

    gains (b, 17), readings of the plant --close--> stacks of closed loops --modal--> poles, peaks, mean squares, errors

The same quantities as `analysis.analyse` by another route: partial fractions in place of Lyapunov equations, a pursued
grid in place of Hamiltonian eigenvalues. Rows for which this route is not good enough say so (`Figures.sound`), and the
caller analyses them one by one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from workbench.analysis.analysis import COST_POINTS, COST_SCALE, ENDS, PEAK_SIGMAS
from workbench.analysis.batch.closing import Closed, Closing, acting, unfiltered
from workbench.analysis.batch.modal import Excited
from workbench.analysis.batch.plants import SENSED, Key, Reading, output_keys, read
from workbench.analysis.mode import REAL
from workbench.analysis.response import WEIGHTS, exciting_types, irregularities, spectrum_of
from workbench.analysis.ride import weight
from workbench.analysis.setting import Setting
from workbench.constants import GRAVITY
from workbench.control.loop import Subject
from workbench.errors import InputError, unknown_name
from workbench.lti.modal import Fractions
from workbench.lti.signals import numbered

DELAY = "delay_margin"  # smallest over the current commands, as the requirement's
MOST_GROWTH = 1e3  # of the terms over a mean square: its square times 1e-16 leaves ten digits
Squares = dict[tuple[str, Key], np.ndarray]  # by irregularity type and output


@dataclass(frozen=True, slots=True)
class Figures:
    """Columns (b,) by quantity; NaN where a quantity has no value; sound (b,): false where not to be trusted."""

    columns: dict[str, np.ndarray]
    sound: np.ndarray


class Batch:
    """Analyses of one setting in stacks; only what the quantities need is computed."""

    def __init__(self, setting: Setting, quantities: Sequence[str]) -> None:
        known = quantity_names(setting)
        for name in quantities:
            if name not in known:
                raise unknown_name("quantity of a batch", name, known)
        self.setting, self.wanted = setting, frozenset(quantities)
        self._groups = [_Group(setting, s, _outputs_for(setting, self.wanted)) for s in setting.subjects]
        self._readings = tuple(g.reading for g in self._groups)

    def read(self, setting: Setting) -> tuple[Reading, ...]:
        """What this batch reads of another vehicle in the same surroundings."""
        return tuple(read(setting, s, g.keys) for s, g in zip(setting.subjects, self._groups, strict=True))

    def evaluate(self, gains: np.ndarray, readings: Sequence[Reading] | None = None) -> Figures:
        """Figures for gains (b, 17), columns as `GAIN_NAMES`; readings with b rows, or the setting's own plant."""
        columns = {name: np.full(len(gains), np.nan) for name in self.wanted}
        sound = np.zeros(len(gains), bool)
        for rows in _alike(gains):
            own = self._readings if readings is None else [_rows_of(r, rows) for r in readings]
            found, good = self._evaluate(gains[rows], own)
            sound[rows] = good
            for name, values in found.items():
                columns[name][rows] = values
        return Figures(columns, sound)

    def _evaluate(self, gains: np.ndarray, readings: Sequence[Reading]) -> tuple[dict[str, np.ndarray], np.ndarray]:
        closed = [g.closing(gains, r) for g, r in zip(self._groups, readings, strict=True)]
        poles = np.concatenate([c.modes.poles for c in closed], axis=1)
        decay = -poles.real.max(axis=1)
        oscillates = np.abs(poles.imag) > REAL * np.abs(poles)
        damping = np.where(oscillates, -poles.real / np.maximum(np.abs(poles), np.finfo(float).tiny), 1.0).min(axis=1)
        found = {"stable": (decay > 0).astype(float), "decay": decay, "damping": damping}
        sound = np.logical_and.reduce([c.sound for c in closed])
        stable = np.flatnonzero(sound & (decay > 0))
        if len(stable) and not self.wanted <= found.keys():
            more, good = self._responses([c.only(stable) for c in closed])
            sound[stable] &= good
            for name, values in more.items():
                found[name] = np.full(len(gains), np.nan)
                found[name][stable] = values
        return {name: values for name, values in found.items() if name in self.wanted}, sound

    def _responses(self, closed: Sequence[Closed]) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """Everything that needs a stable loop."""
        out: dict[str, np.ndarray] = {}
        good = np.ones(len(closed[0].A), bool)
        squares: Squares = {}
        for group, c in zip(self._groups, closed, strict=True):
            name = f"peak_sensitivity.{group.name}"
            if name in self.wanted:
                out[name] = c.peak()
            if DELAY in self.wanted:
                margin, certain = c.delay()
                out[DELAY], good = np.minimum(out.get(DELAY, np.inf), margin), good & certain
            for at, value, growth in group.mean_squares(c):
                squares[at] = squares[at] + value if at in squares else value
                good &= growth < MOST_GROWTH
        self._add_random(out, squares, len(good))
        self._add_errors(out, closed, len(good))
        return out, good

    def _add_random(self, out: dict[str, np.ndarray], squares: Squares, b: int) -> None:
        total: dict[Key, np.ndarray] = {}
        for (_, key), value in squares.items():
            total[key] = total[key] + value if key in total else value
        nothing = np.zeros(b)
        for name in self.wanted:
            kind, *rest = name.split(".")
            if kind == "rms" and (key := _key(self.setting, *rest)) in total:
                out[name] = np.sqrt(np.maximum(total[key], 0))
            if kind == "by_type" and (key := _key(self.setting, *rest[1:])) in total:
                out[name] = np.sqrt(np.maximum(squares.get((rest[0], key), nothing), 0))
        alpha = sum((v for (quantity, _), v in total.items() if quantity == "current"), nothing)
        felt = sum((total.get((f"weighted_{d}", p), nothing) for d in WEIGHTS for p in COST_POINTS), nothing)
        out["sum_alpha_squared"] = alpha
        out["control_power_w.resistive"] = self.setting.coil_resistance * self.setting.main_current**2 * alpha
        out["cost"] = COST_SCALE / GRAVITY**2 * felt

    def _add_errors(self, out: dict[str, np.ndarray], closed: Sequence[Closed], b: int) -> None:
        asked, n = {name.partition(".")[0] for name in self.wanted}, self.setting.law.count
        if asked & {"static_error", "peak_gap_change"}:
            total = sum((c.static() for c in closed), np.zeros((b, 2 * n, 2 * n)))
            worst = np.abs(total).sum(axis=2).reshape(b, 2, n).max(axis=2) * self.setting.accelerometer_bias
            out["static_error.gap"], out["static_error.gap_lateral"] = worst.T
        if asked & {"sensor_noise_rms", "peak_gap_change"}:
            gap, acceleration = self.setting.sensor_noise
            density = np.repeat([gap, gap, acceleration, acceleration], n) / np.sqrt(2.0)  # two-sided
            total = sum((c.noise(density) for c in closed), np.zeros((b, 3 * n)))
            for k, kind in enumerate(SENSED):
                out[f"sensor_noise_rms.{kind}"] = np.sqrt(total[:, k * n : (k + 1) * n].max(axis=1))
            if any(s.direct for s in self.setting.subjects):  # white noise passes straight to the currents
                out["sensor_noise_rms.current"] = np.full(b, np.nan)
        for kind in ("gap", "gap_lateral"):
            if f"peak_gap_change.{kind}" in self.wanted:
                ends = [out.get(f"rms.{kind}.{end}", np.full(b, np.nan)) for end in ENDS]
                both = np.hypot(np.maximum(*ends), out[f"sensor_noise_rms.{kind}"])
                out[f"peak_gap_change.{kind}"] = out[f"static_error.{kind}"] + PEAK_SIGMAS * both


def suits(setting: Setting) -> bool:
    """Whether this route takes a setting: independent irregularity types, two stations, filters of distinct poles.

    Joined sets, and damping by the guideway's rate, it leaves to the analysis of each row.
    """
    if setting.guideway.correlation is not None or "all" in setting.groups:
        return False
    if setting.joined or len({x for x, _ in setting.sets}) > 2:
        return False
    if irregularities(setting.plant, len(setting.sets))[1]:
        return False
    try:
        filters = [spectrum_of(setting, t).shaping_filter(setting.speed) for t in setting.types]
        excited = all(exciting_types(setting, s) for s in setting.subjects)
    except InputError:
        return False
    filters += [weight(name).state_space() for name in WEIGHTS.values()]
    gaps = [name for kind in SENSED[:2] for name in numbered(kind, setting.law.count)]
    through = any(
        s.plant.D[np.ix_(s.plant.index("outputs", gaps), s.plant.index("inputs", s.commands))].any()
        for s in setting.subjects
    )
    return excited and not through and all(Fractions.of(*f) is not None for f in filters)


def quantity_names(setting: Setting) -> tuple[str, ...]:
    """Every quantity a batch can be asked for, named as in the JSON of an analysis; damping and decay besides."""
    places = [(f"{kind}_{d}", p) for kind in ("acceleration", "weighted") for d in WEIGHTS for p in setting.points]
    places += [(kind, end) for kind in SENSED for end in ENDS]
    lateral = any("Y" in s.coordinates for s in setting.subjects)
    errors = SENSED[:2] if lateral else SENSED[:1]
    return (
        "stable", "damping", "decay", DELAY, "cost", "sum_alpha_squared", "control_power_w.resistive",
        *(f"peak_sensitivity.{_public(s)}" for s in setting.subjects),
        *(f"rms.{q}.{p}" for q, p in places),
        *(f"by_type.{t}.{q}.{p}" for t in setting.types for q, p in places),
        *(f"static_error.{k}" for k in errors),
        *(f"sensor_noise_rms.{k}" for k in (*errors, "current")),
        *(f"peak_gap_change.{k}" for k in errors),
    )  # fmt: skip


class _Group:
    """What of a group is the same in every row."""

    def __init__(self, setting: Setting, subject: Subject, asked: set[Key]) -> None:
        self.name, self.delay, self.types = _public(subject), setting.delay, exciting_types(setting, subject)
        every = output_keys(setting, subject)
        self.keys = [k for k in every if k in asked or _felt(k) in asked]
        self.closing, self.reading = Closing(subject), read(setting, subject, self.keys)
        weights = {d: _fractions(*weight(name).state_space()) for d, name in WEIGHTS.items()}
        # (weight or None, rows of the outputs, what their mean squares are called)
        self._classes: list[tuple[Fractions | None, list[int], list[Key]]] = []
        for d, filtering in (("", None), *weights.items()):
            chosen = [
                (i, _felt(k) if d else k) for i, k in enumerate(self.keys) if not d or k[0] == f"acceleration_{d}"
            ]
            chosen = [(i, key) for i, key in chosen if key in asked]
            if chosen:
                self._classes.append((filtering, [i for i, _ in chosen], [key for _, key in chosen]))
        self._shaping = _shared(
            [_fractions(*spectrum_of(setting, t).shaping_filter(setting.speed)) for t in self.types]
        )

    def mean_squares(self, c: Closed) -> Iterator[tuple[tuple[str, Key], np.ndarray, np.ndarray]]:
        """((type, key), mean square (b,), growth (b,)) of every output asked for."""
        if not self._classes:
            return
        count = len(self.types)
        left, right = c.modes.residues(np.concatenate([c.B_front, c.B_rear], axis=2), c.C)
        for shaping, own in self._shaping:
            for filtering, rows, keys in self._classes:
                excited = Excited(
                    c.modes.poles, left[:, :, own], left[:, :, [count + k for k in own]], right[:, rows],
                    c.D_front[:, rows][:, :, own], c.D_rear[:, rows][:, :, own], self.delay,
                )  # fmt: skip
                found = excited.mean_squares(shaping, filtering)
                for i, key in enumerate(keys):
                    for j, k in enumerate(own):
                        yield (self.types[k], key), found.value[:, i, j], found.growth


def _public(subject: Subject) -> str:
    return "heave_pitch" if subject.name == "heave" else subject.name


def _felt(key: Key) -> Key:
    return key[0].replace("acceleration", "weighted"), key[1]


def _key(setting: Setting, quantity: str, place: str) -> Key:
    """The output behind a name: currents go by coil set."""
    if quantity != "current":
        return quantity, place
    return quantity, f"current_{setting.ends[ENDS.index(place)] + 1}"


def _outputs_for(setting: Setting, wanted: frozenset[str]) -> set[Key]:
    """The outputs whose mean squares the quantities need."""
    asked: set[Key] = set()
    for name in wanted:
        kind, *rest = name.split(".")
        if kind == "rms":
            asked.add(_key(setting, *rest))
        elif kind == "by_type":
            asked.add(_key(setting, *rest[1:]))
        elif kind == "peak_gap_change":
            asked |= {(rest[0], end) for end in ENDS}
        elif kind in ("sum_alpha_squared", "control_power_w"):
            asked |= {("current", name) for name in numbered("current", setting.law.count)}
        elif kind == "cost":
            asked |= {(f"weighted_{d}", p) for d in WEIGHTS for p in COST_POINTS}
    return asked


def _fractions(A, B, C, D=0.0) -> Fractions:
    found = Fractions.of(A, B, C, D)
    if found is None:
        raise InputError("a batch needs filters with distinct poles; analyse the rows one by one.")
    return found


def _shared(filters: Sequence[Fractions]) -> list[tuple[Fractions, list[int]]]:
    """Equal filters once, with the positions that have them."""
    out: list[tuple[Fractions, list[int]]] = []
    for k, one in enumerate(filters):
        for other, own in out:
            if np.array_equal(one.poles, other.poles) and np.array_equal(one.residues, other.residues):
                own.append(k)
                break
        else:
            out.append((one, [k]))
    return out


def _alike(gains: np.ndarray) -> list[np.ndarray]:
    """Rows with the same acting filters together; rows without a filter where one is needed in none."""
    code = acting(gains) @ (1 << np.arange(4))
    usable = ~unfiltered(gains)
    return [np.flatnonzero(usable & (code == one)) for one in np.unique(code[usable])]


def _rows_of(reading: Reading, rows: np.ndarray) -> Reading:
    return replace(reading, **{f.name: getattr(reading, f.name)[rows] for f in fields(reading)})

"""Everything that is measured of a vehicle under given gains, by exact algorithms.

    Setting, Gains --close each group--> poles, modes, sensitivity peaks (Hamiltonian), mean squares (Lyapunov),
                                         static errors, control power, cost  --> Analysis

Quantities and their names: guide, Definitions; a group that a problem does not look at leaves its figures empty (None).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from workbench.analysis.mode import REAL, Mode, modes_of
from workbench.analysis.motor import MotorWork, motor_squares, motor_work
from workbench.analysis.nonlinear_ride import NonlinearRide, bends, nonlinear_ride
from workbench.analysis.power import mechanical_power, resistive_power
from workbench.analysis.response import COST_POINTS, COST_SCALE, Driven, driven, point_acceleration, random_loops
from workbench.analysis.sensor import noise_rms, static_errors
from workbench.analysis.setting import Setting
from workbench.constants import GRAVITY
from workbench.control import Gains
from workbench.control.loop import Subject
from workbench.control.loop.polynomial import roots_of
from workbench.lti.minimal import loop_poles
from workbench.lti.norm import Peak, peak_gain
from workbench.lti.signals import numbered
from workbench.result import Result, Row, plain

TYPES = ("A1", "A2", "A3", "A4")
ENDS = ("front", "rear")
PEAK_SIGMAS = 3.0


@dataclass(frozen=True, kw_only=True, repr=False)
class Analysis(Result):
    """The measured behaviour of a vehicle under given gains; SI units.

    poles : all eigenvalues, nothing cancelled;  loop_poles : those between the current commands and themselves
    modes : one per oscillatory pair or real pole;  peak_sensitivity : group to Peak of σ_max((I+L)⁻¹)
    rms : quantity to {place: value}, and `by_type` the same per irregularity type
    static_error : largest static gap change from accelerometer bias;  control_power_w : to_body, electrical, resistive
    sensor_noise_rms : rms gap, gap_lateral, current from sensor noise alone, worst coil set
    peak_gap_change : static error + 3σ of guideway and sensor noise, gap and gap_lateral, worst end [m]
    clearance : gap, gap_lateral: least distance of any coil from floor and wall at rest [m]
    motor : what control asks of a motor; None without one
    cost : J = 10⁴ × six weighted mean squares in g²
    values are None where the loop is unstable or a gap filter is missing
    """

    problem: str
    gains: Gains
    stable: bool
    poles: np.ndarray
    loop_poles: np.ndarray
    modes: tuple[Mode, ...]
    peak_sensitivity: Mapping[str, Peak | None]
    rms: Mapping[str, Mapping[str, float | None]]
    by_type: Mapping[str, Mapping[str, Mapping[str, float | None]]]
    sum_alpha_squared: float | None
    static_error: Mapping[str, float | None]
    sensor_noise_rms: Mapping[str, float | None]
    peak_gap_change: Mapping[str, float | None]
    clearance: Mapping[str, float]
    control_power_w: Mapping[str, float | None]
    cost: float | None
    motor: MotorWork | None = None
    _setting: Setting | None = field(default=None, repr=False, compare=False)

    @cached_property
    def nonlinear(self) -> NonlinearRide | None:
        """The ride with forces that bend; None where these are not known, or the linear ride has no figures."""
        if self._setting is None or self.cost is None or not bends(self._setting):
            return None
        return nonlinear_ride(self._setting, self.gains, self.rms, self.cost)

    @property
    def damping(self) -> float:
        """Smallest damping ratio of an oscillatory mode; 1 if none oscillates."""
        return min((m.damping for m in self.modes if m.oscillates), default=1.0)

    @property
    def decay(self) -> float:
        """Decay rate of the slowest pole [1/s]; negative if unstable."""
        return float(-self.poles.real.max())

    def to_dict(self) -> dict[str, Any]:
        """Every figure under the names other programs read; complex numbers as [re, im]."""
        document = plain(self)
        document["gains"] = self.gains.as_dict()
        if self.motor is None:
            del document["motor"]
        document["peak_sensitivity"] = {k: None if p is None else p.value for k, p in self.peak_sensitivity.items()}
        document["peak_sensitivity_bracket"] = {
            k: None
            if p is None
            else plain({"lower": p.lower, "upper": p.upper, "frequency_hz": p.frequency / (2 * np.pi)})
            for k, p in self.peak_sensitivity.items()
        }
        return document

    def rows(self) -> list[Row]:
        out: list[Row] = [
            ("problem", self.problem, ""),
            ("stable", self.stable, ""),
            ("cost J", self.cost, ""),
            ("smallest damping ratio", self.damping, "1"),
            ("decay rate", self.decay, "1/s"),
        ]
        out += [
            (f"peak sensitivity, {g}", None if p is None else p.value, "1") for g, p in self.peak_sensitivity.items()
        ]
        units = {"gap": ("mm", 1e3), "gap_lateral": ("mm", 1e3), "current": ("1", 1.0)}
        for name, values in self.rms.items():
            unit, factor = units.get(name, ("m/s²", 1.0))
            out += [(f"rms {name}, {place}", None if v is None else v * factor, unit) for place, v in values.items()]
        out.append(("sum of mean square currents", self.sum_alpha_squared, "1"))
        out += [
            (f"static {k} error from bias", None if v is None else v * 1e3, "mm") for k, v in self.static_error.items()
        ]
        out += [
            (f"peak {k} change (static + 3σ)", None if v is None else v * 1e3, "mm")
            for k, v in self.peak_gap_change.items()
        ]
        out += [(f"control power, {k}", v, "W") for k, v in self.control_power_w.items()]
        return out + ([] if self.motor is None else self.motor.rows())


def analyse(setting: Setting, gains: Gains, name: str = "") -> Analysis:
    """The exact measures of a setting under given gains.

    A gap filter of time constant zero with a rate gain has no finite response to noise: roots only, the rest is None.
    """
    if unfiltered(gains):
        return _roots_only(setting, gains, name)
    loops = [(s, s.close(gains)) for s in setting.subjects]
    poles = _in_order(np.concatenate([closed.poles() for _, closed in loops]))
    at_commands = _in_order(np.concatenate([loop_poles(*s.sensitivity(closed)[:3]) for s, closed in loops]))
    modes = tuple(mode for s, closed in loops for mode in modes_of(s, closed))
    stable = bool(poles.real.max() < 0)
    peaks: dict[str, Peak | None] = {"heave_pitch": None, "sway_roll_yaw": None}
    for s, closed in loops:
        peaks["heave_pitch" if s.name == "heave" else s.name] = peak_gain(*s.sensitivity(closed)) if stable else None
    random = _random(setting, gains) if stable else _Random.empty(setting)
    static = static_errors(setting, loops) if stable else {"gap": None, "gap_lateral": None}
    noise = noise_rms(setting, loops) if stable else dict.fromkeys(("gap", "gap_lateral", "current"))
    return Analysis(
        problem=name, gains=gains, stable=stable, poles=poles, loop_poles=at_commands,
        modes=tuple(sorted(modes, key=lambda m: m.frequency_hz)), peak_sensitivity=peaks,
        rms=random.rms, by_type=random.by_type, sum_alpha_squared=random.sum_alpha_squared,
        static_error=static, sensor_noise_rms=noise, peak_gap_change=_peaks(random.rms, static, noise),
        clearance=dict(zip(("gap", "gap_lateral"), setting.clearance, strict=True)),
        control_power_w=random.power, cost=random.cost,
        motor=motor_work(setting, loops, random.motor_squares, random.motor_power), _setting=setting,
    )  # fmt: skip


def unfiltered(gains: Gains) -> bool:
    """Whether a gap's rate is taken without a filter."""
    return any(getattr(gains, tau) == 0 != getattr(gains, K) for tau, K in (("tau_h", "K_hdot"), ("tau_hp", "K_hpdot")))


def _roots_only(setting: Setting, gains: Gains, name: str) -> Analysis:
    """Roots of the characteristic polynomials; they belong to no state, so the modes are called "unfiltered"."""
    roots = np.concatenate([roots_of(setting.plant, setting.law, s.name, gains) for s in setting.subjects])
    nothing = dict.fromkeys(("gap", "gap_lateral"))
    blank = _Random.empty(setting)
    modes = [
        Mode(
            name="unfiltered",
            frequency_hz=float(abs(p) / (2 * np.pi)),
            damping=float(-p.real / abs(p)),
            pole=complex(p),
        )
        for p in _in_order(roots)
        if p.imag >= -REAL * abs(p)
    ]
    return Analysis(
        problem=name, gains=gains, stable=bool(roots.real.max() < 0), poles=_in_order(roots), loop_poles=np.zeros(0),
        modes=tuple(modes), peak_sensitivity={"heave_pitch": None, "sway_roll_yaw": None},
        rms=blank.rms, by_type=blank.by_type, sum_alpha_squared=None, static_error=nothing,
        sensor_noise_rms={**nothing, "current": None}, peak_gap_change=nothing,
        clearance=dict(zip(("gap", "gap_lateral"), setting.clearance, strict=True)),
        control_power_w=blank.power, cost=None, motor=None,
    )  # fmt: skip


def _in_order(poles: np.ndarray) -> np.ndarray:
    return poles[np.lexsort((poles.imag, np.abs(poles)))]


@dataclass(frozen=True, slots=True)
class _Random:
    rms: dict[str, dict[str, float | None]]
    by_type: dict[str, dict[str, dict[str, float | None]]]
    sum_alpha_squared: float | None
    power: dict[str, float | None]
    cost: float | None
    motor_squares: np.ndarray | None = None
    motor_power: float | None = None

    @classmethod
    def empty(cls, setting: Setting) -> "_Random":
        """The same names without values, for an unstable loop."""
        blank = _blank(setting)
        power = dict.fromkeys(("to_body", "electrical", "resistive"))
        return cls(blank, {t: _blank(setting) for t in TYPES}, None, power, None)


def _blank(setting: Setting) -> dict[str, dict[str, float | None]]:
    names = {f"{kind}_{d}": list(setting.points) for kind in ("acceleration", "weighted") for d in "zy"}
    names |= {name: list(ENDS) for name in ("gap", "gap_lateral", "current")}
    return {name: dict.fromkeys(places) for name, places in names.items()}


def _random(setting: Setting, gains: Gains) -> _Random:
    """Mean squares of all groups, added over groups and over uncorrelated types or independent sources."""
    squares: dict[str, dict[tuple[str, str], float]] = {}
    power = {"to_body": 0.0, "electrical": 0.0}
    motor, motor_power = np.zeros(4), 0.0
    alpha = 0.0
    for s, closed in random_loops(setting, gains):
        system = driven(setting, s, closed)
        state = system.stationary()
        keys, rows = _outputs(setting, s, system)
        values = state.mean_squares(rows)
        alpha += float(state.mean_squares(system.rows(numbered("current", setting.law.count))).sum())
        body, port = mechanical_power(setting, system, state)
        power["to_body"] += float(body.sum())
        power["electrical"] += float(port.sum())
        drawn, work = motor_squares(setting, system, state)
        motor, motor_power = motor + drawn, motor_power + work
        for k, kind in enumerate(system.types):
            one = squares.setdefault(kind, {})
            for key, value in zip(keys, values[k], strict=True):
                one[key] = one.get(key, 0.0) + float(value)
    total: dict[tuple[str, str], float] = {}
    for one in squares.values():
        for key, value in one.items():
            total[key] = total.get(key, 0.0) + value
    # a type that acts and does not reach a quantity gives zero; correlated types have no shares of their own
    apart = setting.types if setting.guideway.correlation is None else ()
    shares = {t: {key: squares.get(t, {}).get(key, 0.0) for key in total} if t in apart else {} for t in TYPES}
    by_type = {t: _nested(setting, shares[t]) for t in TYPES}
    felt = [total.get((f"weighted_{d}", p), 0.0) for d in "zy" for p in COST_POINTS]
    return _Random(
        rms=_nested(setting, total), by_type=by_type, sum_alpha_squared=alpha,
        power={**power, "resistive": resistive_power(setting, alpha)}, cost=COST_SCALE / GRAVITY**2 * sum(felt),
        motor_squares=motor, motor_power=motor_power,
    )  # fmt: skip


def _outputs(setting: Setting, subject: Subject, system: Driven):
    """Keys (quantity, place) and C rows of the reported outputs that a group contributes to."""
    keys, rows = [], []
    names = list(system.outputs)
    stack = system.rows(names)
    for (direction, point), row in system.weighted.items():
        keys.append((f"weighted_{direction}", point))
        rows.append(row)
        felt = point_acceleration(names, setting.points[point], direction)
        if system.finite(felt):
            keys.append((f"acceleration_{direction}", point))
            rows.append(felt @ stack)
    for end, i in zip(ENDS, setting.ends, strict=True):
        for kind in ("gap", "gap_lateral", "current"):
            if kind == "gap_lateral" and set(setting.groups) <= {"heave", "heave_pitch"}:
                continue  # without sway, roll and yaw the lateral gap is the guideway's own deviation
            keys.append((kind, end))
            rows.append(system.outputs[f"{kind}_{i + 1}"])
    return keys, np.array(rows)


def _nested(setting: Setting, squares: dict[tuple[str, str], float]) -> dict[str, dict[str, float | None]]:
    out = _blank(setting)
    for (quantity, place), value in squares.items():
        out[quantity][place] = float(np.sqrt(max(value, 0.0)))
    return out


def _peaks(rms, static, noise) -> dict[str, float | None]:
    """Static error + 3σ of guideway and sensor noise together, at the worse end; None where one of them is."""
    out: dict[str, float | None] = {}
    for kind in ("gap", "gap_lateral"):
        ends = [v for v in rms[kind].values() if v is not None]
        known = static[kind] is not None and noise[kind] is not None and ends
        out[kind] = static[kind] + PEAK_SIGMAS * float(np.hypot(max(ends), noise[kind])) if known else None
    return out

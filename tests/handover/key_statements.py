"""For every key of a data file: two values, and what must change when it has the other one.

A key that is not here fails `test_every_key`: whoever adds one says what it does.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from key_figures import LIMITED, LIMITS

from workbench.control.gains import GAIN_NAMES


@dataclass(frozen=True)
class Pair:
    """Two data files that differ in one key.

    base : shipped problem;  value : the other one's;  also : other keys to values, in both
    moves, keeps : what must and must not change, as `key_figures.Seen` names it;  scales : what changes by a factor
    refused : words of the sentence that refuses the other file;  slow : forces of other coils are computed anew
    """

    base: str
    value: Any
    moves: tuple[str, ...] = ()
    keeps: tuple[str, ...] = ()
    scales: Mapping[str, float] = field(default_factory=dict)
    also: Mapping[str, Any] = field(default_factory=dict)
    refused: str = ""
    slow: bool = False


REVENUE, HEAVE, PITCH, SWAY = "comfort_limit", "heave", "heave_pitch", "sway_roll_yaw"
COILS, MOTOR, REPORT = "scheduled_vehicle", "hybrid_motor", "report_1975"
NOTE = {"source": "of a test"}
RIDE, SIDEWAYS = ("cost", "rms.gap.front"), ("rms.gap_lateral.front",)
ALONE = ("poles", "sensor_noise_rms.gap")  # what does not know the guideway
WHOLE = {"problem.groups": ["all"]}  # a vehicle aslant, whose motions are coupled


def _with(values: list[float], k: int, value: float) -> list[float]:
    return [*values[:k], value, *values[k + 1 :]]


VEHICLE = {
    "problem.title": Pair(HEAVE, "Another title", ("title",), ALONE),
    "problem.ride": Pair(REVENUE, "nonlinear", ("soft:kinds",), ALONE),
    "problem.groups": Pair(REVENUE, ["all"], ("peak_sensitivity.all", "peak_sensitivity.heave_pitch")),
    "vehicle.weight_n": Pair(REVENUE, 444900.0, ("poles", *RIDE)),
    "vehicle.front_arm_m": Pair(REVENUE, 9.1, ("poles", "point:front", *RIDE)),
    "vehicle.rear_arm_m": Pair(REVENUE, 7.7, ("poles", "point:rear", *RIDE)),
    "vehicle.half_track_m": Pair(REVENUE, 1.0, ("poles", *RIDE)),
    "vehicle.coil_depth_m": Pair(REVENUE, 1.3, ("poles", *RIDE)),
    "vehicle.gap_m": Pair(REVENUE, 0.31, ("clearance",), ("poles", *RIDE)),
    "vehicle.gap_lateral_m": Pair(REVENUE, 0.31, ("clearance",), ("poles", *RIDE)),
    "vehicle.gap_minimum_m": Pair(COILS, 0.29, refused="gap", also={"operating_point": {"speed_m_s": 60.0, **NOTE}}),
    "vehicle.speed_m_s": Pair(REVENUE, 130.0, RIDE, ALONE),
    "vehicle.coil_sets_m": Pair(
        REVENUE, [[9.2, 0.965], [9.2, -0.965], [-7.65, 0.965], [-7.65, -0.965]], ("poles", *RIDE), ("point:front",)
    ),
    "vehicle.joined_sets": Pair("two_coil_corner", [[1, 2], [3, 4], [5, 6]], refused="joined", slow=True),
    "inertia.roll_kg_m2": Pair(REVENUE, 7.52e4, ("poles",)),
    "inertia.pitch_kg_m2": Pair(REVENUE, 3.42e6, ("poles",)),
    "inertia.yaw_kg_m2": Pair(REVENUE, 3.36e6, ("poles",)),
    "inertia.roll_range_kg_m2": Pair(HEAVE, [7.6e4, 7.7e4], refused="roll_kg_m2 must lie in roll_range_kg_m2"),
    "inertia.pitch_range_kg_m2": Pair(HEAVE, [3.0e6, 3.1e6], refused="pitch_kg_m2 must lie in pitch_range_kg_m2"),
    "inertia.yaw_range_kg_m2": Pair(HEAVE, [3.0e6, 3.1e6], refused="yaw_kg_m2 must lie in yaw_range_kg_m2"),
    "points.places": Pair(PITCH, {"seat": [3.0, 0.0, 0.0]}, ("point:seat", "rms.acceleration_z.seat"), ALONE),
}

LIFT = [1.1120e5, -8.9372e5, 8.2437e4, -1.2899e4, 3.3981e5]
LATERAL = [3.9640e4, 8.2437e4, -3.2430e5, -4.7202e4, 6.3715e4]
MOMENT = [1.1768e4, -1.2899e4, -4.7202e4, -2.3642e4, 2.7473e4]
EXTENDED = {"kind": "extended", "corrected": True, "main_current_a_turns": 429690.0, **NOTE}
ASLANT = {**WHOLE, "operating_point": {"side_force_n": 5e3, **NOTE}}
AHEAD = {"operating_point": {"cg_forward_m": 0.3, **NOTE}}  # away from the pose about which laws are expanded
FORCES = {
    "force_law[first_order].lift": Pair(REVENUE, _with(LIFT, 1, -8.9e5), ("poles", *RIDE)),
    "force_law[first_order].lateral": Pair(REVENUE, _with(LATERAL, 2, -3.25e5), ("poles", *SIDEWAYS)),
    "force_law[first_order].moment": Pair(REVENUE, _with(MOMENT, 4, 2.8e4), ("poles", *SIDEWAYS)),
    "force_law[first_order].order": Pair(REVENUE, "words for a reader", keeps=("plant", "poles", *RIDE)),
    "force_law[first_order].lift_to_drag": Pair(REVENUE, 60.0, ("poles", *RIDE)),
    "force_law[first_order].main_current_a_turns": Pair(
        REVENUE, 859380.0, keeps=("poles", *RIDE), scales={"control_power_w.resistive": 4.0}
    ),
    "force_law[first_order].control_below_m": Pair(REVENUE, 0.05, ("clearance",), ("poles", *RIDE)),
    "force_law[extended].corrected": Pair(REVENUE, False, ("poles",), also={"force_law": EXTENDED, **ASLANT}),
    "force_law[extended].main_current_a_turns": Pair(
        REVENUE, 859380.0, scales={"control_power_w.resistive": 4.0}, also={"force_law": EXTENDED}
    ),
}
# of the coils: the other value; every one moves the poles
COIL = {
    "physics": "scaled", "coil_width_m": 0.51, "coil_length_m": 3.05, "control_width_m": 0.52, "control_length_m": 3.1,
    "control_below_m": 0.11, "main_current_a_turns": 435000.0, "plate_thickness_m": 0.02,
    "plate_conductivity_s_m": 3.0e7,
}  # fmt: skip
QUICK = ("main_current_a_turns", "plate_thickness_m", "plate_conductivity_s_m")
SLOWER = {"operating_point": {"speed_m_s": 60.0, **NOTE}}
EXPANDED = {"force_law.kind": "taylor", "force_law.expansion_order": 2}
for kind, more in (("corner", {}), ("taylor", EXPANDED)):
    FORCES |= {
        f"force_law[{kind}].{key}": Pair(COILS, value, ("poles",), also=more, slow=key not in QUICK or kind == "taylor")
        for key, value in COIL.items()
    }
    FORCES[f"force_law[{kind}].hold"] = Pair(COILS, "gap", ("clearance", "poles"), also={**SLOWER, **more}, slow=True)
FORCES["force_law[taylor].expansion_order"] = Pair(COILS, 1, ("poles",), also={**EXPANDED, **AHEAD}, slow=True)
# a kind is the whole table: another one gives another vehicle
KINDS = {
    "force_law[first_order].kind": Pair(REVENUE, EXTENDED, ("poles",), also=AHEAD),
    "force_law[extended].kind": Pair(REVENUE, EXTENDED, ("poles",), also=AHEAD),
    "force_law[corner].kind": Pair(COILS, "taylor", refused="expansion_order"),
    "force_law[taylor].kind": Pair(COILS, "corner", refused="expansion_order", also=EXPANDED, slow=True),
}

SURROUNDINGS = {
    "physics.current_lag_s": Pair(REVENUE, 0.011, ("poles", "delay_margin")),
    "physics.gravity_term": Pair(REVENUE, False, ("poles", *RIDE)),
    "physics.coil_length_m": Pair(REVENUE, 3.0, ("poles", *RIDE)),
    "physics.thrust_n": Pair(REVENUE, 5e4, ("poles", *RIDE)),
    "physics.lift_damping_n_s_m": Pair(REVENUE, 1e3, ("poles", *RIDE)),
    "physics.lateral_damping_n_s_m": Pair(REVENUE, 1e3, ("poles", *SIDEWAYS)),
    "physics.bank_reading": Pair(REVENUE, "section", ("plant",), ("poles", *RIDE)),  # a bank: curves, simulations
    "sensors.accelerometer_bias_mg": Pair(
        REVENUE, 4.0, ("peak_gap_change.gap",), ALONE, {"static_error.gap": 2.0, "static_error.gap_lateral": 2.0}
    ),
    "sensors.gap_noise_um_per_root_hz": Pair(
        REVENUE, 20.0, keeps=RIDE, scales={"sensor_noise_rms.gap": 2.0, "sensor_noise_rms.current": 2.0},
        also={"sensors.acceleration_noise_mm_s2_per_root_hz": 0.0},
    ),
    "sensors.acceleration_noise_mm_s2_per_root_hz": Pair(
        REVENUE, 2.0, keeps=RIDE, scales={"sensor_noise_rms.gap": 2.0, "sensor_noise_rms.current": 2.0},
        also={"sensors.gap_noise_um_per_root_hz": 0.0},
    ),
    "control_coil.turn_length_m": Pair(REVENUE, 14.0, keeps=RIDE, scales={"control_power_w.resistive": 2.0}),
    "control_coil.conductor_area_cm2": Pair(REVENUE, 100.0, keeps=RIDE, scales={"control_power_w.resistive": 0.5}),
    "control_coil.resistivity_ohm_m": Pair(REVENUE, 3.4e-8, keeps=RIDE, scales={"control_power_w.resistive": 2.0}),
    "discretisation.sample_time_s": Pair(HEAVE, 0.002, ("sample_time",), ALONE),
}  # fmt: skip
# of the American spectra only the cross-level has a finite variance
FRA = {"kind": "fra", "track_class": 6, "extrapolate": True, "types": ["A2"], **NOTE}
GERMAN = {"kind": "german", "level": "low", "types": ["A1"], **NOTE}
TIED = [[1.0, 0.0, 0.0, 0.5], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.5, 0.0, 0.0, 1.0]]
TYPES = {"guideway.types": ["A1", "A2", "A3", "A4"]}
GUIDEWAY = {
    "guideway[power_law].kind": Pair(HEAVE, GERMAN, RIDE, ALONE),
    "guideway[power_law].roughness_m": Pair(REVENUE, 6e-6, (), ALONE, {"cost": 4.0, "rms.gap.front": 2.0}),
    "guideway[power_law].corner_frequency_hz": Pair(REVENUE, 0.2, RIDE, ALONE),
    "guideway[power_law].types": Pair(PITCH, ["A1"], RIDE, ALONE),
    "guideway[power_law].correlation": Pair(PITCH, TIED, ("rms.gap.front",), ALONE, also=TYPES),
    "guideway[fra].kind": Pair(SWAY, FRA, SIDEWAYS, ALONE),
    "guideway[fra].track_class": Pair(SWAY, 4, SIDEWAYS, ALONE, also={"guideway": FRA}),
    "guideway[fra].extrapolate": Pair(SWAY, False, refused="extrapolate", also={"guideway": FRA}),
    "guideway[fra].types": Pair(SWAY, ["A1"], refused="needs an irregularity type", also={"guideway": FRA}),
    "guideway[fra].correlation": Pair(SWAY, [[2.0] * 4] * 4, refused="correlation must be", also={"guideway": FRA}),
    "guideway[german].kind": Pair(HEAVE, GERMAN, RIDE, ALONE),
    "guideway[german].level": Pair(HEAVE, "high", RIDE, ALONE, also={"guideway": GERMAN}),
    "guideway[german].types": Pair(HEAVE, ["A2"], refused="needs an irregularity type", also={"guideway": GERMAN}),
    "guideway[german].correlation": Pair(
        PITCH, TIED, ("rms.gap.front",), ALONE, also={"guideway": {**GERMAN, "types": ["A1", "A4"]}}
    ),
}

FREE = {f"fixed.{name}": Pair(REPORT, 0.4 if "tau" in name else 0.1, ("poles", f"fixed:{name}")) for name in GAIN_NAMES}
FREE |= {f"fixed.{name}": Pair(REPORT, 1.1, ("poles", f"fixed:{name}")) for name in ("K_heave", "K_pitch")}
# yaw's filters act through K_yaw alone, and so on: what a gain multiplies must not be zero
FREE["fixed.K_hp"] = Pair(REPORT, -0.1, ("poles", "fixed:K_hp"))
FREE |= {
    f"bounds.{name}": Pair(REPORT, [0.5, 1.5], (f"bound:{name}", f"fixed:{name}"), also={"bounds": NOTE})
    for name in GAIN_NAMES
}

SPECIAL = {"motor": MOTOR, "lateral": SWAY, "vertical": HEAVE}
REQUIRED = {
    f"requirements.{key}": Pair(
        next((base for word, base in SPECIAL.items() if word in key), HEAVE), 1e-9 if "at_most" in key else 1e9,
        (f"met:{key}",), ALONE,
    )
    for key in LIMITS
}  # fmt: skip

LOST = {"operating_point": {"lost_set": 1, "lost_share": 0.01, **NOTE}}
POINT = {
    "speed_m_s": Pair(COILS, 100.0, ("poles", "clearance")),
    "balance": Pair(REVENUE, "cg", ("plant", "poles")),
    "carried_by": Pair(REVENUE, "currents", ("clearance", "poles"), also={"operating_point.weight_n": 450000.0}),
    "weight_n": Pair(REVENUE, 450000.0, ("clearance", "poles", *RIDE)),
    "cg_forward_m": Pair(REVENUE, 0.3, ("clearance", "poles", *RIDE)),
    "side_force_n": Pair(REVENUE, 5e3, ("clearance", "poles"), also=WHOLE),
    "side_force_above_cg_m": Pair(REVENUE, 0.5, ("poles",), also={**WHOLE, "operating_point.side_force_n": 5e3}),
    "side_force_ahead_of_cg_m": Pair(REVENUE, 0.5, ("poles",), also={**WHOLE, "operating_point.side_force_n": 5e3}),
    "curve_lateral_m_s2": Pair(REVENUE, 0.2, ("clearance", "poles"), also=WHOLE),
    "lost_set": Pair(REVENUE, 3, ("poles", "clearance"), also={**WHOLE, **LOST}),
    "lost_share": Pair(REVENUE, 0.02, ("poles", "clearance"), also={**WHOLE, **LOST}),
}
TURN = {**WHOLE, "operating_point.curve_lateral_m_s2": 0.2}
POINT |= {
    f"curve_{key}": Pair(REVENUE, value, ("poles",), also=TURN)
    for key, value in {
        "cant_rad": 0.01, "roll_rate_rad_s": 0.005, "roll_acceleration_rad_s2": 0.005, "lateral_jerk_m_s3": 0.1,
    }.items()
}  # fmt: skip
POINT = {f"operating_point.{key}": pair for key, pair in POINT.items()}

DRIVE = {
    "thrust_n": 42000.0, "drop_m": 0.1, "coils_per_side": 17, "rated_current_a": 1600.0, "magnet_a_turns": 510000.0,
    "pole_pitch_m": 1.2, "coil_width_m": 0.9, "coil_length_m": 1.05, "magnet_offset_m": 0.9, "winding_offset_m": 0.6,
    "current_lag_s": 0.012,
}  # fmt: skip
DRIVEN = {f"motor.{key}": Pair(MOTOR, value, ("poles", "motor.current_at_3_sigma")) for key, value in DRIVE.items()}

# where a vehicle of another mass, … shows: base, the varied interval, what its worst vehicle has
WORST, PEAK = "worst:damping_ratio_at_least", "worst:peak_sensitivity_at_most"
SPREAD = {
    "mass": (HEAVE, [0.5, 1.5], PEAK), "cg_forward_m": (PITCH, [-1.0, 1.0], PEAK),
    "roll_inertia": (SWAY, [0.5, 1.5], WORST), "pitch_inertia": (PITCH, [0.7, 1.3], PEAK),
    "yaw_inertia": (SWAY, [0.9, 1.1], PEAK), "current_force": (HEAVE, [0.5, 1.5], PEAK),
    "gap_force": (HEAVE, [0.5, 1.5], WORST), "vertical_sensors": (HEAVE, [0.5, 1.5], PEAK),
    "lateral_sensors": (SWAY, [0.8, 1.2], PEAK),
}  # fmt: skip
QUICKLY_BORNE = ("damping_ratio_at_least", "peak_sensitivity_at_most", "rms_gap_front_at_most_mm")
LITTLE = {"variation": {"mass": [0.999, 1.001], **NOTE}}
VARIED = {
    f"variation.{key}": Pair(base, interval, (worst,), ALONE, also=LITTLE)
    for key, (base, interval, worst) in SPREAD.items()
}
VARIED |= {
    f"model.{key}": Pair(
        base, [{"name": "one", key: interval[0], **NOTE}], (worst,), ALONE, also={"model": [{"name": "one", **NOTE}]}
    )
    for key, (base, interval, worst) in SPREAD.items()
}
FLYING = {"schedule": None, "problem.groups": ["heave_pitch"], "requirements": {"damping_ratio_at_least": 0.3, **NOTE}}
VARIED |= {
    "variation.cost": Pair(HEAVE, "worst", ("robust_cost",), also={"variation": {"mass": [0.8, 1.2], **NOTE}}),
    "variation.speed_m_s": Pair(COILS, [130.0, 134.0], (WORST,), ALONE, also={**FLYING, **LITTLE}, slow=True),
    "model.speed_m_s": Pair(
        COILS, [{"name": "one", "speed_m_s": 100.0, **NOTE}], (WORST,), ALONE,
        also={**FLYING, "model": [{"name": "one", **NOTE}]},
    ),
    "model.name": Pair(
        HEAVE, [{"name": "two", "mass": 0.9, **NOTE}], ("varied:models",), (WORST,),
        also={"model": [{"name": "one", "mass": 0.9, **NOTE}]},
    ),
}  # fmt: skip
VARIED |= {
    f"variation.limits.{key}": Pair(
        next((base for word, base in SPECIAL.items() if word in key), HEAVE),
        1.0,
        (f"worst:{key}",),
        ALONE,
        also=LITTLE,
        slow=key not in QUICKLY_BORNE,
    )
    for key in LIMITED["variation.limits"]
}

PLANNED = {
    "schedule.range_m_s": Pair(COILS, [40.0, 134.0], ("plan:range", "plan:speeds"), ALONE),
    "schedule.degree": Pair(COILS, 3, ("plan:degree",), ALONE),
    "schedule.points": Pair(COILS, 7, ("plan:points",), ALONE),
    "schedule.checked_speeds": Pair(COILS, 105, ("plan:speeds",), ALONE),
} | {f"schedule.limits.{key}": Pair(COILS, 0.123, ("plan:requirements",), ALONE) for key in LIMITED["schedule.limits"]}

LOOKED = {
    "design.starts": Pair(HEAVE, 3, ("effort:starts",), ALONE),
    "design.seed": Pair(HEAVE, 5, ("effort:seed",), ALONE),
    "design.budget_s": Pair(HEAVE, 30.0, ("effort:budget",), ALONE),
}
STATEMENTS: dict[str, Pair] = (
    LOOKED | VEHICLE | FORCES | KINDS | SURROUNDINGS | GUIDEWAY | FREE | REQUIRED | POINT | DRIVEN | VARIED | PLANNED
)

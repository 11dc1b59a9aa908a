"""The vehicle away from the nominal point: equilibria, their linear models, coefficients against speed."""

import tomllib
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from workbench.constants import GRAVITY
from workbench.errors import InfeasibleError, InputError
from workbench.files.problem import ProblemData, load_problem, parse_problem, shipped_folder
from workbench.physics.forces.flight import Levitation
from workbench.physics.forces.law import FirstOrderLaw, report_first_order
from workbench.physics.forces.operating import law_at
from workbench.physics.forces.taylor import TaylorLaw
from workbench.physics.vehicle import Extras, Vehicle, linearise
from workbench.physics.vehicle.conditions import Conditions, Curve, SideWind
from workbench.physics.vehicle.flight import FlyingCoils, flight, lift_off
from workbench.physics.vehicle.operating import joined, operating_point

COILS = {
    "kind": "corner", "physics": "scaled", "coil_width_m": 0.5, "coil_length_m": 3.0, "control_width_m": 0.5,
    "control_length_m": 3.0, "control_below_m": 0.1, "main_current_a_turns": 429690.0, "plate_thickness_m": 0.0254,
    "plate_conductivity_s_m": 3.422e7, "source": "report, A.3",
}  # fmt: skip


def vehicle(law=None, **extras) -> Vehicle:
    return Vehicle.four_corners(
        front=9.0, rear=7.65, half_track=0.965, depth=1.21, mass=444800 / GRAVITY, roll_inertia=7.53e4,
        pitch_inertia=3.41e6, yaw_inertia=3.35e6, speed=134.0, force_law=law or report_first_order(),
        extras=Extras(**extras),
    )  # fmt: skip


@cache
def bent() -> TaylorLaw:
    """A law with curvature, cheap enough for many linearisations."""
    return TaylorLaw.from_corner(law_at(), 2)


def data(law=None, **changes) -> ProblemData:
    mapping = tomllib.loads((shipped_folder() / "comfort_limit" / "data.toml").read_text())
    for block, values in changes.items():
        mapping[block] = {**mapping.get(block, {"source": "test"}), **values}
    if law:
        mapping["force_law"] = law
    return ProblemData(parse_problem(mapping), "changed", "0" * 64, None)


@pytest.mark.parametrize("name", ["report_1975", "comfort_limit", "sway_roll_yaw"])
def test_nominal_conditions_change_no_digit_of_a_shipped_plant(name):
    problem = load_problem(name)
    plain = linearise(problem.vehicle).plant
    for matrix in "ABCD":
        assert np.array_equal(getattr(problem.setting.plant, matrix), getattr(plain, matrix))


@pytest.mark.parametrize(
    "conditions",
    [
        Conditions(wind=SideWind(force=2e4, above=0.5, ahead=1.0)),
        Conditions(cg_forward=0.3, carried_by="currents"),
        Conditions(mass=5e4),
    ],
)
@pytest.mark.parametrize(
    "extras", [{}, {"current_lag": 0.01, "gravity_term": True, "lift_damping": 900.0, "thrust": 4e4}]
)
def test_slopes_set_by_set_give_the_linearisation_of_the_whole_vehicle(conditions, extras):
    point = operating_point(vehicle(bent(), **extras), conditions)
    ours, direct = point.linearise().plant, linearise(point.vehicle, point.trim).plant
    for matrix in "ABCD":
        reference = getattr(direct, matrix)
        # two routes of a thousand operations each: rounding
        assert getattr(ours, matrix) == pytest.approx(reference, rel=1e-10, abs=1e-12 * np.abs(reference).max())


def test_a_small_side_wind_moves_the_vehicle_as_the_static_gain_of_its_plant():
    force = 10.0
    point = operating_point(vehicle(bent()), Conditions(wind=SideWind(force=force, above=0.4, ahead=2.0)))
    plant = linearise(vehicle(bent())).plant
    columns = plant.index("inputs", ["force_y", "moment_roll", "moment_yaw"])
    static = -np.linalg.solve(plant.A, plant.B[:, columns] @ [force, 0.4 * force, 2.0 * force])[:5]
    # curvature adds a relative force/weight = 2e-5
    assert point.trim.pose == pytest.approx(static, rel=1e-3, abs=1e-9)


def test_a_lost_coil_set_leaves_the_motion_of_the_three_others():
    whole = operating_point(vehicle(bent(), current_lag=0.01, gravity_term=True))
    lost = replace(whole, conditions=Conditions(lost_set=4), strength=np.array([1.0, 1.0, 1.0, 0.0]))
    lost = replace(
        lost, trim=replace(whole.trim, currents=np.full(4, 1e-12))
    )  # off the nominal point: every set on its own
    three = whole.vehicle.with_values(positions=whole.vehicle.positions[:3])
    ours, theirs = lost.linearise(), linearise(three)
    assert ours.stiffness == pytest.approx(theirs.stiffness, rel=1e-9, abs=1e-3)  # of 2e8 N m
    assert ours.current[:, :3] == pytest.approx(theirs.current, rel=1e-9, abs=1e-3)
    assert np.abs(ours.current[:, 3]).max() < 1e-3
    rows, others = (p.index("states", ["Z_rate", "Phi_rate"]) for p in (ours.plant, theirs.plant))
    columns, theirs_columns = (p.index("states", ["Z", "Theta", "Y", "Phi", "Psi"]) for p in (ours.plant, theirs.plant))
    expected = theirs.plant.A[np.ix_(others, theirs_columns)]
    assert ours.plant.A[np.ix_(rows, columns)] == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_nine_tenths_of_a_lost_coil_set_can_be_carried_by_currents_but_not_all_of_it():
    exact = vehicle(law_at())
    point = operating_point(exact, Conditions(lost_set=1, lost_share=0.9, carried_by="currents"))
    lift = sum(
        share * exact.force_law.forces(*d, a)[0]
        for share, d, a in zip(point.strength, point.deviation.T, point.trim.currents, strict=True)
    )
    # heave equilibrium: drag of a pitchless vehicle has no vertical part, help carries the rest
    assert lift == pytest.approx(444800 + point.nominal.external[0], rel=1e-6)
    with pytest.raises(InfeasibleError, match="no equilibrium carried by pose with the coils clear of the guideway"):
        operating_point(exact, Conditions(lost_set=1))


def test_a_balanced_curve_leaves_no_side_load():
    cant = 0.1
    curve = Curve(lateral=GRAVITY * np.tan(cant), cant=cant)
    loads = curve.loads(vehicle())
    assert curve.unbalanced == pytest.approx(0, abs=1e-12)
    # the centre of gravity, 1.21 m above the line the track turns about, moves on a circle that much smaller
    q, r = curve.lateral / 134.0 * np.array([np.sin(cant), np.cos(cant)])
    m, above = vehicle().mass, vehicle().depth
    assert loads[2] == pytest.approx(m * above * q * r, rel=1e-9)
    # the apparent weight grows to m g / cos(cant)
    assert loads[0] == pytest.approx(444800 * (1 / np.cos(cant) - 1) - m * above * q**2, rel=1e-9)


def test_an_unbalanced_right_hand_curve_presses_the_left_gaps_of_the_walls_closed():
    point = operating_point(vehicle(bent()), Conditions(curve=Curve(lateral=0.5)))
    right, left = point.deviation[1, 0], point.deviation[1, 1]
    assert left < 0 < right or right < 0 < left
    assert point.trim.pose[2] < 0  # outwards, to the left


def test_two_half_coils_at_a_distance_are_one_coil_with_their_radius_of_gyration():
    whole, s = report_first_order(), 2.5
    half = FirstOrderLaw(
        **{k: tuple(v / 2 for v in getattr(whole, k)) for k in ("lift", "lateral", "moment")},
        drag_ratio=whole.drag_ratio,
    )
    places = [(x + d, y) for x in (9.0, -7.65) for y in (0.965, -0.965) for d in (s / 2, -s / 2)]
    pairs = ((0, 1), (2, 3), (4, 5), (6, 7))
    extras = {"current_lag": 0.01, "gravity_term": True}
    eight = vehicle(half, **extras).with_values(positions=tuple(places), joined=pairs)
    four = vehicle(whole, **extras, coil_length=s * np.sqrt(3))  # L²/12 = (s/2)²
    assert eight.command_positions == pytest.approx(np.array(four.positions))
    ours, theirs = operating_point(eight).plant(), linearise(four).plant
    assert ours.outputs == theirs.outputs
    # the guideway reaches every half coil by itself: the same under both is what it is under the whole one
    kinds = ("zeta", "eta", "bank")
    both = np.array([[_same_input(mine, other, kinds) for other in theirs.inputs] for mine in ours.inputs], float)
    for matrix in "ABCD":
        reference = getattr(theirs, matrix)
        found = getattr(ours, matrix) @ both if matrix in "BD" else getattr(ours, matrix)
        assert found == pytest.approx(reference, rel=1e-9, abs=1e-11 * np.abs(reference).max())


def _same_input(mine: str, other: str, kinds) -> bool:
    kind, _, number = mine.rpartition("_")
    return other == (f"{kind}_{(int(number) + 1) // 2}" if kind in kinds else mine)


def test_sets_that_are_not_joined_keep_their_plant():
    plant = linearise(vehicle()).plant
    assert joined(plant, vehicle()) is plant


def test_the_two_coil_vehicle_has_four_commands_and_flies_with_a_lost_coil():
    problem = load_problem("two_coil_corner")
    assert problem.law.count == 4
    assert problem.vehicle.count == 8
    point = operating_point(problem.vehicle, Conditions(lost_set=1))
    assert point.deviation[0].min() > -0.2  # the control coils hang 0.1 m below, the nominal gap is 0.3 m
    assert point.plant().inputs[:4] == ("command_1", "command_2", "command_3", "command_4")


def test_the_computed_law_gives_the_vehicle_of_the_printed_coefficients():
    printed = load_problem("comfort_limit").setting.plant
    computed = data({**COILS, "physics": "report"}).build().setting.plant
    # printed to four or five digits; the roll moment's derivative by roll is 0.7 % off in the report (ledger, A.3)
    assert computed.poles().imag.max() == pytest.approx(printed.poles().imag.max(), rel=1e-3)
    assert np.abs(computed.B - printed.B).max() < 2e-3 * np.abs(printed.B).max()


def test_slower_vehicles_fly_lower_and_drag_more():
    coils = FlyingCoils(levitation=Levitation())
    flights = [flight(coils, speed) for speed in (30.0, 60.0, 134.0)]
    assert np.all(np.diff([f.gap for f in flights]) > 0)
    assert np.all(np.diff([1 / f.exact.drag_ratio for f in flights]) > 0)
    # the weight is carried at every speed; the gap is solved to 1e-10 m
    lifts = [f.exact.forces(0.0, 0.0, 0.0, 0.0)[0] for f in flights]
    assert lifts == pytest.approx([444800 / 4] * 3, rel=1e-8)
    slopes = [*flights[-1].exact.stiffness()[0], flights[-1].exact.current_action()[0]]
    assert [lifts[-1], *slopes] == pytest.approx(report_first_order().lift, rel=1e-3)  # as printed, up to five digits


def test_the_lift_off_speed_is_the_one_whose_gap_is_the_smallest_allowed():
    coils = FlyingCoils(levitation=Levitation(), gap_minimum=0.25)
    slowest = lift_off(coils)
    assert flight(coils, slowest * 1.0001).gap == pytest.approx(0.25, abs=1e-4)
    with pytest.raises(
        InputError, match=r"the speed must not be below lift-off \(.* m/s for 444800 N at a gap of 0.25 m\); got"
    ):
        flight(coils, slowest * 0.99)


def test_a_held_gap_asks_for_more_current_at_lower_speed():
    coils = FlyingCoils(levitation=Levitation(), hold="gap")
    slow, fast = flight(coils, 50.0), flight(coils, 134.0)
    assert slow.gap == fast.gap == 0.3
    assert slow.current > fast.current


def test_a_problem_can_be_taken_to_another_speed():
    changed = data(COILS).at_speed(60.0).build()
    assert changed.vehicle.speed == changed.setting.speed == 60.0
    assert changed.setting.clearance[0] < 0.3


def test_an_expansion_and_the_exact_law_have_the_same_plant_in_nominal_flight():
    exact = data(COILS).build().setting.plant
    order = data({**COILS, "kind": "taylor", "expansion_order": 1}).build().setting.plant
    # the expansion differentiates the same energy: rounding
    assert pytest.approx(exact.A, rel=1e-7, abs=1e-7) == order.A


@pytest.mark.parametrize(
    ("law", "changes", "sentence"),
    [
        (None, {"operating_point": {"speed_m_s": 60.0}}, "must stay at the speed of its coefficients, 134 m/s"),
        (COILS, {"operating_point": {"speed_m_s": 2.0}}, "the speed must not be below lift-off"),
        (COILS, {"vehicle": {"gap_minimum_m": 0.05}}, "gap_minimum must be more than 0.1 m"),
        (
            {**COILS, "physics": "report"},
            {"operating_point": {"speed_m_s": 100.0}},
            "physics 'report' must stay at 134 m/s",
        ),
        (COILS, {"operating_point": {"lost_set": 7}}, "lost_set must be 1 … 4"),
        (COILS, {"operating_point": {"side_force_n": 5e6}}, "no equilibrium carried by pose"),
        (COILS, {"vehicle": {"joined_sets": [[1, 2], [3, 4]]}}, "coil sets that share a command must sit on one side"),
        (COILS, {"vehicle": {"joined_sets": [[1], [2], [3]]}}, "joined must name each of the 4 coil sets once"),
    ],
)
def test_impossible_points_are_refused_with_a_sentence(law, changes, sentence):
    with pytest.raises((InputError, InfeasibleError), match=sentence):
        data(law, **changes).build()


@pytest.mark.parametrize(
    ("law", "key"),
    [({**COILS, "plate_thickness_m": 0.0}, "plate_thickness_m"), ({**COILS, "expansion_order": 2}, "expansion_order"),
     ({**COILS, "kind": "taylor", "expansion_order": 9}, "expansion_order"),
     ({**COILS, "control_below_m": -0.1}, "control_below_m")],
)  # fmt: skip
def test_impossible_force_laws_name_their_key(law, key):
    with pytest.raises(InputError, match=key):
        data(law)


def test_a_control_coil_below_the_floor_is_refused():
    with pytest.raises(InputError, match="stay clear of the guideway"):
        data({**COILS, "control_below_m": 0.3}, vehicle={"gap_minimum_m": 0.5}).build()

"""Every number of the data, the operating point and a variation acts once: as in a vehicle whose data say so."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from workbench.analysis.analysis import analyse
from workbench.constants import GRAVITY
from workbench.errors import InfeasibleError, InputError
from workbench.files.problem import ProblemData, load_problem, parse_problem, shipped_folder
from workbench.physics.vehicle import varied
from workbench.physics.vehicle.operating import operating_point

WEIGHT = 444800.0


def data(name="comfort_limit", **changes) -> ProblemData:
    mapping = tomllib.loads((shipped_folder() / name / "data.toml").read_text())
    for block, values in changes.items():
        mapping[block] = {**mapping.get(block, {"source": "test"}), **values}
    return ProblemData(parse_problem(mapping), "changed", "0" * 64, None)


def lift(point) -> float:
    """Of all coil sets where the vehicle rests [N]."""
    law = point.vehicle.force_law
    each = (law.forces(*d, a)[0] for d, a in zip(point.deviation.T, point.trim.currents, strict=True))
    return float(point.strength @ np.array(list(each)))


def same_plant(one, other, rel=1e-9):
    assert one.inputs == other.inputs
    for letter in "ABCD":
        reference = getattr(other, letter)
        # two trims of one equilibrium agree to 1e-9 m; slopes of 1e7 N/m² then to 1e-2 of 1e6 N/m
        assert getattr(one, letter) == pytest.approx(reference, rel=rel, abs=1e-8 * np.abs(reference).max()), letter


@pytest.mark.parametrize("kind", [{}, {"kind": "taylor", "expansion_order": 2}])
def test_a_weight_at_the_operating_point_is_that_weight_in_the_data(kind):
    heavy = {"weight_n": 1.1 * WEIGHT}
    at_point = data("coil_vehicle", force_law=kind, operating_point=heavy)
    same_plant(
        at_point.build().setting.plant, data("coil_vehicle", force_law=kind, vehicle=heavy).build().setting.plant
    )
    # the numbers: 489.3 kN are due, 533.8 kN were carried
    assert lift(at_point.operating_point()) == pytest.approx(489280.0, rel=1e-9)
    assert at_point.vehicle().mass == pytest.approx(489280.0 / GRAVITY, rel=1e-12)


@pytest.mark.parametrize("carrier", ["pose", "currents"])
@pytest.mark.parametrize(
    ("name", "law"),
    [("comfort_limit", {}), ("coil_vehicle", {}), ("coil_vehicle", {"physics": "report"}),
     ("coil_vehicle", {"hold": "gap"}), ("coil_vehicle", {"kind": "taylor", "expansion_order": 2})],
)  # fmt: skip
def test_whoever_carries_it_the_coils_lift_the_weight(name, law, carrier):
    point = data(
        name, force_law=law, operating_point={"weight_n": 1.1 * WEIGHT, "carried_by": carrier}
    ).operating_point()
    help_down = point.nominal.external[0]  # printed coefficients leave 3 N
    assert lift(point) == pytest.approx(1.1 * WEIGHT + help_down, rel=1e-8)
    assert abs(help_down) < 1e-4 * WEIGHT
    if carrier == "currents":
        assert np.abs(point.deviation[0]).max() < 1e-9


@pytest.mark.parametrize(("name", "law"), [("comfort_limit", {}), ("coil_vehicle", {})])
def test_a_variation_of_mass_multiplies_the_mass_of_the_operating_point(name, law):
    changed = data(name, force_law=law, operating_point={"weight_n": 0.95 * WEIGHT})
    for factor in (0.85, 1.0, 1.15):
        vehicle, _ = changed.elsewhere({"mass": factor})
        found = changed.operating_point(vehicle).vehicle.mass
        assert found == pytest.approx(factor * 0.95 * WEIGHT / GRAVITY, rel=1e-12)


def test_damping_depends_on_the_mass_whatever_the_operating_point():
    gains = load_problem("comfort_limit").approved
    changed = data(operating_point={"weight_n": 0.97 * WEIGHT})
    found = [analyse(changed.elsewhere({"mass": factor})[1], gains).damping for factor in (0.85, 1.0, 1.15)]
    assert np.abs(np.diff(found)).min() > 1e-3


@pytest.mark.parametrize("key", ["roll", "pitch", "yaw"])
def test_a_variation_of_an_inertia_is_that_inertia_in_the_data(key):
    own = getattr(data().file.inertia, f"{key}_kg_m2")
    wide = {f"{key}_kg_m2": 1.003 * own, f"{key}_range_kg_m2": [own, 1.01 * own]}
    same_plant(data().elsewhere({f"{key}_inertia": 1.003})[1].plant, data(inertia=wide).build().setting.plant)


def test_variations_of_the_forces_are_coefficients_in_the_data():
    law = data().file.force_law
    rows = {name: getattr(law, name) for name in ("lift", "lateral", "moment")}
    currents = {name: [*row[:4], 1.1 * row[4]] for name, row in rows.items()}
    gaps = {name: [row[0], *(1.08 * k for k in row[1:4]), row[4]] for name, row in rows.items()}
    same_plant(data().elsewhere({"current_force": 1.1})[1].plant, data(force_law=currents).build().setting.plant)
    same_plant(data().elsewhere({"gap_force": 1.08})[1].plant, data(force_law=gaps).build().setting.plant)


def test_a_moved_centre_of_gravity_is_that_of_the_data():
    free = {"balance": "pose"}
    moved = data(operating_point={**free, "cg_forward_m": 0.4})
    drawn = data(operating_point=free, vehicle={"front_arm_m": 8.6, "rear_arm_m": 8.05})
    same_plant(moved.operating_point().plant(), drawn.operating_point().plant())
    twice = data(operating_point={**free, "cg_forward_m": 0.1}).elsewhere({"cg_forward_m": 0.3})[1].plant
    same_plant(twice, moved.operating_point().plant())


def test_a_speed_of_the_operating_point_or_of_a_variation_is_that_of_the_data_at_the_same_current():
    slow = data("coil_vehicle", operating_point={"speed_m_s": 60.0}).build().setting
    same_plant(slow.plant, data("coil_vehicle", vehicle={"speed_m_s": 60.0}).build().setting.plant)
    same_plant(data("coil_vehicle").elsewhere({"speed_m_s": 60.0})[1].plant, slow.plant)


def test_a_share_lost_is_lost_once_from_a_set_whose_current_helps_at_rest():
    point = data(operating_point={"balance": "currents", "lost_set": 1, "lost_share": 0.1}).operating_point()
    assert lift(point) == pytest.approx(WEIGHT, rel=1e-3)  # pitched drag carries a little
    assert point.trim.currents == pytest.approx(point.nominal.currents, abs=1e-15)


@pytest.mark.parametrize("force", [1.0e5, 2.0e6])
def test_a_force_law_that_does_not_carry_the_weight_is_refused(force):
    rows = data().file.force_law
    with pytest.raises(InputError, match="must carry the weight of 444800 N at the nominal pose; a force down of"):
        data(force_law={"lift": [force, *rows.lift[1:]]}).build()


@pytest.mark.parametrize("force", [1.0e5, 2.0e6])
def test_a_vehicle_of_ones_own_whose_law_does_not_carry_it_has_no_operating_point(force):
    vehicle = data().vehicle()
    weak = vehicle.with_values(force_law=replace(vehicle.force_law, lift=(force, *vehicle.force_law.lift[1:])))
    with pytest.raises(InputError, match="must carry the weight of 444800 N at the nominal pose; a force down of"):
        operating_point(weak)
    with pytest.raises(InputError, match="a pitch moment of"):
        operating_point(vehicle.with_values(positions=tuple((x + 3.0, y) for x, y in vehicle.positions)))


def test_a_heavier_vehicle_of_a_variation_is_held_in_the_pose_of_the_one_it_varies():
    point = data().operating_point(varied(data().vehicle(), mass=1.15))
    assert not point.trim.pose.any()
    assert point.trim.external[0] == pytest.approx(-0.15 * 444800, rel=1e-9)


def test_a_force_law_that_leaves_a_moment_is_refused():
    with pytest.raises(InputError, match="a pitch moment of"):
        data(vehicle={"front_arm_m": 12.0}).build()
    lop = [[9.0, 0.965], [9.0, -0.5], [-7.65, 0.965], [-7.65, -0.5]]
    with pytest.raises(InputError, match="a roll moment of"):
        data(vehicle={"coil_sets_m": lop}).build()


@pytest.mark.parametrize(("force", "accepted"), [(1.1120e5 * (1 + 9e-4), True), (1.1120e5 * (1 + 11e-4), False)])
def test_four_printed_digits_of_the_lift_are_enough(force, accepted):
    changed = data(force_law={"lift": [force, *data().file.force_law.lift[1:]]})
    if accepted:
        changed.build()
        return
    with pytest.raises(InputError, match="must carry the weight"):
        changed.build()


def test_the_same_law_in_another_unit_is_refused():
    law = data().file.force_law
    kilonewtons = {name: [k / 1e3 for k in getattr(law, name)] for name in ("lift", "lateral", "moment")}
    with pytest.raises(InputError, match="must carry the weight"):
        data(force_law=kilonewtons).build()


def test_an_equilibrium_more_than_a_gap_away_is_refused():
    rows = data().file.force_law
    changed = data(force_law={"lift": [4e5, *rows.lift[1:]]}, operating_point={"balance": "pose"})
    with pytest.raises(InfeasibleError, match="less than a gap away from its nominal pose"):
        changed.build()


def test_the_clearance_is_the_least_distance_of_any_coil():
    # the control coil hangs 0.1 m below the main coil
    assert data("coil_vehicle").build().setting.clearance == pytest.approx((0.2, 0.3), abs=1e-6)
    ahead = data("coil_vehicle", operating_point={"cg_forward_m": 0.5}).build().setting
    assert ahead.clearance[0] == pytest.approx(0.193, abs=5e-4)
    # a side wind moves all sets alike: what the right ones gain of their wall the left ones lose
    blown = data("coil_vehicle", operating_point={"side_force_n": 5000.0}).operating_point()
    nearest = blown.clearance(data("coil_vehicle").file.force_law.coils(), 0.3, 0.3)
    assert nearest[1] < 0.3 - 0.5 * np.abs(blown.deviation[1]).max()
    lower = data(force_law={"control_below_m": 0.15}).build().setting
    assert lower.clearance[0] == pytest.approx(0.15, abs=1e-12)

"""The closed loop derived a second time: exact rationals against the workbench's own matrices, pole by pole."""

import numpy as np
import pytest
from flint import fmpq

from workbench.control import GAIN_NAMES
from workbench.physics.vehicle import varied
from workbench.verify.exact.failure import NotProved, TableError
from workbench.verify.exact.system import System, zeros
from workbench.verify.vehicle.law import GAIN_NAMES as NAMES_OF_THE_CHECKER
from workbench.verify.vehicle.loop import closed_loop, factors, left_out
from workbench.verify.vehicle.table import table_of

TIGHT = 1e-12  # relative to the largest: two orders of the same sums in doubles


def floats(matrix):
    return np.array([[float(x) for x in row] for row in matrix.tolist()])


def response(system, omega):
    A, B, C, D = map(floats, (system.A, system.B, system.C, system.D))
    return C @ np.linalg.solve(1j * omega * np.eye(len(A)) - A, B) + D


@pytest.fixture(scope="module", params=["revenue", "heave", "hybrid"])
def file(request):
    return request.getfixturevalue(request.param)


def test_poles_are_those_of_the_workbenchs_own_closed_loop(file):
    table, problem = table_of(file.document), file.design.problem
    for one in problem.subjects:
        ours = np.sort_complex(np.linalg.eigvals(floats(closed_loop(table, one.name).A)))
        theirs = np.sort_complex(one.close(file.design.gains).poles())
        assert len(ours) == len(theirs)
        # 1e-9: the slowest filters' poles nearly coincide, and move by the root of the rounding
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)


def test_every_response_of_the_closed_loop_is_the_workbenchs_own(file):
    table, problem = table_of(file.document), file.design.problem
    for one in problem.subjects:
        loop, closed = closed_loop(table, one.name), one.close(file.design.gains)
        root = np.sqrt([float(d) for d in loop.lengths])
        patterns = [f"error_{c}" for c in one.commands]
        outer = [name for name in closed.inputs if name not in patterns]
        for omega in (0.0, 2.0, 30.0):
            ours = response(loop.system.select(outer, problem.setting.plant.outputs), omega)
            theirs = closed.select(inputs=outer, outputs=problem.setting.plant.outputs).response([omega])[0]
            assert np.abs(ours - theirs).max() < TIGHT * np.abs(theirs).max()
            ours = response(loop.sensitivity, omega) * root[:, None] / root
            theirs = closed.select(inputs=patterns, outputs=one.commands).response([omega])[0]
            assert np.abs(ours - theirs).max() < 1e-11  # of about 1; S near 0 Hz is a small difference


def test_a_filter_without_gain_has_no_state_and_a_rate_without_filter_no_loop(revenue):
    def without(name, tau=None):
        return table_of(revenue.changed(lambda d: d["gains"].update({name: "0", **({tau: "0"} if tau else {})})))

    assert closed_loop(without("K_hdot"), "heave_pitch").A.nrows() == 8  # 2 × (2 + 1 current) + 2 filters of 4
    assert closed_loop(without("K_zdot", "tau_z"), "heave_pitch").A.nrows() == 8
    with pytest.raises(NotProved, match="a gap rate is taken without a filter"):
        closed_loop(table_of(revenue.changed(lambda d: d["gains"].update(tau_h="0"))), "heave_pitch")


def test_an_actuator_takes_its_signal_from_the_coils(hybrid):
    table = table_of(hybrid.document)
    spread = table.law.spread()
    assert all(entry == 0 for entry in spread["sway"][:4])
    assert all(entry == 0 for entry in spread["yaw"][:4])
    patterns, lengths = table.law.patterns("sway_roll_yaw")
    assert patterns.ncols() == 3  # the coils' difference pattern is never commanded
    assert [int(d) for d in lengths] == [4, 2, 2]


def test_the_whole_vehicle_has_the_poles_of_both_groups(revenue):
    table = table_of(revenue.document)
    groups = [np.linalg.eigvals(floats(closed_loop(table, g).A)) for g in ("heave_pitch", "sway_roll_yaw")]
    whole = np.linalg.eigvals(floats(closed_loop(table, "all").A))
    np.testing.assert_allclose(
        np.sort_complex(whole), np.sort_complex(np.concatenate(groups)), rtol=1e-6, atol=1e-6
    )  # near-triple poles of three equal filters: the cube root of rounding


def test_a_lopsided_plant_is_refused_by_group(revenue):
    def lopsided(document):
        plant = document["plant"]
        plant["A"][plant["states"].index("Z_rate")][plant["states"].index("Phi")] = "0.01"

    table = table_of(revenue.changed(lopsided))
    with pytest.raises(NotProved, match="heave and pitch are coupled with sway, roll and yaw"):
        closed_loop(table, "heave_pitch")
    assert float(left_out(table, "heave_pitch")) > 1e-5
    assert closed_loop(table, "all").A.nrows() == 24
    with pytest.raises(TableError, match="a group must be one of"):
        closed_loop(table, "wheels")


def test_factors_of_one_give_the_printed_poles(revenue):
    table = table_of(revenue.document)
    one, printed = (
        np.sort_complex(np.linalg.eigvals(floats(closed_loop(table, "sway_roll_yaw", theta).A)))
        for theta in (dict.fromkeys(("mass", "inertia", "current_force", "gap_force"), fmpq(1)), {})
    )
    np.testing.assert_allclose(one, printed, rtol=1e-8, atol=1e-8)  # near-double poles, as above
    assert factors({"inertia": fmpq(2), "roll_inertia": fmpq(3)})["roll_inertia"] == 6


def test_a_varied_loop_is_that_of_a_vehicle_with_those_inertias(revenue):
    """Other masses in the data, the same coil forces: what the factors on mass and inertia mean."""
    problem = revenue.design.problem
    table = table_of(revenue.document)
    v = problem.vehicle
    # a heavier vehicle on the same coils: its surplus weight is carried by a constant help, as the nominal moment is
    heavier = v.with_values(
        mass=v.mass * 1.15, roll_inertia=v.roll_inertia * 0.9, pitch_inertia=v.pitch_inertia * 1.1,
        yaw_inertia=v.yaw_inertia * 1.05,
    )  # fmt: skip
    theta = {
        "mass": fmpq(115, 100), "roll_inertia": fmpq(9, 10), "pitch_inertia": fmpq(11, 10),
        "yaw_inertia": fmpq(105, 100),
    }  # fmt: skip
    for one in problem.with_vehicle(heavier).subjects:
        ours = np.sort_complex(np.linalg.eigvals(floats(closed_loop(table, one.name, theta).A)))
        theirs = np.sort_complex(one.close(revenue.design.gains).poles())
        np.testing.assert_allclose(ours, theirs, rtol=1e-8, atol=1e-8)  # near-double poles, as above


@pytest.mark.parametrize(
    "values", [{"current_force": 1.1, "gap_force": 0.92}, {"mass": 0.85, "gap_force": 1.08, "yaw_inertia": 0.9}]
)
def test_factors_mean_what_they_mean_for_a_varied_vehicle(revenue, values):
    problem, table = revenue.design.problem, table_of(revenue.document)
    theta = {name: fmpq(round(100 * value), 100) for name, value in values.items()}
    for one in problem.with_vehicle(varied(problem.vehicle, **values)).subjects:
        ours = np.sort_complex(np.linalg.eigvals(floats(closed_loop(table, one.name, theta).A)))
        theirs = np.sort_complex(one.close(revenue.design.gains).poles())
        np.testing.assert_allclose(ours, theirs, rtol=1e-8, atol=1e-8)  # near-double poles, as above


def test_without_the_vehicle_behind_the_plant_no_factor_has_a_meaning(revenue):
    table = table_of(revenue.changed(lambda d: d["certificate"].update(physics=None)))
    with pytest.raises(NotProved, match="needs the vehicle behind the plant"):
        closed_loop(table, "heave_pitch", {"mass": fmpq(11, 10)})


def test_an_unknown_factor_and_a_mass_that_vanishes_are_refused(revenue):
    table = table_of(revenue.document)
    with pytest.raises(NotProved, match="a box over 'wheels' is not known"):
        closed_loop(table, "heave_pitch", {"wheels": fmpq(1)})
    with pytest.raises(NotProved, match="must keep mass and inertias positive"):
        closed_loop(table, "heave_pitch", {"mass": fmpq(0)})


def test_the_seventeen_names_are_the_workbenchs():
    assert NAMES_OF_THE_CHECKER == GAIN_NAMES


def test_missing_signals_are_refused_by_name():
    empty = System(zeros(1, 1), zeros(1, 1), zeros(1, 1), zeros(1, 1), ("x",), ("u",), ("y",))
    with pytest.raises(TableError, match="must have 'Z' among its states; it has x"):
        empty.index("states", ["Z"])

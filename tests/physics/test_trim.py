"""Where the vehicle rests: the printed geometry is not in equilibrium."""

import numpy as np
import pytest

from workbench.control.loop import close
from workbench.errors import InfeasibleError, InputError
from workbench.ledger.baseline import report_gains, report_law, report_model, report_vehicle
from workbench.physics.vehicle import linearise, trim


def test_the_lift_carries_the_weight():
    assert trim(report_vehicle()).residual[0] == pytest.approx(0.0, abs=25)  # 4 F_L0 = 444.80 kN, five printed digits


def test_the_printed_geometry_leaves_a_pitch_moment():
    # 2 (a_F − a_R) F_L0 − 4 c K_1 (F_L0 + F_G0), Table B-1
    assert trim(report_vehicle()).residual[1] == pytest.approx(2.88e5, rel=2e-3)


def test_the_moment_tilts_the_free_vehicle_by_a_milliradian():
    assert trim(report_vehicle(), "pose").pose[1] == pytest.approx(1.2e-3, abs=5e-5)


def test_with_the_printed_position_gain_it_tilts_six_times_as_far():
    # static response of the closed loop to the moment left over: softening multiplies trim errors
    loop = close(report_model().plant, report_law(), report_gains()).system
    given = loop.index("inputs", ["moment_pitch"])[0]
    pitch, front, rear = loop.index("outputs", ["Theta", "gap_1", "gap_3"])
    static = loop.response(0.0)[0][:, given].real * trim(report_vehicle()).residual[1]
    assert static[pitch] == pytest.approx(6.5e-3, abs=5e-5)
    assert static[front] == pytest.approx(54e-3, abs=5e-4)  # with the coupled heave
    assert static[rear] == pytest.approx(-54e-3, abs=5e-4)
    free = report_model().plant.response(0.0)[0][:, report_model().plant.index("inputs", ["moment_pitch"])[0]].real
    assert static[pitch] / (free[1] * trim(report_vehicle()).residual[1]) == pytest.approx(5.6, abs=0.1)


@pytest.mark.parametrize("by", ["moment", "currents", "cg", "pose"])
def test_every_trim_is_at_rest(by):
    found = trim(report_vehicle(), by)
    motion_at_rest = linearise(found.vehicle, found)
    assert np.isfinite(motion_at_rest.stiffness).all()
    again = trim(found.vehicle, "moment") if by == "cg" else None
    if again is not None:
        assert np.abs(again.residual[:2]).max() < 1e-3  # N, N m: the shifted centre of gravity leaves nothing


def test_a_trim_by_currents_holds_the_nominal_pose():
    found = trim(report_vehicle(), "currents")
    assert found.pose == pytest.approx(np.zeros(5), abs=1e-12)
    # front and rear currents of opposite sign carry the moment
    assert found.currents[0] < 0 < found.currents[2]


def test_a_side_wind_is_carried_with_a_slip():
    found = trim(report_vehicle(), "pose", external=(0.0, 0.0, 1e4, 0.0, 0.0))
    assert found.pose[2] > 0  # pushed to the right
    assert found.pose[2] == pytest.approx(1e4 / 1.2972e6, rel=0.6)  # softened by roll


def test_loads_beyond_reach_are_said_to_be_so():
    with pytest.raises(InfeasibleError, match="no equilibrium by pose was found"):
        trim(report_vehicle(), "pose", external=(0.0, 1e10, 0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="unknown trim 'ballast'"):
        trim(report_vehicle(), "ballast")

"""Every force law answers alike: its tangent is the derivative of its forces, for one coil set and for many."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest

from workbench.ledger.baseline import report_vehicle
from workbench.physics.forces.law import (
    ForceLaw,
    Tangent,
    formula_tangent,
    report_extended,
    report_first_order,
)
from workbench.physics.forces.operating import law_at
from workbench.physics.forces.taylor import TaylorLaw
from workbench.physics.vehicle import linearise
from workbench.physics.vehicle.variation import ScaledLaw

DEVIATION = np.array([[0.01, -0.02, 0.0], [0.005, 0.0, -0.01], [0.002, -0.003, 0.0]])
ALPHA = np.array([0.05, -0.1, 0.0])


@dataclass(frozen=True)
class Springs:
    """A law from outside: cubic springs, a current that pulls; nothing of the workbench but one line."""

    drag_ratio: float = 0.02
    affine: bool = False

    def forces(self, gap_change, gap_lateral_change, roll, alpha):
        lift = 1.112e5 - 9e5 * gap_change + 4e6 * gap_change**3 + 3.4e5 * alpha * (1 - 2 * gap_change)
        return lift, 4e4 - 3e5 * gap_lateral_change, -2e4 * roll + 1e4 * alpha

    def tangent(self, deviation: np.ndarray, alpha: np.ndarray) -> Tangent:
        return formula_tangent(self, deviation, alpha)


LAWS = {
    "first order": report_first_order(),
    "extended": report_extended(),
    "corner": law_at(),
    "taylor": TaylorLaw.from_corner(law_at(), 2),
    "scaled": ScaledLaw(report_extended(), 0.9, 1.2),
    "scaled affine": ScaledLaw(report_first_order(), 0.9, 1.2),
    "from outside": Springs(),
}


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_a_tangent_is_value_and_slope_of_the_forces_of_each_set(law):
    assert isinstance(law, ForceLaw)
    values, slopes = law.tangent(DEVIATION, ALPHA)
    point = ca.SX.sym("point", 4)
    forces = ca.vertcat(*law.forces(*ca.vertsplit(point)))
    exact = ca.Function("exact", [point], [forces, ca.jacobian(forces, point)])
    assert values.shape == (3, 3)
    assert slopes.shape == (3, 12)
    for i, place in enumerate(np.vstack([DEVIATION, ALPHA]).T):
        value, slope = exact(place)
        size = np.abs(slope.full()).max()
        np.testing.assert_allclose(values[:, [i]], value.full(), rtol=1e-12, atol=1e-12 * size)  # rounding
        np.testing.assert_allclose(slopes[:, 4 * i : 4 * i + 4], slope.full(), rtol=1e-11, atol=1e-12 * size)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_affine_says_whether_the_slopes_depend_on_the_place(law):
    _, here = law.tangent(DEVIATION, ALPHA)
    _, there = law.tangent(2 * DEVIATION, -ALPHA)
    assert law.affine == bool(np.array_equal(here, there))


def test_a_law_from_outside_flies_the_vehicle():
    vehicle = report_vehicle().with_values(force_law=Springs())
    lin = linearise(vehicle)
    assert lin.stiffness[0, 0] == pytest.approx(-4 * 9e5, rel=1e-12)  # four sets, lift per gap, Z down against the gap
    assert lin.current[0] == pytest.approx([-3.4e5] * 4, rel=1e-12)

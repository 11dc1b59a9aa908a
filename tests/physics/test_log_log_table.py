"""Facts about piecewise power laws."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad

from workbench.physics.guideway.interpolation import LogLog

TABLE = LogLog((1.0, 4.0, 8.0, 80.0), (2.0, 1.0, 1.0, 10.0))


def test_the_points_lie_on_the_curve():
    np.testing.assert_allclose(TABLE.value(np.array(TABLE.x)), TABLE.y, rtol=1e-14)  # logarithm and exponential


def test_halfway_in_logarithm_lies_the_geometric_mean():
    assert TABLE.value(2.0) == pytest.approx(2**0.5, rel=1e-14)


def test_the_integral_is_the_area_also_where_the_law_is_one_over_x():
    for table in (TABLE, LogLog((1.0, 10.0, 20.0), (1.0, 0.1, 3.0))):
        area = sum(
            quad(table.value, a, b, epsabs=0, epsrel=1e-12)[0]
            for a, b in zip((0.5, *table.x), (*table.x, 100.0), strict=True)
        )
        assert table.integral(0.5, 100.0) == pytest.approx(area, rel=1e-11)


def test_a_derivative_of_the_symbolic_curve_is_its_power():
    x = ca.SX.sym("x")
    slope = ca.Function("slope", [x], [ca.jacobian(TABLE.value(x), x) * x / TABLE.value(x)])
    assert float(slope(2.0)) == pytest.approx(-0.5, rel=1e-13)
    assert float(slope(20.0)) == pytest.approx(1.0, rel=1e-13)

"""The data and pictures of Figures A-2 to A-9."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from workbench.errors import InputError
from workbench.plots.forces import (
    corner_curves,
    lift_curves,
    pair_curves,
    plot_coefficient,
    plot_lift,
    plot_pair,
    plot_speed,
    speed_curves,
)


@pytest.fixture
def ax():
    figure, axes = plt.subplots()
    yield axes
    plt.close(figure)


def test_figure_3_passes_through_the_printed_lift_coefficient():
    curves = corner_curves("lift", heights=[0.3], gaps_lateral=[0.3])
    assert curves.values[0, 0] == pytest.approx(0.7187, abs=5e-5)  # A.3, four digits


def test_figure_6_adds_up_to_the_printed_action_of_the_current():
    below = pair_curves("lift", 0.1, heights=[0.3], gaps_lateral=[0.3]).values[0, 0]
    above = pair_curves("lift", -0.1, heights=[0.2], gaps_lateral=[0.3]).values[0, 0]
    # A.3: F_Lα = 3.3981(05), the sum of contributions (b) and (c); two coefficients of four decimals, five digits
    assert 0.8380 * 184635 * (below + above) == pytest.approx(3.3981e5, abs=21)


def test_figure_9_passes_through_the_quarter_weight():
    curves = lift_curves(heights=[0.3, 0.35], alphas=[0.0])
    assert curves.values[0, 0] == pytest.approx(444800 / 4, abs=5)  # A.3, five digits
    assert curves.values[0, 1] < curves.values[0, 0]


def test_figure_2_rises_in_lift_over_drag():
    curves = speed_curves(np.array([5.0, 30.0, 134.0]))
    assert np.all(np.diff(curves.lift_to_drag) > 0)
    assert curves.lift_ratio[-1] == pytest.approx(0.879, abs=1e-3)  # slab of 59 % IACS, not the report's 0.8380


def test_pictures_draw_into_the_axes_given_and_return_them(ax):
    assert plot_speed(speed_curves(np.array([5.0, 134.0])), ax=ax) is ax
    assert ax.get_xlabel() == "speed [m/s]"
    curves = corner_curves("moment", heights=[0.2, 0.3])
    assert len(plot_coefficient(curves, ax=ax).get_legend().get_texts()) >= len(curves.parameter)
    assert plot_pair("lateral", ax=ax) is ax
    assert plot_lift(lift_curves(), weight_share=111200.0, ax=ax) is ax


def test_a_coefficient_that_is_none_is_refused():
    with pytest.raises(InputError, match="unknown coefficient 'lfit'; did you mean 'lift'"):
        corner_curves("lfit")

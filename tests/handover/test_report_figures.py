"""Spectra, loops and pictures of a design against the exact analysis."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from workbench.analysis.comfort import boundary
from workbench.analysis.loop_curve import loop_curves
from workbench.analysis.mode import Mode
from workbench.analysis.spectra import response_spectra
from workbench.design.tradeoff import TradeOff
from workbench.errors import InputError
from workbench.plots.design import plot_roots
from workbench.plots.nyquist import plot_nyquist
from workbench.plots.spectra import plot_acceleration, plot_current, plot_gap
from workbench.plots.tradeoff import plot_tradeoff


@pytest.fixture
def ax():
    return Figure().add_subplot()


@pytest.fixture(scope="module")
def spectra(design):
    return response_spectra(design.problem.setting, design.gains)


def test_the_area_under_every_density_is_the_exact_mean_square(design):
    # tails ∝ 1/f² of acceleration beyond 1e5 Hz and the flat start below 1e-4 Hz hold less than 1e-4 of each area;
    # guide, Definitions: Roughness: a grid must agree to 1e-3
    wide = response_spectra(design.problem.setting, design.gains, np.geomspace(1e-4, 1e5, 1801))
    for quantity, place in wide.density:
        exact = design.analysis.rms[quantity][place]
        assert wide.rms(quantity, place) ** 2 == pytest.approx(exact**2, rel=1e-3), (quantity, place)


def test_densities_are_real_and_not_negative(spectra):
    for values in spectra.density.values():
        assert values.dtype == float
        assert values.min() >= 0


def test_a_correlation_of_the_types_changes_densities_but_not_the_uncorrelated_sum(design):
    from dataclasses import replace

    setting = design.problem.setting
    R = np.eye(4)
    R[0, 3] = R[3, 0] = 0.8  # A1 with A4: both act through heave and pitch
    tied = replace(setting, guideway=replace(setting.guideway, correlation=tuple(map(tuple, R.tolist()))))
    f = np.geomspace(0.1, 10, 20)
    plain = response_spectra(setting, design.gains, f)
    one = response_spectra(tied, design.gains, f)
    R[0, 3] = R[3, 0] = -0.8
    other = response_spectra(
        replace(setting, guideway=replace(setting.guideway, correlation=tuple(map(tuple, R.tolist())))), design.gains, f
    )
    mean = (one.density["gap", "front"] + other.density["gap", "front"]) / 2
    np.testing.assert_allclose(mean, plain.density["gap", "front"], rtol=1e-10)  # the cross term is odd in R
    assert not np.allclose(one.density["gap", "front"], plain.density["gap", "front"], rtol=1e-3)


def test_a_problem_of_heave_alone_has_no_lateral_acceleration(heave_design):
    spectra = response_spectra(heave_design.problem.setting, heave_design.gains, np.geomspace(0.1, 10, 9))
    assert not spectra.density["acceleration_y", "cg"].any()
    assert spectra.density["acceleration_z", "cg"].all()


@pytest.mark.parametrize("frequencies", [[1.0], [0.0, 1.0], [2.0, 1.0], [1.0, np.inf], [[1.0, 2.0]]])
def test_frequencies_that_do_not_rise_from_a_positive_one_are_refused(design, frequencies):
    with pytest.raises(InputError, match="frequencies must rise from a positive one"):
        response_spectra(design.problem.setting, design.gains, frequencies)


def test_an_unstable_loop_has_neither_spectra_nor_loops(unstable_design):
    setting, gains = unstable_design.problem.setting, unstable_design.gains
    with pytest.raises(InputError, match="spectra need a stable loop"):
        response_spectra(setting, gains)
    with pytest.raises(InputError, match="must be stable when closed"):
        loop_curves(setting, gains)


def test_no_loop_enters_the_circle_of_its_groups_peak_sensitivity_and_one_comes_near(design):
    curves = loop_curves(design.problem.setting, design.gains)
    assert [(c.group, c.name) for c in curves] == [
        (group, name)
        for group in ("heave_pitch", "sway_roll_yaw")
        for name in ("front and rear together", "front against rear")
    ]
    for group, peak in design.analysis.peak_sensitivity.items():
        distances = [c.closest[0] for c in curves if c.group == group]
        assert min(distances) >= 1 / peak.upper
        # S_ii is one entry of a 2 × 2 matrix whose largest singular value is at most √2 … 2 times its largest entry
        assert min(distances) <= 2 / peak.value


def test_the_loop_of_a_single_channel_has_the_closed_loops_sensitivity(heave_design):
    (curve,) = loop_curves(heave_design.problem.setting, heave_design.gains, np.geomspace(0.05, 20, 4000))
    peak = heave_design.analysis.peak_sensitivity["heave_pitch"]
    # the grid misses the peak by at most its curvature times the square of half a step, 0.08 % of the frequency
    assert 1 / curve.closest[0] == pytest.approx(peak.value, rel=1e-5)
    assert 2 * np.pi * curve.closest[1] == pytest.approx(peak.frequency, rel=2e-3)


def test_pictures_draw_on_the_axes_given_and_return_them(design, spectra, ax):
    assert plot_roots(design.analysis.modes, damping=0.4, decay=0.3, ax=ax) is ax
    assert (
        plot_acceleration(spectra, "lateral", ax=Figure().add_subplot()).get_ylabel() == "acceleration density [g²/Hz]"
    )
    assert plot_gap(spectra, "vertical", ax=Figure().add_subplot()).get_title() == "Gap change"
    assert len(plot_current(spectra, ax=Figure().add_subplot()).lines) == 2
    with pytest.raises(InputError, match="unknown direction 'sideways'"):
        plot_gap(spectra, "sideways", ax=ax)


def test_without_axes_a_picture_makes_its_own(design, spectra):
    import matplotlib.pyplot as plt

    made = [plot_roots(design.analysis.modes), plot_gap(spectra, "lateral"), plot_acceleration(spectra, "vertical")]
    made.append(plot_nyquist(loop_curves(design.problem.setting, design.gains, np.geomspace(0.1, 10, 9))[:1]))
    assert len({id(axes) for axes in made}) == 4
    for axes in made:
        plt.close(axes.figure)


def test_a_picture_shows_every_mode_or_counts_it(design, ax):
    plot_roots(design.analysis.modes, ax=ax)
    drawn = sum(
        len(line.get_xdata())
        for line in ax.lines
        if line.get_label() in ("heave", "pitch", "sway", "roll", "yaw", "filter")
    )
    hidden = int(ax.get_xlabel().split("(")[1].split()[0])
    assert drawn + hidden == len(design.analysis.modes)


def test_the_comfort_boundary_is_drawn_at_its_corners_and_inside_the_picture(spectra, ax):
    mask = boundary("1 h", "vertical").mask()
    plot_acceleration(spectra, "vertical", masks=[mask], ax=ax)
    line = ax.lines[-1]
    assert tuple(line.get_xdata()) == mask.frequency_hz
    assert tuple(line.get_ydata()) == mask.g2_per_hz
    assert max(line.get_ydata()) < ax.get_ylim()[1]


def test_the_sensitivity_circle_has_the_radius_one_over_m(design, ax):
    curves = loop_curves(design.problem.setting, design.gains, np.geomspace(0.1, 10, 50))
    plot_nyquist(curves[:2], peak_sensitivity=2.0, ax=ax)
    (circle,) = [line for line in ax.lines if line.get_label() == "sensitivity 2"]
    radius = np.hypot(np.asarray(circle.get_xdata()) + 1, circle.get_ydata())
    np.testing.assert_allclose(radius, 0.5, rtol=1e-12)


def test_a_trade_off_marks_designs_and_failures_in_millimetres(ax):
    curve = TradeOff(
        quantity="rms gap, front", unit="m", limits=(0.03, 0.02, 0.01), costs=(30.0, 40.0, None), gains=(None,) * 3
    )
    plot_tradeoff(curve, chosen=(0.02, 40.0), ax=ax)
    np.testing.assert_allclose(ax.lines[0].get_xdata(), [20.0, 30.0])
    np.testing.assert_allclose(ax.lines[1].get_xdata(), [10.0])
    nothing = TradeOff(quantity="rms gap, front", unit="m", limits=(0.01,), costs=(None,), gains=(None,))
    with pytest.raises(InputError, match="at least one limit with a design; none of 1 has one"):
        plot_tradeoff(nothing, ax=ax)


def test_an_unstable_real_root_is_drawn_however_far_to_the_right(ax):
    modes = (
        Mode(name="heave", frequency_hz=1.0, damping=0.5, pole=complex(-3.0, 5.0)),
        Mode(name="filter", frequency_hz=300.0, damping=1.0, pole=complex(-2000.0, 0.0)),
        Mode(name="pitch", frequency_hz=80.0, damping=-1.0, pole=complex(500.0, 0.0)),
    )
    plot_roots(modes, ax=ax)
    drawn = [x for line in ax.lines if line.get_marker() != "None" for x in line.get_xdata()]
    assert 500.0 in drawn
    assert ax.get_xlim()[1] > 500.0
    assert "1 stable root" in ax.get_xlabel()  # the fast filter, and nothing else

"""Root loci and parameter studies."""

import matplotlib as mpl
import numpy as np
import pytest

from workbench.control.loop.locus import figure_c1, figure_c2, parameter_study, root_locus
from workbench.control.loop.polynomial import roots_of
from workbench.errors import InputError
from workbench.ledger.baseline import report_gains, report_law, report_model
from workbench.plots.locus import plot_locus, plot_study

mpl.use("Agg")


def test_every_point_of_a_locus_holds_the_roots_of_its_gains():
    plant, law, gains = report_model().plant, report_law(), report_gains()
    locus = root_locus(plant, law, "heave_pitch", gains, ("K_hdot", "K_zdot"), [0.1, 0.2, 0.3])
    for value, roots in zip(locus.values, locus.roots, strict=True):
        expected = roots_of(plant, law, "heave_pitch", gains.with_values(K_hdot=value, K_zdot=value))
        # the filters' −1/τ is a fourfold root, which rounding spreads by the fourth root of 1e-16
        assert np.sort_complex(np.round(roots, 3)) == pytest.approx(np.sort_complex(np.round(expected, 3)), abs=2e-3)


def test_branches_are_continuous():
    locus = root_locus(
        report_model().plant, report_law(), "sway_roll_yaw", report_gains(), "tau_y", np.linspace(0.2, 0.6, 200)
    )
    # a root moves by less than 0.5 rad/s per 2 ms except where branches meet, and there with the square root
    assert np.abs(np.diff(locus.roots, axis=0)).max() < 1.0


def test_figure_c1_passes_through_the_printed_roots():
    # C.5: 0.6 Hz, 0.6 and 0.56 Hz, 0.55 at K_θ = 1 and damping gain 0.15; the last is ours, 0.562
    study = figure_c1(report_model().plant, report_law(), report_gains(), rates=[0.15], pitch_gains=[1.0])
    assert study.modes(0, 0) == pytest.approx(np.array([[0.560, 0.562], [0.614, 0.610]]), abs=5e-4)


def test_one_root_of_figure_c1_hardly_depends_on_the_pitch_gain():
    # C.5: one root is essentially a function of the damping gain, the second depends on both
    study = figure_c1(report_model().plant, report_law(), report_gains(), rates=[0.15], pitch_gains=[0.9, 1.1])
    heave = [min(study.modes(0, j), key=lambda mode: abs(mode[0] - 0.6)) for j in (0, 1)]
    pitch = [max(study.modes(0, j), key=lambda mode: abs(mode[0] - 0.6)) for j in (0, 1)]
    assert abs(heave[0][0] - heave[1][0]) < 0.02
    assert abs(pitch[0][0] - pitch[1][0]) > 0.2


def test_in_figure_c2_a_gain_moves_the_damping_of_two_modes_in_opposite_directions():
    # C.6: a change in gain produces opposite changes in system damping in two related modes
    study = figure_c2(report_model().plant, report_law(), report_gains(), sway_gains=[0.52, 0.54], rates=[0.294])
    low, high = (study.modes(i, 0) for i in (0, 1))
    assert high[0, 1] < low[0, 1] - 0.1
    assert high[1, 1] > low[1, 1] + 0.01


def test_the_printed_gains_are_the_best_damped_of_figure_c2():
    study = figure_c2(report_model().plant, report_law(), report_gains())
    i, j = np.unravel_index(np.argmax(study.least_damping), study.least_damping.shape)
    assert study.first[i] == pytest.approx(0.518, abs=0.01)  # the grid's step
    assert study.second[j] == 0.294


def test_pictures_are_drawn_on_the_given_axes():
    import matplotlib.pyplot as plt

    _, axes = plt.subplots(1, 2)
    study = figure_c1(report_model().plant, report_law(), report_gains(), rates=[0.1, 0.2], pitch_gains=[1.0])
    locus = root_locus(report_model().plant, report_law(), "heave", report_gains(), "K_h", [-1.0, -2.0])
    assert plot_study(study, ax=axes[0]) is axes[0]
    assert plot_locus(locus, ax=axes[1]) is axes[1]
    assert axes[0].get_xlabel() == "undamped frequency [Hz]"
    plt.close("all")


def test_bad_studies_are_refused():
    plant, law, gains = report_model().plant, report_law(), report_gains()
    with pytest.raises(InputError, match="unknown gain 'K_x'"):
        root_locus(plant, law, "heave", gains, "K_x", [1.0])
    with pytest.raises(InputError, match="finite row of numbers"):
        root_locus(plant, law, "heave", gains, "K_h", [np.nan])
    with pytest.raises(InputError, match="order of the polynomial must not change"):
        root_locus(plant, law, "heave", gains, "tau_h", [0.5, 0.0])
    with pytest.raises(InputError, match="must not share a gain"):
        parameter_study(plant, law, "heave", gains, ("K_h", [1.0]), (("K_h", "K_hp"), [1.0]))

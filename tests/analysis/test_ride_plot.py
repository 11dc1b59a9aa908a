"""Facts about the pictures of ride and roughness."""

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pytest

from workbench.analysis.comfort import boundary
from workbench.analysis.ride import third_octaves
from workbench.constants import GRAVITY
from workbench.errors import InputError
from workbench.physics.guideway.catalogue import american, german
from workbench.plots.ride import plot_acceleration_psd, plot_roughness, plot_third_octaves


@pytest.fixture
def ax():
    figure, axes = plt.subplots()
    yield axes
    plt.close(figure)


def level(f):
    return np.full_like(f, GRAVITY**2 * 1e-3)


def labels(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_densities_are_drawn_in_g_squared_per_hertz_beside_their_masks(ax):
    limits = [boundary(duration, "vertical").mask() for duration in ("1 h", "2.5 h")]
    assert plot_acceleration_psd({"cg": level}, masks=limits, ax=ax) is ax
    curve, *masks = ax.get_lines()
    assert curve.get_ydata() == pytest.approx(np.full(600, 1e-3))
    assert masks[0].get_ydata() == pytest.approx(limits[0].g2_per_hz)
    assert masks[0].get_linestyle() != masks[1].get_linestyle()
    assert all(text.endswith("(unverified)") for text in labels(ax)[1:])


def test_an_array_is_drawn_at_its_own_points_without_zeros(ax):
    plot_acceleration_psd({"a": (np.array([1.0, 2.0, 3.0]), np.array([1.0, 0.0, 1.0]))}, ax=ax)
    assert ax.get_lines()[0].get_xdata() == pytest.approx([1.0, 3.0])


def test_third_octaves_are_steps_as_wide_as_their_bands(ax):
    bands = third_octaves(level, low_hz=1, high_hz=10)
    plot_third_octaves({"cg": bands}, boundaries=[boundary("8 h", "vertical")], ax=ax)
    steps = ax.patches[0].get_data()
    assert steps.values == pytest.approx(bands.rms)
    assert steps.edges[1] / steps.edges[0] == pytest.approx(10**0.1)


def test_spectra_are_drawn_only_where_they_are_valid(ax):
    plot_roughness({"class 6": american(6, "vertical"), "low": german("low", "vertical")}, ax=ax)
    limited, free = ax.get_lines()
    assert limited.get_xdata()[[0, -1]] == pytest.approx([1.524, 304.8])
    assert free.get_xdata()[[0, -1]] == pytest.approx([1.0, 1000.0])


def test_a_new_figure_is_made_when_none_is_given():
    axes = plot_roughness({"low": german("low", "vertical")})
    assert axes.get_xlabel() == "wavelength [m]"
    plt.close(axes.figure)


def test_an_axis_that_shows_nothing_is_refused(ax):
    with pytest.raises(InputError, match="must be valid somewhere on the axis"):
        plot_roughness({"class 6": american(6, "vertical")}, wavelength_min=400.0, ax=ax)
    with pytest.raises(InputError, match="lower end < upper end"):
        plot_acceleration_psd({}, low_hz=2.0, high_hz=1.0, ax=ax)

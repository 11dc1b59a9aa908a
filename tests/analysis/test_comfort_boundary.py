"""Facts about comfort boundaries, masks and the verdicts in words."""

import numpy as np
import pytest

from workbench.analysis.comfort import (
    BAND_WIDTH,
    Mask,
    boundary,
    comfort_verdict,
    read_mask,
    step_of_scale,
    worst_band,
    worst_ratio,
)
from workbench.analysis.ride import third_octaves
from workbench.constants import GRAVITY
from workbench.errors import InputError

OCTAVES = (1.0, 2.0, 4.0, 8.0, 16.0, 31.5)


# Independent evaluation in g²/Hz; three digits (two for 7.9e-4), tolerance one unit of the third
@pytest.mark.parametrize(
    ("duration", "direction", "densities"),
    [
        ("1 h", "vertical", (2.53e-2, 6.32e-3, 1.58e-3, 7.9e-4, 1.58e-3, 3.11e-3)),
        ("1 h", "lateral", (3.28e-3, 1.64e-3, 3.28e-3, 6.56e-3, 1.31e-2, 2.58e-2)),
        ("2.5 h", "vertical", (9.16e-3, 2.29e-3, 5.72e-4, 2.86e-4, 5.72e-4, 1.13e-3)),
    ],
)
def test_reduced_comfort_masks_have_the_known_densities(duration, direction, densities):
    mask = boundary(duration, direction).mask()
    ours = [mask.psd(f) / GRAVITY**2 for f in OCTAVES]
    np.testing.assert_allclose(ours, densities, rtol=3e-3)


def test_the_boundaries_are_flat_where_the_body_is_most_sensitive():
    vertical, lateral = boundary("8 h", "vertical", "fatigue"), boundary("8 h", "lateral", "fatigue")
    assert [vertical.rms(f) for f in (1.0, 4.0, 5.7, 8.0, 16.0)] == pytest.approx([0.63, 0.315, 0.315, 0.315, 0.63])
    assert [lateral.rms(f) for f in (1.0, 1.4, 2.0, 4.0)] == pytest.approx([0.224, 0.224, 0.224, 0.448])


def test_the_three_levels_stand_as_1_to_3_15_to_6_3():
    reduced, fatigue, exposure = (
        boundary("1 h", "vertical", k).rms(5.0) for k in ("reduced_comfort", "fatigue", "exposure")
    )
    assert fatigue / reduced == pytest.approx(3.15)
    assert exposure / fatigue == pytest.approx(2.0)
    assert fatigue == pytest.approx(1.18)


def test_longer_rides_allow_less():
    names = ("1 min", "16 min", "25 min", "1 h", "2.5 h", "4 h", "8 h", "16 h", "24 h")
    for direction in ("vertical", "lateral"):
        limits = [boundary(name, direction).rms(5.0) for name in names]
        assert limits == sorted(limits, reverse=True)


def test_unverified_numbers_say_so():
    assert not boundary("1 h", "vertical").verified
    assert not boundary("1 h", "vertical").mask().verified
    assert "not checked" in boundary("1 h", "vertical").provenance


def test_a_density_on_the_mask_meets_it_with_ratio_one():
    mask = boundary("1 h", "vertical").mask()
    f = np.geomspace(1, 80, 100)
    touching = worst_ratio((f, mask.psd(f)), mask)
    # interpolation between the array's points misses the corners at 4 and 8 Hz by a hair, above or below
    assert touching.ratio == pytest.approx(1.0, abs=0.02)
    assert worst_ratio(lambda x: 0.49 * mask.psd(x), mask).ratio == pytest.approx(0.49, rel=1e-9)
    assert worst_ratio(lambda x: 0.49 * mask.psd(x), mask).met
    assert not worst_ratio(lambda x: 1.01 * mask.psd(x), mask).met


def test_a_narrow_peak_of_a_function_is_found():
    mask = boundary("1 h", "vertical").mask()

    def peak(f):
        return mask.psd(f) / (1 + ((f - 5.4321) / 0.05) ** 2)

    worst = worst_ratio(peak, mask)
    assert worst.ratio == pytest.approx(1.0, rel=1e-9)
    assert worst.frequency_hz == pytest.approx(5.4321, rel=1e-6)


def test_the_worst_ratio_of_an_array_lies_at_a_point_of_array_or_mask():
    mask = Mask(
        name="m", direction="vertical", frequency_hz=(1, 3, 10), g2_per_hz=(1e-2, 1e-4, 1e-2), provenance="assumed"
    )
    worst = worst_ratio((np.array([0.5, 20.0]), np.ones(2)), mask)
    assert worst.frequency_hz == 3.0
    assert worst.ratio == pytest.approx(1e4 / GRAVITY**2)
    assert (worst.low_hz, worst.high_hz) == (1.0, 10.0)


def test_a_flat_spectrum_gives_the_same_verdict_by_band_and_by_density():
    limit = boundary("1 h", "vertical")

    def level(f):
        return np.full_like(f, 1e-3)

    by_band = worst_band(third_octaves(level, low_hz=0.8, high_hz=100), limit)
    at = by_band.frequency_hz
    assert at == pytest.approx(10**0.9)  # where the limit a²/f is lowest: 8 Hz
    assert by_band.ratio**2 == pytest.approx(1e-3 / limit.mask().psd(at), rel=1e-6)
    assert limit.rms(at) ** 2 == pytest.approx(
        limit.mask().psd(at) * BAND_WIDTH * at, rel=2e-2
    )  # bend at 8 Hz, not a point


@pytest.mark.parametrize(
    ("rms", "words"),
    [
        (0.0, "not uncomfortable"),
        (0.3149, "not uncomfortable"),
        (0.315, "a little uncomfortable"),
        (0.55, "a little uncomfortable to fairly uncomfortable"),
        (0.7, "fairly uncomfortable"),
        (0.9, "fairly uncomfortable to uncomfortable"),
        (1.4, "uncomfortable to very uncomfortable"),
        (2.2, "very uncomfortable to extremely uncomfortable"),
        (9.0, "extremely uncomfortable"),
    ],
)
def test_the_verdict_names_every_range_that_holds(rms, words):
    assert comfort_verdict(rms) == words


def test_scales_without_overlap_have_one_word_for_each_index():
    assert step_of_scale("sperling", 2.6) == "not unpleasant"
    assert step_of_scale("sperling", 2.5) == "not unpleasant"
    assert step_of_scale("en_12299", 0.0) == "very comfortable"
    assert step_of_scale("en_12299", 4.6) == "very uncomfortable"


FILE = """
name = "a specification"
provenance = "assumed for this test"
verified = false
frequency_hz = [0.5, 5, 50.0]
vertical_g2_per_hz = [1e-2, 1e-4, 1e-3]
"""


def written(tmp_path, text):
    path = tmp_path / "mask.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_mask_file_is_read_as_it_stands(tmp_path):
    mask = read_mask(written(tmp_path, FILE), "vertical")
    assert mask.name == "a specification"
    assert mask.frequency_hz == (0.5, 5.0, 50.0)
    assert mask.psd(0.5 * 10**0.5) == pytest.approx(1e-3 * GRAVITY**2)
    assert not mask.verified


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("name =", "nome =", "unknown key in mask file mask.toml 'nome'; did you mean 'name'"),
        ("verified = false\n", "", "needs verified as true or false; got None"),
        ("5, 50.0]", '"5", 50.0]', "frequency_hz in mask file mask.toml must list numbers"),
        ("5, 50.0]", "nan, 50.0]", "finite and increasing"),
        ("5, 50.0]", "5]", "as many values as points"),
        ("1e-4", "-1e-4", "must be positive and finite"),
        ("vertical", "lateral", "needs vertical_g2_per_hz as a list of numbers"),
        ('"assumed for this test"', '""', "provenance must name the source"),
        ("name =", "name", "must be TOML"),
    ],
)
def test_a_wrong_mask_file_is_refused_with_the_line_to_mend(tmp_path, old, new, sentence):
    with pytest.raises(InputError, match=sentence):
        read_mask(written(tmp_path, FILE.replace(old, new)), "vertical")


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: boundary("2 h", "vertical"), "unknown duration '2 h'"),
        (lambda: boundary("1 h", "up"), "unknown direction"),
        (lambda: boundary("1 h", "vertical", "comfort"), "unknown level"),
        (lambda: boundary("1 h", "vertical").rms(0.5), "holds from 1 to 80 Hz"),
        (
            lambda: boundary("1 h", "vertical").mask().psd(np.array([5.0, 90.0])),
            "a mask holds from 1 to 80 Hz; got 5…90",
        ),
        (lambda: worst_ratio((np.array([0.1, 0.5]), np.ones(2)), boundary("1 h", "vertical").mask()), "must overlap"),
        (lambda: read_mask("/nowhere/mask.toml", "vertical"), "must be readable"),
        (lambda: comfort_verdict(float("nan")), "finite and not negative"),
        (lambda: step_of_scale("sperling", -1.0), "finite and not negative"),
    ],
)
def test_what_has_no_answer_is_refused(ask, sentence):
    with pytest.raises(InputError, match=sentence):
        ask()
